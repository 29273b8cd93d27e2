"""Benchmark of a field of moving cylinders: its runs and its report."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from missions.bench.dyna_worlds import WORLDS, dyna_text
from missions.bench.layout import write_world
from missions.bench.reporting import FIGURES, failures, figures, short
from missions.bench.runs import Entry, Rules, Setup, TrialRow, with_controller
from missions.execution.prepare import RunOptions
from missions.execution.resources import MISSIONS
from stack.errors import InputError

FAST: dict[str, dict[str, str]] = {
    "mppi": {
        "controller.cruise_speed": "1.8", "controller.reverse_speed": "0.9",
        "controller.turn_speed": "3.5", "controller.linear_deviation": "0.7",
        "controller.angular_deviation": "1.4", "controller.moving_margin": "1.0",
        "controller.path_align_weight": "5", "controller.path_follow_weight": "3",
    },
    "dwb": {"controller.cruise_speed": "1.8", "controller.turn_speed": "3.5"},
    "graceful": {"controller.cruise_speed": "1.8", "controller.turn_speed": "3.5"},
    "pure_pursuit": {"controller.cruise_speed": "1.8"},
}  # fmt: skip
"""Parameters for 1.8 m/s by controller: the cylinders are faster than the default of 0.8 m/s. In an
open field, `mppi` needs no path to keep to; it searches widely and keeps farther away."""

MISSION = MISSIONS / "bench" / "dyna.yaml"
RULES = Rules(goal_radius=1.0, time_limit=100.0)


def dyna_setups(
    controllers: Sequence[str], robot: str = "jackal", mission: str = str(MISSION),
    given: Mapping[str, str] = MappingProxyType({}),
) -> list[Setup]:  # fmt: skip
    """Return a setup for each controller, with the parameters of `FAST`.

    Args:
        controllers: names of controllers.
        robot: name or file of a robot.
        mission: name or file of a mission.
        given: further parameters; they override those of `FAST`.
    """
    return [
        Setup(
            mission,
            RULES,
            RunOptions(
                robot=robot, parameters=with_controller(name, {**FAST.get(name, {}), **given})
            ),
        )
        for name in controllers
    ]


def dyna_entries(setups: Sequence[Setup], worlds: int, trials: int, folder: Path) -> list[Entry]:
    """Return the runs of every setup, trial and world.

    Args:
        setups: one mission with different controllers.
        worlds: number of worlds, spread evenly over all.
        trials: runs per world.
        folder: folder for the generated world files.

    Raises:
        InputError: more worlds than exist.
    """
    if not 1 <= worlds <= WORLDS:
        raise InputError(f"--worlds {worlds}: expected 1 to {WORLDS}")
    numbers = [round(n * (WORLDS - 1) / max(1, worlds - 1)) for n in range(worlds)]
    cases = [
        write_world(dyna_text(number), str(number), folder / f"dyna_{number}.yaml")
        for number in numbers
    ]
    return [
        Entry(setup, case, trial) for setup in setups for trial in range(trials) for case in cases
    ]


def report(runs: Sequence[TrialRow]) -> list[str]:
    """Return a line per setup, and one per failure.

    `impossible` counts the runs that nobody could have passed (people/oracle.py).
    """
    lines = [f"{'setup':<24}  reached  collided  was struck  timeout  gave up  impossible{FIGURES}"]
    for setup in dict.fromkeys(run.setup for run in runs):
        own = [run for run in runs if run.setup == setup]
        count = Counter(run.status for run in own)
        reached = f"{count['success']}/{len(own)}"
        lines.append(
            f"{short(setup):<24}  {reached:<7}  {count['contact']:8d}  {count['struck']:10d}"
            f"  {count['timeout']:7d}  {count['gave_up']:7d}"
            f"  {sum(run.possible is False for run in own):10d}{figures(own)}"
        )
    return lines + failures(runs)

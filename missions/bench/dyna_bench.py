"""The field of moving cylinders: which runs it is made of, and its report."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from missions.bench.dyna_worlds import WORLDS, dyna_text
from missions.bench.layout import written
from missions.bench.reporting import FIGURES, failures, figures, short
from missions.bench.runs import Entry, Rules, Run, Setup
from missions.execution.resources import MISSIONS
from stack.errors import InputError

FAST: dict[str, dict[str, str]] = {
    "mppi": {
        "controller.cruise_speed": "1.8", "controller.reverse_speed": "0.9",
        "controller.turn_speed": "3.5", "controller.linear_deviation": "0.4",
        "controller.angular_deviation": "0.8",
    },
    "dwb": {"controller.cruise_speed": "1.8", "controller.turn_speed": "3.5"},
    "graceful": {"controller.cruise_speed": "1.8", "controller.turn_speed": "3.5"},
    "pure_pursuit": {"controller.cruise_speed": "1.8"},
}  # fmt: skip
"""What makes each controller as fast as what it meets: the defaults are for 0.8 m/s indoors."""

MISSION = MISSIONS / "bench" / "dyna.yaml"
RULES = Rules(goal_radius=1.0, time_limit=100.0)


def dyna_setups(
    controllers: Sequence[str], robot: str = "jackal", mission: str = str(MISSION),
    given: Mapping[str, str] = MappingProxyType({}),
) -> list[Setup]:  # fmt: skip
    """A setup for each controller, as fast as what it meets.

    Args:
        controllers: names.
        robot: name or file.
        mission: name or file.
        given: further parameters, over those of FAST.
    """
    return [
        Setup(
            mission, RULES, robot=robot, controller=name, parameters={**FAST.get(name, {}), **given}
        )
        for name in controllers
    ]


def dyna_entries(setups: Sequence[Setup], worlds: int, trials: int, folder: Path) -> list[Entry]:
    """The first worlds by every trial, for each setup in turn.

    Args:
        setups: of one mission, with different controllers.
        worlds: how many.
        trials: runs in each world.
        folder: for the generated world files.

    Raises:
        InputError: more worlds than there are.
    """
    if not 1 <= worlds <= WORLDS:
        raise InputError(f"--worlds {worlds}: there are {WORLDS}, the fullest last")
    numbers = [round(n * (WORLDS - 1) / max(1, worlds - 1)) for n in range(worlds)]
    cases = [
        written(dyna_text(number), str(number), folder / f"dyna_{number}.yaml")
        for number in numbers
    ]
    return [
        Entry(setup, case, trial) for setup in setups for trial in range(trials) for case in cases
    ]


def report(runs: Sequence[Run]) -> list[str]:
    """A line for each setup, and each failure."""
    lines = [f"{'setup':<24}  reached  drove into  was struck  late  gave up{FIGURES}"]
    for setup in dict.fromkeys(run.setup for run in runs):
        own = [run for run in runs if run.setup == setup]
        count = Counter(run.status for run in own)
        reached = f"{count['success']}/{len(own)}"
        lines.append(
            f"{short(setup):<24}  {reached:<7}  {count['contact']:10d}  {count['struck']:10d}"
            f"  {count['timeout']:4d}  {count['gave_up']:7d}{figures(own)}"
        )
    return lines + failures(runs)

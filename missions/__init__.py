"""Missions: the language, the compiler, the runner and the command line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from missions.execution.report import Report
    from robots.bodies import MakeBody

__all__ = ["run", "run_together"]


def run(  # noqa: PLR0913 - the settings of a run, all by keyword
    mission: str | Path,
    *,
    seed: int = 0,
    arguments: Mapping[str, str] | None = None,
    robot: str | None = None,
    world: str | None = None,
    start: str | None = None,
    out: str | Path | None = None,
    speed: float = 0.0,
    parameters: Mapping[str, str] | None = None,
    record: Sequence[str] = (),
    replay: str | Path | None = None,
    body: str | MakeBody = "",
    forget_kept: bool = False,
    faults: str | None = None,
) -> Report:
    """Run a whole mission in the caller's process.

    Args:
        mission: the mission file, or the name of a shipped one.
        seed: seed of every random stream; the same seed gives a bit-identical run.
        arguments: values for the mission's arguments, as text, like `--set`.
        robot: replaces the mission's robot: a name or the path of a robot.yaml.
        world: replaces the mission's world: a name or a path.
        start: replaces the mission's start: a place or "x,y,heading" (metres, radians).
        out: the run folder; must be empty or absent. None writes no records.
        speed: simulated seconds per wall second; 0 is as fast as possible.
        parameters: `controller.cruise_speed` -> value as text; overrides all files.
        record: `sensors` records every observation in the folder's sensors.mcap.
        replay: a sensors.mcap to play instead of driving.
        body: `simulated` or `scripted`, or a function that makes a body from a BodySetup; empty:
            the choice of the robot file.
        forget_kept: start keys with `keep: true` from their initial values. Without `out` they
            always do.
        faults: of the simulated robot instead of the mission's: names joined by `+`, or `none`.

    Raises:
        InputError: the mission, robot or world has errors; nothing has moved.
    """
    from missions.execution.prepare import RunOptions
    from missions.execution.running import run_mission

    options = RunOptions(
        seed=seed, arguments=dict(arguments or {}), robot=robot, world=world, start=start,
        out=Path(out) if out is not None else None, speed=speed, serve=False,
        parameters=dict(parameters or {}), record=tuple(record),
        replay=Path(replay) if replay is not None else None,
        body=body if isinstance(body, str) else "", forget_kept=forget_kept, faults=faults,
    )  # fmt: skip
    make_body = None if isinstance(body, str) else body
    return run_mission(mission, options, make_body=make_body)


def run_together(  # noqa: PLR0913 - the settings of a run, all by keyword
    missions: Sequence[str | Path],
    *,
    seed: int = 0,
    arguments: Mapping[str, str] | None = None,
    world: str | None = None,
    out: str | Path | None = None,
    speed: float = 0.0,
    parameters: Mapping[str, str] | None = None,
    record: Sequence[str] = (),
) -> list[Report]:
    """Run several missions in the caller's process: a robot each, in one world with one clock.

    Args:
        missions: the mission files, or names of shipped ones; at least two.
        seed: of the first robot; the second one has `seed + 1`, and so on.
        arguments: values for the missions' arguments, as text; each takes those that it declares.
        world: replaces the missions' world: a name or a path.
        out: receives a run folder for each mission, by its name. None writes no records.
        speed: simulated seconds per wall second; 0 is as fast as possible.
        parameters: as for `run`, for all missions.
        record: as for `run`.

    Returns:
        The reports, in the order of the missions.

    Raises:
        InputError: a mission has errors, they are in different worlds, or two robots start at the
            same place; nothing has moved.
    """
    from missions.execution.prepare import RunOptions
    from missions.execution.shared_world import prepare_together
    from missions.execution.shared_world import run_together as run_entries

    options = RunOptions(
        seed=seed, arguments=dict(arguments or {}), world=world,
        out=Path(out) if out is not None else None, speed=speed, serve=False,
        parameters=dict(parameters or {}), record=tuple(record),
    )  # fmt: skip
    return run_entries(prepare_together(missions, options))

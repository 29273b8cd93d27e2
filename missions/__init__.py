"""Missions: the language, the compiler, the runner and the command line.

import missions

report = missions.run("missions/01_drive_to_a_point.yaml", seed=3)
assert report.status == "success"
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from missions.execution.report import Report

__all__ = ["run"]


def run(  # noqa: PLR0913 - what a run is made of, all by keyword
    mission: str | Path,
    *,
    seed: int = 0,
    arguments: Mapping[str, str] | None = None,
    robot: str | None = None,
    world: str | None = None,
    start: str | None = None,
    out: str | Path | None = None,
    speed: float = 0.0,
    rerun: bool = False,
    parameters: Mapping[str, str] | None = None,
) -> Report:
    """Run a whole mission in the caller's own process.

    Args:
        mission: the mission file, or the name of a shipped one.
        seed: of every random stream; the same seed gives the same run, bit for bit.
        arguments: values for the mission's arguments, as `--set` takes them.
        robot: another robot than the mission's: a name or the path of a robot.yaml.
        world: another world: a name or a path.
        start: another start: a place or "x,y,heading".
        out: the run's folder; must be empty or absent. None keeps no records.
        speed: simulated seconds per wall second; 0 is as fast as the machine can.
        rerun: record mission.rrd into the folder.
        parameters: `controller.cruise_speed` -> value as text, over everything in files.

    Raises:
        InputError: the mission, robot or world is wrong; nothing has moved.
    """
    from missions.execution.prepare import RunOptions
    from missions.execution.runner import run_mission

    options = RunOptions(
        seed=seed, arguments=dict(arguments or {}), robot=robot, world=world, start=start,
        out=Path(out) if out is not None else None, speed=speed, rerun=rerun, serve=False,
        parameters=dict(parameters or {}),
    )  # fmt: skip
    return run_mission(mission, options)

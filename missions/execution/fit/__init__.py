"""Whether a mission fits its world and robot: start, goals, zones, speeds, components."""

from __future__ import annotations

from missions.execution.fit.goals import goal_findings, start_problem
from missions.execution.fit.speeds import setting_findings, speed_findings
from missions.execution.fit.zones import keepout_areas, zone_findings
from missions.language.model import Mission
from stack.documents import Finding
from stack.drivetrain.description import RobotDescription
from stack.sim.worlds.world import World
from stack.types import Pose2D

__all__ = [
    "fit_findings",
    "keepout_areas",
    "setting_findings",
    "start_problem",
    "zone_findings",
]


def fit_findings(
    mission: Mission, world: World, robot: RobotDescription, start: Pose2D
) -> list[Finding]:
    """Return errors and warnings about goals and speeds that world and robot do not allow."""
    found = speed_findings(mission, robot)
    if mission.map != "none":  # else poses are relative to the start, not to the world
        found += goal_findings(mission, world, robot, start)
    return found

"""Whether a mission fits its world and robot: start, goals, zones, speeds, components."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from missions.execution.component_choices import DRIVING_KINDS
from missions.execution.fit.components import Marks
from missions.execution.fit.costmaps import inflation_findings, layer_findings
from missions.execution.fit.goals import goal_findings, start_problem
from missions.execution.fit.needs import component_needs
from missions.execution.fit.periods import period_findings
from missions.execution.fit.speeds import setting_findings, speed_findings
from missions.execution.fit.tolerances import tolerance_findings
from missions.execution.fit.zones import keepout_areas, zone_findings
from missions.language.model import Mission
from stack.components import Choice, noun
from stack.documents import Finding
from stack.drivetrain.description import RobotDescription
from stack.sim.worlds.world import World
from stack.types import Pose2D

__all__ = [
    "component_findings",
    "fit_findings",
    "fixed_base_findings",
    "keepout_areas",
    "setting_findings",
    "start_problem",
    "tolerance_findings",
    "zone_findings",
]

UNUSED = "W151"
"""The code of a component of a robot that cannot drive."""


def fit_findings(
    mission: Mission, world: World, robot: RobotDescription, start: Pose2D
) -> list[Finding]:
    """Return errors and warnings about goals and speeds that world and robot do not allow."""
    found = speed_findings(mission, robot)
    if mission.map != "none":  # else poses are relative to the start, not to the world
        found += goal_findings(mission, world, robot, start)
    return found


def fixed_base_findings(
    choices: Mapping[str, Choice], marks: Marks, robot: RobotDescription
) -> Iterator[Finding]:
    """Yield what is wrong with the components of a mission whose robot cannot drive."""
    yield from period_findings(marks.mission, choices["loop"].parameters)
    for kind, named in marks.mission.components.items():
        if kind in DRIVING_KINDS:
            sentence = f"{noun(kind)}: {robot.name} cannot drive: it has no effect"
            yield Finding(named.mark, UNUSED, sentence, f"remove `{kind}`")
    used = {kind: choice for kind, choice in choices.items() if kind not in DRIVING_KINDS}
    yield from component_needs(used, marks, robot)


def component_findings(
    choices: Mapping[str, Choice], marks: Marks, robot: RobotDescription
) -> Iterator[Finding]:
    """Yield errors and warnings about components that do not fit the robot or the mission."""
    yield from period_findings(marks.mission, choices["loop"].parameters)
    yield from component_needs(choices, marks, robot)
    yield from layer_findings(choices, marks, robot)
    yield from inflation_findings(choices["costmap"], marks, robot)

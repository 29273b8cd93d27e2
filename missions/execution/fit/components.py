"""Whether the chosen components fit the robot, the map and each other."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

from missions.execution.resources import map_folder
from missions.language.model import Mission
from missions.language.reading.header import LOCALISATION
from stack.components import Choice, Component, Estimator
from stack.costmap.parameters import CostmapParameters
from stack.documents import Finding, Mark, Node
from stack.drivetrain.description import RobotDescription
from stack.errors import InputError, ParameterError
from stack.mapping.limits import MAX_CELLS
from stack.perception.markers.parameters import MarkerParameters
from stack.runtime.parameters import LoopParameters
from stack.sim.rates import physics_steps
from stack.sim.worlds.rasterise import RESOLUTION, map_problem, map_shape
from stack.sim.worlds.world import World
from stack.types import Pose2D

MISSING = "E183"
"""The code of a sensor that the robot lacks."""


@dataclass(frozen=True)
class Marks:
    """A mission with the document it was read from, for the positions of findings."""

    mission: Mission
    document: Node

    def of(self, key: str) -> Mark:
        """Return the position of a top-level key's value, or the start of the file."""
        node = self.document.get(key)
        return node.mark if node is not None else Mark(str(self.mission.source))

    def of_component(self, kind: str, parameter: str = "") -> Mark:
        """Return the position of a component or its parameter; of its section if a default."""
        named = self.mission.components.get(kind)
        if named is None:
            return self.of("navigation")
        return named.marks.get(parameter, named.mark)


def mark_of_component(mission: Mission, kind: str, parameter: str) -> Mark:
    """Return the position of a parameter, else of its component, else the start of the file."""
    named = mission.components.get(kind)
    return Mark(str(mission.source)) if named is None else named.marks.get(parameter, named.mark)


def check_robot_fits(choices: dict[str, Choice], marks: Marks, robot: RobotDescription) -> None:
    """Raise InputError for components whose settings do not fit the robot."""
    for choice in choices.values():
        if not issubclass(choice.component, Component):
            continue  # settings of a fixed part
        try:
            choice.component.check(choice.parameters, robot)
        except InputError as error:
            mark = marks.of_component(choice.kind)
            raise InputError([Finding(mark, "E111", str(error))]) from None


def check_estimator(choice: Choice, marks: Marks, belief: Pose2D | None) -> None:
    """Raise InputError for an unknown initial pose on a map that the estimator cannot find."""
    estimator: type[Estimator] = choice.component
    if marks.mission.map != "none" and belief is None and estimator.needs_initial_pose:
        sentence = f"the estimator {choice.name!r} cannot find an unknown initial pose"
        mark = marks.of("initial_pose")
        raise InputError([Finding(mark, "E111", sentence, "use `localisation: mcl`, or give one")])
    if marks.mission.map == "none":
        return
    folder = map_folder(marks.mission.map, marks.mission.source.parent)
    try:
        estimator.check_map(folder)
    except InputError as error:
        raise InputError([Finding(marks.of("map"), "E111", str(error))]) from None


def check_markers(choices: dict[str, Choice], marks: Marks, robot: RobotDescription) -> None:
    """Raise InputError for markers that nothing can see or use."""
    settings: MarkerParameters = choices["markers"].parameters
    estimator = choices[LOCALISATION]
    uses: type[Estimator] = estimator.component
    for name, wanted in (("localise", settings.localise), ("survey", settings.survey)):
        if wanted and robot.camera is None:
            sentence = f"markers: {name}: the robot {robot.name!r} has no camera"
            raise InputError([Finding(marks.of_component("markers", name), MISSING, sentence)])
    if settings.localise and not uses.uses_markers:
        sentence = f"markers: localise: the estimator {estimator.name!r} does not use markers"
        mark = marks.of_component("markers", "localise")
        hint = "use `localisation: mcl`, or `dead_reckoning` without a map"
        raise InputError([Finding(mark, "E111", sentence, hint)])


def check_rate(loop: LoopParameters, marks: Marks) -> None:
    """Raise InputError for a control rate that the simulation cannot step."""
    try:
        physics_steps("control period", loop.period)
    except ParameterError as error:
        mark = marks.of_component("loop", "control_rate")
        raise InputError([Finding(mark, "E111", error.sentence, error.hint)]) from None


def check_map_size(marks: Marks, world: World, costs: CostmapParameters) -> None:
    """Raise InputError for a world of which no map can be drawn in cells of this size."""
    if marks.mission.map != "from_world":
        return
    for resolution in (RESOLUTION, costs.map_resolution):
        sentence = map_problem(world, resolution)
        if not sentence:
            continue
        hint = "use `map: none`, or set closer `bounds` in the world file"
        if resolution != RESOLUTION:
            rows, columns = map_shape(world, resolution)
            least = ceil(100.0 * resolution * (rows * columns / MAX_CELLS) ** 0.5) / 100.0
            hint = f"set `navigation: {{costmap: {{map_resolution: {least:g}}}}}`"
        raise InputError([Finding(marks.of("world"), "E413", sentence, hint)])

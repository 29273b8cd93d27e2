"""Start and goals of a mission, compared with its world and robot."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import inf, isnan

import numpy as np

from behaviours.base import RobotBehaviour
from missions.execution.fit.reachability import ReachableFloor
from missions.execution.fit.steps import every_leaf, every_step
from missions.language.analysis.claims import number_of
from missions.language.expressions.scope import UNSET, Role, Symbol
from missions.language.kinds.leaf import LeafStep
from missions.language.model import Mission
from missions.language.values import Constant, ListValue, Reference, Value
from stack.documents import Finding, Mark
from stack.drivetrain.description import RobotDescription
from stack.geometry.polygons import outline_points
from stack.planning.parameters import PlannerParameters
from stack.sim.worlds.outlines import Outline, outlines
from stack.sim.worlds.world import World
from stack.types import FloatArray, Footprint, Pose2D

CLEARANCE = 0.05
"""Metres to the nearest obstacle below which a goal is a tight fit."""
OVERLAP = 0.01
"""Metres of overlap at the start that rounding of poses and outlines explains."""
SPACING = 0.02
"""Metres between the points of the robot's outline that are compared with obstacles."""


@dataclass(frozen=True)
class Goal:
    """A goal: its pose, where it is written, and how near to it is enough.

    Attributes:
        tolerance: metres; infinite if it is not known before the mission runs.
        can_be_partial: whether its behaviour has a port `partial`.
    """

    pose: Pose2D
    mark: Mark
    name: str
    is_partial: bool
    tolerance: float = 0.0
    can_be_partial: bool = True

    def hint(self, remedy: str) -> str:
        """Return a remedy with `partial: true` as the other one, if the behaviour has the port."""
        if not self.can_be_partial:
            return remedy
        more = "or use `partial: true`: the robot stops at the nearest place and succeeds"
        return f"{remedy}, {more}"

    def rim(self, footprint: Footprint) -> FloatArray:
        """Return points (n, 2) on the robot's outline at the goal."""
        return self.pose.transform(outline_points(footprint.points, SPACING))

    def collision(self, code: str, thing: str, gap: float, need: float, remedy: str) -> Finding:
        """Return the error that the goal is in a thing, or nearer to it than the robot needs."""
        sentence = f"{self.words()} is in {thing}"
        if gap > 0.0:
            sentence = f"{self.words()} is too near to {thing}: {gap:.2f} m, "
            sentence += f"the robot needs {need:.2f} m"
        return Finding(self.mark, code, sentence, self.hint(remedy))

    def tight_fit(self, thing: str, gap: float) -> Finding:
        """Return the warning that the robot's outline at the goal touches a thing, or nearly."""
        state = f"leaves {100.0 * gap:.0f} cm to" if gap > 0.0 else "overlaps"
        sentence = f"{self.words()} is a tight fit: at {np.degrees(self.pose.heading):.0f} deg "
        sentence += f"the robot {state} {thing}"
        return Finding(self.mark, "W140", sentence, "move the goal, or turn it")

    def words(self) -> str:
        at = f"({round(self.pose.x, 3):g}, {round(self.pose.y, 3):g})"
        return f"the goal {self.name} {at}" if self.name else f"the goal {at}"


def goal_findings(
    mission: Mission, world: World, robot: RobotDescription, start: Pose2D
) -> list[Finding]:
    """Return errors and warnings about goals at which the robot cannot stand or arrive.

    Args:
        mission: a checked mission with poses in the world frame.
        world: world as it is when the mission starts.
        robot: its footprint and height count.
        start: where the mission starts; in an obstacle, no goal is called unreachable.
    """
    goals = Goals(mission).all(robot.footprint)
    found = list(_goal_findings(goals, world, robot.footprint))
    faulty = {item.mark for item in found if item.severity == "error"}
    sound = [goal for goal in goals if not goal.is_partial and goal.mark not in faulty]
    if sound:
        found += _unreachable(sound, world, robot, start)
    return found


def start_problem(start: Pose2D, world: World, footprint: Footprint) -> str:
    """Return why the robot cannot start at a pose; "" if it can."""
    where = f"the start ({start.x:g}, {start.y:g})"
    if not _covers(world, start):
        return f"{where} is outside {world.name}, which covers {_area(world)}"
    point = np.array([[start.x, start.y]])
    rim = start.transform(outline_points(footprint.points, SPACING))
    for outline in outlines(world):
        if outline.distance_to(point)[0] < footprint.inscribed_radius:
            return f"{where} collides with {_thing(outline, world)}"
        if outline.distance_to(rim).min() < -OVERLAP:
            turned = f"at {np.degrees(start.heading):.0f} deg the robot"
            return f"{where}: {turned} overlaps {_thing(outline, world)}"
    return ""


def _covers(world: World, pose: Pose2D) -> bool:
    x_min, y_min, x_max, y_max = world.bounds
    return x_min <= pose.x <= x_max and y_min <= pose.y <= y_max


def _area(world: World) -> str:
    x_min, y_min, x_max, y_max = world.bounds
    return f"x {x_min:g} to {x_max:g} m and y {y_min:g} to {y_max:g} m"


@dataclass(frozen=True)
class Area:
    """An area that the robot drives over: corners (n, 2), map frame, and where it is written."""

    corners: FloatArray
    mark: Mark
    name: str

    def words(self) -> str:
        return f"the area {self.name}" if self.name else "the area"


class Goals:
    """Follows goals and areas from the ports of behaviours to the poses in the file."""

    def __init__(self, mission: Mission) -> None:
        self.mission = mission
        self.sources: dict[Symbol, list[tuple[Value, Mark]]] = {}
        for step in every_step(mission):
            inputs = mission.trees[step.uses].inputs if step.uses else {}
            for symbol, value in step.binds(inputs):
                self.sources.setdefault(symbol, []).append((value, step.mark))

    def all(self, footprint: Footprint) -> list[Goal]:
        """Return every goal that is known before the mission runs, each position once."""
        found: dict[tuple[Mark, Pose2D, bool, float], Goal] = {}
        for step in every_leaf(self.mission):
            partial = step.ports.get("partial")
            is_partial = isinstance(partial, Constant) and partial.value is True
            tolerance = _tolerance(step.ports.get("tolerance"))
            for port in step.behaviour.goal_ports:
                for pose, mark, name in self._poses(step.ports.get(port), step.mark, ()):
                    at = _standing_pose(step, pose, footprint)
                    if at is None or isnan(at.x):
                        continue  # not known yet, or a place with an error
                    named = name if at == pose else f"of {step.kind}"
                    goal = Goal(
                        at, mark, named, is_partial, tolerance, "partial" in step.behaviour.ports
                    )  # fmt: skip
                    found.setdefault((mark, at, is_partial, tolerance), goal)
        return list(found.values())

    def areas(self) -> list[Area]:
        """Return every area that is known before the mission runs, each position once."""
        found: dict[Mark, Area] = {}
        for step in every_leaf(self.mission):
            for port in step.behaviour.area_ports:
                for value, mark in self._origins(step.ports.get(port), step.mark, ()):
                    corners = [pose for pose, _, _ in self._poses(value, mark, ())]
                    if len(corners) >= 3 and not any(isnan(pose.x) for pose in corners):
                        name = _name_of(value) if isinstance(value, Constant) else ""
                        points = np.array([[pose.x, pose.y] for pose in corners])
                        found.setdefault(mark, Area(points, mark, name))
        return list(found.values())

    def _origins(
        self, value: Value | None, mark: Mark, through: tuple[Symbol, ...]
    ) -> Iterator[tuple[Value, Mark]]:
        """Yield the values that a value can have, with positions, through all references."""
        if isinstance(value, Reference):
            symbol = value.symbol
            if symbol in through:
                return
            for source, where in self.sources.get(symbol, ()):
                yield from self._origins(source, where, (*through, symbol))
            if symbol.role is Role.KEY and symbol.value is not UNSET:
                yield Constant(symbol.value, f"${symbol.name}", symbol.mark), symbol.mark
        elif value is not None:
            yield value, (value.mark if isinstance(value, Constant) else None) or mark

    def _poses(
        self, value: Value | None, mark: Mark, through: tuple[Symbol, ...]
    ) -> Iterator[tuple[Pose2D, Mark, str]]:
        """Yield the poses that a value can have, with position and name."""
        for origin, where in self._origins(value, mark, through):
            if isinstance(origin, Constant):
                yield from _constants(origin, where)
            elif isinstance(origin, ListValue):
                for item in origin.items:
                    yield from self._poses(item, where, through)


def _standing_pose(step: LeafStep, pose: Pose2D, footprint: Footprint) -> Pose2D | None:
    """Return where the robot stands for a pose of a step; None if that is not known yet."""
    cls = step.behaviour.cls
    assert issubclass(cls, RobotBehaviour)  # others have no goal ports
    ports = {name: port.default for name, port in step.behaviour.ports.items()}
    ports |= {
        name: value.value if isinstance(value, Constant) else None
        for name, value in step.ports.items()
    }
    return cls.standing_pose(pose, footprint, ports)


def _constants(value: Constant, mark: Mark) -> Iterator[tuple[Pose2D, Mark, str]]:
    name = _name_of(value)
    where = value.mark or mark
    if isinstance(value.value, Pose2D):
        yield value.value, where, name
    elif isinstance(value.value, list | tuple):
        for number, pose in enumerate(value.value):
            if isinstance(pose, Pose2D):
                at = value.items[number] if number < len(value.items) else where
                yield pose, at, f"{number + 1} of {name}" if name else ""


def _name_of(value: Constant) -> str:
    return value.text if value.text.startswith("$") else ""


def _tolerance(value: Value | None) -> float:
    """Return how far from a goal a drive may end, metres: at least the planner's tolerance."""
    known = number_of(value)
    if known is not None:
        return max(known, PlannerParameters.tolerance)
    is_open = value is not None and not isinstance(value, Constant)
    return inf if is_open else PlannerParameters.tolerance


def _unreachable(
    goals: Sequence[Goal], world: World, robot: RobotDescription, start: Pose2D
) -> Iterator[Finding]:
    """Report goals to which no way of the robot's width leads."""
    floor = ReachableFloor(world, robot, start)
    width = robot.footprint.width
    for goal in goals:
        if floor.reaches(goal.pose, goal.tolerance):
            continue
        x, y = floor.nearest(goal.pose)
        sentence = f"no way leads from the start ({start.x:g}, {start.y:g}) to {goal.words()}: "
        sentence += f"{robot.name} is {width:.2f} m wide; the nearest place that it can reach is "
        sentence += f"({x:.2f}, {y:.2f})"
        hint = "move the goal, make an opening in the world, or use `partial: true`"
        yield Finding(goal.mark, "W143", sentence, hint)


def _goal_findings(goals: Sequence[Goal], world: World, footprint: Footprint) -> Iterator[Finding]:
    if not goals:
        return
    inside: list[Goal] = []
    for goal in goals:
        if _covers(world, goal.pose):
            inside.append(goal)
            continue
        sentence = f"{goal.words()} is outside {world.name}, which covers {_area(world)}"
        yield Finding(goal.mark, "E180", sentence, _hint(goal, world))
    shapes = outlines(world)
    points = np.array([[goal.pose.x, goal.pose.y] for goal in inside])
    if not shapes or not inside:
        return
    gaps = np.array([shape.distance_to(points) for shape in shapes])
    nearest = gaps.argmin(axis=0)
    for number, goal in enumerate(inside):
        if goal.is_partial:
            continue
        thing, need = _thing(shapes[nearest[number]], world), footprint.inscribed_radius
        gap = float(gaps[nearest[number], number])
        if gap < need:
            yield goal.collision("E181", thing, gap, need, "move the goal")
            continue
        near = [shapes[row] for row in np.flatnonzero(
            gaps[:, number] < footprint.circumscribed_radius + CLEARANCE)]  # fmt: skip
        yield from _tight(goal, near, world, footprint)


def _tight(
    goal: Goal, near: Sequence[Outline], world: World, footprint: Footprint
) -> Iterator[Finding]:
    """Report a goal at which the robot's outline, at its heading, touches an obstacle."""
    if not near:
        return
    rim = goal.rim(footprint)
    gaps = [float(shape.distance_to(rim).min()) for shape in near]
    if min(gaps) < CLEARANCE:
        yield goal.tight_fit(_thing(near[gaps.index(min(gaps))], world), min(gaps))


def _thing(shape: Outline, world: World) -> str:
    return f"{shape.name or 'a wall'} of {world.name}"


def _hint(goal: Goal, world: World) -> str:
    for unit, factor in (("cm", 0.01), ("mm", 0.001)):
        x, y = goal.pose.x * factor, goal.pose.y * factor
        if _covers(world, Pose2D(x, y)) and max(abs(x), abs(y)) > 1.0:
            return f"poses are in metres; for {unit} write [{x:g}, {y:g}]"
    if world.places:
        return f"use another goal; places of {world.name}: {', '.join(world.places)}"
    return "use another goal"

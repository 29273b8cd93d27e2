"""Start and goals of a mission, compared with its keep-out zones."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import compress

import numpy as np
from numpy.typing import NDArray

from missions.execution.fit.goals import CLEARANCE, SPACING, Area, Goal, Goals
from missions.execution.fit.reachability import ReachableFloor
from missions.language.model import Mission
from stack.costmap.choosing import LayerChoice
from stack.costmap.closing_zones import closing_zones, zone_words
from stack.costmap.layer import Frame
from stack.costmap.layers.zone_layers import KeepoutLayer
from stack.costmap.parameters import CostmapParameters
from stack.costmap.zones import ZONE_MARGIN, Zone, ZoneCells, read_mask
from stack.documents import Finding, Mark
from stack.drivetrain.description import RobotDescription
from stack.geometry.polygons import distances_to_edges, points_inside
from stack.sim.worlds.world import World
from stack.types import FloatArray, OccupancyGrid, Pose2D

POINTS_ALONG = 30
"""Points along the longer side of an area that are compared with zones."""


@dataclass(frozen=True)
class KeepoutArea:
    """A keep-out zone as checks see it: a polygon or a mask.

    Attributes:
        name: of the zone, or of the layer of a mask.
        zone: the polygon; None for a mask.
        mask: its occupied cells are the area; None for a polygon.
        whole: whether the whole footprint stays outside, or only the centre.
    """

    name: str
    zone: Zone | None
    mask: OccupancyGrid | None
    whole: bool = True

    def words(self) -> str:
        """Return what it is, for messages."""
        return zone_words((self.name,))

    def distance_to(self, points: FloatArray) -> FloatArray:
        """Return the distance of points (n, 2) to the area: (n,) metres, negative inside."""
        if self.zone is not None:
            corners = self.zone.points
            away = distances_to_edges(points, corners)
            return np.where(points_inside(points, corners), -away, away)
        grid = self.mask
        assert grid is not None
        rows, columns = np.nonzero(grid.occupied)
        away = np.full(len(points), np.inf)
        if not rows.size:
            return away
        half = 0.5 * grid.resolution
        middles = (np.column_stack([columns, rows]) + 0.5) * grid.resolution + grid.origin
        for number, point in enumerate(points):
            beyond = np.abs(middles - point) - half
            outside = np.hypot(*np.maximum(beyond, 0.0).T)
            away[number] = float((outside + np.minimum(beyond.max(axis=1), 0.0)).min())
        return away

    def cells(self, frame: Frame, margin: float) -> NDArray[np.bool_]:
        """Return the cells (rows, columns) within metres of the area."""
        zones = () if self.zone is None else (self.zone,)
        drawn = ZoneCells(zones, self.mask, margin)
        drawn.lay_out(frame, None)
        return drawn.cells > 0


def keepout_areas(layers: Sequence[LayerChoice]) -> tuple[KeepoutArea, ...]:
    """Return the keep-out zones of a mission's costmap layers.

    Raises:
        InputError: a mask cannot be read.
    """
    found: list[KeepoutArea] = []
    for layer in layers:
        if not issubclass(layer.component, KeepoutLayer):
            continue
        parameters = layer.parameters(CostmapParameters())
        whole, mask = layer.is_inflated, read_mask(parameters.mask)
        found += [KeepoutArea(zone.name, zone, None, whole) for zone in parameters.zones]
        if mask is not None:
            found.append(KeepoutArea(layer.name, None, mask, whole))
    return tuple(found)


def zone_findings(
    mission: Mission, world: World, robot: RobotDescription, start: tuple[Pose2D, Mark],
    areas: Sequence[KeepoutArea],
) -> list[Finding]:  # fmt: skip
    """Return errors and warnings about keep-out zones at the start, at goals and between them.

    Args:
        mission: a checked mission with poses in the world frame.
        world: as it is when the mission starts.
        robot: its footprint and height count.
        start: pose, and where it is written.
        areas: keep-out zones.
    """
    if not areas or mission.map == "none":  # else poses are relative to the start
        return []
    found = list(_start_findings(start, robot, areas))
    sound = []
    goals = Goals(mission)
    for drawn in goals.areas():
        found += _area_findings(drawn, robot, areas)
    for goal in goals.all(robot.footprint):
        here = [] if goal.is_partial else list(_goal_findings(goal, robot, areas))
        found += here
        if not goal.is_partial and not any(item.severity == "error" for item in here):
            sound.append(goal)
    if sound:
        found += _closed_ways(sound, world, robot, start[0], areas)
    return found


def _need(area: KeepoutArea, robot: RobotDescription) -> float:
    """Return the metres that the robot's centre must stay away from an area."""
    return robot.footprint.inscribed_radius if area.whole else 0.0


def _start_findings(
    start: tuple[Pose2D, Mark], robot: RobotDescription, areas: Sequence[KeepoutArea]
) -> Iterator[Finding]:
    pose, mark = start
    for area in areas:
        if _distance(area, pose) < _need(area, robot):
            sentence = f"the start ({pose.x:g}, {pose.y:g}) is in {area.words()}"
            hint = "the robot leaves it by the shortest way; start outside, or move the zone"
            yield Finding(mark, "W146", sentence, hint)


def _goal_findings(
    goal: Goal, robot: RobotDescription, areas: Sequence[KeepoutArea]
) -> Iterator[Finding]:
    for area in areas:
        gap, need = _distance(area, goal.pose), _need(area, robot)
        if gap < need:
            yield goal.collision("E182", area.words(), gap, need, "move the goal or the zone")
            return
    for area in areas:
        if not area.whole:
            continue
        gap = float(area.distance_to(goal.rim(robot.footprint)).min())
        if gap < CLEARANCE:
            yield goal.tight_fit(area.words(), gap)
            return


def _area_findings(
    drawn: Area, robot: RobotDescription, areas: Sequence[KeepoutArea]
) -> Iterator[Finding]:
    """Report an area of which the robot can cover nothing, or not all, because of zones."""
    points = _points_in(drawn.corners)
    gaps = np.array([area.distance_to(points) for area in areas])
    touched = [bool((gap < 0.0).any()) for gap in gaps]
    if not any(touched):
        return
    words = zone_words(tuple(dict.fromkeys(area.name for area in compress(areas, touched))))
    needs = np.array([_need(area, robot) for area in areas])
    if (gaps < needs[:, None]).any(axis=0).all():
        sentence = f"{drawn.words()} is in {words}: the robot must not drive there"
        yield Finding(drawn.mark, "E184", sentence, "move the area or the zone")
        return
    share = float((gaps < 0.0).any(axis=0).mean())
    sentence = f"{share:.0%} of {drawn.words()} is in {words} and is left out"
    yield Finding(drawn.mark, "W150", sentence, "draw the area outside the zone")


def _points_in(corners: FloatArray) -> FloatArray:
    """Return points (n, 2) on a grid in a polygon; its corners if it is smaller than the grid."""
    low, high = corners.min(axis=0), corners.max(axis=0)
    step = max(SPACING, float((high - low).max()) / POINTS_ALONG)
    axes = [
        np.arange(first + 0.5 * step, last, step) for first, last in zip(low, high, strict=True)
    ]
    points = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
    inside = points[points_inside(points, corners)]
    return inside if len(inside) else corners


def _closed_ways(
    goals: Sequence[Goal], world: World, robot: RobotDescription, start: Pose2D,
    areas: Sequence[KeepoutArea],
) -> Iterator[Finding]:  # fmt: skip
    """Report goals to which every way leads through zones."""
    names = tuple(dict.fromkeys(area.name for area in areas))

    def more(area: KeepoutArea) -> float:
        return ZONE_MARGIN if area.whole else -robot.footprint.circumscribed_radius

    floors: dict[frozenset[str], ReachableFloor] = {}

    def floor(without: Collection[str]) -> ReachableFloor:
        left = frozenset(names) - frozenset(without)
        if left not in floors:
            closed = [(area.cells, more(area)) for area in areas if area.name in left]
            floors[left] = ReachableFloor(world, robot, start, closed)
        return floors[left]

    for goal in goals:

        def is_open(without: Collection[str], goal: Goal = goal) -> bool:
            return floor(without).reaches(goal.pose, goal.tolerance)

        closing = closing_zones(names, is_open)
        if not closing:
            continue
        x, y = floor(()).nearest(goal.pose)
        verb = "closes" if len(closing) == 1 else "close"
        sentence = f"{zone_words(closing)} {verb} the way from the start ({start.x:g}, "
        sentence += f"{start.y:g}) to {goal.words()}; the nearest place that {robot.name} can "
        sentence += f"reach is ({x:.2f}, {y:.2f})"
        hint = "make the zone smaller, move the goal, or use `partial: true`"
        yield Finding(goal.mark, "W147", sentence, hint)


def _distance(area: KeepoutArea, pose: Pose2D) -> float:
    return float(area.distance_to(np.array([[pose.x, pose.y]]))[0])

"""Robot facade for behaviours: navigation, localisation, costmaps and camera."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import degrees
from typing import Any

import numpy as np

from stack.errors import ParameterError
from stack.mapping.exploration.frontiers import FrontierParameters
from stack.navigation.disambiguation import Disambiguation
from stack.navigation.doubt import other_places
from stack.navigation.drive_to_goal import GoalDrive
from stack.navigation.facade.parts import FacadeParts
from stack.navigation.facade.perception import PerceptionFacade
from stack.navigation.relocalisation import Relocalisation, report_pose
from stack.navigation.tasks import MotionExecutor, MotionTask
from stack.navigation.tuning import NamedParameters, change
from stack.parameters import suggestion
from stack.robot import JsonValue
from stack.types import (
    Battery,
    ContactZone,
    CoveragePlan,
    Footprint,
    Frontier,
    Image,
    Marker,
    OccupancyGrid,
    Path,
    Pose2D,
    PoseEstimate,
    Scan,
    StandingObject,
    TrackedObject,
    Twist,
)


class RobotFacade(PerceptionFacade):
    """Implementation of stack.robot.Robot with the components of the stack.

    It answers from what the step has perceived and keeps no state of its own.
    """

    def __init__(self, parts: FacadeParts) -> None:
        super().__init__(parts)
        self._navigation = parts.navigator
        self._parameters = NamedParameters(parts.tunables)

    @property
    def parameters(self) -> dict[str, Any]:
        """Current parameters of the components: `controller.cruise_speed` -> value."""
        return self._parameters.current()

    def set_parameter(self, name: str, value: Any) -> None:
        """Change a parameter of a component, from the next step on.

        Raises:
            ParameterError: unknown component or parameter, or an invalid value.
        """
        read = change(self._parts.tunables, name, value)
        self._parts.emit("parameter", f"{name} is now {read}", name=name, value=str(read))

    @property
    def time(self) -> float:
        """Seconds on the body's clock."""
        return self._parts.clock()

    @property
    def estimate(self) -> PoseEstimate:
        """Pose in the map frame with covariance and health of the localisation."""
        return self._parts.estimator.estimate

    @property
    def pose(self) -> Pose2D:
        """Estimated pose of the robot, map frame."""
        return self.estimate.pose

    @property
    def odometry(self) -> Pose2D:
        """Dead-reckoned pose in the odom frame."""
        return self._perceived.motion.pose

    @property
    def localisation_health(self) -> float:
        """In [0, 1]; below 0.3 the scans do not fit the map here."""
        return self.estimate.health

    @property
    def speed(self) -> Twist:
        """Measured velocity."""
        return self._perceived.motion.twist

    @property
    def footprint(self) -> Footprint:
        """The robot's outline in the base frame."""
        return self._parts.robot.footprint

    @property
    def battery(self) -> Battery:
        """State of charge; full before the first observation."""
        return self._perceived.battery

    @property
    def scan(self) -> Scan | None:
        """The newest scan of the lidar that the localisation uses."""
        return self._perceived.newest(self._parts.estimator.lidar, Scan)

    @property
    def markers(self) -> tuple[Marker, ...]:
        """The known markers of the world, map frame."""
        return self._parts.markers

    @property
    def tracks(self) -> tuple[TrackedObject, ...]:
        """Moving objects around the robot, map frame."""
        return self._perceived.at(self.estimate).world.tracks

    @property
    def standing_objects(self) -> tuple[StandingObject, ...]:
        """Objects that are not on the map and have not moved, map frame."""
        return self._perceived.at(self.estimate).world.standing

    @property
    def map(self) -> OccupancyGrid:
        """The map so far."""
        return self._parts.maps.grid

    @property
    def known_area(self) -> float:
        """Area of the map's free and occupied cells, square metres."""
        return self._parts.maps.known_area

    @property
    def recording_over(self) -> bool:
        """Whether all measurements of a replayed log have been played."""
        return self._parts.recording_over()

    def frontiers(
        self, *, sensor_range: float = 6.0, least_size: float = 0.4, least_gain: float = 0.25,
        avoided: Sequence[Pose2D] = (), seen_from: Sequence[Pose2D] | None = None,
    ) -> list[Frontier]:  # fmt: skip
        """Places where the robot can see unknown space, the nearest first."""
        parameters = FrontierParameters(sensor_range, least_size, least_gain)
        return self._parts.maps.frontiers(self.pose, parameters, avoided, seen_from)

    def coverage(
        self, corners: list[Pose2D], spacing: float, *, clearance: float | None = None
    ) -> CoveragePlan:
        """Lanes that cover a polygon, or the robot's room."""
        polygon = np.array([(corner.x, corner.y) for corner in corners]) if corners else None
        return self._parts.maps.coverage(self.pose, polygon, spacing, clearance)

    def save_map(self, name: str) -> str:
        """Save the map as a folder; return its name."""
        saved = self._parts.maps.save(name)
        self._parts.emit("map", f"saved the map as {saved}: {self.known_area:.1f} m² known")
        for one in self._parts.maps.surveyed:
            x, y, _ = one.position
            self._parts.emit(
                "marker",
                f"surveyed marker {one.number} at ({x:.2f}, {y:.2f}), {degrees(one.heading):.0f} "
                f"deg, within {one.position_deviation:.2f} m and "
                f"{degrees(one.heading_deviation):.1f} deg",
                number=one.number, x=round(x, 3), y=round(y, 3), heading=round(one.heading, 4),
            )  # fmt: skip
        return saved

    def load_map(self, name: str, pose: Pose2D | None = None) -> None:
        """Load a saved map and use it from now on."""
        before = self.pose
        grid = self._parts.maps.load(name, pose)
        rows, columns = grid.cells.shape
        x, y = grid.origin
        end = Pose2D(x + columns * grid.resolution, y + rows * grid.resolution)
        self._parts.cover([Pose2D(x, y), end])
        self._parts.draw(grid)
        report_pose(self._parts.emit, before, self.pose, "map")

    def set_mapping(self, is_mapping: bool) -> None:
        """Begin or cease to change the map."""
        self._parts.estimator.set_mapping(is_mapping)
        self._parts.emit("map", "mapping" if is_mapping else "localising on the map as it is")

    def fit_at(self, pose: Pose2D) -> float:
        """Localisation health of the newest scan at another pose; 0 without a scan."""
        return 0.0 if self.scan is None else self._parts.estimator.fit_at(pose, self.scan)

    def navigate_to(
        self, goal: Pose2D, *, tolerance: float | None = None, partial: bool = False
    ) -> MotionTask:
        """Plan and drive to a pose in the map frame, replanning as the world changes."""
        self._parts.cover([goal])
        return self._navigation.navigate_to(
            goal, tolerance=tolerance, partial=partial, first=self._unless_ambiguous
        )

    def navigate_through(
        self, goals: list[Pose2D], *, tolerance: float | None = None
    ) -> MotionTask:
        """Drive through poses in turn to the last one, without stopping in between."""
        self._parts.cover(goals)
        return self._navigation.navigate_through(
            goals, tolerance=tolerance, first=self._unless_ambiguous
        )

    def follow_path(self, path: Path) -> MotionTask:
        """Follow a fixed path, without replanning."""
        return self._navigation.follow_path(path)

    def plan(self, goal: Pose2D, start: Pose2D | None = None) -> MotionTask:
        """Plan without driving; the result is the task's `path`."""
        self._parts.cover([goal])
        return self._navigation.plan(goal, start)

    def spin(
        self, angle: float, *, speed: float | None = None, while_lost: bool = False
    ) -> MotionTask:
        """Turn in place by an angle (may exceed a full turn), positive to the left."""
        return self._navigation.spin(angle, speed=speed, while_lost=while_lost)

    def back_up(
        self, distance: float, *, speed: float | None = None, while_lost: bool = False
    ) -> MotionTask:
        """Drive straight back by a distance; fails before it hits what a sensor sees."""
        return self._navigation.back_up(distance, speed=speed, while_lost=while_lost)

    def drive_on_heading(
        self, distance: float, *, speed: float | None = None, direction: float = 0.0,
        while_lost: bool = False,
    ) -> MotionTask:  # fmt: skip
        """Drive straight by a distance (negative: backward) and hold the heading."""
        return self._navigation.drive_on_heading(
            distance, speed=speed, direction=direction, while_lost=while_lost
        )

    def escape(
        self, *, clearance: float | None = None, distance: float = 1.5,
        speed: float | None = None, while_lost: bool = False,
    ) -> MotionTask:  # fmt: skip
        """Drive out of a tight spot by range sensors and odometry alone."""
        return self._navigation.escape(
            clearance=clearance, distance=distance, speed=speed, while_lost=while_lost
        )

    def assisted_teleop(self, seconds: float, *, silence: float = 30.0) -> MotionTask:
        """Let the operator drive, within the limits of the safety stage."""
        return self._navigation.assisted_teleop(seconds, silence=silence)

    def drive_for(
        self, twist: Twist, seconds: float, *, while_lost: bool = False,
        contact: ContactZone | None = None, gives_way: bool = False,
    ) -> None:  # fmt: skip
        """Drive a velocity for some seconds; cancels another running motion task."""
        self._navigation.drive_for(
            twist, seconds, while_lost=while_lost, contact=contact, gives_way=gives_way
        )

    def clear_costmap(
        self, which: str = "both", *, radius: float | None = None, layer: str | None = None
    ) -> None:
        """Clear sensed obstacles in the `local` or `global` costmap or `both`. The map stays.

        Args:
            which: costmap.
            radius: metres around the robot; None: everywhere.
            layer: name of the only layer to clear; None: all.

        Raises:
            ParameterError: unknown costmap or layer.
        """
        known = ("local", "global", "both")
        if which not in known:
            raise ParameterError(
                "which", f"{which!r} is not one of {', '.join(known)}", suggestion(which, known)
            )
        named = {"local": self._parts.local_costmap, "global": self._parts.global_costmap}
        costmaps = [costmap for name, costmap in named.items() if which in (name, "both")]
        layers = [name for costmap in costmaps for name in costmap.layers]
        if layer is not None and layer not in layers:
            raise ParameterError("layer", f"unknown layer {layer!r}", suggestion(layer, layers))
        for costmap in costmaps:
            if layer is not None and layer not in costmap.layers:
                continue
            if radius is None:
                costmap.clear(layer=layer)
            else:
                costmap.clear_around(self.pose, radius, layer=layer)
        within = "" if radius is None else f", {radius:g} m around the robot"
        only = "" if layer is None else f", layer {layer}"
        self._parts.emit("recovery", f"cleared costmap: {which}{within}{only}", costmap=which)

    def set_edge(self, edge: str, *, closed: bool) -> None:
        """Close or open an edge of the planner's route graph, from the next plan on.

        Raises:
            ParameterError: there is no such edge, or the planner has no route graph.
        """
        self._navigation.set_edge(edge, closed=closed)

    def disambiguate(self) -> MotionTask:
        """Drive to where rival poses differ until one is left; succeeds at once without rivals."""
        task = self._navigation.new_task("disambiguate")
        executor = self._disambiguation(task)
        self._navigation.start(executor, "recovery", "telling the possible poses apart")
        return task

    def _disambiguation(self, task: MotionTask, then: GoalDrive | None = None) -> Disambiguation:
        return Disambiguation(
            task,
            self._parts.estimator,
            self._navigation.parameters,
            lambda: self.scan,
            self._navigation.view_drive,
            self._navigation.localisation_monitor,
            then,
        )

    def _unless_ambiguous(self, drive: GoalDrive) -> MotionExecutor:
        """Return a drive to a goal, preceded by disambiguation while there are rivals."""
        before = self._navigation.parameters.ambiguous_goals == "disambiguate"
        if before and other_places(drive, self.estimate, self._navigation.parameters):
            return self._disambiguation(drive.task, drive)
        return drive

    def relocalise(self) -> MotionTask:
        """Find the pose on the whole map by lidar alone; fails AMBIGUOUS when several poses fit."""
        task = self._navigation.new_task("relocalise")
        parts = self._parts
        executor = Relocalisation(
            task,
            parts.estimator,
            self._navigation.parameters,
            lambda: self.scan,
            parts.frames,
            self._parts.emit,
        )
        self._navigation.start(executor, "recovery", "searching for the pose on the whole map")
        return task

    def set_pose(
        self, pose: Pose2D, *, position_deviation: float, heading_deviation: float, source: str
    ) -> None:
        """Reset the localisation around a pose."""
        before = self.pose
        self._parts.estimator.set_pose(pose, position_deviation, heading_deviation)
        report_pose(self._parts.emit, before, pose, source)

    def save_image(
        self, image: Image, name: str, *, details: Mapping[str, JsonValue] | None = None
    ) -> str:
        """Save an image in the run's folder; return its path relative to that folder."""
        return self._parts.store.save(image, name, details)

    def say(self, text: str) -> None:
        """Write a message to the operator to the event log."""
        self._parts.emit("say", text)

"""The robot that behaviours see: one face for navigation, localisation, costmaps and camera."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from math import degrees
from typing import Any, Protocol

from stack.body import Body
from stack.errors import ParameterError
from stack.navigation.navigator import Navigator
from stack.navigation.relocalisation import Estimator, Match, Relocalisation
from stack.navigation.tasks import CostmapLike, Emit, MotionTask, NavigationState
from stack.navigation.tuning import Tunable, change, flat
from stack.parameters import suggestion
from stack.types import (
    Battery,
    Footprint,
    Image,
    Marker,
    MarkerSighting,
    Observation,
    Odometry,
    Path,
    Pose2D,
    PoseEstimate,
    Scan,
    TrackedObject,
    Twist,
    wrap_angle,
)

CAMERA_LEASE = 1.0
"""Seconds of robot time for which asking for a picture keeps the camera on."""

JUMP, TURN = 0.3, 0.2
"""Metres and radians: after a larger jump, what was sensed before lies in the wrong places."""


class MarkerDetector(Protocol):
    """Finds known markers in pictures."""

    def sightings(self, image: Image) -> tuple[MarkerSighting, ...]:
        """The known markers in a picture."""
        ...


class ImageStore(Protocol):
    """Keeps pictures in the run's folder."""

    def save(self, image: Image, name: str) -> str:
        """Keep a picture; its path relative to the folder."""
        ...


@dataclass(frozen=True)
class FacadeParts:
    """What a pilot is composed of.

    Attributes:
        markers: the known markers of this place, map frame.
        detector: None when the robot has no camera.
        tunables: components whose parameters may be changed, by name.
        cover: lets the ground of the costmaps grow to hold some poses, where there is no map.
        forget_tracks: called when what was followed before lies in the wrong places.
    """

    body: Body
    navigator: Navigator
    estimator: Estimator
    local_costmap: CostmapLike
    global_costmap: CostmapLike
    store: ImageStore
    emit: Emit
    markers: tuple[Marker, ...] = ()
    detector: MarkerDetector | None = None
    tunables: Mapping[str, Tunable] = field(default_factory=dict)
    cover: Callable[[Iterable[Pose2D]], None] = lambda poses: None
    forget_tracks: Callable[[], None] = lambda: None


class RobotFacade:
    """stack.robot.Robot over the parts of the stack.

    The runtime calls `update` with each observation and `advance` once per control step, and asks
    the body for a picture whenever `camera_wanted`.

    Attributes:
        tracks: what moves around the robot, map frame; whoever follows it puts it here.
    """

    def __init__(self, parts: FacadeParts) -> None:
        self._parts, self._navigation = parts, parts.navigator
        self._observation: Observation | None = None
        self._odometry = Odometry(0.0, Pose2D(0.0, 0.0), Twist())
        self._scan: Scan | None = None
        self._scans: dict[str, Scan] = {}
        self._image: Image | None = None
        self._sightings: tuple[Image, tuple[MarkerSighting, ...]] | None = None
        self._lease = -CAMERA_LEASE
        self.tracks: tuple[TrackedObject, ...] = ()

    def update(self, observation: Observation, odometry: Odometry | None = None) -> None:
        """Take in what the sensors said in this step.

        Args:
            observation: from the body.
            odometry: dead reckoning better than the wheels' own (fused with the gyro), or None.
        """
        self._observation = observation
        self._odometry = odometry or observation.odometry
        self._scan = observation.scan or self._scan
        self._scans = {**self._scans, **observation.scans}
        self._image = observation.image or self._image

    def advance(self) -> Twist:
        """The velocity that the task under way wants in this step."""
        tracks = tuple(track.at(self.time) for track in self.tracks)
        state = NavigationState(self.time, self.estimate, self._odometry, self._scan, tracks)
        self._parts.cover([state.estimate.pose])
        return self._navigation.advance(state)

    @property
    def scans(self) -> Mapping[str, Scan]:
        """The newest scans of further lidars, by name."""
        return self._scans

    @property
    def camera_wanted(self) -> bool:
        """Whether somebody asked for pictures within the last second."""
        return self.time - self._lease < CAMERA_LEASE

    @property
    def parameters(self) -> dict[str, Any]:
        """Component parameters in force: `controller.cruise_speed` -> value."""
        return flat(self._parts.tunables)

    def set_parameter(self, name: str, value: Any) -> None:
        """Put another value of a component's parameter in force, from the next step on.

        Raises:
            ParameterError: no such component or parameter, or a value that will not do.
        """
        read = change(self._parts.tunables, name, value)
        self._parts.emit("parameter", f"{name} is now {read}", name=name, value=str(read))

    @property
    def time(self) -> float:
        """Seconds on the body's clock."""
        return self._parts.body.time

    @property
    def estimate(self) -> PoseEstimate:
        """Pose in the map frame with covariance and health of the localisation."""
        return self._parts.estimator.estimate

    @property
    def pose(self) -> Pose2D:
        """Best estimate of where the robot is, in the map frame."""
        return self.estimate.pose

    @property
    def odometry(self) -> Pose2D:
        """Dead-reckoned pose in the odom frame."""
        return self._odometry.pose

    @property
    def localisation_health(self) -> float:
        """In [0, 1]; below 0.3 the scans do not fit the map here."""
        return self.estimate.health

    @property
    def speed(self) -> Twist:
        """Measured velocity."""
        return self._odometry.twist

    @property
    def footprint(self) -> Footprint:
        """The robot's outline in the base frame."""
        return self._parts.body.description.footprint

    @property
    def battery(self) -> Battery:
        """State of charge; full before the first observation."""
        return Battery(1.0) if self._observation is None else self._observation.battery

    @property
    def scan(self) -> Scan | None:
        """The newest lidar scan."""
        return self._scan

    @property
    def markers(self) -> tuple[Marker, ...]:
        """The known markers of this place, map frame."""
        return self._parts.markers

    def image(self) -> Image | None:
        """The newest camera picture since somebody began to ask; keeps the camera on.

        A picture from before the camera was last off is not handed out: it shows another moment.
        """
        if not self.camera_wanted:
            self._image = None
        self._lease = self.time
        return self._image

    def marker_sightings(self) -> tuple[MarkerSighting, ...]:
        """Known markers in the newest picture; keeps the camera on as `image` does."""
        image, detector = self.image(), self._parts.detector
        if image is None or detector is None:
            return ()
        if self._sightings is None or self._sightings[0] is not image:
            self._sightings = (image, detector.sightings(image))
        return self._sightings[1]

    def fit_at(self, pose: Pose2D) -> float:
        """Localisation health that the newest scan would have at another pose; 0 without one."""
        return 0.0 if self._scan is None else self._parts.estimator.fit_at(pose, self._scan)

    def navigate_to(
        self, goal: Pose2D, *, tolerance: float | None = None, partial: bool = False
    ) -> MotionTask:
        """Plan and drive to a pose in the map frame, replanning as the world changes."""
        self._parts.cover([goal])
        return self._navigation.navigate_to(goal, tolerance=tolerance, partial=partial)

    def navigate_through(
        self, goals: list[Pose2D], *, tolerance: float | None = None
    ) -> MotionTask:
        """Drive past poses in turn to the last one without stopping in between."""
        self._parts.cover(goals)
        return self._navigation.navigate_through(goals, tolerance=tolerance)

    def follow_path(self, path: Path) -> MotionTask:
        """Drive along a given path, without replanning."""
        return self._navigation.follow_path(path)

    def plan(self, goal: Pose2D, start: Pose2D | None = None) -> MotionTask:
        """Plan without driving; the answer is the task's `path`."""
        self._parts.cover([goal])
        return self._navigation.plan(goal, start)

    def spin(self, angle: float, *, speed: float | None = None) -> MotionTask:
        """Turn in place by an angle (also above a full turn), positive to the left."""
        return self._navigation.spin(angle, speed=speed)

    def back_up(self, distance: float, *, speed: float | None = None) -> MotionTask:
        """Drive straight back by a distance; gives up rather than touch what the lidar sees."""
        return self._navigation.back_up(distance, speed=speed)

    def drive_on_heading(
        self, distance: float, *, speed: float | None = None, direction: float = 0.0
    ) -> MotionTask:
        """Drive straight by a distance, negative is backward, and hold the heading."""
        return self._navigation.drive_on_heading(distance, speed=speed, direction=direction)

    def escape(
        self, *, clearance: float | None = None, distance: float = 1.5, speed: float | None = None
    ) -> MotionTask:
        """Drive out of a tight spot by lidar and odometry alone."""
        return self._navigation.escape(clearance=clearance, distance=distance, speed=speed)

    def assisted_teleop(self, seconds: float, *, silence: float = 30.0) -> MotionTask:
        """Let the operator drive; safety has the last word."""
        return self._navigation.assisted_teleop(seconds, silence=silence)

    def drive_for(self, twist: Twist, seconds: float) -> None:
        """Velocity with a time to live; cancels another motion task under way."""
        self._navigation.drive_for(twist, seconds)

    def clear_costmap(
        self, which: str = "both", *, radius: float | None = None, layer: str | None = None
    ) -> None:
        """Forget sensed obstacles: `local`, `global` or `both`. The static map stays.

        Args:
            which: costmap.
            radius: metres round the robot; None is everywhere.
            layer: name of the one layer that is to forget; None is all.

        Raises:
            ParameterError: another word, or no such layer.
        """
        known = ("local", "global", "both")
        if which not in known:
            raise ParameterError(
                "which", f"there is no {which!r} costmap", suggestion(which, known)
            )
        named = {"local": self._parts.local_costmap, "global": self._parts.global_costmap}
        costmaps = [costmap for name, costmap in named.items() if which in (name, "both")]
        layers = [name for costmap in costmaps for name in costmap.layers]
        if layer is not None and layer not in layers:
            raise ParameterError(
                "layer", f"there is no layer {layer!r} here", suggestion(layer, layers)
            )
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

    def relocalise(self) -> MotionTask:
        """Find the pose anywhere on the map from lidar alone; fails AMBIGUOUS rather than guess."""
        task = self._navigation.new_task("relocalise")
        activity = Relocalisation(task, self._parts.estimator, self._relocalised)
        self._navigation.start(activity, "recovery", "looks for its place on the whole map")
        return task

    def set_pose(
        self, pose: Pose2D, *, position_deviation: float, heading_deviation: float, source: str
    ) -> None:
        """Reset the localisation around a pose."""
        before = self.pose
        self._parts.estimator.start(pose, position_deviation, heading_deviation)
        self._jumped(before, pose, source)

    def save_image(self, image: Image, name: str) -> str:
        """Keep a picture in the run's folder; returns its path relative to that folder."""
        return self._parts.store.save(image, name)

    def say(self, text: str) -> None:
        """Tell the operator: goes into the event log."""
        self._parts.emit("say", text)

    def _relocalised(self, before: Pose2D, match: Match) -> None:
        self._jumped(before, match.pose, "lidar")

    def _jumped(self, before: Pose2D, pose: Pose2D, source: str) -> None:
        """Tell of a new pose, and forget what was sensed from a wrong one."""
        jump = before.distance_to(pose)
        turn = abs(wrap_angle(pose.heading - before.heading))
        if jump > JUMP or turn > TURN:
            self._parts.forget_tracks()
            self._parts.local_costmap.clear()
            self._parts.global_costmap.clear()
        self._parts.emit(
            "relocalised",
            f"now at ({pose.x:.2f}, {pose.y:.2f}, {degrees(pose.heading):.0f} deg) by {source}, "
            f"{jump:.2f} m and {degrees(turn):.0f} deg from before",
            by=source, jump=round(jump, 3), turn=round(turn, 4),
        )  # fmt: skip

"""The robot as behaviours see it. Plugins import this module, stack.types and stack.errors.

Nothing blocks. A call that takes time returns a task which keeps its own outcome; a newer motion
task cancels the older. Names follow nav2_simple_commander.
"""

from __future__ import annotations

from typing import Protocol

from stack.types import (
    Battery,
    Failure,
    Footprint,
    Image,
    Marker,
    MarkerSighting,
    Path,
    Pose2D,
    PoseEstimate,
    Scan,
    TaskStatus,
    Twist,
)


class Task(Protocol):
    """Something asked of the robot that takes time. Holds its own outcome."""

    @property
    def status(self) -> TaskStatus:
        """RUNNING until it succeeded, failed or was cancelled; never changes after that."""
        ...

    @property
    def feedback(self) -> str:
        """Progress in a few words for the operator, e.g. `3.2 m to go`."""
        ...

    @property
    def failure(self) -> Failure | None:
        """Why it failed or was cancelled; None otherwise."""
        ...

    @property
    def distance_remaining(self) -> float:
        """Metres left (radians for a spin); 0 when unknown or over."""
        ...

    @property
    def path(self) -> Path | None:
        """The path in force, or the answer of `plan`; None when there is none."""
        ...

    def cancel(self) -> None:
        """End it and stop the robot. Does nothing once the task is over."""
        ...


class Robot(Protocol):
    """What a behaviour may ask of the robot."""

    @property
    def time(self) -> float:
        """Seconds on the robot's clock: simulated time in simulation."""
        ...

    @property
    def estimate(self) -> PoseEstimate:
        """Pose in the map frame with covariance and health of the localisation."""
        ...

    @property
    def pose(self) -> Pose2D:
        """Best estimate of where the robot is, in the map frame."""
        ...

    @property
    def odometry(self) -> Pose2D:
        """Dead-reckoned pose in the odom frame: drifts, never jumps. For distances and turns."""
        ...

    @property
    def localisation_health(self) -> float:
        """In [0, 1]; below 0.3 the scans do not fit the map here."""
        ...

    @property
    def speed(self) -> Twist:
        """Measured velocity."""
        ...

    @property
    def footprint(self) -> Footprint:
        """The robot's outline in the base frame."""
        ...

    @property
    def battery(self) -> Battery:
        """State of charge."""
        ...

    @property
    def scan(self) -> Scan | None:
        """The newest lidar scan."""
        ...

    @property
    def markers(self) -> tuple[Marker, ...]:
        """The known markers of this place, map frame."""
        ...

    def image(self) -> Image | None:
        """The newest camera picture; asking keeps the camera on for another second."""
        ...

    def marker_sightings(self) -> tuple[MarkerSighting, ...]:
        """Known markers in the newest picture; keeps the camera on as `image` does."""
        ...

    def fit_at(self, pose: Pose2D) -> float:
        """Localisation health that the newest scan would have at another pose, in [0, 1]."""
        ...

    def navigate_to(
        self, goal: Pose2D, *, tolerance: float | None = None, partial: bool = False
    ) -> Task:
        """Plan and drive to a pose in the map frame, replanning as the world changes.

        With `partial`, having come as near to it as there is a way to counts as success.
        """
        ...

    def navigate_through(self, goals: list[Pose2D], *, tolerance: float | None = None) -> Task:
        """Drive past poses in turn to the last one without stopping in between."""
        ...

    def follow_path(self, path: Path) -> Task:
        """Drive along a given path, without replanning."""
        ...

    def plan(self, goal: Pose2D, start: Pose2D | None = None) -> Task:
        """Plan without driving; the answer is the task's `path`."""
        ...

    def spin(self, angle: float, *, speed: float | None = None) -> Task:
        """Turn in place by an angle (also above a full turn), positive to the left."""
        ...

    def back_up(self, distance: float, *, speed: float | None = None) -> Task:
        """Drive straight back by a distance; gives up rather than touch what the lidar sees."""
        ...

    def drive_on_heading(
        self, distance: float, *, speed: float | None = None, direction: float = 0.0
    ) -> Task:
        """Drive straight by a distance (negative: backward), holding the heading by odometry.

        Gives up rather than touch what the lidar sees.

        Args:
            distance: metres.
            speed: m/s; None is the robot's own.
            direction: of travel in the base frame, radians; omnidirectional robots only.
        """
        ...

    def escape(
        self, *, clearance: float | None = None, distance: float = 1.5, speed: float | None = None
    ) -> Task:
        """Drive out of a tight spot by lidar and odometry alone; no costmap, map or pose is asked.

        Args:
            clearance: metres wanted round the outline; None is the robot's own.
            distance: metres to drive for it, at most.
            speed: m/s; None is the robot's own.
        """
        ...

    def assisted_teleop(self, seconds: float, *, silence: float = 30.0) -> Task:
        """Let the operator drive; safety has the last word. Succeeds when the operator is done.

        Args:
            seconds: for which, at most; fails TIMED_OUT after that.
            silence: seconds without a velocity from the operator after which it fails.
        """
        ...

    def drive_for(self, twist: Twist, seconds: float) -> None:
        """Velocity with a time to live, for behaviours that close their own loop each tick.

        Safety still has the last word. Cancels a motion task under way.
        """
        ...

    def clear_costmap(
        self, which: str = "both", *, radius: float | None = None, layer: str | None = None
    ) -> None:
        """Forget sensed obstacles: `local`, `global` or `both`. The static map stays.

        Args:
            which: costmap.
            radius: metres round the robot; None is everywhere.
            layer: name of the one layer that is to forget; None is all.
        """
        ...

    def set_edge(self, edge: str, *, closed: bool) -> None:
        """Close or open an edge of the planner's route graph; a drive under way plans anew.

        Raises:
            ParameterError: there is no such edge, or the planner has no route graph.
        """
        ...

    def relocalise(self) -> Task:
        """Find the pose anywhere on the map from lidar alone; fails AMBIGUOUS rather than guess."""
        ...

    def set_pose(
        self, pose: Pose2D, *, position_deviation: float, heading_deviation: float, source: str
    ) -> None:
        """Reset the localisation around a pose; `source` (e.g. `marker`) goes into the report."""
        ...

    def save_image(self, image: Image, name: str) -> str:
        """Keep a picture in the run's folder; returns its path relative to that folder."""
        ...

    def say(self, text: str) -> None:
        """Tell the operator: goes into the event log."""
        ...

"""Drive of the robot, for behaviours."""

from __future__ import annotations

from typing import Protocol

from stack.robot.task import Task
from stack.types import ContactZone, Footprint, Path, Pose2D, Twist


class Base(Protocol):
    """The drive of the robot: goals on the map, and motions by odometry and range sensors."""

    @property
    def odometry(self) -> Pose2D:
        """Dead-reckoned pose, odom frame: drifts but never jumps. For distances and turns."""

    @property
    def speed(self) -> Twist:
        """Measured velocity, base frame."""

    @property
    def footprint(self) -> Footprint:
        """Outline of the robot in the base frame."""

    def held(self, since: float) -> str:
        """What held the robot most since a time, seconds; empty if nothing did for long.

        A sentence for failures, as in: held 7.4 of 8.0 s: stopped: obstacle 0.3 m ahead.
        """

    def navigate_to(
        self, goal: Pose2D, *, tolerance: float | None = None, partial: bool = False
    ) -> Task:
        """Plan and drive to a pose, with replanning when the world changes.

        Args:
            goal: map frame.
            tolerance: metres; None: the robot's own.
            partial: accept the nearest reachable pose as success.
        """

    def navigate_through(self, goals: list[Pose2D], *, tolerance: float | None = None) -> Task:
        """Drive through poses (map frame) in order, without stopping before the last one.

        Raises:
            ParameterError: no goals.
        """

    def follow_path(self, path: Path) -> Task:
        """Drive along a path (map frame), without replanning.

        Raises:
            ParameterError: the path has fewer than two points.
        """

    def plan(self, goal: Pose2D, start: Pose2D | None = None) -> Task:
        """Plan without driving; the result is the task's `path`.

        Args:
            goal: map frame.
            start: map frame; None: the robot's pose.
        """

    def spin(self, angle: float, *, speed: float | None = None, while_lost: bool = False) -> Task:
        """Turn in place by an angle, radians, positive to the left; may exceed a full turn.

        This motion and the next three fail with LOST while the robot is lost, and so does
        `drive_for`. A behaviour that finds the pose sets `while_lost`.
        """

    def back_up(
        self, distance: float, *, speed: float | None = None, while_lost: bool = False
    ) -> Task:
        """Drive straight back by a distance, metres; fails before it touches an obstacle.

        Raises:
            ParameterError: a distance or speed that is not above 0, or a robot that cannot reverse.
        """

    def drive_on_heading(
        self, distance: float, *, speed: float | None = None, direction: float = 0.0,
        while_lost: bool = False,
    ) -> Task:  # fmt: skip
        """Drive straight by a distance, with the heading held by odometry.

        Fails before it touches an obstacle that a sensor sees.

        Args:
            distance: metres; negative: backward.
            speed: m/s; None: the robot's own.
            direction: of travel in the base frame, radians; omnidirectional robots only.
            while_lost: drive also while the robot is lost.

        Raises:
            ParameterError: a speed that is not above 0.
        """

    def escape(
        self, *, clearance: float | None = None, distance: float = 1.5,
        speed: float | None = None, while_lost: bool = False,
    ) -> Task:  # fmt: skip
        """Drive out of a tight spot by range sensors and odometry, without costmap, map or pose.

        Sensors do not see keep-out zones. A robot that knows where it is stays out of them, and
        drives out of one in which it stands on the map.

        Args:
            clearance: required free distance around the footprint, metres; None: the robot's own.
            distance: maximum driving distance, metres.
            speed: m/s; None: the robot's own.
            while_lost: drive also while the robot is lost.

        Raises:
            ParameterError: a value that is not above 0.
        """

    def assisted_teleop(self, seconds: float, *, silence: float = 30.0) -> Task:
        """Let the operator drive, limited by safety. Succeeds when the operator is done.

        Args:
            seconds: time limit; fails with TIMED_OUT after that.
            silence: seconds without a velocity from the operator after which it fails.
        """

    def drive_for(
        self, twist: Twist, seconds: float, *, while_lost: bool = False,
        contact: ContactZone | None = None, gives_way: bool = False,
    ) -> Task:  # fmt: skip
        """Drive a velocity for some seconds, for behaviours with their own control loop.

        Safety still limits the velocity. Cancels the current motion task; a call while the last one
        is driven renews that one's task, which succeeds when the time is over.

        Args:
            twist: base frame.
            seconds: after which the robot stops, unless the call is repeated.
            while_lost: drive also while the robot is lost.
            contact: where the robot may touch something, such as a dock: what the sensors see there
                does not stop it, and it drives slowly.
            gives_way: leave the way of a person who walks towards the robot, as drives do.

        Raises:
            NavigationError: LOST, while the robot is, unless `while_lost` is set or the twist is
                standstill. A behaviour that does not catch it fails with LOST.
        """

    def disambiguate(self) -> Task:
        """Drive to where the estimate and its rivals differ until one pose is left.

        Succeeds at once without rivals. Fails with AMBIGUOUS when no reachable place differs.
        """

    def set_edge(self, edge: str, *, closed: bool) -> None:
        """Close or open an edge of the planner's route graph; a current drive replans.

        Raises:
            ParameterError: there is no such edge, or the planner has no route graph.
        """

"""Follows a path segment by segment with a controller, forward or backward, and stops between them.

In a base frame whose x axis points backward, reversing is driving forward with the footprint
rotated by 180 degrees; the arcs and their radii are the same. Any controller for forward driving
therefore follows backward segments when it gets poses in this frame.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from math import hypot, inf, pi
from typing import Any

import numpy as np

from stack.components import Controller, ControlState, GoalTolerance, StopCriterion
from stack.control.parameters import STOP_SHARE
from stack.control.ramps import Ramp
from stack.drivetrain.description import RobotDescription
from stack.errors import NavigationError
from stack.geometry.path_progress import PathProgress, turned
from stack.geometry.path_segment import PathSegment
from stack.lifecycle import Lifecycle
from stack.types import (
    STANDSTILL,
    FailureCode,
    FloatArray,
    Footprint,
    Path,
    Pose2D,
    Twist,
    wrap_angle,
)

SEGMENT_END, STEERED_END = 0.05, 0.01
"""Remaining length in metres at which a segment before another is complete; for a car.

A car cannot make up for a turn that it has cut short.
"""

STANDING_SPEED = 0.02
"""m/s below which the direction may be changed."""

SAME_GOAL = 0.02
"""Metres up to which the end of a new path counts as the same goal."""

SAME_POSITION = 0.06
"""Distance to the goal in metres within which a new short path to it counts as arrived, at most;
half of the tolerance if that is less."""

_ANY_TOLERANCE = GoalTolerance()

CreateController = Callable[[Any, RobotDescription, float], Controller]


class PathFollower(Lifecycle):
    """Drives the segments of a path in turn with a controller.

    The drive owns the progress on its path; the follower only begins the next segment when the
    robot stands at the end of one. So another drive can use the follower in between.

    Args:
        create: creates the controller from parameters, robot and period; its class, for example.
        parameters: of the controller.
        robot: outline, limits and kind of drive.
        period: seconds between two steps.
    """

    def __init__(
        self, create: CreateController, parameters: Any, robot: RobotDescription, period: float
    ) -> None:
        self._create, self._robot, self._period = create, robot, period
        self._forward = create(parameters, robot, period)
        self._backward: Controller | None = None
        self._arrival = Arrival()
        self._progress: PathProgress | None = None
        self._tolerance = GoalTolerance()
        self._segment: PathSegment | None = None
        self._last, self._began_at, self._steered_at = STANDSTILL, 0.0, -inf
        self._ramp = Ramp(robot.drivetrain, period, 0.0)

    @property
    def parameters(self) -> Any:
        """Current parameters of the controller."""
        return self._forward.parameters

    def configure(self, parameters: Any) -> None:
        """Apply new parameters."""
        for controller in self._controllers():
            controller.configure(parameters)

    def start(self, now: float) -> None:
        self._began_at = now
        for controller in self._controllers():
            controller.start(now)

    def pause(self, now: float) -> None:
        for controller in self._controllers():
            controller.pause(now)

    def resume(self, now: float) -> None:
        for controller in self._controllers():
            controller.resume(now)

    def stop(self, now: float) -> None:
        for controller in self._controllers():
            controller.stop(now)

    @property
    def reverses(self) -> bool:
        """Whether the robot can follow a path forward or backward, as its headings say."""
        drivetrain = self._robot.drivetrain
        return (
            drivetrain.turns_in_place
            and not drivetrain.can_move_sideways
            and (self._robot.limits.reverse_speed > 0.0)
        )

    def progress_on(self, path: Path) -> PathProgress:
        """Return the progress at the beginning of a path, as this robot drives it."""
        return PathProgress(
            path,
            directional=not self._robot.drivetrain.can_move_sideways,
            steered=not self._robot.drivetrain.turns_in_place,
        )

    def follow(self, progress: PathProgress, tolerance: GoalTolerance = _ANY_TOLERANCE) -> None:
        """Follow a path from where the robot is on it.

        Args:
            progress: on the path.
            tolerance: at its end.

        Raises:
            NavigationError: NO_VALID_PATH for a backward segment when the robot cannot reverse.
        """
        self._progress = progress
        self._tolerance = tolerance
        self._arrival.set_path(progress.path, tolerance)
        for controller in self._controllers():
            controller.set_tolerance(tolerance)
        self._set_segment(progress.segment)

    def step(self, state: ControlState) -> Twist:
        """Compute the velocity command for this step.

        Args:
            state: of the robot; the progress is up to date with its pose.

        Raises:
            NavigationError: COLLISION_AHEAD when no safe command exists; NO_VALID_PATH for a
                backward segment when the robot cannot reverse.
        """
        progress = self._progress
        if progress is None:
            return STANDSTILL
        segment = progress.segment
        if not segment.is_last and segment.remaining <= self._segment_end:
            moves = hypot(state.twist.linear, state.twist.lateral) >= STANDING_SPEED
            if moves or self._last != STANDSTILL:
                last = self._ramp.rebased(self._last, state.twist)  # ignores an earlier drive's
                self._last = self._ramp.stopped(last)
                return self._last
            progress.begin_next(state.pose)
            segment = progress.segment
            self._set_segment(segment)
            self._driver(segment).pause(state.time)  # held while the robot came to a stand
            self._driver(segment).resume(state.time)
        criterion = self._forward.stop_criterion
        at_goal = self._arrival.reached(state.pose, segment, criterion)
        self._last = STANDSTILL
        if at_goal != state.at_goal:
            state = replace(state, at_goal=at_goal)
        self._last = self._steer(segment, state)
        return self._last

    @property
    def local_plan(self) -> Path | None:
        """Planned motion of the next seconds, map frame."""
        if self._segment is None:
            return None
        plan = self._driver(self._segment).local_plan
        return plan if plan is None or not self._segment.backward else turned(plan)

    @property
    def plans_with_tracks(self) -> bool:
        """Whether the controller keeps clear of moving objects itself."""
        return self._forward.needs_tracks

    @property
    def top_speed(self) -> float:
        """Speed at which the robot drives along the current segment at most, m/s."""
        limits, segment = self._robot.limits, self._segment
        backward = segment is not None and segment.backward
        own = limits.reverse_speed if backward else limits.linear_speed
        return min(own, self._forward.top_speed)

    def way_ahead(self, distance: float, *, backward: bool) -> FloatArray:
        """Return the (k, 2) points ahead, map frame; none if they are driven the other way round.

        Args:
            distance: metres of way.
            backward: whether the robot drives in reverse.
        """
        segment = self._segment
        if segment is None or segment.backward != backward:
            return np.empty((0, 2))
        return segment.ahead(distance)

    def keeps_clear(self, now: float) -> bool:
        """Whether the command of this step begins a plan that keeps clear of everybody who moves.

        Args:
            now: seconds; False if the controller was not asked at this time.
        """
        if self._segment is None or self._steered_at != now:
            return False
        return self._driver(self._segment).keeps_clear

    @property
    def _segment_end(self) -> float:
        """Remaining metres at which a segment before another is complete."""
        return SEGMENT_END if self._robot.drivetrain.turns_in_place else STEERED_END

    def _steer(self, segment: PathSegment, state: ControlState) -> Twist:
        self._steered_at = state.time
        if not segment.backward:
            return self._forward.step(state)
        pose, twist = state.pose, state.twist
        reversed_state = replace(
            state,
            pose=Pose2D(pose.x, pose.y, wrap_angle(pose.heading + pi)),
            twist=Twist(-twist.linear, twist.angular, -twist.lateral),
            points=None if state.points is None else -state.points,
            blind_behind=False,  # that is where it comes from
        )
        twist = self._driver(segment).step(reversed_state)
        return Twist(-twist.linear, twist.angular, -twist.lateral)

    def _driver(self, segment: PathSegment) -> Controller:
        """The controller for a segment; the one for backward driving is created when needed."""
        if not segment.backward:
            return self._forward
        if self._backward is None:
            self._backward = self._create(
                self.parameters, facing_backward(self._robot), self._period
            )
            self._backward.start(self._began_at)
            self._backward.set_tolerance(self._tolerance)
        return self._backward

    def _controllers(self) -> Iterator[Controller]:
        yield self._forward
        if self._backward is not None:
            yield self._backward

    def _set_segment(self, segment: PathSegment) -> None:
        if segment.backward and not self._robot.limits.reverse_speed:
            raise NavigationError(
                FailureCode.NO_VALID_PATH,
                "the path has a backward segment, but the robot's reverse_speed is 0 m/s; "
                "use a planner that does not reverse, or raise the robot's reverse_speed",
            )
        self._segment = segment
        self._driver(segment).set_segment(segment)


def facing_backward(robot: RobotDescription) -> RobotDescription:
    """Return the robot with a base frame that faces backward."""
    limits = replace(
        robot.limits, linear_speed=robot.limits.reverse_speed,
        reverse_speed=min(robot.limits.linear_speed, robot.limits.reverse_speed),
    )  # fmt: skip
    return replace(robot, footprint=Footprint(-robot.footprint.points), limits=limits)


class Arrival:
    """Remembers that the robot has reached the goal's position.

    Turning in place moves a robot slightly. Measured straight to the goal, the position counts as
    left only when a new path leads to another goal, or when the robot is farther away than twice
    the distance of the criterion. Measured along the path, it counts until the next path.
    """

    def __init__(self) -> None:
        self._goal: Pose2D | None = None
        self._arrived, self._fresh = False, True
        self._same = SAME_POSITION

    def set_path(self, path: Path, tolerance: GoalTolerance) -> None:
        """Set the path to follow, and how near to its end is enough."""
        same_goal = min(SAME_GOAL, STOP_SHARE * tolerance.position)
        if self._goal is None or self._goal.distance_to(path.goal) > same_goal:
            self._arrived = False
        self._same = min(SAME_POSITION, STOP_SHARE * tolerance.position)
        self._goal, self._fresh = path.goal, True

    def reached(self, pose: Pose2D, segment: PathSegment, criterion: StopCriterion) -> bool:
        """Whether the robot is at the goal's position.

        Args:
            pose: of the robot, map frame.
            segment: that it drives, up to date with the pose.
            criterion: of the controller.
        """
        if self._goal is None or not segment.is_last:
            return False
        distance = pose.distance_to(self._goal)
        if not criterion.along_path:
            limit = criterion.distance * (2.0 if self._arrived else 1.0)
            ends = self._arrived or segment.ends_within(criterion.distance)
            self._arrived = distance <= limit and ends
            return self._arrived
        if self._fresh:
            short = segment.length <= 2.0 * self._same
            self._arrived = short and distance <= self._same
        self._fresh = False
        self._arrived = self._arrived or segment.remaining <= criterion.distance
        return self._arrived

"""Splits a path at its cusps and follows the segments one after another, forward or backward.

In a base frame whose x axis points backward, reversing is driving forward with the footprint
rotated by 180 degrees; the arcs and their radii are the same. Any controller for forward driving
therefore follows backward segments when it gets poses in this frame.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import accumulate
from math import pi
from typing import Any

import numpy as np

from stack.components import Controller, ControlState
from stack.control.path_progress import PathProgress
from stack.control.ramps import Ramp
from stack.drivetrain.description import RobotDescription
from stack.errors import NavigationError
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

SEGMENT_END = 0.05
"""Remaining length in metres at which a segment before a cusp is complete."""

STANDING = 0.02
"""m/s below which the direction may be changed."""


@dataclass(frozen=True, slots=True)
class PathSegment:
    """Part of a path that is driven in one direction.

    Attributes:
        path: poses with the robot's headings.
        backward: whether the robot reverses along it.
    """

    path: Path
    backward: bool


def segments_of(path: Path) -> tuple[PathSegment, ...]:
    """Split a path at its cusps; each segment begins where the one before ends.

    A step is backward when it leads against the headings at both its ends. The first and the last
    heading of a path may be those of the robot and the goal, so only the inner one counts there.
    """
    steps = np.diff(path.points[:, :2], axis=0)
    moves = np.flatnonzero(np.einsum("nk,nk->n", steps, steps) > 1e-12)
    if not len(moves):
        return (PathSegment(path, backward=False),)
    reverse = _leads_backward(steps, path.points[:, 2])[moves]
    changes = np.flatnonzero(reverse[1:] != reverse[:-1]) + 1
    begins = [0, *(int(moves[change]) for change in changes)]
    ends = [*begins[1:], len(path.points) - 1]
    directions = [bool(reverse[0]), *(bool(reverse[change]) for change in changes)]
    return tuple(
        PathSegment(Path(path.points[begin : end + 1]), backward)
        for begin, end, backward in zip(begins, ends, directions, strict=True)
    )


def cusps_of(path: Path) -> tuple[float, ...]:
    """Return the distances along a path, in metres, at which the driving direction changes."""
    lengths = [segment.path.length for segment in segments_of(path)]
    return tuple(accumulate(lengths[:-1]))


def _leads_backward(steps: FloatArray, headings: FloatArray) -> FloatArray:
    """Return (n - 1,) whether each step leads backward; `headings` (n,) are those of its ends."""
    ahead = np.column_stack([np.cos(headings), np.sin(headings)])
    before, after = (
        np.einsum("nk,nk->n", steps, ahead[:-1]),
        np.einsum("nk,nk->n", steps, ahead[1:]),
    )
    if len(steps) > 1:
        before[0], after[-1] = after[0], before[-1]
    found: FloatArray = (before < 0.0) & (after < 0.0)
    return found


def controller_for(component: Any, parameters: Any, robot: RobotDescription, period: float) -> Any:
    """Create a controller (see stack.components); wrapped in a CuspSplitter unless omnidirectional.

    For an omnidirectional robot the heading does not determine the driving direction, so its paths
    have no cusps.
    """
    if robot.drivetrain.can_move_sideways:
        return component(parameters, robot, period)
    return CuspSplitter(component, parameters, robot, period)


class CuspSplitter(Controller):
    """Follows the segments of a path in turn with a controller, and stops at each cusp."""

    def __init__(
        self, component: Any, parameters: Any, robot: RobotDescription, period: float
    ) -> None:
        self._component, self._robot, self._period = component, robot, period
        self._forward: Controller = component(parameters, robot, period)
        self._backward: Controller | None = None
        self._segments: tuple[PathSegment, ...] = ()
        self._index, self._last = 0, STANDSTILL
        self._progress: PathProgress | None = None
        self._ramp = Ramp(robot.drivetrain, period, 0.0)

    @property
    def parameters(self) -> Any:
        """Current parameters of the controller."""
        return self._forward.parameters

    def configure(self, parameters: Any) -> None:
        """Apply new parameters."""
        for driver in filter(None, (self._forward, self._backward)):
            driver.configure(parameters)

    def start(self, now: float) -> None:
        """Begin a drive."""
        for driver in filter(None, (self._forward, self._backward)):
            driver.start(now)

    def pause(self, now: float) -> None:
        """Hold the drive."""
        for driver in filter(None, (self._forward, self._backward)):
            driver.pause(now)

    def resume(self, now: float) -> None:
        """Continue the drive."""
        for driver in filter(None, (self._forward, self._backward)):
            driver.resume(now)

    def stop(self, now: float) -> None:
        """End the drive."""
        for driver in filter(None, (self._forward, self._backward)):
            driver.stop(now)

    def set_path(self, path: Path) -> None:
        """Set the path to follow, map frame."""
        self._segments = segments_of(path)
        self._begin(0)

    def command(self, state: ControlState) -> Twist:
        """Compute the velocity command for this step.

        Raises:
            NavigationError: COLLISION_AHEAD when no safe command exists; NO_VALID_PATH for a
                backward segment when the robot cannot reverse.
        """
        if self._progress is None:
            return STANDSTILL
        self._progress.advance(state.pose)
        is_last = self._index == len(self._segments) - 1
        if not is_last and self._progress.remaining <= SEGMENT_END:
            if abs(state.twist.linear) < STANDING and self._last == STANDSTILL:
                self._begin(self._index + 1)
            else:
                last = self._ramp.rebased(self._last, state.twist)  # ignores an earlier drive's
                self._last = self._ramp.stopped(last)
                return self._last
        self._last = self._segment_command(state)
        return self._last

    @property
    def local_plan(self) -> Path | None:
        """Planned motion of the next seconds, map frame."""
        if self._progress is None:
            return None
        plan = self._driver.local_plan
        return plan if plan is None or not self._segment.backward else Path(_reversed(plan.points))

    def _segment_command(self, state: ControlState) -> Twist:
        if not self._segment.backward:
            return self._driver.command(state)
        pose, twist = state.pose, state.twist
        reversed_state = replace(
            state,
            pose=Pose2D(pose.x, pose.y, wrap_angle(pose.heading + pi)),
            twist=Twist(-twist.linear, twist.angular, -twist.lateral),
            points=None if state.points is None else -state.points,
        )
        twist = self._driver.command(reversed_state)
        return Twist(-twist.linear, twist.angular, -twist.lateral)

    @property
    def _segment(self) -> PathSegment:
        return self._segments[self._index]

    @property
    def _driver(self) -> Controller:
        """The controller of the current segment."""
        if not self._segment.backward:
            return self._forward
        if self._backward is None:
            self._backward = self._component(
                self.parameters, facing_backward(self._robot), self._period
            )
        return self._backward

    def _begin(self, index: int) -> None:
        """Start a segment."""
        self._index = index
        segment = self._segment
        if segment.backward and not self._robot.limits.reverse_speed:
            raise NavigationError(
                FailureCode.NO_VALID_PATH,
                "the path has a backward segment, but the robot's reverse_speed is 0 m/s; "
                "use a planner that does not reverse, or raise the robot's reverse_speed",
            )
        self._progress = PathProgress(segment.path)
        path = segment.path
        self._driver.set_path(Path(_reversed(path.points)) if segment.backward else path)


def facing_backward(robot: RobotDescription) -> RobotDescription:
    """Return the robot with a base frame that faces backward."""
    limits = replace(
        robot.limits, linear_speed=robot.limits.reverse_speed,
        reverse_speed=min(robot.limits.linear_speed, robot.limits.reverse_speed),
    )  # fmt: skip
    return replace(robot, footprint=Footprint(-robot.footprint.points), limits=limits)


def _reversed(points: FloatArray) -> FloatArray:
    """Return poses (n, 3) with their headings rotated by 180 degrees."""
    turned: FloatArray = points + np.array([0.0, 0.0, pi])
    return turned

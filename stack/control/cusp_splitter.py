"""Paths with cusps: they are driven leg by leg, some of the legs backward.

Seen from a frame whose x axis points backward, a robot that reverses is one that drives forward
and whose outline is turned by half a circle: its arcs and their radii are the same. So any
controller that drives forward drives reverse legs as well, with such a frame as its base.
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
from stack.drivetrain.description import DriveKind, RobotDescription
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

LEG_END = 0.05
"""Metres left of a leg, before the next one, at which it has been driven."""

STANDING = 0.02
"""m/s below which the direction may be changed."""


@dataclass(frozen=True, slots=True)
class PathSegment:
    """A piece of a path that is driven in one direction.

    Attributes:
        path: headings are the robot's.
        backward: whether these point against the motion.
    """

    path: Path
    backward: bool


def legs_of(path: Path) -> tuple[PathSegment, ...]:
    """The pieces of a path between its cusps, each beginning where the one before ends.

    A step leads backward when the headings at both its ends say so. At the ends of a path the
    heading may be the robot's or the goal's own, so only the inner one counts there.
    """
    steps = np.diff(path.points[:, :2], axis=0)
    moves = np.flatnonzero(np.einsum("nk,nk->n", steps, steps) > 1e-12)
    if not len(moves):
        return (PathSegment(path, backward=False),)
    against = _against(steps, path.points[:, 2])[moves]
    changes = np.flatnonzero(against[1:] != against[:-1]) + 1
    begins = [0, *(int(moves[change]) for change in changes)]
    ends = [*begins[1:], len(path.points) - 1]
    directions = [bool(against[0]), *(bool(against[change]) for change in changes)]
    return tuple(
        PathSegment(Path(path.points[begin : end + 1]), backward)
        for begin, end, backward in zip(begins, ends, directions, strict=True)
    )


def cusps_of(path: Path) -> tuple[float, ...]:
    """Metres along a path at which the direction of driving changes."""
    lengths = [leg.path.length for leg in legs_of(path)]
    return tuple(accumulate(lengths[:-1]))


def _against(steps: FloatArray, headings: FloatArray) -> FloatArray:
    """(n - 1,) whether each step leads backward, given the headings (n,) of its ends."""
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
    """A controller of a class (see stack.components) for a robot, leg by leg where that counts.

    To an omnidirectional robot a heading says nothing of the direction to drive in.
    """
    if robot.drive is DriveKind.OMNI:
        return component(parameters, robot, period)
    return CuspSplitter(component, parameters, robot, period)


class CuspSplitter:
    """Drives the legs of a path in turn with a controller, and stands where they meet."""

    def __init__(
        self, component: Any, parameters: Any, robot: RobotDescription, period: float
    ) -> None:
        self._component, self._robot, self._period = component, robot, period
        self._forward: Controller = component(parameters, robot, period)
        self._backward: Controller | None = None
        self._legs: tuple[PathSegment, ...] = ()
        self._index, self._last = 0, STANDSTILL
        self._track: PathProgress | None = None
        self._ramp = Ramp(robot.limits, period, 0.0, robot.turning_radius)

    @property
    def parameters(self) -> Any:
        """Of the controller, in force."""
        return self._forward.parameters

    def configure(self, parameters: Any) -> None:
        """Put other parameters in force."""
        for driver in filter(None, (self._forward, self._backward)):
            configure = getattr(driver, "configure", None)
            if configure is None:
                driver.parameters = parameters
            else:
                configure(parameters)

    def set_path(self, path: Path) -> None:
        """A new path to follow, map frame."""
        self._legs = legs_of(path)
        self._begin(0)

    def command(self, state: ControlState) -> Twist:
        """The velocity to drive now.

        Raises:
            NavigationError: COLLISION_AHEAD when nothing safe can be commanded; NO_VALID_PATH for
                a leg backward when the robot does not reverse.
        """
        if self._track is None:
            return STANDSTILL
        self._track.advance(state.pose)
        last_leg = self._index == len(self._legs) - 1
        if not last_leg and self._track.remaining <= LEG_END:
            if abs(state.twist.linear) < STANDING and self._last == STANDSTILL:
                self._begin(self._index + 1)
            else:
                last = self._ramp.rebased(self._last, state.twist)  # not one of an earlier drive
                self._last = self._ramp.stopped(last)
                return self._last
        self._last = self._driven(state)
        return self._last

    @property
    def local_plan(self) -> Path | None:
        """What it means to drive next, map frame."""
        if self._track is None:
            return None
        plan = self._driver.local_plan
        return plan if plan is None or not self._leg.backward else Path(_turned(plan.points))

    def _driven(self, state: ControlState) -> Twist:
        if not self._leg.backward:
            return self._driver.command(state)
        pose, twist = state.pose, state.twist
        about = replace(
            state,
            pose=Pose2D(pose.x, pose.y, wrap_angle(pose.heading + pi)),
            twist=Twist(-twist.linear, twist.angular, -twist.lateral),
            points=None if state.points is None else -state.points,
        )
        twist = self._driver.command(about)
        return Twist(-twist.linear, twist.angular, -twist.lateral)

    @property
    def _leg(self) -> PathSegment:
        return self._legs[self._index]

    @property
    def _driver(self) -> Controller:
        """The controller that drives the leg."""
        if not self._leg.backward:
            return self._forward
        if self._backward is None:
            self._backward = self._component(
                self.parameters, turned_about(self._robot), self._period
            )
        return self._backward

    def _begin(self, index: int) -> None:
        """Go on with a leg."""
        self._index = index
        leg = self._leg
        if leg.backward and not self._robot.limits.reverse_speed:
            raise NavigationError(
                FailureCode.NO_VALID_PATH,
                "the path has a leg backward, but the robot's reverse_speed is 0 m/s",
            )
        self._track = PathProgress(leg.path)
        self._driver.set_path(Path(_turned(leg.path.points)) if leg.backward else leg.path)


def turned_about(robot: RobotDescription) -> RobotDescription:
    """The robot with a base frame that faces backward."""
    limits = replace(
        robot.limits, linear_speed=robot.limits.reverse_speed,
        reverse_speed=min(robot.limits.linear_speed, robot.limits.reverse_speed),
    )  # fmt: skip
    return replace(robot, footprint=Footprint(-robot.footprint.points), limits=limits)


def _turned(points: FloatArray) -> FloatArray:
    """Poses (n, 3) with their headings turned by half a circle."""
    turned: FloatArray = points + np.array([0.0, 0.0, pi])
    return turned

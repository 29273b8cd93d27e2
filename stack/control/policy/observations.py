"""Observations and actions of policies: names, units, ranges, and how they are computed.

The environment of `treepilot.gym` and the controller `onnx_policy` both use this table, so that a
policy gets in a mission exactly what it got in training.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import cos, hypot, pi, sin

import numpy as np
from numpy.typing import NDArray

from stack.components import ControlState
from stack.control.policy.parameters import (
    COMMAND,
    GOAL,
    IMAGE,
    NORMALISED,
    PATH,
    POSE,
    RANGES,
    REMAINING,
    VELOCITY,
    PolicyParameters,
)
from stack.drivetrain.description import RobotDescription
from stack.errors import InputError
from stack.geometry.path_segment import PathSegment
from stack.types import FloatArray, Image, Pose2D, Twist

Values = NDArray[np.float32] | NDArray[np.uint8]
Vector = NDArray[np.float32]

FASTER = 1.5
"""A measured velocity can exceed the limit of the commanded one by this factor."""


@dataclass(frozen=True, slots=True)
class View:
    """What there is to observe in a step.

    Attributes:
        state: of the robot.
        segment: of the path that is driven, map frame, up to date with the pose.
        command: last velocity that was commanded, base frame.
    """

    state: ControlState
    segment: PathSegment
    command: Twist


@dataclass(frozen=True)
class Field:
    """One observation.

    Attributes:
        name: in lists of observations, and of the network's input.
        unit: of its numbers; empty if they have several or none.
        help: what the numbers are, in order.
        low: least values; their shape is that of the observation.
        high: largest values.
        measure: computes the values; they are clipped to the range.
    """

    name: str
    unit: str
    help: str
    low: Values
    high: Values
    measure: Callable[[View], FloatArray | Values]

    def observe(self, view: View) -> Values:
        """Return the observation in a step."""
        values = self.measure(view)
        if self.low.dtype == np.uint8:
            return values.astype(np.uint8)
        return np.clip(values, self.low, self.high).astype(np.float32)


class Observations:
    """The observations of a policy on a robot.

    Args:
        parameters: names and sizes.
        robot: with its limits and camera.

    Raises:
        InputError: the robot has no camera for `image`.

    Attributes:
        fields: in the order of the parameters.
    """

    def __init__(self, parameters: PolicyParameters, robot: RobotDescription) -> None:
        makers = {
            RANGES: _ranges, GOAL: _goal, POSE: _pose, PATH: _path, REMAINING: _remaining,
            VELOCITY: _velocity, COMMAND: _command, IMAGE: _image,
        }  # fmt: skip
        self.fields = tuple(makers[name](parameters, robot) for name in parameters.observations)

    def observe(self, view: View) -> dict[str, Values]:
        """Return the observations in a step, by name."""
        return {field.name: field.observe(view) for field in self.fields}

    def check_flat(self) -> None:
        """Refuse a flat vector with a picture in it.

        Raises:
            InputError: `image` is among the observations.
        """
        if any(field.name == IMAGE for field in self.fields):
            raise InputError("an observation with an `image` is not flat; leave `flat` out")


def flat(observed: Mapping[str, Values]) -> Vector:
    """Return the numbers of observations, which have no picture, one after another."""
    return np.concatenate([values.ravel() for values in observed.values()]).astype(np.float32)


def velocity_parts(robot: RobotDescription) -> tuple[str, ...]:
    """Return the parts of a velocity that the robot has, in their order."""
    sideways = ("lateral",) if robot.drivetrain.can_move_sideways else ()
    return ("linear", *sideways, "angular")


class Actions:
    """The actions of a policy on a robot: (2,) or, if it moves sideways, (3,) numbers.

    Attributes:
        low: least values: of the velocity forward, to the left (m/s) and of turning (rad/s), or -1.
        high: largest values.
    """

    def __init__(self, parameters: PolicyParameters, robot: RobotDescription) -> None:
        self._parts, self._limits = velocity_parts(robot), robot.limits
        self._least, self._most = _velocity_range(robot)
        self._is_normalised = parameters.actions == NORMALISED
        ones = np.ones(len(self._parts), np.float32)
        self.low = -ones if self._is_normalised else self._least
        self.high = ones if self._is_normalised else self._most

    def twist(self, action: Vector) -> Twist:
        """Return the velocity of an action, within the robot's limits; NaN stays NaN."""
        values = np.asarray(action, np.float64).ravel()
        if self._is_normalised:
            values = np.where(values < 0.0, -values * self._least, values * self._most)
        return self._limits.clipped(Twist(**dict(zip(self._parts, values.tolist(), strict=True))))


def _velocity_range(robot: RobotDescription) -> tuple[Vector, Vector]:
    limits = robot.limits
    least = {"linear": -limits.reverse_speed, "lateral": -limits.lateral_speed}
    most = {"linear": limits.linear_speed, "lateral": limits.lateral_speed}
    parts, turning = velocity_parts(robot), limits.angular_speed
    return (
        np.array([least.get(part, -turning) for part in parts], np.float32),
        np.array([most.get(part, turning) for part in parts], np.float32),
    )


def _components(twist: Twist, parts: tuple[str, ...]) -> FloatArray:
    named = {"linear": twist.linear, "lateral": twist.lateral, "angular": twist.angular}
    return np.array([named[part] for part in parts])


def _relative(goal: Pose2D, base: Pose2D, reach: float) -> FloatArray:
    """Position of a pose in the frame of another, at most `reach` away, and cosine and sine."""
    pose = goal.relative_to(base)
    scale = min(1.0, reach / max(hypot(pose.x, pose.y), 1e-9))
    return np.array([scale * pose.x, scale * pose.y, cos(pose.heading), sin(pose.heading)])


def _ranges(p: PolicyParameters, robot: RobotDescription) -> Field:
    def measure(view: View) -> FloatArray:
        nearest = np.full(p.sectors, p.sight)
        points = view.state.points
        if points is None or not len(points):
            return nearest
        turns = (np.arctan2(points[:, 1], points[:, 0]) + pi) / (2.0 * pi)
        sectors = np.minimum((turns * p.sectors).astype(np.int64), p.sectors - 1)
        np.minimum.at(nearest, sectors, np.hypot(points[:, 0], points[:, 1]))
        return nearest

    return Field(
        RANGES, "m", "distance from the base to the nearest obstacle in each sector of all range "
        "sensors, anticlockwise from behind the robot; `sight` where there is none",
        np.zeros(p.sectors, np.float32), np.full(p.sectors, p.sight, np.float32), measure,
    )  # fmt: skip


def _placed(name: str, help: str, reach: float, measure: Callable[[View], FloatArray]) -> Field:
    most = np.array([reach, reach, 1.0, 1.0], np.float32)
    return Field(name, "m", help, -most, most, measure)


def _goal(p: PolicyParameters, robot: RobotDescription) -> Field:
    return _placed(
        GOAL, "goal in the robot's frame: x, y (m), cosine and sine of its heading", p.reach,
        lambda view: _relative(view.segment.arrival, view.state.pose, p.reach),
    )  # fmt: skip


def _pose(p: PolicyParameters, robot: RobotDescription) -> Field:
    return _placed(
        POSE, "robot in the goal's frame: x, y (m), cosine and sine of its heading", p.reach,
        lambda view: _relative(view.state.pose, view.segment.arrival, p.reach),
    )  # fmt: skip


def _path(p: PolicyParameters, robot: RobotDescription) -> Field:
    def measure(view: View) -> FloatArray:
        left = view.segment.remaining
        ahead = [
            view.segment.pose_ahead(min(left, number * p.path_spacing))
            for number in range(1, p.path_points + 1)
        ]
        points = np.array([[pose.x, pose.y] for pose in ahead])
        return view.state.pose.inverse().transform(points)

    most = np.full((p.path_points, 2), p.reach, np.float32)
    return Field(
        PATH, "m", "x and y of points on the path ahead, `path_spacing` apart, in the robot's "
        "frame; beyond its end the end", -most, most, measure,
    )  # fmt: skip


def _remaining(p: PolicyParameters, robot: RobotDescription) -> Field:
    return Field(
        REMAINING, "m", "length of the path that is left", np.zeros(1, np.float32),
        np.full(1, p.reach, np.float32), lambda view: np.array([view.segment.remaining]),
    )  # fmt: skip


def _velocity(p: PolicyParameters, robot: RobotDescription) -> Field:
    (least, most), parts = _velocity_range(robot), velocity_parts(robot)
    fastest = np.float32(FASTER) * np.maximum(-least, most)
    return Field(
        VELOCITY, "m/s, rad/s", "measured velocity: forward, to the left if the robot moves "
        "sideways, turning", -fastest, fastest,
        lambda view: _components(view.state.twist, parts),
    )  # fmt: skip


def _command(p: PolicyParameters, robot: RobotDescription) -> Field:
    (least, most), parts = _velocity_range(robot), velocity_parts(robot)
    return Field(
        COMMAND, "m/s, rad/s", "last velocity that the policy decided, as `velocity`", least, most,
        lambda view: _components(view.command, parts),
    )  # fmt: skip


def _image(p: PolicyParameters, robot: RobotDescription) -> Field:
    if robot.camera is None:
        raise InputError(f"the robot {robot.name!r} has no camera for the observation `{IMAGE}`")
    camera = robot.camera.model
    columns = p.image_width or camera.width
    rows = max(1, round(columns * camera.height / camera.width))

    def measure(view: View) -> Values:
        image: Image | None = view.state.image
        if image is None:
            return np.zeros((rows, columns, 3), np.uint8)
        if image.pixels.shape[:2] == (rows, columns):
            return image.pixels
        import cv2

        return np.asarray(
            cv2.resize(image.pixels, (columns, rows), interpolation=cv2.INTER_AREA), np.uint8
        )

    low = np.zeros((rows, columns, 3), np.uint8)
    return Field(
        IMAGE, "", "newest picture of the camera: rows, columns, RGB; black before the first one",
        low, np.full_like(low, 255), measure,
    )  # fmt: skip

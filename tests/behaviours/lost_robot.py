"""The kinematic robot with a camera, markers, and a pose estimate that may be wrong."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import atan2, hypot, pi, radians

import numpy as np
from kinematic_robot import PERIOD, KinematicRobot, cast_rays

from behaviours._sensing.marker_pose import rotated
from behaviours.testing import ScriptedTask
from stack.types import (
    STANDSTILL,
    CameraModel,
    Image,
    Marker,
    MarkerSighting,
    Pose2D,
    PoseCandidate,
    Twist,
    wrap_angle,
)

CAMERA = CameraModel(320, 240, 160.0, (0.15, 0.0, 0.25))  # 90 degrees wide
CAMERA_STEPS, LATENCY_STEPS = 4, 2  # 5 Hz, 0.1 s
TURNING_SPEED = 1.0
PIXELS = np.zeros((240, 320, 3), dtype=np.uint8)


@dataclass
class LostRobot(KinematicRobot):
    """A robot with a wrong pose estimate; `pose` is the truth, `belief` the estimate.

    Attributes:
        belief: map frame; moves with the odometry.
        camera_works: whether there are pictures.
        global_answer: results of the lidar search: a pose, `truth`, or None for `refusal`.
        refusal: code and sentence of a lidar search without result.
        true_error: rotation of the correct candidate about the marker, radians.
        exposed: steps of the last pictures, with pose and angular speed at the exposure.
        blurred: number of sightings requested in pictures taken while turning.
        wrong_first: the wrong candidate has the smaller reprojection error.
    """

    belief: Pose2D = Pose2D(0.0, 0.0)
    camera_works: bool = True
    global_answer: list[Pose2D | str | None] = field(default_factory=list)
    refusal: tuple[str, str] = ("AMBIGUOUS", "two places fit alike")
    true_error: float = radians(8.0)
    wrong_first: bool = True
    exposed: list[tuple[int, Pose2D, float]] = field(default_factory=list)
    blurred: int = 0
    turn_left: float = 0.0
    asked_at: float = -10.0

    def __post_init__(self) -> None:
        super().__post_init__()
        self.health = self.fit_at(self.belief)

    def spin(
        self, angle: float, *, speed: float | None = None, while_lost: bool = False
    ) -> ScriptedTask:
        self.turn_left = angle
        return super().spin(angle, speed=speed, while_lost=while_lost)

    def relocalise(self) -> ScriptedTask:
        task = super().relocalise()
        answer = self.global_answer.pop(0) if self.global_answer else None
        if answer is None:
            task.fail(*self.refusal)
        else:
            self.belief = self.pose if answer == "truth" else answer
            task.succeed()
        return task

    def set_pose(self, pose: Pose2D, **deviations: object) -> None:
        super().set_pose(pose, **deviations)
        truth, self.belief = self.way[-1] if self.way else self.pose, pose
        self.pose = truth  # a new estimate does not move the robot

    def fit_at(self, pose: Pose2D) -> float:
        """Share of every sixth beam that ends within 12 cm of where the map says."""
        ranges = self.scan.ranges[::6].astype(float)
        expected = cast_rays(self.segments, pose, self.scan.angles[::6])
        return float(np.mean(np.abs(ranges - expected) < 0.12))

    def image(self) -> Image | None:
        self.asked_at = self.time
        ready = [step for step, *_ in self.exposed if step <= self.steps - LATENCY_STEPS]
        return Image(ready[-1] * PERIOD, PIXELS, CAMERA) if ready else None

    def marker_sightings(self) -> tuple[MarkerSighting, ...]:
        ready = [one for one in self.exposed if one[0] <= self.steps - LATENCY_STEPS]
        if not ready:
            return ()
        step, pose, turning = ready[-1]
        self.blurred += abs(turning) > 0.05
        seen = [self._sighting(marker, pose, step * PERIOD) for marker in self.markers]
        return tuple(one for one in seen if one is not None)

    def _sighting(self, marker: Marker, pose: Pose2D, stamp: float) -> MarkerSighting | None:
        """Both candidates of a marker within 4 m, 40 degrees of ahead, seen from in front."""
        dx, dy = marker.position[0] - pose.x, marker.position[1] - pose.y
        bearing = wrap_angle(atan2(dy, dx) - pose.heading)
        view = wrap_angle(atan2(-dy, -dx) - marker.heading)
        if hypot(dx, dy) > 4.0 or abs(bearing) > radians(40.0) or abs(view) > radians(70.0):
            return None
        right = PoseCandidate(rotated(pose, marker.position[:2], self.true_error, 1.03), 0.4)
        mirrored = rotated(pose, marker.position[:2], -2.0 * view - self.true_error, 1.0)
        wrong = PoseCandidate(mirrored, 0.3 if self.wrong_first else 0.9)
        ordered = sorted((right, wrong), key=lambda one: one.error)
        return MarkerSighting(stamp, marker, hypot(dx, dy), tuple(ordered))

    def _step(self) -> None:
        before = self.odometry
        if self.motion.status.name == "RUNNING" and self.calls_of("spin"):
            self._turn()
        super()._step()
        self.belief = self.belief.compose(self.odometry.relative_to(before))
        if self.steps % 2 == 0:
            self.health = self.fit_at(self.belief)
        if self.camera_works and self.time - self.asked_at < 1.0 and self.steps % CAMERA_STEPS == 0:
            self.exposed = [*self.exposed[-3:], (self.steps, self.pose, self.speed.angular)]

    def _turn(self) -> None:
        """Turn on: fast while much is left, and slowly at the end."""
        self.turn_left -= self.speed.angular * PERIOD
        if abs(self.turn_left) < radians(1.0) and abs(self.speed.angular) < 0.2:
            self.twist = STANDSTILL
            self.motion.succeed()
        else:
            speed = min(max(5.0 * self.turn_left, -TURNING_SPEED), TURNING_SPEED)
            self.twist = Twist(0.0, speed)
        self.alive_until = self.time + 0.1


def marker_on_wall(number: int, x: float, y: float, facing: float) -> Marker:
    return Marker(number, 0.2, (x, y, 0.3), wrap_angle(facing % (2.0 * pi)))

"""The dynamic window approach: pairs of speeds that can be reached, driven ahead and judged.

D. Fox, W. Burgard, S. Thrun, "The dynamic window approach to collision avoidance", IEEE Robotics
and Automation Magazine 4, 1997. As in Nav2's DWB the window is what can be reached within the
simulated time, and the speeds change towards each sample as fast as the drive allows. What Nav2's
RotateToGoal critic does, the last turn on the spot, `PathEnds` does for all controllers.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, copysign

import numpy as np

from stack.components import ControlState
from stack.control.dwb.critics import Sampling, judge
from stack.control.dwb.parameters import DwbParameters
from stack.control.ends import PathEnds
from stack.control.ramps import stopping_speed
from stack.control.swept import BoolArray, SweptFootprint
from stack.control.track import Track
from stack.description import Limits, RobotDescription
from stack.types import STANDSTILL, FloatArray, Path, Pose2D, Twist, wrap_angle

SPACING = 0.05
"""Metres between the path points that the critics look at."""

CREEP = 0.08
"""m/s that are allowed however near the goal is."""

SHORTER = (1.0, 0.5, 0.25)
"""Shares of speed and simulated time tried in turn while nothing is clear."""

LEAST_STEPS = 5
"""Steps simulated at least."""

LEAST_SPEED = 0.01
"""m/s and rad/s below which a command has no direction."""


@dataclass
class _Direction:
    """A direction that was taken, and where: it is kept until the robot has moved on."""

    forward: float = 0.0
    turn: float = 0.0
    pose: Pose2D | None = None


class Dwb:
    """Follows a path by trying the speeds within the dynamic window (DWA)."""

    Parameters = DwbParameters

    def __init__(self, parameters: DwbParameters, robot: RobotDescription, period: float) -> None:
        self._robot, self._period = robot, period
        self._swept = SweptFootprint(robot.footprint)
        self._path: Path | None = None
        self._local_plan: FloatArray | None = None
        self._direction = _Direction()
        self.configure(parameters)

    def configure(self, parameters: DwbParameters) -> None:
        """Put other parameters in force."""
        self.parameters = parameters
        self._ends = PathEnds(parameters, self._robot, self._swept, self._period)
        if self._path is not None:
            self._ends.set_path(self._path)

    def set_path(self, path: Path) -> None:
        """A new path to follow, map frame."""
        self._path = path
        self._ends.set_path(path)

    def command(self, state: ControlState) -> Twist:
        """The velocity to drive now.

        Raises:
            NavigationError: COLLISION_AHEAD when nothing safe could be commanded for `patience`.
        """
        ends = self._ends
        track = ends.begin(state)
        if track is None:
            return STANDSTILL
        if ends.reached(state):
            self._local_plan, chosen = None, ends.finish(state)
        else:
            chosen = ends.turned(state) or self._sampled(track, state)
        return ends.end(state, chosen)

    @property
    def local_plan(self) -> Path | None:
        """Where the speeds chosen lead, map frame."""
        return None if self._local_plan is None else Path(self._local_plan)

    def _sampled(self, track: Track, state: ControlState) -> Twist | None:
        """The best speeds; slower and less far ahead, then a turn to the path, if none will do."""
        turn = self._ends.realigned(state) if self._ends.held else None
        if turn is not None:
            return turn
        for share in SHORTER:
            twist = self._best(track, state, share)
            if twist is not None:
                self._note_direction(state.pose, twist)
                return twist
        self._local_plan, self._direction = None, _Direction()
        return self._ends.realigned(state)

    def _best(self, track: Track, state: ControlState, share: float) -> Twist | None:
        """The best of the speeds that collide with nothing; None when all do, or it is to stand."""
        last = self._ends.last
        p, top = self._before_goal(track, state, share)
        linear, angular = window(p, self._robot.limits, last, top)
        keep = self._not_oscillating(state.pose, linear, angular)
        linear, angular = linear[keep], angular[keep]
        poses = drive(p, self._robot.limits, state.pose, last, (linear, angular))
        reach = top * p.simulation_time + p.forward_point
        sampling = Sampling(
            linear, angular, poses, track.sampled(reach, SPACING),
            track.sampled(reach, SPACING, beyond=True), SPACING, state.costs,
            near_goal=track.remaining <= p.forward_point,
        )  # fmt: skip
        scores = judge(sampling, p)
        scores[self._swept.clear_poses(state.costs, state.pose, poses) < poses.shape[1]] = np.inf
        best = int(np.argmin(scores))
        stands = abs(linear[best]) < LEAST_SPEED and abs(angular[best]) < LEAST_SPEED
        if not np.isfinite(scores[best]) or stands:
            return None
        self._local_plan = poses[best]
        return self._ends.ramped(Twist(float(linear[best]), float(angular[best])))

    def _before_goal(
        self, track: Track, state: ControlState, share: float
    ) -> tuple[DwbParameters, float]:
        """The parameters with a simulated time that ends about at the goal, and the top speed.

        A robot whose speeds are all driven far beyond the goal would creep towards it.
        """
        p, limits = self.parameters, self._robot.limits
        way = max(track.remaining, state.pose.distance_to(track.path.goal))
        brake = p.brake_share * limits.linear_deceleration
        cruise = share * min(p.cruise_speed, limits.linear_speed)
        top = min(cruise, max(stopping_speed(way, brake, p.response_time + self._period), CREEP))
        steps = ceil(1.5 * way / (top * p.simulation_step))
        time = min(share * p.simulation_time, max(LEAST_STEPS, steps) * p.simulation_step)
        return replace(p, simulation_time=time), top

    def _not_oscillating(self, pose: Pose2D, linear: FloatArray, angular: FloatArray) -> BoolArray:
        """Which samples do not reverse a direction that was taken a moment ago (Oscillation)."""
        taken, p = self._direction, self.parameters
        keep = np.ones(len(linear), dtype=bool)
        if taken.pose is None:
            return keep
        moved = pose.distance_to(taken.pose) >= p.oscillation_distance
        turned = abs(wrap_angle(pose.heading - taken.pose.heading)) >= p.oscillation_angle
        if moved or turned:
            self._direction = _Direction()
            return keep
        keep &= linear * taken.forward >= 0.0
        if not taken.forward:
            keep &= angular * taken.turn >= 0.0
        return keep

    def _note_direction(self, pose: Pose2D, twist: Twist) -> None:
        """Remember a direction of travel; of turning only while the robot hardly drives."""
        if self._direction.pose is not None:
            return
        forward = copysign(1.0, twist.linear) if abs(twist.linear) > LEAST_SPEED else 0.0
        turn = copysign(1.0, twist.angular) if abs(twist.angular) > LEAST_SPEED else 0.0
        if forward or turn:
            self._direction = _Direction(forward, turn, pose)


def window(
    p: DwbParameters, limits: Limits, last: Twist, top: float
) -> tuple[FloatArray, FloatArray]:
    """Speeds forward and turning, both (n,), that can be reached within the simulated time.

    Args:
        p: samples, speeds and the simulated time.
        limits: of the robot.
        last: driven now.
        top: m/s forward at most.
    """
    time = p.simulation_time
    back = min(p.reverse_speed, limits.reverse_speed)
    low = max(-back, last.linear - limits.linear_deceleration * time)
    high = min(top, last.linear + limits.linear_acceleration * time)
    fastest = min(p.turn_speed, limits.angular_speed)
    swing = limits.angular_acceleration * time
    right, left = max(-fastest, last.angular - swing), min(fastest, last.angular + swing)
    linear = np.union1d(np.linspace(low, max(low, high), p.linear_samples), [0.0])
    angular = np.union1d(np.linspace(right, max(right, left), p.angular_samples), [0.0])
    pairs = np.meshgrid(linear, angular, indexing="ij")
    return pairs[0].ravel(), pairs[1].ravel()


def drive(
    p: DwbParameters, limits: Limits, pose: Pose2D, last: Twist,
    wanted: tuple[FloatArray, FloatArray],
) -> FloatArray:  # fmt: skip
    """Where pairs of speeds lead, from the speeds driven now.

    Args:
        p: time and step of the simulation.
        limits: of the robot.
        pose: now, map frame.
        last: driven now.
        wanted: speeds forward and turning, both (n,).

    Returns:
        (n, k, 3) poses in the map frame.
    """
    step = p.simulation_step
    times: FloatArray = step * np.arange(1.0, round(p.simulation_time / step) + 1.0)
    linear = _approach(
        last.linear, wanted[0], times, (limits.linear_acceleration, limits.linear_deceleration)
    )
    turn = limits.angular_acceleration
    angular = _approach(last.angular, wanted[1], times, (turn, turn))
    heading = pose.heading + np.cumsum(angular, axis=1) * step
    middle = heading - 0.5 * step * angular
    x = pose.x + np.cumsum(linear * np.cos(middle), axis=1) * step
    y = pose.y + np.cumsum(linear * np.sin(middle), axis=1) * step
    return np.stack([x, y, heading], axis=-1)


def _approach(
    now: float, wanted: FloatArray, times: FloatArray, rates: tuple[float, float]
) -> FloatArray:
    """(n, k) speeds on the way to the wanted ones (n,), rising and falling at the given rates."""
    rises = np.abs(wanted) > abs(now)
    most = np.where(rises, rates[0], rates[1])[:, None] * times
    return now + np.clip(wanted[:, None] - now, -most, most)

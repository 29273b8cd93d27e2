"""Dynamic window controller: samples reachable velocities, simulates them and scores them.

D. Fox, W. Burgard, S. Thrun, "The dynamic window approach to collision avoidance", IEEE Robotics
and Automation Magazine 4, 1997. As in Nav2's DWB the window contains the speeds that are reachable
within the simulated time, and the speeds change towards each sample as fast as the drive allows.
`GoalAlignment` does the final turn in place, for which Nav2 has the RotateToGoal critic.
"""

from __future__ import annotations

from dataclasses import astuple, dataclass, replace
from math import ceil, copysign

import numpy as np

from stack.components import ControlState
from stack.control.dwb.critics import Sampling, Speeds, total_cost
from stack.control.dwb.parameters import DwbParameters
from stack.control.path_controller import PathController
from stack.control.ramps import stopping_speed
from stack.control.swept import BoolArray
from stack.control.turning import BRAKE_SHARE
from stack.drivetrain.description import RobotDescription
from stack.drivetrain.limits import limit_speeds
from stack.geometry.path_segment import PathSegment
from stack.types import FloatArray, Pose2D, Twist, wrap_angle

LATERAL_SAMPLES = 5
"""Omnidirectional robots only: number of lateral speeds."""

PATH_SPACING = 0.05
"""Metres between the path points that the critics use."""

CREEP_SPEED = 0.08
"""Speed in m/s that is always allowed near the goal."""

EASIER_SAMPLES = (1.0, 0.5, 0.25)
"""Factors on speed and simulated time, tried in turn while no sample is clear."""

CAR_ALIGNMENT = 4.0
"""Factor on the path alignment weight of a car, which cannot align by turning in place."""

LEAST_STEPS = 5
"""Minimum number of simulated steps."""

LEAST_SPEED = 0.01
"""Speed in m/s and rad/s below which a command has no direction."""


@dataclass
class _Direction:
    """A driving direction and the pose at which it was chosen; kept until the robot has moved."""

    forward: float = 0.0
    turn: float = 0.0
    pose: Pose2D | None = None


class Dwb(PathController[DwbParameters]):
    """Dynamic window controller (DWB): samples the speeds within the dynamic window."""

    Parameters = DwbParameters

    def __init__(self, parameters: DwbParameters, robot: RobotDescription, period: float) -> None:
        super().__init__(parameters, robot, period)
        self._direction = _Direction()

    def _follow(self, segment: PathSegment, state: ControlState) -> Twist | None:
        """The best speeds; if none is clear, slower ones over less time, then a turn in place."""
        turn = self._alignment.realigned(state) if self._alignment.held else None
        if turn is not None:
            return turn
        for share in EASIER_SAMPLES:
            twist = self._best(segment, state, share)
            if twist is not None:
                self._note_direction(state.pose, twist)
                return twist
        self._local_plan, self._direction = None, _Direction()
        return self._alignment.realigned(state)

    def _best(self, segment: PathSegment, state: ControlState, share: float) -> Twist | None:
        """The best collision-free sample; None when there is none or the best one is standstill."""
        last = self._alignment.last
        p, top = self._before_goal(state, share)
        speeds = window(p, self._robot, last, top)
        speeds = speeds.of(self._not_oscillating(state.pose, speeds))
        poses = drive(p, self._robot, state.pose, last, speeds)
        reach = top * p.simulation_time + p.forward_point
        sampling = Sampling(
            speeds, poses, segment.sampled(reach, PATH_SPACING),
            segment.sampled(reach, PATH_SPACING, beyond=True), PATH_SPACING, state.costs,
            near_goal=segment.remaining <= p.forward_point and not self._robot.turning_radius,
        )  # fmt: skip
        scores = total_cost(sampling, p)
        scores[self._swept.clear_poses(state.costs, state.pose, poses) < poses.shape[1]] = np.inf
        best = int(np.argmin(scores))
        twist = speeds.twist(best)
        if not np.isfinite(scores[best]) or max(map(abs, astuple(twist))) < LEAST_SPEED:
            return None
        self._local_plan = poses[best]
        return self._alignment.ramped(twist)

    def _before_goal(self, state: ControlState, share: float) -> tuple[DwbParameters, float]:
        """The parameters with a simulated time that ends near the goal, and the top speed (m/s).

        If all samples were simulated far beyond the goal, the robot would creep towards it.
        """
        p, limits = self.parameters, self._robot.limits
        left = self._alignment.distance_left(state)
        brake = BRAKE_SHARE * limits.linear_deceleration
        cruise = share * min(p.cruise_speed, limits.linear_speed)
        stopping = stopping_speed(left, brake, p.response_time + self._period)
        top = min(
            cruise, max(stopping, self._alignment.parameters.final_speed(CREEP_SPEED, self._period))
        )
        steps = ceil(1.5 * left / (top * p.simulation_step))
        time = min(share * p.simulation_time, max(LEAST_STEPS, steps) * p.simulation_step)
        align = p.path_align_weight * (CAR_ALIGNMENT if self._robot.turning_radius else 1.0)
        return replace(p, simulation_time=time, path_align_weight=align), top

    def _not_oscillating(self, pose: Pose2D, speeds: Speeds) -> BoolArray:
        """Which samples do not reverse a recently chosen direction (Nav2's Oscillation critic)."""
        taken, p = self._direction, self.parameters
        keep = np.ones(len(speeds.linear), dtype=bool)
        if taken.pose is None:
            return keep
        moved = pose.distance_to(taken.pose) >= p.oscillation_distance
        turned = abs(wrap_angle(pose.heading - taken.pose.heading)) >= p.oscillation_angle
        if moved or turned:
            self._direction = _Direction()
            return keep
        keep &= speeds.linear * taken.forward >= 0.0
        if not taken.forward:
            keep &= speeds.angular * taken.turn >= 0.0
        return keep

    def _note_direction(self, pose: Pose2D, twist: Twist) -> None:
        """Remember the driving direction; the turning direction counts only without driving."""
        if self._direction.pose is not None:
            return
        forward = copysign(1.0, twist.linear) if abs(twist.linear) > LEAST_SPEED else 0.0
        turn = copysign(1.0, twist.angular) if abs(twist.angular) > LEAST_SPEED else 0.0
        if forward or turn:
            self._direction = _Direction(forward, turn, pose)


def window(p: DwbParameters, robot: RobotDescription, last: Twist, top: float) -> Speeds:
    """Sample the speeds that are reachable within the simulated time.

    Lateral speeds are sampled for omnidirectional robots only. The turning speeds of a car are
    limited by its turning radius.

    Args:
        p: number of samples, speeds and the simulated time.
        robot: gives limits and drive.
        last: current velocity.
        top: top forward speed, m/s.
    """
    time, limits = p.simulation_time, robot.limits
    back = min(p.reverse_speed, limits.reverse_speed)
    rise, fall = limits.linear_acceleration * time, limits.linear_deceleration * time
    fastest = min(p.turn_speed, limits.angular_speed)
    swing = limits.angular_acceleration * time
    linear = _samples(p.linear_samples, (-back, top), (last.linear - fall, last.linear + rise))
    angular = _samples(
        p.angular_samples, (-fastest, fastest), (last.angular - swing, last.angular + swing)
    )
    sideways = np.zeros(1)
    if robot.drivetrain.can_move_sideways:
        most = min(limits.lateral_speed, top)
        reach = (last.lateral - rise, last.lateral + rise)
        sideways = _samples(LATERAL_SAMPLES, (-most, most), reach)
    axes = (axis.ravel() for axis in np.meshgrid(linear, angular, sideways, indexing="ij"))
    speeds = Speeds(*axes)
    if robot.turning_radius:
        most_turn = np.abs(speeds.linear) / robot.turning_radius
        turning = np.clip(speeds.angular, -most_turn, most_turn)
        speeds = replace(speeds, angular=turning)
    return speeds


def _samples(count: int, limits: tuple[float, float], reach: tuple[float, float]) -> FloatArray:
    """Return evenly spaced speeds within limits and reach, and 0."""
    low, high = max(limits[0], reach[0]), min(limits[1], reach[1])
    return np.union1d(np.linspace(low, max(low, high), count), [0.0])


def drive(
    p: DwbParameters, robot: RobotDescription, pose: Pose2D, last: Twist, wanted: Speeds
) -> FloatArray:
    """Simulate the motion towards wanted speeds.

    Args:
        p: time and step of the simulation.
        robot: gives limits and drive.
        pose: current pose, map frame.
        last: current velocity.
        wanted: final speeds of the n samples.

    Returns:
        (n, k, 3) poses in the map frame.
    """
    step, limits = p.simulation_step, robot.limits
    times: FloatArray = step * np.arange(1.0, round(p.simulation_time / step) + 1.0)
    rates = (limits.linear_acceleration, limits.linear_deceleration)
    linear = limit_speeds(last.linear, wanted.linear, times, *rates)
    turn = limits.angular_acceleration
    angular = limit_speeds(last.angular, wanted.angular, times, turn, turn)
    if robot.turning_radius:
        most = np.abs(linear) / robot.turning_radius
        angular = np.clip(angular, -most, most)
    heading = pose.heading + np.cumsum(angular, axis=1) * step
    middle = heading - 0.5 * step * angular
    c, s = np.cos(middle), np.sin(middle)
    ahead, left = linear * c, linear * s
    if robot.drivetrain.can_move_sideways:
        lateral = limit_speeds(last.lateral, wanted.lateral, times, *rates)
        ahead, left = ahead - lateral * s, left + lateral * c
    x, y = pose.x + np.cumsum(ahead, axis=1) * step, pose.y + np.cumsum(left, axis=1) * step
    return np.stack([x, y, heading], axis=-1)

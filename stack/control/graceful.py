"""Graceful controller: a smooth control law that steers into poses on the path.

J. J. Park, B. Kuipers, "A smooth control law for graceful motion of differential wheeled mobile
robots in 2D environment", ICRA 2011. In polar coordinates around the target, with distance r,
heading of the robot delta and of the target phi, both relative to the line of sight, the curvature

    kappa = -1/r (k_delta (delta - atan(-k_phi phi)) + (1 + k_phi / (1 + (k_phi phi)²)) sin delta)

drives the robot into the target pose, and v = v_max / (1 + beta |kappa|^lambda) slows it in bends.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan, atan2, cos, hypot, sin

import numpy as np

from stack.components import ControlState
from stack.control.goal_alignment import GoalAlignmentParameters
from stack.control.path_controller import PathController
from stack.control.ramps import stopping_speed
from stack.control.turning import BRAKE_SHARE
from stack.geometry.path_segment import PathSegment
from stack.parameters import parameter
from stack.types import FloatArray, Pose2D, Twist, wrap_angle

TARGET_SPACING = 0.05
"""Metres between the path points tried as targets."""

TARGETS_TRIED = 6
"""Number of targets tried between the farthest and the nearest."""

SIMULATION_STEP = 0.1
"""Seconds between the poses of the simulated motion."""

MOST_STEPS = 80
"""Maximum number of simulated steps to a target."""

TARGET_REACHED = 0.05
"""Distance in metres to the target at which the simulated motion ends."""


@dataclass(frozen=True)
class GracefulParameters(GoalAlignmentParameters):
    """Parameters of `Graceful`."""

    min_speed: float = parameter(0.1, "m/s", above=0.0, help="minimum speed in bends")
    min_lookahead: float = parameter(
        0.15, "m", above=0.0, not_above="max_lookahead", public=True,
        help="nearest target on the path",
    )  # fmt: skip
    max_lookahead: float = parameter(
        0.8, "m", above=0.0, public=True, help="farthest target on the path"
    )
    k_phi: float = parameter(
        2.0, above=0.0, help="ratio of the rates at which heading and distance converge"
    )
    k_delta: float = parameter(2.0, above=0.0, help="gain on the robot's heading error")
    beta: float = parameter(0.4, at_least=0.0, help="how strongly curvature reduces the speed")
    slowing_power: float = parameter(
        2.0, above=0.0, help="lambda: how sharply the speed falls with curvature"
    )
    cost_slowdown: float = parameter(
        0.5, at_least=0.0, at_most=1.0, help="share of speed lost at the highest passable cost"
    )
    time_to_collision: float = parameter(
        1.0, "s", above=0.0, help="slows down when a collision is nearer than this"
    )


class Graceful(PathController[GracefulParameters]):
    """Graceful controller: steers into poses on the path by a smooth control law."""

    Parameters = GracefulParameters

    def _follow(self, segment: PathSegment, state: ControlState) -> Twist | None:
        """Drive to the farthest target whose simulated motion is clear; None if there is none.

        A nearer target keeps closer to the path. When the motion to every target is blocked, the
        robot drives towards the nearest one as far as the motion is clear.
        """
        self._local_plan = None
        if self._alignment.held:
            return self._alignment.realigned(state)
        speed = self._top_speed(state)
        for target in self._targets(segment, state.pose):
            poses = self._simulate(state.pose, target, speed)
            clear = int(self._swept.clear_poses(state.costs, state.pose, poses[None])[0])
            if clear == len(poses):
                break
        else:
            share = clear * SIMULATION_STEP / self.parameters.time_to_collision
            speed = min(speed, speed * share)
            if clear == 0 or speed < 0.3 * self.parameters.min_speed:
                return self._alignment.realigned(state)
        self._local_plan = poses
        linear, angular = self.law(state.pose, target, speed)
        return self._alignment.ramped(Twist(linear, angular))

    def _top_speed(self, state: ControlState) -> float:
        """Cruise speed, reduced at high costs and near the goal, m/s."""
        p, limits = self.parameters, self._robot.limits
        cruise = min(p.cruise_speed, limits.linear_speed)
        costs, cell = state.costs, state.costs.cell_at(state.pose.x, state.pose.y)
        cost = int(costs.cells[cell]) if costs.contains(*cell) else 0
        if cost <= 254:
            cruise *= 1.0 - p.cost_slowdown * min(cost, 252) / 252.0
        exact = self._alignment.parameters
        distance = self._alignment.distance_left(state) - 0.5 * exact.stop_distance
        brake = BRAKE_SHARE * limits.linear_deceleration
        stopping = stopping_speed(distance, brake, p.response_time + self._period)
        return min(cruise, max(stopping, exact.final_speed(0.5 * p.min_speed, self._period)))

    def _targets(self, segment: PathSegment, pose: Pose2D) -> list[Pose2D]:
        """Poses on the path between the lookahead distances, farthest first, map frame."""
        p = self.parameters
        points = segment.sampled(p.max_lookahead, TARGET_SPACING)
        away = np.hypot(points[:, 0] - pose.x, points[:, 1] - pose.y)
        eligible = np.flatnonzero((away >= p.min_lookahead) & (away <= p.max_lookahead))
        if not len(eligible):
            eligible = np.array([len(points) - 1])
        picked = np.unique(np.linspace(0, len(eligible) - 1, TARGETS_TRIED).round().astype(int))
        return [_pose_on(points, int(eligible[index]), pose) for index in picked[::-1]]

    def _simulate(self, pose: Pose2D, target: Pose2D, speed: float) -> FloatArray:
        """Simulate the control law up to a target: (k, 3) poses, map frame."""
        poses = []
        for _ in range(MOST_STEPS):
            linear, angular = self.law(pose, target, speed)
            turn = angular * SIMULATION_STEP
            middle, step = pose.heading + 0.5 * turn, linear * SIMULATION_STEP
            pose = Pose2D(
                pose.x + step * cos(middle), pose.y + step * sin(middle), pose.heading + turn
            )
            poses.append((pose.x, pose.y, pose.heading))
            if pose.distance_to(target) <= max(TARGET_REACHED, step):
                break
        return np.array(poses)

    def law(self, pose: Pose2D, target: Pose2D, top: float) -> tuple[float, float]:
        """Compute forward speed (m/s) and turning speed (rad/s) by the control law.

        Args:
            pose: of the robot.
            target: in the same frame.
            top: speed on a straight line, m/s.
        """
        p = self.parameters
        distance = max(pose.distance_to(target), 1e-3)
        sight = pose.bearing_to(target)
        phi, delta = wrap_angle(target.heading - sight), wrap_angle(pose.heading - sight)
        bend = p.k_phi * phi
        kappa = (
            -(
                p.k_delta * (delta - atan(-bend))
                + (1.0 + p.k_phi / (1.0 + bend * bend)) * sin(delta)
            )
            / distance
        )
        if self._robot.turning_radius:
            tightest = 1.0 / self._robot.turning_radius
            kappa = min(max(kappa, -tightest), tightest)
        speed = top / (1.0 + p.beta * float(abs(kappa) ** p.slowing_power))
        speed = max(speed, min(p.min_speed, top))
        fastest = min(p.turn_speed, self._robot.limits.angular_speed)
        if abs(kappa) * speed > fastest:
            speed = fastest / abs(kappa)
        return speed, kappa * speed


def _pose_on(points: FloatArray, index: int, pose: Pose2D) -> Pose2D:
    """Return a point of a polyline (k, 2) with the direction of travel as heading."""
    x, y = points[index]
    before, after = points[max(0, index - 2)], points[min(len(points) - 1, index + 2)]
    dx, dy = after - before
    if hypot(dx, dy) < 1e-6:
        dx, dy = x - pose.x, y - pose.y
    return Pose2D(float(x), float(y), atan2(dy, dx))

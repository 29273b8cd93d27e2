"""MPPI optimiser: sample around the last plan, simulate, score, average."""

from __future__ import annotations

from math import cos, sin

import numpy as np
from numpy.typing import NDArray

from stack.control.mppi.critics.critics import CRITICS, CriticData, evaluate_obstacles
from stack.control.mppi.parameters import MppiParameters
from stack.control.mppi.scene import Array32, BodyArrays, LocalPath, Obstacles, Rollouts
from stack.drivetrain.description import RobotDescription
from stack.geometry.savitzky_golay import savitzky_golay_weights
from stack.streams import stream
from stack.types import FloatArray, Pose2D, Twist

NOISE_CORRELATION = 0.8
"""Correlation of the noise of neighbouring steps: rollouts of white noise only tremble."""

TABLE_LENGTH = 4
"""Number of columns of the table, in batches."""

CALM_SHARE, CALMEST = 0.4, 0.03
"""Share of the rollouts with reduced noise, and the smallest factor on it."""

FILTER_HALF_WINDOW = 4
"""Half window of the smoothing filter: the number of past commands that it uses."""

PURSUITS = tuple((speed, ahead) for speed in (1.0, 0.7, 0.4, 0.2) for ahead in (0.6, 0.3, 0.15))
"""Factors on the top speed, and lookahead distances in metres, of the added path pursuits."""

TURNS_IN_PLACE = (-2.6, -2.0, -1.4, -0.7, 0.0, 0.7, 1.4, 2.0, 2.6)
DODGES = (
    *((speed, turn) for speed in (1.0, 0.5) for turn in TURNS_IN_PLACE),
    *((-1.0, turn) for turn in (-1.4, -0.7, 0.0, 0.7, 1.4)),
)
"""Factors on the top speed forward or backward, and angles in radians, of the evasive motions added
near people."""

DODGE_SHARES = np.array([share for share, _ in DODGES], np.float32)


class Optimiser:
    """Holds a plan, a sequence of controls, and improves it in each control step.

    Williams, Drews, Goldfain, Rehg, Theodorou, "Information-theoretic model predictive control",
    ICRA 2017, and IEEE Transactions on Robotics 34, 2018.

    Attributes:
        plan: (axes, steps) float32: forward, turning and (omni only) lateral speeds.
    """

    def __init__(self, parameters: MppiParameters, robot: RobotDescription, period: float) -> None:
        from stack.control.mppi import kernels
        from stack.control.mppi.critics import kernels as critic_kernels

        p = self.parameters = parameters
        self._kernels, self._critic_kernels, self._period = kernels, critic_kernels, period
        deviations = [p.linear_deviation, p.angular_deviation, p.lateral_deviation]
        self._drivetrain, self._axes = robot.drivetrain, robot.drivetrain.velocity_axes
        self._noise = NoiseTable(p.batch, p.steps, NOISE_CORRELATION, deviations[: self._axes])
        self._rollouts = Rollouts(self._axes, p.steps, p.batch)
        self._single = Rollouts(self._axes, p.steps, 1)
        self._bounds = bounds(p, robot)
        self._reverse_speed = float(self._bounds[1])
        self._pursuits = np.array([(share * self.top_speed, ahead) for share, ahead in PURSUITS])
        self._dodging_turns = dodging_turns(p, float(self._bounds[2]))
        self._places, self._shift = np.arange(p.steps), period / p.time_step
        self._filter = savitzky_golay_weights(FILTER_HALF_WINDOW, 2)
        self._past = np.zeros((self._axes, FILTER_HALF_WINDOW))
        self.plan: Array32 = np.zeros((self._axes, p.steps), np.float32)

    @property
    def top_speed(self) -> float:
        """Top forward speed, m/s."""
        return float(self._bounds[0])

    def limit_reverse(self, speed: float) -> None:
        """Limit the speed backward in m/s from now on, at most to the robot's and parameter's."""
        self._bounds[1] = min(self._reverse_speed, speed)

    def reset(self) -> None:
        """Reset the plan to standstill."""
        self.plan[:] = 0.0
        self._past[:] = 0.0

    def shift(self) -> None:
        """Shift the plan by one control period; its last controls are held."""
        for axis in self.plan:
            axis[:] = np.interp(self._places + self._shift, self._places, axis)

    def improve(
        self, heading: float, twist: Twist, path: LocalPath, obstacles: Obstacles,
        body: BodyArrays,
    ) -> None:  # fmt: skip
        """Improve the plan by sampling.

        Args:
            heading: of the robot, map frame, radians.
            twist: current velocity.
            path: to follow.
            obstacles: to avoid.
            body: the robot's outline.
        """
        rollouts, kernels, p = self._rollouts, self._critic_kernels, self.parameters
        for _ in range(p.iterations):
            self._sample(rollouts.controls, heading, twist, path)
            if len(obstacles.moving):
                self._dodge(rollouts.controls)
            self._drive(rollouts, heading, twist)
            evaluate_obstacles(kernels, p, rollouts, obstacles, body)
            furthest = kernels.furthest_reached(rollouts.poses, rollouts.hits, path.points)
            critic_data = CriticData(
                kernels, p, path, self.plan, self._noise.pull(self.plan), heading, int(furthest),
                self._drivetrain.aligns_in_place, moving=len(obstacles.moving) > 0,
            )  # fmt: skip
            rollouts.costs[:] = 0.0
            for critic in CRITICS:
                critic(critic_data, rollouts)
            self._kernels.weighted_mean(rollouts.controls, rollouts.costs, p.temperature, self.plan)
        self._smooth()

    def best(self) -> Array32:
        """Return the controls of the best rollout of the last `improve`, (axes, steps)."""
        return self._rollouts.controls[:, :, int(np.argmin(self._rollouts.costs))]

    def trajectory(self, controls: Array32, pose: Pose2D, twist: Twist) -> tuple[FloatArray, Twist]:
        """Simulate one control sequence.

        Args:
            controls: (axes, steps).
            pose: current pose, map frame.
            twist: current velocity.

        Returns:
            (steps, 3) poses in the map frame, and the velocity after the first step.
        """
        single = self._single
        single.controls[:, :, 0] = controls
        self._drive(single, pose.heading, twist)
        poses = single.poses[:3, :, 0].T.astype(np.float64)
        first = [float(axis[0, 0]) for axis in single.velocities]
        poses[:, :2] += (pose.x, pose.y)
        return poses, Twist(*first)

    def remember(self, twist: Twist) -> None:
        """Store a command for the smoothing filter."""
        command = (twist.linear, twist.angular, twist.lateral)[: self._axes]
        self._past = np.column_stack([self._past[:, 1:], command])

    def _sample(self, controls: Array32, heading: float, twist: Twist, path: LocalPath) -> None:
        """Sample the controls: the plan with noise, and a few fixed candidates.

        E. Trevisan, J. Alonso-Mora, "Biased-MPPI: Informing sampling-based model predictive control
        by fusing ancillary controllers", IEEE Robotics and Automation Letters 9, 2024.
        """
        noise, top = self._noise, self._bounds
        self._kernels.sample(self.plan, noise.values, noise.begins(), noise.scales, controls)
        controls[:, :, 0] = self.plan
        controls[:, :, 1:5] = 0.0
        controls[1, :, 2], controls[1, :, 3], controls[0, :, 4] = top[2], -top[2], -top[1]
        start = self._start(heading, twist)
        self._kernels.pursue(path.points, start, top, self._pursuits, 5, controls)

    def _dodge(self, controls: Array32) -> None:
        """Add evasive motions: a turn, then straight on.

        Noise around a plan that stops rarely finds them. Among moving people, a robot that can only
        collide or wait freezes (Trautman and Krause, "Unfreezing the robot", IROS 2010).
        """
        first = 5 + len(PURSUITS)
        columns = slice(first, first + len(DODGES))
        tops = np.where(DODGE_SHARES > 0.0, self._bounds[0], self._bounds[1])
        controls[:, :, columns] = 0.0
        controls[0, :, columns] = DODGE_SHARES * tops
        controls[1, :, columns] = self._dodging_turns

    def _start(self, heading: float, twist: Twist) -> Array32:
        start = [twist.linear, twist.angular, twist.lateral, cos(heading), sin(heading)]
        self._bounds[9] = heading
        return np.array(start, np.float32)

    def _drive(self, rollouts: Rollouts, heading: float, twist: Twist) -> None:
        self._kernels.roll_out(
            rollouts.controls, self._start(heading, twist), self._bounds, rollouts.velocities,
            rollouts.poses, rollouts.excess,
        )  # fmt: skip

    def _smooth(self) -> None:
        """Smooth the plan (Savitzky-Golay), padded with past commands and its last controls."""
        for axis, past, top in zip(self.plan, self._past, self._tops(), strict=True):
            padded = np.concatenate([past, axis, np.repeat(axis[-1:], FILTER_HALF_WINDOW)])
            axis[:] = np.convolve(padded, self._filter, "valid")
            np.minimum(np.maximum(axis, -top[0]), top[1], out=axis)

    def _tops(self) -> list[tuple[float, float]]:
        """Top speeds backward and forward of each axis."""
        top, back, fastest, sideways = (float(bound) for bound in self._bounds[:4])
        return [(back, top), (fastest, fastest), (sideways, sideways)][: self._axes]


def dodging_turns(p: MppiParameters, fastest: float) -> Array32:
    """Return the turning speeds (steps, k) of the evasive motions, rad/s.

    Args:
        p: of the controller.
        fastest: turning speed, rad/s.
    """
    turns = np.array([turn for _, turn in DODGES])
    turning = np.rint(np.abs(turns) / (fastest * p.time_step))  # steps
    speeds = np.where(np.arange(p.steps)[:, None] < turning, np.copysign(fastest, turns), 0.0)
    return speeds.astype(np.float32)


def bounds(p: MppiParameters, robot: RobotDescription) -> Array32:
    """Return the bounds of the motion model, (10,), in the order of `kernels.roll_out`."""
    step, limits, radius = p.time_step, robot.limits, robot.turning_radius
    return np.array(
        [
            min(p.cruise_speed, limits.linear_speed),
            min(p.reverse_speed, limits.reverse_speed),
            min(p.turn_speed, limits.angular_speed),
            min(p.lateral_speed, limits.lateral_speed),
            limits.linear_acceleration * step,
            limits.linear_deceleration * step,
            limits.angular_acceleration * step,
            1.0 / radius if radius else 0.0,
            step,
            0.0,
        ],
        np.float32,
    )


class NoiseTable:
    """Normal noise, correlated over the steps of a rollout.

    Each column is the noise of one rollout and one axis, a stationary first-order autoregressive
    sequence. A command uses `batch` neighbouring columns from a random offset, a different one per
    axis, so that the combinations are new although the columns repeat.

    Attributes:
        values: (axes, steps, columns) float32.
        scales: (batch,) float32 factors on a draw: rollouts with little noise keep to a plan
            through a narrow passage, where those with full noise all collide.
    """

    def __init__(self, batch: int, steps: int, correlation: float, deviations: list[float]) -> None:
        """Draw the table.

        Args:
            batch: rollouts per command.
            steps: steps per rollout.
            correlation: of neighbouring steps, in [0, 1).
            deviations: standard deviation per axis, m/s or rad/s.
        """
        self._correlation, self._deviations = correlation, np.array(deviations)
        self._random = stream(0, "mppi noise")
        shape = (len(deviations), steps, TABLE_LENGTH * batch)
        self.values: Array32 = self._random.standard_normal(shape, dtype=np.float32)
        fresh = np.float32(np.sqrt(1.0 - correlation * correlation))
        for t in range(1, steps):
            self.values[:, t] *= fresh
            self.values[:, t] += np.float32(correlation) * self.values[:, t - 1]
        self.values *= np.array(deviations, np.float32)[:, None, None]
        self._last = shape[2] - batch
        calm = np.geomspace(CALMEST, 1.0, round(CALM_SHARE * batch))
        self.scales: Array32 = np.ones(batch, np.float32)
        self.scales[: len(calm)] = calm

    def begins(self) -> NDArray[np.int64]:
        """Return the (axes,) first columns of the next draw."""
        return self._random.integers(0, self._last + 1, len(self.values))

    def pull(self, plan: Array32) -> Array32:
        """Return the plan times the inverse covariance of the noise; both (axes, steps).

        The inverse covariance of a first-order autoregressive sequence is tridiagonal.
        """
        r = self._correlation
        middle = plan.astype(np.float64)
        weighed = (1.0 + r * r) * middle
        weighed[:, 0] -= r * r * middle[:, 0]
        weighed[:, -1] -= r * r * middle[:, -1]
        weighed[:, 1:] -= r * middle[:, :-1]
        weighed[:, :-1] -= r * middle[:, 1:]
        weighed /= (1.0 - r * r) * np.square(self._deviations)[:, None]
        return weighed.astype(np.float32)

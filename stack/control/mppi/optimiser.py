"""The optimisation of MPPI: sample around the last plan, drive, judge, average."""

from __future__ import annotations

from math import cos, sin

import numpy as np

from stack.control.mppi.critics.critics import CRITICS, Judgement, look_around
from stack.control.mppi.noise import NoiseTable
from stack.control.mppi.parameters import MppiParameters
from stack.control.mppi.scene import Array32, LocalPath, Obstacles, Outline, Rollouts
from stack.drivetrain.description import DriveKind, RobotDescription
from stack.types import FloatArray, Pose2D, Twist

HISTORY = 4
"""Half the window of the smoothing filter: how many past commands it looks at."""

PURSUITS = tuple((speed, ahead) for speed in (1.0, 0.7, 0.4, 0.2) for ahead in (0.6, 0.3, 0.15))
"""Shares of the top speed and lookahead distances (metres) of the path pursuits tried."""

DODGES = tuple((speed, turn) for speed in (1.0, 0.5) for turn in (-1.4, -0.7, 0.7, 1.4))
"""Shares of the top speed and angles (radians) of the dodges tried while something moves."""


def savitzky_golay(half: int, order: int) -> FloatArray:
    """(2 half + 1,) weights of the least-squares polynomial's value in the middle of a window.

    A. Savitzky, M. J. E. Golay, "Smoothing and Differentiation of Data by Simplified Least Squares
    Procedures", Analytical Chemistry 36, 1964.
    """
    places = np.arange(-half, half + 1, dtype=float)
    weights: FloatArray = np.linalg.pinv(np.vander(places, order + 1, increasing=True))[0]
    return weights


class Optimiser:
    """Keeps a plan, a sequence of controls, and makes it better step by step.

    Williams, Drews, Goldfain, Rehg, Theodorou, "Information-theoretic model predictive control",
    ICRA 2017, and IEEE Transactions on Robotics 34, 2018.

    Attributes:
        plan: (axes, steps) float32: speeds forward, turning and, omni only, sideways.
    """

    def __init__(self, parameters: MppiParameters, robot: RobotDescription, period: float) -> None:
        from stack.control.mppi import kernels
        from stack.control.mppi.critics import kernels as critic_kernels

        p = self.parameters = parameters
        self._kernels, self._critic_kernels, self._period = kernels, critic_kernels, period
        deviations = [p.linear_deviation, p.angular_deviation, p.lateral_deviation]
        self._drive_kind = robot.drive
        self._axes = 3 if robot.drive is DriveKind.OMNI else 2
        self._noise = NoiseTable(p.batch, p.steps, p.noise_correlation, deviations[: self._axes])
        self._rollouts = Rollouts(self._axes, p.steps, p.batch)
        self._single = Rollouts(self._axes, p.steps, 1)
        self._bounds = bounds(p, robot)
        self._filter = savitzky_golay(HISTORY, 2)
        self._past = np.zeros((self._axes, HISTORY))
        self.plan: Array32 = np.zeros((self._axes, p.steps), np.float32)

    @property
    def top_speed(self) -> float:
        """m/s forward at most."""
        return float(self._bounds[0])

    def reset(self) -> None:
        """Forget the plan: stand."""
        self.plan[:] = 0.0
        self._past[:] = 0.0

    def shift(self) -> None:
        """Let one control period pass: the plan begins that much later, its end is held."""
        times = np.arange(self.parameters.steps) + self._period / self.parameters.time_step
        places = np.arange(self.parameters.steps)
        for axis in self.plan:
            axis[:] = np.interp(times, places, axis)

    def improve(
        self, heading: float, twist: Twist, path: LocalPath, obstacles: Obstacles, body: Outline
    ) -> None:
        """Replace the plan by a better one.

        Args:
            heading: of the robot, map frame.
            twist: driven now.
            path: to follow.
            obstacles: to keep clear of.
            body: the robot's outline.
        """
        rollouts, kernels, p = self._rollouts, self._critic_kernels, self.parameters
        for _ in range(p.iterations):
            self._sample(rollouts.controls, heading, twist, path)
            if len(obstacles.moving):
                self._dodge(rollouts.controls)
            self._drive(rollouts, heading, twist)
            look_around(kernels, p, rollouts, obstacles, body)
            furthest = kernels.furthest_reached(
                rollouts.poses, rollouts.hits, path.points, rollouts.nearest
            )
            judgement = Judgement(
                kernels, p, path, self.plan, self._noise.pull(self.plan), heading, int(furthest),
                self._drive_kind, moving=len(obstacles.moving) > 0,
            )  # fmt: skip
            rollouts.costs[:] = 0.0
            for critic in CRITICS:
                critic(judgement, rollouts)
            self._kernels.weighted_mean(rollouts.controls, rollouts.costs, p.temperature, self.plan)
        self._smooth()

    def best(self) -> Array32:
        """(axes, steps) the controls of the best rollout of the last improvement."""
        return self._rollouts.controls[:, :, int(np.argmin(self._rollouts.costs))]

    def trajectory(self, controls: Array32, pose: Pose2D, twist: Twist) -> tuple[FloatArray, Twist]:
        """Where controls lead.

        Args:
            controls: (axes, steps).
            pose: now, map frame.
            twist: driven now.

        Returns:
            (steps, 3) poses in the map frame, and the velocity that the first step reaches.
        """
        single = self._single
        single.controls[:, :, 0] = controls
        self._drive(single, pose.heading, twist)
        poses = single.poses[:3, :, 0].T.astype(np.float64)
        first = [float(axis[0, 0]) for axis in single.velocities]
        poses[:, :2] += (pose.x, pose.y)
        return poses, Twist(*first)

    def remember(self, twist: Twist) -> None:
        """A command was given: the smoothing filter looks back at it."""
        given = (twist.linear, twist.angular, twist.lateral)[: self._axes]
        self._past = np.column_stack([self._past[:, 1:], given])

    def _sample(self, controls: Array32, heading: float, twist: Twist, path: LocalPath) -> None:
        """Fill the controls: what is worth trying in any case, and noise round the plan.

        E. Trevisan, J. Alonso-Mora, "Biased-MPPI: Informing sampling-based model predictive control
        by fusing ancillary controllers", IEEE Robotics and Automation Letters 9, 2024.
        """
        noise, top = self._noise, self._bounds
        self._kernels.sample(self.plan, noise.values, noise.begins(), noise.scales, controls)
        controls[:, :, 0] = self.plan
        controls[:, :, 1:5] = 0.0
        controls[1, :, 2], controls[1, :, 3], controls[0, :, 4] = top[2], -top[2], -top[1]
        start = self._start(heading, twist)
        for column, (share, lookahead) in enumerate(PURSUITS, 5):
            self._kernels.pursue(
                path.points, start, top, share * self.top_speed, lookahead, column, controls
            )

    def _dodge(self, controls: Array32) -> None:
        """Turns aside and straight on; noise round a plan that stops hardly finds these.

        Among people who walk on, a robot that sees only the choice between driving into them and
        waiting for them freezes (Trautman and Krause, "Unfreezing the robot", IROS 2010).
        """
        step, fastest = self.parameters.time_step, float(self._bounds[2])
        first = 5 + len(PURSUITS)
        for column, (share, turn) in enumerate(DODGES, first):
            turning = min(self.parameters.steps, round(abs(turn) / (fastest * step)))
            controls[:, :, column] = 0.0
            controls[0, :, column] = share * self.top_speed
            controls[1, :turning, column] = np.copysign(fastest, turn)

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
        """Savitzky-Golay over the plan, with the past commands before it and its end after it."""
        for axis, past, top in zip(self.plan, self._past, self._tops(), strict=True):
            padded = np.concatenate([past, axis, np.repeat(axis[-1:], HISTORY)])
            axis[:] = np.convolve(padded, self._filter, "valid")
            np.clip(axis, -top[0], top[1], out=axis)

    def _tops(self) -> list[tuple[float, float]]:
        """Greatest speeds backward and forward of each axis."""
        top, back, fastest, sideways = (float(bound) for bound in self._bounds[:4])
        return [(back, top), (fastest, fastest), (sideways, sideways)][: self._axes]


def bounds(p: MppiParameters, robot: RobotDescription) -> Array32:
    """(10,) what the motion model is bounded by, as `kernels.roll_out` reads it."""
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

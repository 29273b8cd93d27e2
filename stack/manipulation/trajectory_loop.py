"""What a body calls in each step of its motor loop: targets of a trajectory, and the watch.

NumPy alone: neither the planner nor its libraries are needed where a trajectory is followed.
"""

from __future__ import annotations

from bisect import bisect_right

import numpy as np

from stack.drivetrain.arm_description import ArmDescription
from stack.manipulation.braking import braking
from stack.manipulation.hermite import piece
from stack.types import FloatArray
from stack.types.arms import JointState, JointTrajectory

TRACKING_ERROR = 0.1
"""Radians, or metres of prismatic joints, between target and position from which the arm stops."""

FULL_EFFORT = 0.99
"""Share of the effort limit from which on a motor is considered to be at it."""

OVERLOAD_TIME = 0.3
"""Seconds: accelerating may take all effort for a moment; longer means that something resists."""


class TrajectoryFollower:
    """Targets of the joints at each time, and what is wrong with their motion.

    Before the first trajectory, and after the end of each, the arm holds its position.
    """

    def __init__(
        self,
        description: ArmDescription,
        positions: FloatArray,
        tracking_error: float = TRACKING_ERROR,
    ) -> None:
        """Hold the positions (n,), radians, of the arm that the description describes."""
        self._description, self._tracking_error = description, tracking_error
        self._full_since: list[float | None] = [None] * len(positions)
        still = JointTrajectory(np.zeros(1), positions[None].copy(), np.zeros((1, len(positions))))
        self._begin, self._trajectory = 0.0, still
        self._times = still.times.tolist()

    def start(self, trajectory: JointTrajectory, time: float) -> None:
        """Begin a trajectory at a time, seconds on the body's clock."""
        self._trajectory, self._begin = trajectory, time
        self._times = trajectory.times.tolist()
        self._full_since = [None] * len(self._full_since)

    def stop(self, time: float) -> None:
        """Brake along the path of the trajectory from a time on, seconds on the body's clock."""
        since = max(0.0, time - self._begin)
        self.start(braking(self._trajectory, since, self._description.limits), time)

    def is_over(self, time: float) -> bool:
        """Return whether the trajectory has ended at a time, seconds on the body's clock."""
        return time - self._begin >= self._trajectory.duration

    def targets(self, time: float) -> tuple[FloatArray, FloatArray]:
        """Return positions and velocities (n,) at a time, seconds on the body's clock."""
        trajectory, since = self._trajectory, time - self._begin
        if since >= trajectory.duration:
            return trajectory.positions[-1], np.zeros_like(trajectory.positions[-1])
        k = max(0, bisect_right(self._times, since) - 1)
        step = self._times[k + 1] - self._times[k]
        return piece(
            min(1.0, max(0.0, (since - self._times[k]) / step)),
            step,
            (trajectory.positions[k], trajectory.positions[k + 1]),
            (trajectory.velocities[k], trajectory.velocities[k + 1]),
        )

    def watch(self, state: JointState) -> str:
        """Return what is wrong: a joint that is not where it should be, or that something holds.

        Args:
            state: measured, at its stamp; called in each step of the motor loop.

        Returns:
            A sentence with joint and numbers; empty if the motion is as commanded.
        """
        return self._off_track(state) or self._overloaded(state)

    def _off_track(self, state: JointState) -> str:
        errors = np.abs(self.targets(state.stamp)[0] - state.positions)
        joint = int(errors.argmax())
        if errors[joint] <= self._tracking_error:
            return ""
        return (
            f"{self._description.joints[joint]}: tracking error {errors[joint]:.3f} above "
            f"{self._tracking_error:.3f}"
        )

    def _overloaded(self, state: JointState) -> str:
        limits = self._description.limits.effort
        full = np.abs(state.efforts) >= FULL_EFFORT * limits
        if not full.any():
            self._full_since = [None] * len(full)
            return ""
        for joint, is_full in enumerate(full.tolist()):
            since = self._full_since[joint]
            if not is_full:
                self._full_since[joint] = None
            elif since is None:
                self._full_since[joint] = state.stamp
            elif state.stamp - since > OVERLOAD_TIME:
                return (
                    f"{self._description.joints[joint]}: effort at its limit of "
                    f"{limits[joint]:.0f} for {state.stamp - since:.1f} s"
                )
        return ""

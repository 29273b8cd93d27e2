"""Check of a trajectory for an arm: shape, numbers, limits of the joints, where it begins."""

from __future__ import annotations

import numpy as np

from stack.drivetrain.arm_description import ArmDescription
from stack.errors import ParameterError
from stack.types import JointState, JointTrajectory

ARRIVED = 0.01
"""Distance of each joint from its goal at which a motion is over, rad or m."""

BEGINS_WITHIN = 0.05
"""Distance of each joint from the begin of a trajectory, rad or m."""

ROUNDING = 1e-3
"""Share by which a speed may exceed its limit."""


def check_trajectory(
    trajectory: JointTrajectory, arm: ArmDescription, joints: JointState | None
) -> None:
    """Check a trajectory that the planner has not made.

    Args:
        trajectory: to be followed.
        arm: that follows it.
        joints: as they are measured; None: not yet.

    Raises:
        ParameterError: the arm cannot follow it.
    """
    limits, rows = arm.limits, trajectory.positions
    if rows.ndim != 2 or rows.shape[1] != len(arm.joints) or len(rows) < 2:
        wanted = f"at least 2 rows of {len(arm.joints)} positions"
        raise ParameterError("trajectory", f"expected {wanted}, got an array {rows.shape}")
    if trajectory.velocities.shape != rows.shape or trajectory.times.shape != rows.shape[:1]:
        raise ParameterError("trajectory", "times, positions and velocities differ in length")
    every = trajectory.times, rows, trajectory.velocities
    if not all(np.isfinite(numbers).all() for numbers in every):
        raise ParameterError("trajectory", "times, positions and velocities must be finite")
    if trajectory.times[0] != 0.0 or not (np.diff(trajectory.times) > 0.0).all():
        raise ParameterError("trajectory", "times must rise from 0")
    if np.any(trajectory.velocities[-1]):
        raise ParameterError("trajectory", "it must end at rest")
    outside = (rows < limits.lower - ARRIVED) | (rows > limits.upper + ARRIVED)
    if outside.any():
        row, joint = map(int, np.argwhere(outside)[0])
        raise ParameterError(
            "trajectory",
            f"{arm.joints[joint]} would go to {rows[row, joint]:.3f}, beyond its limits "
            f"{limits.lower[joint]:g} to {limits.upper[joint]:g}",
        )
    between = np.diff(rows, axis=0) / np.diff(trajectory.times)[:, np.newaxis]
    fastest = np.abs(np.vstack([trajectory.velocities, between])).max(axis=0)
    joint = int((fastest / limits.velocity).argmax())
    if fastest[joint] > limits.velocity[joint] * (1.0 + ROUNDING):
        raise ParameterError(
            "trajectory",
            f"{arm.joints[joint]} would move at {fastest[joint]:.3f} per second, faster "
            f"than its limit {limits.velocity[joint]:g}", "give it more time",
        )  # fmt: skip
    if joints is None:
        raise ParameterError("trajectory", "the joints are not measured yet", "wait for them")
    away = np.abs(rows[0] - joints.positions)
    worst = int(away.argmax())
    if not away[worst] <= BEGINS_WITHIN:
        raise ParameterError(
            "trajectory",
            f"it begins {away[worst]:.3f} from where {arm.joints[worst]} is",
            "plan from the measured positions",
        )

"""Timing of an arm's path: as fast as velocity, acceleration and jerk of each joint allow.

1. Corners are rounded (blending.py).
2. The fastest time law along the path within the limits of velocity and acceleration is computed
   by a pass backwards and one forwards over a grid of the path's length, as by TOPP-RA (Pham,
   Pham, IEEE T-RO 2018).
3. The positions p(i Δt) of that motion are averaged over a window of m samples, and the averages
   c(i) are the control points of a uniform cubic B-spline. It is the trajectory.

The limits hold exactly and everywhere, not at samples only. The derivatives of a B-spline stay
between the differences of its control points; those of p, Δp/Δt and Δ²p/Δt², are averages of the
true velocity and acceleration of step 2 (mean value theorem), and averages of what is within a
limit are within it. The jerk is Δ³c/Δt³ <= 2 a_max / (m Δt): the smallest m that satisfies the
limit is used. For a single line with a phase of constant velocity the result is the optimal
S-curve up to a few samples.

The average leaves the path of step 1 by at most a_max (m Δt)²/24 at corners, and not at all on
lines. `timed` therefore checks the timed motion against the scene; where it is not free, corners
are rounded less and in the end the arm stops at them, which follows the checked path exactly.

Ruckig was measured beside it (tests/benchmarks/arm_planning.py): without its cloud service it has
no waypoints on the way, and stopping at each of them takes longer.
"""

from __future__ import annotations

import numpy as np

from stack.drivetrain.arm_description import JointLimits
from stack.errors import NavigationError
from stack.manipulation.blending import Section, blended
from stack.manipulation.collisions import Collisions
from stack.manipulation.hermite import hermite
from stack.manipulation.kernels import time_law
from stack.types import FailureCode, FloatArray
from stack.types.arms import JointTrajectory

PERIOD = 0.01
"""Seconds between two control points."""

TOLERANCES = (0.1, 0.03, 0.01, 0.0)
"""Radians of joint space by which corners are rounded, in the order in which they are tried."""

SAME = 1e-6
"""Radians: nearer waypoints are one."""


def time_path(
    waypoints: FloatArray, limits: JointLimits, tolerance: float = TOLERANCES[0]
) -> JointTrajectory:
    """Return the fastest motion along waypoints, from rest to rest.

    Args:
        waypoints: (k, n) positions of the joints.
        limits: of the joints.
        tolerance: radians of joint space by which corners may be rounded; 0: the arm stops there.
    """
    waypoints = _without_repetitions(waypoints)
    if len(waypoints) == 1:
        return JointTrajectory(np.zeros(1), waypoints.copy(), np.zeros_like(waypoints))
    sampled = [_sampled(section, limits) for section in blended(waypoints, tolerance)]
    window = 1
    while True:
        control = _averaged(sampled, window)
        excess = _excess(control, limits)
        if excess[2] <= 1.0 + 1e-9:
            break
        window = max(window + 1, int(window * 1.1))
    # The time law is exact at its grid; between two points of an arc it may be a little too fast.
    slower = max(1.0, excess[0], excess[1] ** 0.5)
    return _spline(control, PERIOD * slower)


def timed(
    waypoints: FloatArray, limits: JointLimits, checks: Collisions
) -> tuple[JointTrajectory, float]:
    """Return the fastest free motion along the waypoints of a free path, and how far it leaves it.

    Args:
        waypoints: (k, n) positions of the joints.
        limits: of the joints.
        checks: of the scene; the motion keeps half of their clearance, which is what the checks of
            the path leave between two poses.

    Raises:
        NavigationError: COLLISION_AHEAD if an object moves into the way.
    """
    halved = checks.with_clearance(checks.clearance / 2.0)
    for tolerance in TOLERANCES:
        trajectory = time_path(waypoints, limits, tolerance)
        contact = first_contact(trajectory, halved)
        if not contact:
            return trajectory, tolerance
    raise NavigationError(FailureCode.COLLISION_AHEAD, contact)


def first_contact(trajectory: JointTrajectory, checks: Collisions) -> str:
    """Return what touches what and when, with moving objects where they are then; empty: nothing.

    Args:
        trajectory: its begin is time 0 of the scene.
        checks: of the scene.
    """
    poses, times = trajectory.positions, trajectory.times.tolist()
    for before, after, time in zip(poses, poses[1:], times[1:], strict=False):
        if contact := checks.contact_between(before, after, time):
            return f"after {time:.1f} s {contact}"
    return ""


def _without_repetitions(waypoints: FloatArray) -> FloatArray:
    ways = np.linalg.norm(np.diff(waypoints, axis=0), axis=1)
    return waypoints[np.concatenate(([True], ways > SAME))]


def _sampled(section: Section, limits: JointLimits) -> FloatArray:
    """Return the positions (m, n) of the fastest motion along a section, each `PERIOD`."""
    steps = np.diff(section.lengths)
    squares = time_law(
        steps, section.tangents, section.curvatures, limits.velocity, limits.acceleration
    )
    speeds = np.sqrt(squares)
    durations = 2.0 * steps / np.maximum(speeds[:-1] + speeds[1:], 1e-9)
    times = np.concatenate(([0.0], np.cumsum(durations)))
    wanted = np.arange(0.0, times[-1] + PERIOD, PERIOD)
    part = np.clip(np.searchsorted(times, wanted, side="right") - 1, 0, len(steps) - 1)
    since = np.minimum(wanted, times[-1]) - times[part]
    acceleration = (squares[part + 1] - squares[part]) / (2.0 * steps[part])
    length = speeds[part] * since + 0.5 * acceleration * since**2
    length = np.clip(length, 0.0, steps[part])
    sampled = hermite(
        section.lengths, section.positions, section.tangents, section.lengths[part] + length
    )[0]
    sampled[-1] = section.positions[-1]
    return sampled


def _averaged(sampled: list[FloatArray], window: int) -> FloatArray:
    """Return control points (m, n): averages over the window, at rest between the sections."""
    rest = window + 1  # samples at each end; of the averages three are then at rest
    parts = [np.repeat(sampled[0][:1], rest, axis=0)]
    for part in sampled:
        parts += [part, np.repeat(part[-1:], window, axis=0)]
    points = np.vstack((*parts, sampled[-1][-1:]))
    sums = np.cumsum(np.vstack((np.zeros((1, points.shape[1])), points - points[0])), axis=0)
    control: FloatArray = points[0] + (sums[window:] - sums[:-window]) / window
    control[:3], control[-3:] = points[0], points[-1]
    return control


def _excess(control: FloatArray, limits: JointLimits) -> tuple[float, float, float]:
    """Return the largest velocity, acceleration and jerk of a spline as shares of the limits."""
    first = np.diff(control, axis=0) / PERIOD
    second = np.diff(first, axis=0) / PERIOD
    third = np.diff(second, axis=0) / PERIOD
    return (
        float((np.abs(first) / limits.velocity).max()),
        float((np.abs(second) / limits.acceleration).max()),
        float((np.abs(third) / limits.jerk).max()),
    )


def _spline(control: FloatArray, period: float) -> JointTrajectory:
    """Return the knots of the spline: positions and velocities of cubic Hermite pieces."""
    before, here, after = control[:-2], control[1:-1], control[2:]
    positions = (before + 4.0 * here + after) / 6.0
    velocities = (after - before) / (2.0 * period)
    times = period * np.arange(len(positions), dtype=float)
    return JointTrajectory(times, positions, velocities)

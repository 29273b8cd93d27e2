"""Stopping an arm along the path of its trajectory, as soon as the limits of its joints allow.

The path was checked for collisions, so that the arm brakes on it and not away from it. Time on
the trajectory runs on at full rate for a moment w. Then its rate falls to zero, linearly in a time
D, averaged over a window J that limits the jerk: max(a / j), or twice as long, which an arm needs
that accelerates:

    dτ/dt = 1 − (R(t − w) − R(t − w − J)) / J,    R(t) = ∫ clip(t / D, 0, 1) dt

The triples are tried in the order of w + D + J; the first whose motion is within the limits is
taken. The wait w matters where the trajectory itself brakes with all that a joint has. Where none
stops before the end of the trajectory, its rest is the answer.
"""

from __future__ import annotations

import numpy as np

from stack.drivetrain.arm_description import JointLimits
from stack.manipulation.hermite import sample
from stack.types import FloatArray
from stack.types.arms import JointTrajectory

PERIOD = 0.01
"""Seconds between two samples."""

SHORTEST = 0.02
"""Seconds: D of the first attempts."""

END = 1e-3
"""Seconds before the end of a trajectory from which on it is over: the rest is below 1e-6 rad."""

TOLERANCE = 1.02
"""Share of the limits that a stop may reach: it is sampled, not exact as the trajectory is."""


def braking(trajectory: JointTrajectory, time: float, limits: JointLimits) -> JointTrajectory:
    """Return the motion that stops along the path of a trajectory; its times begin at 0.

    Args:
        trajectory: that the arm follows.
        time: since its begin, from which on the arm brakes, seconds.
        limits: of the joints.
    """
    left = trajectory.duration - time
    if left <= END:
        positions = trajectory.positions[-1:]
        return JointTrajectory(np.zeros(1), positions, np.zeros_like(positions))
    window = max(float((limits.acceleration / limits.jerk).max()), PERIOD)
    for _, wait, duration, rounding in _attempts(left, window):
        stop = _slowed(trajectory, time, wait, (duration, rounding))
        if is_within(stop, limits, TOLERANCE):
            return stop
    rest = trajectory.times > time
    positions, velocities = sample(trajectory, np.array([time]))
    return JointTrajectory(
        np.concatenate(([0.0], trajectory.times[rest] - time)),
        np.vstack((positions, trajectory.positions[rest])),
        np.vstack((velocities, trajectory.velocities[rest])),
    )


def is_within(trajectory: JointTrajectory, limits: JointLimits, tolerance: float = 1.0) -> bool:
    """Return whether a trajectory stays within the limits, at and between its samples.

    The jerk is that within the pieces, and the mean one between the middles of two.
    """
    velocity, acceleration, jerk = peaks(trajectory)
    return bool(
        np.all(velocity <= tolerance * limits.velocity)
        and np.all(acceleration <= tolerance * limits.acceleration)
        and np.all(jerk <= tolerance * limits.jerk)
    )


def peaks(trajectory: JointTrajectory) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the largest velocity, acceleration and jerk (n,) of each joint, between samples too.

    In a cubic piece the acceleration is linear: its extremes are at the ends. The velocity has one
    where the acceleration vanishes.
    """
    positions, velocities = trajectory.positions, trajectory.velocities
    if len(positions) == 1:
        still = np.zeros(positions.shape[1])
        return still, still, still
    step = np.diff(trajectory.times)[:, None]
    mean = np.diff(positions, axis=0) / step
    before, after = velocities[:-1], velocities[1:]
    first = (6.0 * mean - 4.0 * before - 2.0 * after) / step
    last = (2.0 * before + 4.0 * after - 6.0 * mean) / step
    jerk = (last - first) / step
    turning = np.clip(-first / np.where(jerk == 0.0, np.inf, jerk), 0.0, step)
    between = before + turning * (first + 0.5 * turning * jerk)
    middle = np.diff((first + last) / 2.0, axis=0) / ((step[1:] + step[:-1]) / 2.0)
    return (
        np.maximum(np.abs(velocities).max(axis=0), np.abs(between).max(axis=0)),
        np.maximum(np.abs(first), np.abs(last)).max(axis=0),
        np.maximum(np.abs(jerk).max(axis=0), np.abs(middle).max(axis=0, initial=0.0)),
    )


def _attempts(left: float, window: float) -> list[tuple[float, float, float, float]]:
    """Return w + D + J, w, D and J of the stops before the end of the trajectory, ascending."""
    durations = SHORTEST * 1.15 ** np.arange(40)
    waits = np.linspace(0.0, left, 6)[:-1]
    return sorted(
        (float(wait + duration + rounding), float(wait), float(duration), rounding)
        for wait in waits
        for duration in durations
        for rounding in (window, 2.0 * window)
        if wait + (duration + rounding) / 2.0 <= left
    )


def _slowed(
    trajectory: JointTrajectory, time: float, wait: float, fall: tuple[float, float]
) -> JointTrajectory:
    """Return the motion whose rate falls after the wait, in the times D and J."""
    duration, window = fall
    count = int(np.ceil((wait + duration + window) / PERIOD)) + 1
    times = np.arange(count, dtype=np.float64) * PERIOD
    since = times - wait
    rate = 1.0 - (_ramp(since, duration) - _ramp(since - window, duration)) / window
    lost = (_area(since, duration) - _area(since - window, duration)) / window
    positions, velocities = sample(trajectory, time + times - lost)
    velocities = velocities * rate[:, None]
    velocities[-1] = 0.0
    return JointTrajectory(times, positions, velocities)


def _ramp(times: FloatArray, duration: float) -> FloatArray:
    """Return R: the integral of the clipped line, from 0."""
    inside = np.clip(times, 0.0, duration)
    integral: FloatArray = inside**2 / (2.0 * duration) + np.maximum(times - duration, 0.0)
    return integral


def _area(times: FloatArray, duration: float) -> FloatArray:
    """Return the integral of R from 0."""
    inside, beyond = np.clip(times, 0.0, duration), np.maximum(times - duration, 0.0)
    integral: FloatArray = inside**3 / (6.0 * duration) + beyond * (duration + beyond) / 2.0
    return integral

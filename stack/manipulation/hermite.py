"""Cubic Hermite pieces: values and slopes between samples of both."""

from __future__ import annotations

import numpy as np

from stack.types import FloatArray
from stack.types.arms import JointTrajectory


def sample(trajectory: JointTrajectory, times: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return positions and velocities (m, n) at times (m,) since the begin; held after the end."""
    if len(trajectory.times) == 1:
        held = np.repeat(trajectory.positions, len(times), axis=0)
        return held, np.zeros_like(held)
    inside = np.clip(times, 0.0, trajectory.duration)
    positions, velocities = hermite(
        trajectory.times, trajectory.positions, trajectory.velocities, inside
    )
    velocities[times >= trajectory.duration] = trajectory.velocities[-1]
    return positions, velocities


def hermite(
    places: FloatArray, values: FloatArray, slopes: FloatArray, at: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return values and slopes (m, n) of cubic Hermite pieces.

    Args:
        places: (k,) rising ends of the pieces.
        values: (k, n) there.
        slopes: (k, n) there.
        at: (m,) between the first and the last place.
    """
    k = np.clip(np.searchsorted(places, at, side="right") - 1, 0, len(places) - 2)
    step = (places[k + 1] - places[k])[:, None]
    share = (at - places[k])[:, None] / step
    return piece(share, step, (values[k], values[k + 1]), (slopes[k], slopes[k + 1]))


def piece(
    share: FloatArray | float,
    step: FloatArray | float,
    values: tuple[FloatArray, FloatArray],
    slopes: tuple[FloatArray, FloatArray],
) -> tuple[FloatArray, FloatArray]:
    """Return value and slope within a piece of the length `step`, at a share of it."""
    (first, last), (rise, fall) = values, slopes
    mean = (last - first) / step
    bend = 3.0 * mean - 2.0 * rise - fall
    twist = rise + fall - 2.0 * mean
    slope = rise + share * (2.0 * bend + 3.0 * share * twist)
    value = first + step * share * (rise + share * (bend + share * twist))
    return value, slope

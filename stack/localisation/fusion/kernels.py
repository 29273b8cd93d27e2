"""Compiled steps of the odometry filter: prediction over an interval, update, gate.

State, (11,): pose x, y, heading in the odom frame; twist v_x, v_y, yaw rate in the base frame; bias
of the gyro; relative error of the wheels' scale; pose of the keyframe in the odom frame. Products
are written as loops: BLAS gives other last bits on other processors.
"""

from __future__ import annotations

from math import cos, exp, pi, sin

import numpy as np
from numba import f8, i8

from stack.kernel_cache import njit
from stack.types import FloatArray

SIZE, TWIST, BIAS, SCALE, KEYFRAME = 11, 3, 6, 7, 8
"""Length of the state, and where its parts begin."""

DURATION, FORWARD, LEFT, TURN, ROTATION = 0, 1, 2, 3, 4
GAIN_X, GAIN_Y, HAS_GYRO, AT_REST = 5, 6, 7, 8
"""Columns of an input: seconds; arc lengths and rotation of the wheels; rotation of the gyro with
its bias; change of velocity by the accelerometer, m/s; whether there was a gyro; whether the robot
stands."""

TRUSTED, DISTURBED, ENTERING = 0, 1, 2
"""Whether the wheels move the base; ENTERING is the first disturbed part."""


@njit(cache=True, nogil=True)
def _wrap(angle: float) -> float:
    return (angle + pi) % (2.0 * pi) - pi


@njit(cache=True, nogil=True)
def predict(
    state: FloatArray, covariance: FloatArray, given: FloatArray, share: float, mode: int,
    noise: FloatArray,
) -> FloatArray:  # fmt: skip
    """Move the state over a share of an input's interval, in place.

    Args:
        state: (11,) at the beginning.
        covariance: (11, 11) at the beginning.
        given: (9,) input; see its columns.
        share: of the input's interval, in (0, 1].
        mode: TRUSTED, DISTURBED or ENTERING.
        noise: (11,): variance of translation per metre along and across the motion, of rotation
            per radian and per metre by the wheels, of the gyro's rotation per second and per
            radian, of disturbed velocity at its beginning and per second, its decay time, variance
            of the gyro's bias per second, and of its rate while disturbed.

    Returns:
        (3, 3) covariance of the displacement, base frame at its end.
    """
    interval = given[DURATION]
    seconds = share * interval
    turning = np.zeros((3, SIZE))
    added = np.zeros(3)
    forward, left = given[FORWARD] / interval, given[LEFT] / interval
    metres = share * (given[FORWARD] * given[FORWARD] + given[LEFT] * given[LEFT]) ** 0.5
    radians = share * abs(given[TURN])
    if given[HAS_GYRO] > 0.0:
        rate = given[ROTATION] / interval - state[BIAS]
        if given[AT_REST] > 0.0:
            rate = 0.0
        else:
            turning[2, BIAS] = -1.0
            added[2] = (noise[4] * seconds + noise[5] * abs(rate) * seconds) / seconds**2
        if mode != TRUSTED:
            added[2] += noise[10]
    elif mode == TRUSTED:
        rate = given[TURN] / interval
        added[2] = (noise[2] * radians + noise[3] * metres) / seconds**2
    else:
        rate = state[TWIST + 2]
        turning[2, TWIST + 2] = 1.0
        added[2] = noise[7] * seconds + (noise[6] if mode == ENTERING else 0.0)
    if mode == TRUSTED:
        u = u_end = (1.0 + state[SCALE]) * forward
        v = v_end = (1.0 + state[SCALE]) * left
        turning[0, SCALE], turning[1, SCALE] = forward, left
        across = 1.0 if abs(left) > abs(forward) else 0.0
        along, beside = noise[0] * metres, noise[1] * metres
        added[0] = (along + across * (beside - along)) / seconds**2
        added[1] = (beside + across * (along - beside)) / seconds**2
    else:
        c, s = cos(rate * seconds), sin(rate * seconds)
        keep = exp(-seconds / noise[8])
        u_end = c * state[3] + s * state[4] + share * given[GAIN_X]
        v_end = -s * state[3] + c * state[4] + share * given[GAIN_Y]
        u_end = forward + keep * (u_end - forward)
        v_end = left + keep * (v_end - left)
        u, v = 0.5 * (state[3] + u_end), 0.5 * (state[4] + v_end)
        turning[0, 3], turning[0, 4] = keep * c, keep * s
        turning[1, 3], turning[1, 4] = -keep * s, keep * c
        added[0] = added[1] = noise[7] * seconds + (noise[6] if mode == ENTERING else 0.0)
    _move(state, covariance, np.array([u, v, rate]), seconds, turning, added)
    state[3], state[4], state[5] = u_end, v_end, rate
    covariance[BIAS, BIAS] += noise[9] * seconds
    displacement: FloatArray = covariance[3:6, 3:6] * seconds**2
    return displacement


@njit(cache=True, nogil=True)
def _move(
    state: FloatArray, covariance: FloatArray, twist: FloatArray, seconds: float,
    turning: FloatArray, added: FloatArray,
) -> None:  # fmt: skip
    """Move the pose on an arc; propagate the covariance.

    Args:
        state: (11,).
        covariance: (11, 11).
        twist: (3,) constant in this time.
        seconds: of this motion.
        turning: (3, 11) derivative of the twist with respect to the state.
        added: (3,) variances of the twist's own errors.
    """
    turn = twist[2] * seconds
    a, b = 1.0 - turn * turn / 6.0, 0.5 * turn
    if abs(turn) > 1e-6:
        a, b = sin(turn) / turn, (1.0 - cos(turn)) / turn
    ahead, aside = twist[0] * seconds, twist[1] * seconds
    along, across = a * ahead - b * aside, b * ahead + a * aside
    c, s = cos(state[2]), sin(state[2])
    dx, dy = c * along - s * across, s * along + c * across
    mc, ms = cos(state[2] + 0.5 * turn), sin(state[2] + 0.5 * turn)
    spread = np.zeros((3, 3))
    spread[0, 0], spread[0, 1], spread[0, 2] = mc * seconds, -ms * seconds, -0.5 * dy * seconds
    spread[1, 0], spread[1, 1], spread[1, 2] = ms * seconds, mc * seconds, 0.5 * dx * seconds
    spread[2, 2] = seconds
    change = np.eye(SIZE)
    change[0, 2], change[1, 2] = -dy, dx
    for i in range(3):
        for j in range(SIZE):
            change[TWIST + i, j] = turning[i, j]
            for k in range(3):
                change[i, j] += spread[i, k] * turning[k, j]
    entry = np.zeros((6, 3))
    for i in range(3):
        entry[TWIST + i, i] = 1.0
        for k in range(3):
            entry[i, k] = spread[i, k]
    moved = _sandwich(change, covariance)
    for i in range(6):
        for j in range(6):
            for k in range(3):
                moved[i, j] += entry[i, k] * added[k] * entry[j, k]
    for i in range(SIZE):
        for j in range(SIZE):
            covariance[i, j] = 0.5 * (moved[i, j] + moved[j, i])
    state[0] += dx
    state[1] += dy
    state[2] = _wrap(state[2] + turn)


@njit(cache=True, nogil=True)
def _sandwich(change: FloatArray, covariance: FloatArray) -> FloatArray:
    """Return F P Fᵀ."""
    n = covariance.shape[0]
    half, whole = np.zeros((n, n)), np.zeros((n, n))
    for i in range(n):
        for k in range(n):
            f = change[i, k]
            if f != 0.0:
                for j in range(n):
                    half[i, j] += f * covariance[k, j]
    for j in range(n):
        for k in range(n):
            f = change[j, k]
            if f != 0.0:
                for i in range(n):
                    whole[i, j] += f * half[i, k]
    return whole


@njit(cache=True, nogil=True)
def update(
    state: FloatArray, covariance: FloatArray, model: FloatArray, innovation: FloatArray,
    deviation: FloatArray, gate: float,
) -> float:  # fmt: skip
    """Update the state with a measurement in place, in Joseph's form; return its distance².

    The distance is Mahalanobis': yᵀ S⁻¹ y of the innovation y and its covariance S. Beyond the gate
    nothing changes.

    Args:
        state: (11,).
        covariance: (11, 11).
        model: (m, 11) derivative of the measurement with respect to the state, m ≤ 3.
        innovation: (m,) measured minus expected.
        deviation: (m, m) covariance of the measurement.
        gate: largest accepted distance (not squared).
    """
    m, n = innovation.size, state.size
    crossed = np.zeros((n, m))
    for i in range(n):
        for j in range(m):
            for k in range(n):
                crossed[i, j] += covariance[i, k] * model[j, k]
    expected = deviation.copy()
    for i in range(m):
        for j in range(m):
            for k in range(n):
                expected[i, j] += model[i, k] * crossed[k, j]
    inverse = _inverse(expected)
    distance = 0.0
    for i in range(m):
        for j in range(m):
            distance += innovation[i] * inverse[i, j] * innovation[j]
    if distance > gate * gate:
        return distance
    gain = np.zeros((n, m))
    for i in range(n):
        for j in range(m):
            for k in range(m):
                gain[i, j] += crossed[i, k] * inverse[k, j]
    rest = np.eye(n)
    for i in range(n):
        for j in range(m):
            state[i] += gain[i, j] * innovation[j]
            for k in range(n):
                rest[i, k] -= gain[i, j] * model[j, k]
    updated = _sandwich(rest, covariance)
    for i in range(n):
        for j in range(n):
            for k in range(m):
                for o in range(m):
                    updated[i, j] += gain[i, k] * deviation[k, o] * gain[j, o]
    for i in range(n):
        for j in range(n):
            covariance[i, j] = 0.5 * (updated[i, j] + updated[j, i])
    state[2] = _wrap(state[2])
    state[KEYFRAME + 2] = _wrap(state[KEYFRAME + 2])
    return distance


@njit(cache=True, nogil=True)
def _inverse(matrix: FloatArray) -> FloatArray:
    """Inverse of a symmetric positive definite (m, m) matrix by Cholesky's decomposition."""
    m = matrix.shape[0]
    lower = np.zeros((m, m))
    for i in range(m):
        for j in range(i + 1):
            total = matrix[i, j]
            for k in range(j):
                total -= lower[i, k] * lower[j, k]
            lower[i, j] = max(total, 1e-300) ** 0.5 if i == j else total / lower[j, j]
    inverse = np.zeros((m, m))
    for column in range(m):
        for i in range(m):
            total = 1.0 if i == column else 0.0
            for k in range(i):
                total -= lower[i, k] * inverse[k, column]
            inverse[i, column] = total / lower[i, i]
        for back in range(m):
            i = m - 1 - back
            total = inverse[i, column]
            for k in range(i + 1, m):
                total -= lower[k, i] * inverse[k, column]
            inverse[i, column] = total / lower[i, i]
    return inverse


@njit(cache=True, nogil=True)
def update_relative(
    state: FloatArray, covariance: FloatArray, measured: FloatArray, deviation: FloatArray,
    gate: float,
) -> float:  # fmt: skip
    """`update` with the base's pose (3,) in the frame of the keyframe."""
    dx, dy = state[0] - state[KEYFRAME], state[1] - state[KEYFRAME + 1]
    c, s = cos(state[KEYFRAME + 2]), sin(state[KEYFRAME + 2])
    x, y = c * dx + s * dy, -s * dx + c * dy
    turn = state[2] - state[KEYFRAME + 2]
    model = np.zeros((3, SIZE))
    model[0, 0], model[0, 1], model[1, 0], model[1, 1] = c, s, -s, c
    model[0, 8], model[0, 9], model[1, 8], model[1, 9] = -c, -s, s, -c
    model[0, 10], model[1, 10] = y, -x
    model[2, 2], model[2, 10] = 1.0, -1.0
    innovation = np.array([measured[0] - x, measured[1] - y, _wrap(measured[2] - turn)])
    return update(state, covariance, model, innovation, deviation, gate)


@njit(cache=True, nogil=True)
def set_keyframe(state: FloatArray, covariance: FloatArray) -> None:
    """Make the current pose the keyframe (stochastic cloning)."""
    for i in range(3):
        state[KEYFRAME + i] = state[i]
        for j in range(KEYFRAME):
            covariance[KEYFRAME + i, j] = covariance[i, j]
            covariance[j, KEYFRAME + i] = covariance[j, i]
    for i in range(3):
        for j in range(3):
            covariance[KEYFRAME + i, KEYFRAME + j] = covariance[i, j]


_VECTOR, _MATRIX = f8[::1], f8[:, ::1]
FUSION = (
    (predict, (_VECTOR, _MATRIX, _VECTOR, f8, i8, _VECTOR)),
    (update, (_VECTOR, _MATRIX, _MATRIX, _VECTOR, _MATRIX, f8)),
    (update_relative, (_VECTOR, _MATRIX, _VECTOR, _MATRIX, f8)),
    (set_keyframe, (_VECTOR, _MATRIX)),
)
"""What the fusion calls, with the types."""

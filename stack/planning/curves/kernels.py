# mypy: allow-untyped-defs
"""Compiled closed forms of the shortest Dubins and Reeds-Shepp curves.

Lengths are in units of the turning radius, coordinates in the frame of the first pose. A curve has
up to five segments, each with a letter (+1 left, 0 straight, -1 right) and a length (negative in
reverse). Unused segments have length 0.
"""

import numpy as np
from numba import b1, f8, i8

from stack.kernel_cache import njit

ZERO = 1e-10
PIECES = 5

# The Reeds-Shepp words up to reflection, time flip and reversal of order.
WORDS = np.array(
    [
        [1, 0, 1, 0, 0],
        [1, 0, -1, 0, 0],
        [1, -1, 1, 0, 0],
        [1, -1, 1, -1, 0],
        [1, -1, 1, -1, 0],
        [1, -1, 0, 1, 0],
        [1, -1, 0, -1, 0],
        [1, -1, 0, 1, -1],
    ]
)
COUNTS = np.array([3, 3, 3, 4, 4, 4, 4, 5])
REVERSIBLE = np.array([False, False, True, False, False, True, True, False])
DUBINS_WORDS = np.array([[1, 0, 1], [1, 0, -1], [1, -1, 1]])


@njit(cache=True, nogil=True)
def _wrap(angle):
    """The angle in [-pi, pi)."""
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


@njit(cache=True, nogil=True)
def _turned(angle):
    """The angle in [0, 2 pi); values within 1e-9 of 2 pi become 0."""
    angle %= 2.0 * np.pi
    return 0.0 if angle > 2.0 * np.pi - 1e-9 else angle


@njit(cache=True, nogil=True)
def _tau_omega(u, v, xi, eta, heading):
    """First and last arc of a word of four arcs (Reeds and Shepp 1990, section 8)."""
    delta = _wrap(u - v)
    a, b = np.sin(u) - np.sin(delta), np.cos(u) - np.cos(delta) - 1.0
    first = np.arctan2(eta * a - xi * b, xi * a + eta * b)
    if 2.0 * (np.cos(delta) - np.cos(v) - np.cos(u)) + 3.0 < 0.0:
        first += np.pi
    tau = _wrap(first)
    return tau, _wrap(tau - u + v - heading)


@njit(cache=True, nogil=True)
def _csc(word, x, y, heading):
    """Arc, straight, arc, all forward; formulas 8.1 and 8.2."""
    if word == 0:
        xi, eta = x - np.sin(heading), y - 1.0 + np.cos(heading)
        t = np.arctan2(eta, xi)
        v = _wrap(heading - t)
        return t >= -ZERO and v >= -ZERO, t, np.hypot(xi, eta), v
    xi, eta = x + np.sin(heading), y - 1.0 - np.cos(heading)
    square = xi * xi + eta * eta
    if square < 4.0:
        return False, 0.0, 0.0, 0.0
    u = np.sqrt(square - 4.0)
    t = _wrap(np.arctan2(eta, xi) + np.arctan2(2.0, u))
    v = _wrap(t - heading)
    return t >= -ZERO and v >= -ZERO, t, u, v


@njit(cache=True, nogil=True)
def _arcs(word, x, y, heading):
    """Words of three and four arcs; formulas 8.3, 8.7 and 8.8."""
    if word == 2:
        xi, eta = x - np.sin(heading), y - 1.0 + np.cos(heading)
        distance = np.hypot(xi, eta)
        if distance > 4.0:
            return False, 0.0, 0.0, 0.0
        u = -2.0 * np.arcsin(0.25 * distance)
        t = _wrap(np.arctan2(eta, xi) + 0.5 * u + np.pi)
        return t >= -ZERO and u <= ZERO, t, u, _wrap(heading - t + u)
    xi, eta = x + np.sin(heading), y - 1.0 - np.cos(heading)
    if word == 3:
        rho = 0.25 * (2.0 + np.hypot(xi, eta))
        if rho > 1.0:
            return False, 0.0, 0.0, 0.0
        u = np.arccos(rho)
        t, v = _tau_omega(u, -u, xi, eta, heading)
        return t >= -ZERO and v <= ZERO, t, u, v
    rho = (20.0 - xi * xi - eta * eta) / 16.0
    if not 0.0 <= rho <= 1.0:
        return False, 0.0, 0.0, 0.0
    u = -np.arccos(rho)
    t, v = _tau_omega(u, u, xi, eta, heading)
    return t >= -ZERO and v >= -ZERO, t, u, v


@njit(cache=True, nogil=True)
def _ccsc(word, x, y, heading):
    """Words with a straight between quarter turns; formulas 8.9, 8.10 and 8.11."""
    xi, eta = x + np.sin(heading), y - 1.0 - np.cos(heading)
    if word == 5:
        xi, eta = x - np.sin(heading), y - 1.0 + np.cos(heading)
    rho = np.hypot(xi, eta)
    if rho < 2.0:
        return False, 0.0, 0.0, 0.0
    if word == 5:
        rest = np.sqrt(rho * rho - 4.0)
        u = 2.0 - rest
        t = _wrap(np.arctan2(eta, xi) + np.arctan2(rest, -2.0))
        v = _wrap(heading - 0.5 * np.pi - t)
        return t >= -ZERO and u <= ZERO and v <= ZERO, t, u, v
    if word == 6:
        t, u = np.arctan2(xi, -eta), 2.0 - rho
        v = _wrap(t + 0.5 * np.pi - heading)
        return t >= -ZERO and u <= ZERO and v <= ZERO, t, u, v
    u = 4.0 - np.sqrt(rho * rho - 4.0)
    t = _wrap(np.arctan2((4.0 - u) * xi - 2.0 * eta, -2.0 * xi + (u - 4.0) * eta))
    v = _wrap(t - heading)
    return u <= ZERO and t >= -ZERO and v >= -ZERO, t, u, v


@njit(cache=True, nogil=True)
def _piece(word, index, t, u, v):
    """Length of one segment of a word with the free lengths t, u and v."""
    last = COUNTS[word] - 1
    if index == 0:
        return t
    if index == last:
        return v
    if word < 3:
        return u
    if word == 3:
        return u if index == 1 else -u
    if word == 4:
        return u
    return u if index == 2 else -0.5 * np.pi


@njit(cache=True, nogil=True)
def reeds_shepp(x, y, heading):
    """Shortest curve with forward and backward segments (Reeds and Shepp 1990).

    Returns:
        (letters (5,), lengths (5,)) of the shortest of the 48 words; see the module docstring.
    """
    best = np.inf
    letters, lengths = np.zeros(PIECES, np.int64), np.zeros(PIECES)
    back_x = x * np.cos(heading) + y * np.sin(heading)
    back_y = x * np.sin(heading) - y * np.cos(heading)
    for word in range(8):
        count = COUNTS[word]
        for variant in range(8 if REVERSIBLE[word] else 4):
            reverse = variant >= 4
            flip = -1.0 if variant & 1 else 1.0
            mirror = -1.0 if variant & 2 else 1.0
            word_x, word_y = (back_x, back_y) if reverse else (x, y)
            word_x, word_y, turn = flip * word_x, mirror * word_y, flip * mirror * heading
            if word < 2:
                valid, t, u, v = _csc(word, word_x, word_y, turn)
            elif word < 5:
                valid, t, u, v = _arcs(word, word_x, word_y, turn)
            else:
                valid, t, u, v = _ccsc(word, word_x, word_y, turn)
            if not valid:
                continue
            total = 0.0
            for index in range(count):
                total += abs(_piece(word, index, t, u, v))
            if total < best - 1e-12:
                best = total
                lengths[:], letters[:] = 0.0, 0
                for index in range(count):
                    slot = count - 1 - index if reverse else index
                    lengths[slot] = flip * _piece(word, index, t, u, v)
                    letters[slot] = int(mirror) * WORDS[word, index]
    return letters, lengths


@njit(cache=True, nogil=True)
def dubins(x, y, heading):
    """Shortest forward curve (Dubins 1957), by the closed forms of Shkel and Lumelsky (2001).

    Returns:
        (letters (5,), lengths (5,)) of the shortest of LSL, LSR, LRL and their mirror images.
    """
    best = np.inf
    letters, lengths = np.zeros(PIECES, np.int64), np.zeros(PIECES)
    distance = np.hypot(x, y)
    for variant in range(6):
        word, mirror = variant // 2, 1 - 2 * (variant % 2)
        alpha = -mirror * np.arctan2(y, x)
        beta = mirror * heading + alpha
        sin_a, cos_a, sin_b, cos_b = np.sin(alpha), np.cos(alpha), np.sin(beta), np.cos(beta)
        square, between = distance * distance, 2.0 * np.cos(alpha - beta)
        if word == 0:
            rest = 2.0 + square - between + 2.0 * distance * (sin_a - sin_b)
            bend = np.arctan2(cos_b - cos_a, distance + sin_a - sin_b)
            t, u, v = _turned(bend - alpha), np.sqrt(max(rest, 0.0)), _turned(beta - bend)
        elif word == 1:
            rest = square - 2.0 + between + 2.0 * distance * (sin_a + sin_b)
            u = np.sqrt(max(rest, 0.0))
            bend = np.arctan2(-cos_a - cos_b, distance + sin_a + sin_b) + np.arctan2(2.0, u)
            t, v = _turned(bend - alpha), _turned(bend - beta)
        else:
            cosine = (6.0 - square + between - 2.0 * distance * (sin_a - sin_b)) / 8.0
            rest = 1.0 - abs(cosine)
            u = 2.0 * np.pi - np.arccos(min(max(cosine, -1.0), 1.0))
            bend = np.arctan2(cos_a - cos_b, distance + sin_a - sin_b)
            t = _turned(0.5 * u - alpha - bend)
            v = _turned(beta - alpha - t + u)
        if rest >= -ZERO and t + u + v < best - 1e-12:
            best = t + u + v
            lengths[0], lengths[1], lengths[2] = t, u, v
            letters[:3] = mirror * DUBINS_WORDS[word]
    return letters, lengths


@njit(cache=True, nogil=True)
def curve(both_ways, x, y, heading):
    """Reeds-Shepp curve if `both_ways`, else Dubins curve; see `reeds_shepp`."""
    if both_ways:
        return reeds_shepp(x, y, heading)
    return dubins(x, y, heading)


@njit(cache=True, nogil=True)
def sample(x, y, heading, letters, lengths, radius, spacing):
    """Poses along a curve from pose (x, y, heading), at most `spacing` metres apart.

    Args:
        x: metres.
        y: metres.
        heading: radians.
        letters: (5,) steering of each segment.
        lengths: (5,) in turning radii.
        radius: turning radius, metres.
        spacing: metres.

    Returns:
        (poses (n, 3) without the first pose, directions (n,) +1 forward or -1 backward).
    """
    count = 0
    for piece in range(PIECES):
        count += int(np.ceil(abs(lengths[piece]) * radius / spacing - 1e-9))
    poses, directions = np.empty((count, 3)), np.empty(count, np.int64)
    at = 0
    for piece in range(PIECES):
        length, letter = lengths[piece] * radius, letters[piece]
        steps = int(np.ceil(abs(length) / spacing - 1e-9))
        for step in range(1, steps + 1):
            driven = length * step / steps
            turn = letter * driven / radius
            chord = driven if letter == 0 else 2.0 * radius * np.sin(0.5 * driven / radius)
            poses[at, 0] = x + chord * np.cos(heading + 0.5 * turn)
            poses[at, 1] = y + chord * np.sin(heading + 0.5 * turn)
            poses[at, 2] = _wrap(heading + turn)
            directions[at] = 1 if length > 0.0 else -1
            at += 1
        if steps > 0:
            x, y, heading = poses[at - 1, 0], poses[at - 1, 1], poses[at - 1, 2]
    return poses, directions


@njit(cache=True, nogil=True)
def distance_table(both_ways, reach, step, bins):
    """Lengths of the shortest curves of radius 1 to the origin from a grid of poses.

    Args:
        both_ways: Reeds-Shepp curves, else Dubins curves.
        reach: grid cells from the origin to each side.
        step: side of a grid cell, in turning radii.
        bins: number of headings; the first one is 0.

    Returns:
        (2 reach + 1, 2 reach + 1, bins) float32 by x, y and heading.
    """
    side = 2 * reach + 1
    table = np.empty((side, side, bins), np.float32)
    for column in range(side):
        for row in range(reach, side):
            for turn in range(bins):
                x, y = (column - reach) * step, (row - reach) * step
                heading = 2.0 * np.pi * turn / bins
                c, s = np.cos(heading), np.sin(heading)
                _, lengths = curve(both_ways, -c * x - s * y, s * x - c * y, -heading)
                total = np.abs(lengths).sum()
                table[column, row, turn] = total
                table[column, side - 1 - row, (bins - turn) % bins] = total
    return table


CURVES = (
    (curve, (b1, f8, f8, f8)),
    (sample, (f8, f8, f8, i8[::1], f8[::1], f8, f8)),
)
"""Entry points, with the types that `CurveShortcut` calls them with."""
DISTANCES = ((distance_table, (b1, i8, f8, i8)),)
"""Entry point, with the types that hybrid A* calls it with."""

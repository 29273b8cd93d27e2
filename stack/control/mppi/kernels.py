"""Compiled loops of MPPI: sampling, motion models, weighted mean.

Arrays are float32 and laid out (steps, batch), so that the inner loops run over neighbouring
rollouts and compile to vector instructions. Positions are in axes parallel to those of the map
frame, with the robot at the origin: float32 then resolves micrometres anywhere on a map.
"""

from __future__ import annotations

from math import cos, exp, hypot, sin, sqrt

import numpy as np
from numba import f4, f8, i8
from numpy.typing import NDArray

from stack.kernel_cache import njit
from stack.types import FloatArray

Array32 = NDArray[np.float32]

ZERO, ONE, HALF = np.float32(0.0), np.float32(1.0), np.float32(0.5)
SIXTH, TWENTY_FOURTH = np.float32(1.0 / 6.0), np.float32(1.0 / 24.0)
ONE_120TH, ONE_720TH = np.float32(1.0 / 120.0), np.float32(1.0 / 720.0)


@njit(cache=True, nogil=True)
def sample(
    plan: Array32, noise: Array32, begins: NDArray[np.int64], scales: Array32, controls: Array32
) -> None:  # fmt: skip
    """Sample controls: the plan plus noise.

    Args:
        plan: (axes, steps) forward, turning and (omni) lateral speeds.
        noise: (axes, steps, n) table of noise, n >= batch.
        begins: (axes,) first column of the table to use, per axis.
        scales: (batch,) factors on the noise.
        controls: (axes, steps, batch), written.
    """
    axes, steps, batch = controls.shape
    for a in range(axes):
        begin = begins[a]
        for t in range(steps):
            mean = plan[a, t]
            for b in range(batch):
                controls[a, t, b] = mean + scales[b] * noise[a, t, begin + b]


@njit(cache=True, nogil=True)
def pursue(
    path: Array32, start: Array32, bounds: Array32, pursuits: FloatArray, first: int,
    controls: Array32,
) -> None:  # fmt: skip
    """Write the controls of pure pursuits of the path (Coulter 1992) into neighbouring columns.

    Args:
        path: (n, 2) points, the robot at the origin.
        start: (5,) as for `roll_out`.
        bounds: (10,) as for `roll_out`.
        pursuits: (k, 2) speed to drive at, m/s, and lookahead distance, metres.
        first: index of the first column in the controls.
        controls: (axes, steps, batch), written.
    """
    for k in range(pursuits.shape[0]):
        speed, lookahead = pursuits[k]
        _pursue(path, start, bounds, speed, lookahead, first + k, controls)


@njit(cache=True, nogil=True)
def _pursue(
    path: Array32, start: Array32, bounds: Array32, speed: float, lookahead: float,
    column: int, controls: Array32,
) -> None:  # fmt: skip
    axes, steps, _ = controls.shape
    step, heading, fastest = float(bounds[8]), float(bounds[9]), float(bounds[2])
    tightest = 1.0 / float(bounds[7]) if bounds[7] > ZERO else 0.0
    brake = 0.5 * float(bounds[5]) / step
    x, y, linear, index, last = 0.0, 0.0, float(start[0]), 0, path.shape[0] - 1
    for t in range(steps):
        while index < last and hypot(path[index, 0] - x, path[index, 1] - y) < lookahead:
            index += 1
        dx, dy = float(path[index, 0]) - x, float(path[index, 1]) - y
        c, s = cos(heading), sin(heading)
        forward, left = c * dx + s * dy, c * dy - s * dx
        distance = hypot(dx, dy)
        curvature = 2.0 * left / max(distance * distance, 1e-4)
        if tightest > 0.0:
            curvature = min(max(curvature, -1.0 / tightest), 1.0 / tightest)
        wanted = speed if forward > 0.0 else 0.0
        if index == last:
            wanted = min(wanted, sqrt(2.0 * brake * distance))
        if curvature != 0.0:
            wanted = min(wanted, fastest / abs(curvature))
        linear += min(max(wanted - linear, -float(bounds[5])), float(bounds[4]))
        angular = min(max(linear * curvature, -fastest), fastest)
        controls[0, t, column], controls[1, t, column] = linear, angular
        if axes == 3:
            controls[2, t, column] = ZERO
        middle = heading + 0.5 * step * angular
        x += step * linear * cos(middle)
        y += step * linear * sin(middle)
        heading += step * angular


@njit(cache=True, nogil=True)
def roll_out(
    controls: Array32, start: Array32, bounds: Array32, velocities: Array32, poses: Array32,
    excess: Array32,
) -> None:  # fmt: skip
    """Simulate all controls with the motion model.

    Args:
        controls: (axes, steps, batch).
        start: (5,) forward, turning and lateral speed; cosine and sine of the heading.
        bounds: (10,) top speeds forward and backward (both positive), turning, lateral; largest
            rise and fall of the speed and change of the turning speed per step; 1 / minimum
            turning radius (0: turns in place); length of a step (s); heading.
        velocities: (axes, steps, batch), written: the speeds within the limits of the drive.
        poses: (5, steps, batch), written: x, y, heading, cosine and sine of the heading.
        excess: (batch,), written: sum over the steps of the controls' excess over the bounds.
    """
    axes, steps, batch = controls.shape
    top, back, fastest, sideways = bounds[0], bounds[1], bounds[2], bounds[3]
    rise, fall, swing = bounds[4], bounds[5], bounds[6]
    inverse_radius, step, heading = bounds[7], bounds[8], bounds[9]
    for b in range(batch):
        excess[b] = ZERO
    linear, angular = np.full(batch, start[0]), np.full(batch, start[1])
    lateral = np.full(batch, start[2])
    x, y = np.zeros(batch, np.float32), np.zeros(batch, np.float32)
    angle, cosine = np.full(batch, heading), np.full(batch, start[3])
    sine = np.full(batch, start[4])
    for t in range(steps):
        for b in range(batch):
            wanted = controls[0, t, b]
            reached = min(max(wanted, -back), top)
            beyond = abs(wanted - reached)
            now = linear[b]
            low = now - (fall if now > ZERO else rise)
            high = now + (rise if now >= ZERO else fall)
            linear[b] = min(max(reached, low), high)
            wanted = controls[1, t, b]
            most = fastest
            if inverse_radius > ZERO:
                most = min(most, abs(linear[b]) * inverse_radius)
            reached = min(max(wanted, -most), most)
            excess[b] += beyond + abs(wanted - reached)
            reached = min(max(reached, angular[b] - swing), angular[b] + swing)
            angular[b] = min(max(reached, -most), most)
        if axes == 3:
            for b in range(batch):
                wanted = controls[2, t, b]
                reached = min(max(wanted, -sideways), sideways)
                excess[b] += abs(wanted - reached)
                now = lateral[b]
                low = now - (fall if now > ZERO else rise)
                high = now + (rise if now >= ZERO else fall)
                lateral[b] = min(max(reached, low), high)
                velocities[2, t, b] = lateral[b]
        for b in range(batch):
            turn = angular[b] * step
            square = turn * turn
            s = turn * (ONE - square * (SIXTH - square * ONE_120TH))
            c = ONE - square * (HALF - square * (TWENTY_FOURTH - square * ONE_720TH))
            old_c, old_s = cosine[b], sine[b]
            new_c = old_c * c - old_s * s
            new_s = old_s * c + old_c * s
            middle_c, middle_s = HALF * (old_c + new_c), HALF * (old_s + new_s)
            x[b] += step * (linear[b] * middle_c - lateral[b] * middle_s)
            y[b] += step * (linear[b] * middle_s + lateral[b] * middle_c)
            angle[b] += turn
            cosine[b], sine[b] = new_c, new_s
            velocities[0, t, b], velocities[1, t, b] = linear[b], angular[b]
            poses[0, t, b], poses[1, t, b], poses[2, t, b] = x[b], y[b], angle[b]
            poses[3, t, b], poses[4, t, b] = new_c, new_s


@njit(cache=True, nogil=True)
def weighted_mean(controls: Array32, costs: Array32, temperature: float, plan: Array32) -> None:
    """Set the plan to the mean of the controls, weighted by exp(-cost / temperature).

    Args:
        controls: (axes, steps, batch).
        costs: (batch,).
        temperature: above 0.
        plan: (axes, steps), written.
    """
    axes, steps, batch = controls.shape
    least = costs.min()
    chosen, weights, total, count = np.empty(batch, np.int64), np.empty(batch, np.float32), 0.0, 0
    for b in range(batch):
        weight = exp(-float(costs[b] - least) / temperature)
        if weight > 1e-6:
            chosen[count], weights[count] = b, weight
            total += weight
            count += 1
    for a in range(axes):
        for t in range(steps):
            mean = 0.0
            for i in range(count):
                mean += float(weights[i]) * float(controls[a, t, chosen[i]])
            plan[a, t] = mean / total


ROLLOUTS = (
    (pursue, (f4[:, ::1], f4[::1], f4[::1], f8[:, ::1], i8, f4[:, :, ::1])),
    (roll_out, (f4[:, :, ::1], f4[::1], f4[::1], f4[:, :, ::1], f4[:, :, ::1], f4[::1])),
    (sample, (f4[:, ::1], f4[:, :, ::1], i8[::1], f4[::1], f4[:, :, ::1])),
    (weighted_mean, (f4[:, :, ::1], f4[::1], f8, f4[:, ::1])),
)
"""Entry points, with the types that the optimiser calls them with."""

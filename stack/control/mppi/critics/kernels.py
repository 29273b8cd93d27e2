"""Compiled loops of the critics. Arrays have the layout of the motion model's kernels."""

from __future__ import annotations

import numpy as np
from numba import f4, f8, i4, i8, u1
from numpy.typing import NDArray

from stack.kernel_cache import njit

Array32 = NDArray[np.float32]

ZERO, ONE, HALF = np.float32(0.0), np.float32(1.0), np.float32(0.5)
PI, TURN, PER_TURN = np.float32(np.pi), np.float32(2.0 * np.pi), np.float32(0.5 / np.pi)
FAR = np.float32(1e9)
HIGHEST_PASSABLE, LETHAL = 252, 254


@njit(cache=True, nogil=True)
def _narrow(
    clearances: Array32, chosen: NDArray[np.int32], distance: Array32, disc: Array32,
    geometry: Array32, xs: Array32, ys: Array32, cosines: Array32, sines: Array32,
) -> None:  # fmt: skip
    """Lower the clearances (n,) of chosen rollouts to that of one disc of the footprint.

    Bilinear interpolation of the distance field between cell centres; FAR off the grid. Without
    branches it is vectorised.
    """
    rows, columns = distance.shape
    left, bottom, per_metre = geometry[0], geometry[1], geometry[2]
    field, width = distance.ravel(), np.int32(columns)
    last_column, last_row = np.float32(columns - 1), np.float32(rows - 1)
    for n in range(clearances.size):
        b = chosen[n]
        x, y, c, s = xs[b], ys[b], cosines[b], sines[b]
        u = (x + c * disc[0] - s * disc[1] - left) * per_metre - HALF
        v = (y + s * disc[0] + c * disc[1] - bottom) * per_metre - HALF
        inside = (u >= ZERO) & (u < last_column) & (v >= ZERO) & (v < last_row)
        u, v = u if inside else ZERO, v if inside else ZERO
        row, column = np.int32(v), np.int32(u)
        du, dv = u - np.float32(column), v - np.float32(row)
        place = row * width + column
        below, above = field[place], field[place + width]
        low = below + du * (field[place + 1] - below)
        high = above + du * (field[place + width + 1] - above)
        away = low + dv * (high - low) if inside else FAR
        clearances[n] = min(clearances[n], away - disc[2])


@njit(cache=True, nogil=True)
def _touches(
    lethal: NDArray[np.int32], column: float, row: float, cosine: float, sine: float,
    outline: Array32,
) -> bool:  # fmt: skip
    """Whether any point of an outline lies in a lethal cell.

    Checks all points: without branches the loop compiles to vector instructions.

    Args:
        lethal: (rows + 2, columns + 2) 1 or 0, with a free border.
        column: of the base, cells from the left edge of the grid, float32.
        row: cells from the bottom edge, float32.
        cosine: of the heading, in cells per metre, float32.
        sine: of the heading, in cells per metre, float32.
        outline: (2, m) x and y of the points, base frame, metres.
    """
    width, right, top = np.int32(lethal.shape[1]), lethal.shape[1] - 1, lethal.shape[0] - 1
    last_column, last_row = np.float32(right), np.float32(top)
    flat, xs, ys = lethal.ravel(), outline[0], outline[1]
    x, y = column + ONE, row + ONE
    touched = np.int32(0)
    for i in range(xs.size):
        px = min(max(x + cosine * xs[i] - sine * ys[i], ZERO), last_column)
        py = min(max(y + sine * xs[i] + cosine * ys[i], ZERO), last_row)
        touched += flat[np.int32(py) * width + np.int32(px)]
    return bool(touched > 0)


@njit(cache=True, nogil=True)
def _reach(discs: Array32) -> np.float32:
    """Radius of the circle about the base that contains discs (k, 3)."""
    reach = ZERO
    for i in range(discs.shape[0]):
        offset = np.sqrt(discs[i, 0] * discs[i, 0] + discs[i, 1] * discs[i, 1])
        reach = max(reach, np.float32(offset) + discs[i, 2])
    return reach


@njit(cache=True, nogil=True)
def near_obstacles(
    poses: Array32, cells: NDArray[np.uint8], distance: Array32,
    lethal: NDArray[np.int32], geometry: Array32,
    discs: Array32, core: Array32, outline: Array32, stride: int, margins: Array32,
    cost: Array32, repulsion: Array32, hits: NDArray[np.int64],
) -> None:  # fmt: skip
    """Compute the costs under the base, the clearance and the first collision of rollouts.

    Discs that cover the footprint give a lower bound of the clearance. Only when it is too small
    the outline is checked point by point.

    Args:
        poses: (5, steps, batch) x, y, heading, cosine, sine.
        cells: (rows, columns) costs, Nav2's values; off the grid is free.
        distance: (rows, columns) metres from a cell's centre to that of the nearest lethal cell.
        lethal: (rows + 2, columns + 2) 1 where the distance is 0, with a free border.
        geometry: (4,) x and y of the grid's outer corner, cells per metre, metres per cell.
        discs: (k, 3) x, y, radius in the base frame; together they cover the footprint.
        core: (l, 3) x, y, radius of discs inside it: they find cells that a fast edge has skipped.
        outline: (2, m) points along the footprint's edge, base frame.
        stride: number of steps between two checks of the outline.
        margins: (3,) desired clearance, critical clearance, ratio of the critical weight to the
            normal one.
        cost: (batch,), written: mean cost in 0..1 up to the end or a collision.
        repulsion: (batch,), written: mean violation of the margins.
        hits: (batch,), written: step of the first collision; the number of steps: none.
    """
    _, steps, batch = poses.shape
    rows, columns = cells.shape
    left, bottom, per_metre, resolution = geometry[0], geometry[1], geometry[2], geometry[3]
    wanted, critical, ratio = margins[0], margins[1], margins[2]
    doubt = np.float32(0.5) * resolution
    diagonal = np.float32(1.4143) * resolution
    far = _reach(discs) + max(wanted, doubt) + diagonal
    share = ONE / np.float32(HIGHEST_PASSABLE)
    by_value = np.zeros(256, np.float32)
    for value in range(LETHAL + 1):
        by_value[value] = share * np.float32(min(value, HIGHEST_PASSABLE))
    all_cells, all_distances, nowhere = cells.ravel(), distance.ravel(), np.int32(cells.size)
    # of each cell, and of none: its price, and whether a rollout above it is near an obstacle
    prices, is_near = np.zeros(nowhere + 1, np.float32), np.zeros(nowhere + 1, np.uint8)
    for number in range(cells.size):
        prices[number] = by_value[all_cells[number]]
        is_near[number] = all_distances[number] <= far
    width, below = np.int32(columns), np.empty(batch, np.int32)
    near, clearances = np.empty(batch + 1, np.int32), np.empty(batch, np.float32)
    for b in range(batch):
        cost[b], repulsion[b], hits[b] = ZERO, ZERO, steps
    for t in range(steps):
        xs, ys = poses[0, t], poses[1, t]
        for b in range(batch):  # the cell below each rollout; without branches it is vectorised
            across, along = (xs[b] - left) * per_metre, (ys[b] - bottom) * per_metre
            inside = (across >= ZERO) & (across < columns) & (along >= ZERO) & (along < rows)
            inside &= hits[b] == steps
            below[b] = np.int32(along) * width + np.int32(across) if inside else nowhere
        count = 0
        for b in range(batch):
            cell = below[b]
            cost[b] += prices[cell]
            near[count] = b
            count += is_near[cell]
        clearances[:count] = FAR
        for i in range(discs.shape[0]):
            _narrow(
                clearances[:count], near, distance, discs[i], geometry,
                xs, ys, poses[3, t], poses[4, t],
            )  # fmt: skip
        for n in range(count):
            b, clearance = near[n], clearances[n] - HALF * resolution
            x, y, c, s = xs[b], ys[b], poses[3, t, b], poses[4, t, b]
            if clearance < wanted:
                repulsion[b] += wanted - max(clearance, ZERO)
                if clearance < critical:
                    repulsion[b] += ratio * (critical - max(clearance, -critical))
            if clearance < doubt and t % stride == stride - 1:
                touched = False
                for i in range(core.shape[0]):
                    px = (x + c * core[i, 0] - s * core[i, 1] - left) * per_metre
                    py = (y + s * core[i, 0] + c * core[i, 1] - bottom) * per_metre
                    if ZERO <= px < columns and ZERO <= py < rows:
                        touched |= distance[int(py), int(px)] < core[i, 2]
                if not touched:
                    touched = _touches(
                        lethal, (x - left) * per_metre, (y - bottom) * per_metre,
                        c * per_metre, s * per_metre, outline,
                    )  # fmt: skip
                if touched:
                    hits[b] = t
    per_step = ONE / np.float32(steps)
    for b in range(batch):
        cost[b] *= per_step
        repulsion[b] *= per_step


@njit(cache=True, nogil=True)
def near_moving(
    poses: Array32, moving: Array32, discs: Array32, margin: float, step: float,
    closeness: Array32, hits: NDArray[np.int64],
) -> None:  # fmt: skip
    """Compute the clearance of rollouts to objects at constant velocity, and the first contact.

    Args:
        poses: (5, steps, batch) x, y, heading, cosine, sine.
        moving: (k, 5) x, y, velocity along both axes, radius; relative to the robot.
        discs: (l, 3) x, y, radius in the base frame; together they cover the footprint.
        margin: desired clearance, metres.
        step: length of a step, seconds.
        closeness: (batch,), written: mean violation of the margin, metres.
        hits: (batch,), updated: step of the first collision; the number of steps: none.
    """
    _, steps, batch = poses.shape
    wanted, seconds, reach = np.float32(margin), np.float32(step), _reach(discs)
    for b in range(batch):
        closeness[b] = ZERO
    for k in range(moving.shape[0]):
        radius = moving[k, 4]
        far = reach + radius + wanted
        square = far * far
        for t in range(steps):
            time = seconds * np.float32(t + 1)
            x, y = moving[k, 0] + time * moving[k, 2], moving[k, 1] + time * moving[k, 3]
            xs, ys, near = poses[0, t], poses[1, t], np.int32(0)
            for b in range(batch):  # most objects are far from all rollouts: vectorised
                dx, dy = x - xs[b], y - ys[b]
                near += np.int32(dx * dx + dy * dy <= square)
            if near == 0:
                continue
            for b in range(batch):
                dx, dy = x - xs[b], y - ys[b]
                if dx * dx + dy * dy > square or hits[b] <= t:
                    continue
                c, s = poses[3, t, b], poses[4, t, b]
                ahead, left = c * dx + s * dy, c * dy - s * dx
                clearance = FAR
                for i in range(discs.shape[0]):
                    u, v = ahead - discs[i, 0], left - discs[i, 1]
                    clearance = min(clearance, np.sqrt(u * u + v * v) - discs[i, 2])
                clearance -= radius
                if clearance < wanted:
                    closeness[b] += wanted - max(clearance, ZERO)
                if clearance < ZERO:
                    hits[b] = t
    per_step = ONE / np.float32(steps)
    for b in range(batch):
        closeness[b] *= per_step


@njit(cache=True, nogil=True)
def add(costs: Array32, term: Array32, weight: float, power: int) -> None:
    """Add (weight × term) ** power to the costs of the rollouts, both (batch,)."""
    factor = np.float32(weight)
    for b in range(costs.shape[0]):
        value = factor * term[b]
        product = value
        for _ in range(1, power):
            product *= value
        costs[b] += product


@njit(cache=True, nogil=True)
def noise_cost(controls: Array32, plan: Array32, pull: Array32, term: Array32) -> None:
    """Sum over axes and steps of pull × (control - plan) (Williams et al. 2018, eq. 33).

    Args:
        controls: (axes, steps, batch).
        plan: (axes, steps).
        pull: (axes, steps) the plan times the inverse covariance of the noise.
        term: (batch,), written.
    """
    axes, steps, batch = controls.shape
    for b in range(batch):
        term[b] = ZERO
    for a in range(axes):
        for t in range(steps):
            mean, factor = plan[a, t], pull[a, t]
            for b in range(batch):
                term[b] += factor * (controls[a, t, b] - mean)


@njit(cache=True, nogil=True)
def mean_distance(poses: Array32, x: float, y: float, term: Array32) -> None:
    """Write the mean distance to a point over the steps, metres, to term (batch,)."""
    _, steps, batch = poses.shape
    goal_x, goal_y, share = np.float32(x), np.float32(y), ONE / np.float32(steps)
    for b in range(batch):
        term[b] = ZERO
    for t in range(steps):
        for b in range(batch):
            dx, dy = poses[0, t, b] - goal_x, poses[1, t, b] - goal_y
            term[b] += np.sqrt(dx * dx + dy * dy) * share


@njit(cache=True, nogil=True)
def mean_turn(poses: Array32, heading: float, term: Array32) -> None:
    """Write the mean angle to a heading over the steps, radians, to term (batch,)."""
    _, steps, batch = poses.shape
    goal, share = np.float32(heading), ONE / np.float32(steps)
    for b in range(batch):
        term[b] = ZERO
    for t in range(steps):
        for b in range(batch):
            angle = poses[2, t, b] - goal
            angle -= TURN * np.floor((angle + PI) * PER_TURN)
            term[b] += abs(angle) * share


@njit(cache=True, nogil=True)
def furthest_reached(poses: Array32, hits: NDArray[np.int64], path: Array32) -> int:
    """Highest path index nearest to the end of a rollout, of collision-free rollouts if any.

    Args:
        poses: (5, steps, batch).
        hits: (batch,) step of the first collision; the number of steps: none.
        path: (n, 2) points.
    """
    _, steps, batch = poses.shape
    best, nearest = np.full(batch, FAR), np.zeros(batch, np.int32)
    xs, ys = poses[0, steps - 1], poses[1, steps - 1]
    for i in range(path.shape[0]):
        px, py, index = path[i, 0], path[i, 1], np.int32(i)
        for b in range(batch):  # without branches it is vectorised
            dx, dy = xs[b] - px, ys[b] - py
            square = dx * dx + dy * dy
            nearest[b] = index if square < best[b] else nearest[b]
            best[b] = min(square, best[b])
    clear, furthest = -1, 0
    for b in range(batch):
        furthest = max(furthest, nearest[b])
        if hits[b] == steps:
            clear = max(clear, nearest[b])
    return clear if clear >= 0 else furthest


@njit(cache=True, nogil=True)
def path_alignment(
    poses: Array32, velocities: Array32, path: Array32, spacing: float, step: float, last: int,
    stride: int, term: Array32,
) -> None:  # fmt: skip
    """Mean distance between a rollout and the path at equal length driven.

    Args:
        poses: (5, steps, batch).
        velocities: (axes, steps, batch).
        path: (n, 2) points, evenly spaced, beginning at the robot.
        spacing: metres between them.
        step: length of a step, seconds.
        last: index of the last path point to compare.
        stride: number of steps between two comparisons.
        term: (batch,), written, metres.
    """
    axes, steps, batch = velocities.shape
    length = np.zeros(batch, np.float32)
    scale = np.float32(step / spacing)
    count, end = ZERO, np.int32(last)
    path_x, path_y = path[:, 0].copy(), path[:, 1].copy()
    for b in range(batch):
        term[b] = ZERO
    for t in range(steps):
        if axes == 3:
            for b in range(batch):
                forward, sideways = velocities[0, t, b], velocities[2, t, b]
                length[b] += np.sqrt(forward * forward + sideways * sideways) * scale
        else:
            for b in range(batch):
                length[b] += abs(velocities[0, t, b]) * scale
        if t % stride != stride - 1:
            continue
        count += ONE
        xs, ys = poses[0, t], poses[1, t]
        for b in range(batch):  # 32 bits: this way it is vectorised
            index = min(np.int32(length[b] + HALF), end)
            dx, dy = xs[b] - path_x[index], ys[b] - path_y[index]
            term[b] += np.sqrt(dx * dx + dy * dy)
    for b in range(batch):
        term[b] /= max(count, ONE)


@njit(cache=True, nogil=True)
def end_bearing(poses: Array32, x: float, y: float, term: Array32) -> None:
    """Write the angle from a rollout's final heading to a point, radians, to term (batch,)."""
    _, steps, batch = poses.shape
    px, py = np.float32(x), np.float32(y)
    for b in range(batch):
        dx, dy = px - poses[0, steps - 1, b], py - poses[1, steps - 1, b]
        c, s = poses[3, steps - 1, b], poses[4, steps - 1, b]
        term[b] = abs(np.arctan2(c * dy - s * dx, c * dx + s * dy))


CRITICS = (
    (add, (f4[::1], f4[::1], f8, i8)),
    (end_bearing, (f4[:, :, ::1], f8, f8, f4[::1])),
    (furthest_reached, (f4[:, :, ::1], i8[::1], f4[:, ::1])),
    (mean_distance, (f4[:, :, ::1], f8, f8, f4[::1])),
    (mean_turn, (f4[:, :, ::1], f8, f4[::1])),
    (near_moving, (f4[:, :, ::1], f4[:, ::1], f4[:, ::1], f8, f8, f4[::1], i8[::1])),
    (
        near_obstacles,
        (
            f4[:, :, ::1], u1[:, ::1], f4[:, ::1], i4[:, ::1], f4[::1], f4[:, ::1], f4[:, ::1],
            f4[:, ::1], i8, f4[::1], f4[::1], f4[::1], i8[::1],
        ),
    ),
    (noise_cost, (f4[:, :, ::1], f4[:, ::1], f4[:, ::1], f4[::1])),
    (path_alignment, (f4[:, :, ::1], f4[:, :, ::1], f4[:, ::1], f8, f8, i8, i8, f4[::1])),
)  # fmt: skip
"""Entry points, with the types that the critics call them with."""

"""Worlds with moving cylinders that do not yield.

After A. Nair, F. Jiang, K. Hou, Z. Xu, S. Li, X. Xiao and P. Stone, "DynaBARN: Benchmarking Metric
Ground Navigation in Dynamic Environments", SSRR 2022, whose obstacles follow polynomials. The
figures here are this project's own: a walled field of 20 x 20 m with cylinders of 0.5 m radius at
0.7 to 1.7 m/s. One half moves on straight lines and bounces off the field's edges, one half on
cubic curves; both go back and forth without end. The first world has 10 cylinders, the last 20.
Cylinders pass through each other and keep away from start and goal.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.random import Generator

from missions.bench.layout import Layout
from stack.streams import stream
from stack.types import FloatArray, Pose2D

WORLDS = 20
FEWEST, MOST = 10, 20
LENGTH, WIDTH = 20.0, 20.0
RADIUS = 0.5
SLOWEST, FASTEST = 0.7, 1.7
START, GOAL = Pose2D(1.2, WIDTH / 2), Pose2D(LENGTH - 1.2, WIDTH / 2)

LOWEST, HIGHEST = np.array([3.2, 0.6]), np.array([LENGTH - 3.2, WIDTH - 0.6])
"""Corners of the rectangle that contains the centres of the cylinders, metres."""

SEGMENTS = 6
"""Straight segments of a bouncing path."""

SAMPLES = 24
"""Points on a curve."""

SHORTEST = 5.0
"""Smallest length of a path, metres."""


def dyna_layout(number: int) -> Layout:
    """Return the layout of a world, counted from 0."""
    random = stream(number, "dyna world")
    count = FEWEST + round((MOST - FEWEST) * (number % WORLDS) / (WORLDS - 1))
    layout = Layout(START, GOAL)
    layout.walls.append(([(0.0, 0.0), (LENGTH, 0.0), (LENGTH, WIDTH), (0.0, WIDTH)], True))
    layout.walkers += [_walker(n, random) for n in range(count)]
    return layout


def dyna_text(number: int) -> str:
    """Return the file of a world, counted from 0."""
    layout = dyna_layout(number)
    doc = f"A field with {len(layout.walkers)} moving cylinders that do not yield."
    return layout.text(f"dyna {number}", doc)


def _walker(number: int, random: Generator) -> dict[str, Any]:
    path = _bouncing(random) if number % 2 else _curve(random)
    while np.linalg.norm(np.diff(path, axis=0), axis=1).sum() < SHORTEST:
        path = _bouncing(random) if number % 2 else _curve(random)
    loop = np.vstack([path, path[-2:0:-1]])
    return {
        "name": f"cylinder {number}",
        "waypoints": np.round(loop, 3).tolist(),
        "speed": round(random.uniform(SLOWEST, FASTEST), 3),
        "radius": RADIUS,
        "start": round(random.uniform(0.0, 0.99), 3),
        "yields": False,
    }


def _bouncing(random: Generator) -> FloatArray:
    """Return the corners (SEGMENTS + 1, 2) of a line that bounces off the edges, metres."""
    corner = random.uniform(LOWEST, HIGHEST)
    angle = random.uniform(-np.pi, np.pi)
    direction = np.array([np.cos(angle), np.sin(angle)])
    corners = [corner]
    for _ in range(SEGMENTS):
        edge = np.where(direction > 0.0, HIGHEST, LOWEST)
        lengths = (edge - corner) / direction
        axis = int(np.argmin(lengths))
        corner = np.clip(corner + lengths[axis] * direction, LOWEST, HIGHEST)
        direction = direction * np.where(np.arange(2) == axis, -1.0, 1.0)
        corners.append(corner)
    return np.array(corners)


def _curve(random: Generator) -> FloatArray:
    """Return points (SAMPLES, 2), metres, on a cubic Bézier curve; it stays in its points' hull."""
    control = random.uniform(LOWEST, HIGHEST, (4, 2))
    t = np.linspace(0.0, 1.0, SAMPLES)[:, None]
    weights = np.hstack([(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3])
    curve: FloatArray = weights @ control
    return curve

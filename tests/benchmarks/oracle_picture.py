"""Picture of what the oracle found: earliest arrivals, and the bodies at the end."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil
from pathlib import Path

import numpy as np

from missions.bench.picture import BODY, GOAL
from stack.types import Pose2D
from tests.benchmarks.oracle import Verdict
from tests.benchmarks.pages import write_page

OBSTACLE, UNREACHED = (70, 60, 50), (225, 225, 225)
"""Colours: blue, green, red."""

SMALLEST = 600
"""Pixels of the longer side, at least."""


def sentence(verdict: Verdict) -> str:
    """Return the verdict in words."""
    if verdict.possible:
        return f"possible: arrival after {verdict.time:.1f} s at the earliest"
    return f"impossible: found in {verdict.ended:.1f} s of the run's time"


def draw_verdict(path: Path, verdict: Verdict, goals: Sequence[Pose2D]) -> None:
    """Write the picture of a verdict as PNG; early arrivals are blue, late ones red.

    Args:
        path: file to write.
        verdict: with the arrivals.
        goals: world frame.
    """
    import cv2

    ground, came = verdict.ground, np.isfinite(verdict.arrival)
    share = np.where(came, verdict.arrival, 0.0) / max(verdict.ended, 1e-9)
    pixels = cv2.applyColorMap((share * 255.0).astype(np.uint8), cv2.COLORMAP_JET)
    pixels[~came] = UNREACHED
    pixels[~ground.free] = OBSTACLE
    zoom = ceil(SMALLEST / max(came.shape))
    pixels = np.kron(pixels[::-1], np.ones((zoom, zoom, 1), np.uint8))
    scale = zoom / ground.resolution

    def at(x: float, y: float) -> tuple[int, int]:
        """Return the pixel at a point, metres."""
        across, up = (x - ground.origin[0]) * scale, (y - ground.origin[1]) * scale
        return round(across), pixels.shape[0] - round(up)

    for x, y, radius in verdict.bodies.tolist():
        cv2.circle(pixels, at(x, y), round(radius * scale), BODY, 2, cv2.LINE_AA)
    for goal in goals:
        cv2.circle(pixels, at(goal.x, goal.y), round(0.2 * scale), GOAL, 2, cv2.LINE_AA)
    write_page(path, pixels, [sentence(verdict)])

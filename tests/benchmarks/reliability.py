"""Reliability diagram of the health."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from stack.types import FloatArray
from tests.benchmarks.pages import write_page

RIGHT, MEAN, TEXT = (200, 110, 30), (40, 40, 220), (30, 30, 30)
"""Colours in OpenCV's order: blue, green, red."""


def draw_reliability(path: Path, bins: FloatArray, error: float) -> None:
    """Write the reliability diagram: share of right poses over the health, with the diagonal.

    Args:
        path: file to write, PNG.
        bins: (n, 3): samples, sum of the health, right samples.
        error: expected calibration error.
    """
    import cv2

    side, margin = 480, 40
    pixels = np.full((side + 2 * margin, side + 2 * margin, 3), 255, np.uint8)

    def at(x: float, y: float) -> tuple[int, int]:
        return margin + round(x * side), margin + side - round(y * side)

    cv2.rectangle(pixels, at(0, 0), at(1, 1), TEXT, 1)
    cv2.line(pixels, at(0, 0), at(1, 1), (190, 190, 190), 1, cv2.LINE_AA)
    total = max(1.0, float(bins[:, 0].sum()))
    for number, (count, health, right) in enumerate(bins.tolist()):
        if not count:
            continue
        low, high = number / len(bins), (number + 1) / len(bins)
        cv2.rectangle(pixels, at(low, 0), at(high, right / count), (225, 200, 170), -1)
        cv2.rectangle(pixels, at(low, 0), at(high, right / count), RIGHT, 1)
        cv2.circle(pixels, at(health / count, right / count), 4, MEAN, -1, cv2.LINE_AA)
        share = f"{count / total:.1%}"
        cv2.putText(pixels, share, (at(low, 0)[0] + 2, at(0, 0)[1] + 15),
                    cv2.FONT_HERSHEY_SIMPLEX, 0.32, TEXT, 1, cv2.LINE_AA)  # fmt: skip
    caption = [
        "Share of right poses (0.3 m, 10 degrees) over the health",
        f"{total:.0f} samples, expected calibration error {error:.3f}; below: share of samples",
    ]
    write_page(path, pixels, caption)

"""Pictures with a caption above them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from textwrap import wrap
from typing import Any

import numpy as np

SMALLEST = 480
"""Width of a picture in pixels, at least."""

LINE, LETTER = 20, 8
"""Height of a line and width of a letter of the caption, pixels."""


def write_page(path: Path, pixels: Any, caption: Sequence[str]) -> None:
    """Write pixels (height, width, 3) with lines of text above them as PNG."""
    import cv2

    width = max(SMALLEST, pixels.shape[1])
    lines = [part for line in caption for part in wrap(line, width // LETTER - 2)]
    height = LINE * len(lines) + LINE // 2
    page = np.full((height + pixels.shape[0], width, 3), 255, np.uint8)
    page[height:, : pixels.shape[1]] = pixels
    for n, line in enumerate(lines, start=1):
        place = (LETTER, LINE * n)
        cv2.putText(page, line, place, cv2.FONT_HERSHEY_SIMPLEX, 0.45, (0, 0, 0), 1, cv2.LINE_AA)
    done, png = cv2.imencode(".png", page)
    if done:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(png.tobytes())

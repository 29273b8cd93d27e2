"""`treepilot show --svg`: the tree, laid out by Graphviz where it is installed."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

from missions.inspection.check import drawing
from stack.errors import InputError

PATIENCE = 60.0
"""Wall seconds; a tree of a thousand nodes takes about one."""


def svg(mission: str) -> str:
    """The compiled tree of a mission as an SVG drawing.

    Raises:
        InputError: the mission is wrong, or Graphviz is missing or fails.
    """
    dot = shutil.which("dot")
    if dot is None:
        raise InputError(
            "drawing as SVG needs Graphviz' `dot` (apt install graphviz, brew install graphviz); "
            "without it there are `show`, `show --mermaid` and `show --dot`"
        )
    graph = drawing(mission, "dot", colours=False)
    try:
        done = subprocess.run(
            [dot, "-Tsvg"], input=graph, capture_output=True, text=True, check=False,
            timeout=PATIENCE, encoding="utf-8",
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        raise InputError(f"{dot} has not drawn the tree within {PATIENCE:g} s") from None
    if done.returncode != 0 or "<svg" not in done.stdout:
        raise InputError(f"{dot} could not draw the tree: {done.stderr.strip()}")
    return done.stdout


def save_svg(mission: str, file: str) -> None:
    """Draw the tree of a mission into a file.

    Raises:
        InputError: as `svg` does, or the file cannot be written.
    """
    text = svg(mission)
    try:
        Path(file).write_text(text, "utf-8")
    except OSError as error:
        raise InputError(f"{file} cannot be written: {error.strerror}") from None

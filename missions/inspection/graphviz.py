"""`treepilot show --svg`: the tree of a mission as an SVG drawing, by Graphviz."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Mapping
from pathlib import Path

from missions.inspection.check import drawing
from stack.errors import InputError

LAYOUT_TIMEOUT = 60.0
"""Wall seconds; the layout of a thousand nodes takes about one second."""


def svg(mission: str, arguments: Mapping[str, str] | None = None) -> str:
    """Return the compiled tree of a mission as an SVG drawing.

    Raises:
        InputError: the mission has errors, or Graphviz is missing or fails.
    """
    dot = shutil.which("dot")
    if dot is None:
        raise InputError(
            "--svg needs `dot` of Graphviz (apt install graphviz, brew install graphviz); "
            "`show`, `show --mermaid` and `show --dot` do not need it"
        )
    graph = drawing(mission, "dot", colours=False, arguments=arguments)
    try:
        done = subprocess.run(
            [dot, "-Tsvg"], input=graph, capture_output=True, text=True, check=False,
            timeout=LAYOUT_TIMEOUT, encoding="utf-8",
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        raise InputError(f"{dot} did not draw the tree within {LAYOUT_TIMEOUT:g} s") from None
    if done.returncode != 0 or "<svg" not in done.stdout:
        raise InputError(f"{dot} could not draw the tree: {done.stderr.strip()}")
    return done.stdout


def save_svg(mission: str, file: str, arguments: Mapping[str, str] | None = None) -> None:
    """Write the tree of a mission as SVG to a file.

    Raises:
        InputError: see `svg`; or the file cannot be written.
    """
    text = svg(mission, arguments)
    try:
        Path(file).write_text(text, "utf-8")
    except OSError as error:
        raise InputError(f"{file} cannot be written: {error.strerror}") from None

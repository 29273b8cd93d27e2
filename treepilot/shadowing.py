"""Finds a user's file or folder that hides one of treepilot's packages from Python's import."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

PACKAGES = ("missions", "behaviours", "stack", "tui", "robots")
"""The top-level packages of treepilot."""


def refuse_shadows() -> None:
    """Check that each package is the one beside this file.

    Raises:
        ImportError: another file is found first; the message names it.
    """
    root = Path(__file__).resolve().parents[1]
    for name in PACKAGES:
        spec = find_spec(name)
        found = [] if spec is None else [*(spec.submodule_search_locations or ()), spec.origin]
        place = Path(next(filter(None, found), root / name))
        if place.resolve() != root / name:
            raise ImportError(
                f"{place} hides treepilot's package `{name}`: rename it, or take {place.parent}"
                " out of Python's path (it is the folder of the script, or in PYTHONPATH)"
            )

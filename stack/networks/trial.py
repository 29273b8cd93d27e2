"""Trial of a model in a process of its own: OpenCV can crash on a damaged file.

Of 300 copies of a model with one to three flipped bits, 8 crashed OpenCV's importer and 133 were
refused with a reason. A mission is therefore checked by a child process that loads the model and
runs it once. `tried` starts a module as that child, which calls `answer`.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Iterable
from functools import lru_cache
from pathlib import Path
from typing import Any

from stack.child_process import run_module
from stack.errors import InputError

LONGEST = 120.0
"""Wall seconds after which a trial is given up."""


def tried(module: str, settings: dict[str, Any], files: Iterable[str]) -> Any:
    """Return what a module says of a model. Unchanged files are tried once.

    Args:
        module: calls `answer` when it is run.
        settings: of the model, which JSON can hold.
        files: the model, then others that it uses; "" for none.

    Raises:
        InputError: the model cannot be used, does not end, or crashes.
    """
    named = tuple(name for name in files if name)
    found, problem = _tried(module, json.dumps(settings), named[0], tuple(map(_version, named)))
    if problem:
        raise InputError(problem)
    return found


def answer(load: Callable[[dict[str, Any]], object]) -> None:
    """Print what a model says of itself, or why it cannot be used, for the process that asks."""
    try:
        found = load(json.loads(sys.argv[1])), ""
    except InputError as error:
        found = None, str(error)
    print(json.dumps(found))


@lru_cache(maxsize=32)
def _tried(module: str, settings: str, model: str, _: tuple[object, ...]) -> tuple[Any, str]:
    """Return the answer of a module in a process of its own, or why the model cannot be used."""
    try:
        child = run_module(module, settings, longest=LONGEST)
    except subprocess.TimeoutExpired:
        return None, f"{model} does not load and run once within {LONGEST:g} s"
    try:
        found, problem = json.loads(child.stdout.decode("utf-8").splitlines()[-1])
    except (ValueError, IndexError):
        return None, (
            f"{model} crashes OpenCV (exit code {child.returncode}): the file is "
            "damaged, or uses what OpenCV does not support; export the model again"
        )
    return found, problem


def _version(file: str) -> tuple[int, int] | None:
    """Return what changes when a file is written; None if it cannot be read."""
    try:
        status = Path(file).stat()
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size

"""PyBullet, imported without its build banner."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


def load() -> Any:
    """Import and return the pybullet module.

    Its C code prints a banner on import, which would corrupt a machine-readable stdout. An
    ImportError is still raised as an exception.
    """
    if "pybullet" in sys.modules:
        return sys.modules["pybullet"]
    null = os.open(os.devnull, os.O_WRONLY)
    try:
        with _redirected(1, null), _redirected(2, null):
            import pybullet
    finally:
        os.close(null)
    return pybullet


@contextmanager
def stdout_as_stderr() -> Iterator[None]:
    """Redirect stdout to stderr for C code, within the context."""
    with _redirected(1, 2):
        yield


@contextmanager
def _redirected(descriptor: int, target: int) -> Iterator[None]:
    """Redirect one file descriptor to another for C code; flushes libc's buffers."""
    libc = ctypes.CDLL(None)
    libc.fflush(None)
    try:
        saved = os.dup(descriptor)
        os.dup2(target, descriptor)
    except OSError:  # the descriptor is closed: nothing to redirect
        yield
        return
    try:
        yield
    finally:
        libc.fflush(None)
        os.dup2(saved, descriptor)
        os.close(saved)

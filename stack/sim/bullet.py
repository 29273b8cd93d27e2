"""PyBullet, imported without its build banner."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


def load() -> Any:
    """The pybullet module.

    Its C code prints a banner as it is imported; a program with a machine-readable stdout and
    a quiet stderr cannot have that. An ImportError still comes through as an exception.
    """
    if "pybullet" in sys.modules:
        return sys.modules["pybullet"]
    with _silent(1), _silent(2):
        import pybullet
    return pybullet


@contextmanager
def _silent(descriptor: int) -> Iterator[None]:
    """Send what C code writes to a file descriptor nowhere, its buffers included."""
    libc = ctypes.CDLL(None)
    libc.fflush(None)
    try:
        saved = os.dup(descriptor)
    except OSError:  # closed: nothing to keep clean
        yield
        return
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, descriptor)
    os.close(nowhere)
    try:
        yield
    finally:
        libc.fflush(None)
        os.dup2(saved, descriptor)
        os.close(saved)

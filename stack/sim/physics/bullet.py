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
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        with _redirected(1, nowhere), _redirected(2, nowhere):
            import pybullet
    finally:
        os.close(nowhere)
    return pybullet


@contextmanager
def stdout_as_stderr() -> Iterator[None]:
    """Let C code that prints to stdout print to stderr for a while."""
    with _redirected(1, 2):
        yield


@contextmanager
def _redirected(descriptor: int, target: int) -> Iterator[None]:
    """Send what C code writes to one file descriptor to another, its buffers included."""
    libc = ctypes.CDLL(None)
    libc.fflush(None)
    try:
        saved = os.dup(descriptor)
        os.dup2(target, descriptor)
    except OSError:  # closed: nothing to keep clean
        yield
        return
    try:
        yield
    finally:
        libc.fflush(None)
        os.dup2(saved, descriptor)
        os.close(saved)

"""Real-time privileges of the fast loop: what it asks for, what it got, and how to get the rest."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable
from dataclasses import dataclass

PRIORITY = 60
"""Of SCHED_FIFO: above interrupt threads (50) of a kernel with PREEMPT_RT, so that a busy network
card does not delay it."""

_LOCK_NOW, _LOCK_LATER = 1, 2

_LIMITS = "/etc/security/limits.d/treepilot.conf"


@dataclass(frozen=True, slots=True)
class Privilege:
    """One privilege.

    Attributes:
        name: `priority`, `memory` or `processor`.
        problem: why it was not granted; empty if it was.
        remedy: the command that grants it; empty if none does.
    """

    name: str
    problem: str = ""
    remedy: str = ""


def acquire() -> list[Privilege]:
    """Ask for all privileges for this process; return what came of each."""
    return [
        _asked("memory", _lock_memory, "memlock unlimited"),
        _asked("processor", _bind, ""),
        _asked("priority", _raise_priority, f"rtprio {PRIORITY}"),
    ]


def _asked(name: str, ask: Callable[[], None], limit: str) -> Privilege:
    try:
        ask()
    except OSError as error:
        line = f'echo "$USER - {limit}" | sudo tee -a {_LIMITS}; then log in again'
        return Privilege(name, f"{error.strerror or error}", line if limit else "")
    return Privilege(name)


def _lock_memory() -> None:
    """No page of this process is ever swapped out or read again from a file."""
    library = ctypes.CDLL(None, use_errno=True)
    if library.mlockall(_LOCK_NOW | _LOCK_LATER):
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number))


def _bind() -> None:
    """Stay on the last processor: it keeps its caches, and interrupts favour the first."""
    allowed = sorted(os.sched_getaffinity(0))
    if len(allowed) < 2:
        raise OSError(0, "this process may use one processor only")
    os.sched_setaffinity(0, allowed[-1:])


def _raise_priority() -> None:
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))

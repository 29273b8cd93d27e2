"""Freshness of numba's cache: machine code is outdated when a function in it has changed.

Numba compiles the functions that a kernel calls, and the numbers that its module imports, into the
kernel's machine code, but compares the kernel's own file only. The locators here add what is
imported. Each module of kernels imports `njit` from here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from hashlib import sha256
from typing import Any

from numba import config, njit
from numba.core import caching
from numba.core.dispatcher import Dispatcher


class _Stamped:
    """A locator whose stamp also covers what the function's module has imported."""

    def __init__(self, py_func: Callable[..., Any], py_file: str) -> None:
        super().__init__(py_func, py_file)  # type: ignore[call-arg]
        self._globals = py_func.__globals__

    def get_source_stamp(self) -> bytes:
        """Return the digest of the file, and of the kernels and numbers that it imports."""
        own: bytes = super().get_source_stamp()  # type: ignore[misc]
        return sha256(repr((own, _imported(self._globals))).encode()).digest()


class UserProvided(_Stamped, caching.UserProvidedCacheLocator):
    """Cache in NUMBA_CACHE_DIR."""


class InTree(_Stamped, caching.InTreeCacheLocator):
    """Cache beside the source."""


class UserWide(_Stamped, caching.UserWideCacheLocator):
    """Cache in the user's folder, for an installation that cannot be written."""


def _imported(names: Mapping[str, Any]) -> list[tuple[str, object]]:
    """Return the globals of a module that numba compiles into its kernels, in order.

    A kernel of another module stands for its stamp, which covers what that module imports.
    """
    found: list[tuple[str, object]] = []
    for name, value in sorted(names.items()):
        if isinstance(value, Dispatcher) and value.__module__ != names["__name__"]:
            found.append((name, _stamp_of(value)))
        elif _is_number(value):
            found.append((name, value))
    return found


def _stamp_of(kernel: Any) -> bytes:
    if isinstance(kernel._cache, caching.FunctionCache):
        stamp: bytes = kernel._cache._cache_file._source_stamp
        return stamp
    code: bytes = kernel.py_func.__code__.co_code  # without a cache it has no file's stamp
    return code


def _is_number(value: object) -> bool:
    if isinstance(value, tuple):
        return all(_is_number(part) for part in value)
    return isinstance(value, int | float)


# The last two are numba's own, for functions that have no file. An environment variable would reach
# other programs, which have no such classes.
OWN = (UserProvided, InTree, UserWide)
config.CACHE_LOCATOR_CLASSES = ",".join(  # type: ignore[attr-defined]
    [*(f"{__name__}.{own.__name__}" for own in OWN), "IPythonCacheLocator", "ZipCacheLocator"]
)

__all__ = ["njit"]

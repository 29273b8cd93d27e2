"""Compilation of kernels before the first step, so that no step of the loop waits for one.

Numba compiles a function when it is first called with new argument types, which takes seconds, and
keeps the machine code in a cache on disk. What a run will call is declared: each part has a class
method `kernels`, and each module with compiled loops lists its entry points with the types that the
stack calls them with (always C-contiguous and writable arrays, unless listed otherwise).
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from typing import Any

KernelTypes = tuple[tuple[Any, tuple[Any, ...]], ...]
"""Numba functions, each with the numba types of its arguments."""


def missing(kernels: Iterable[tuple[Any, tuple[Any, ...]]]) -> KernelTypes:
    """Return the kernels whose machine code is neither loaded nor in numba's cache.

    Loading it takes some 30 ms per kernel, too long for those that a run may never call. Numba has
    no public function that only looks: this reads the index of its cache, as `compile` does.
    """
    return tuple((kernel, types) for kernel, types in kernels if not _is_compiled(kernel, types))


def _is_compiled(kernel: Any, types: tuple[Any, ...]) -> bool:
    from numba.core.dispatcher import Dispatcher

    has_cache = isinstance(kernel, Dispatcher)  # a Python function with NUMBA_DISABLE_JIT
    if not has_cache or types in kernel.overloads:
        return True
    key = kernel._cache._index_key(types, kernel.targetctx.codegen())
    return key in _first_index(kernel) or key in _index(kernel)


def _index(kernel: Any) -> frozenset[Any]:
    """Keys of the machine code of a kernel in numba's cache."""
    return frozenset(kernel._cache._cache_file._load_index())


@cache
def _first_index(kernel: Any) -> frozenset[Any]:
    """The index when it was first read: that takes 0.5 ms, and each run asks for 60 kernels."""
    return _index(kernel)


def compile_kernel(kernel: Any, types: tuple[Any, ...]) -> None:
    """Compile a kernel for these argument types, or load it from numba's cache."""
    kernel.compile(types)

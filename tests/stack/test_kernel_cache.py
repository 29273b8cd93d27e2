"""Machine code in numba's cache is used until a function or a number that it contains changes."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CALLEE = """\
from stack.kernel_cache import njit
from {package}.numbers import FACTOR

@njit(cache=True)
def scaled(x):
    return {expression}
"""
MIDDLE = """\
from stack.kernel_cache import njit
from {package}.callee import scaled

@njit(cache=True)
def twice(x):
    return scaled(x) + scaled(x)
"""
CALLER = """\
from stack.kernel_cache import njit
from {package}.middle import twice

@njit(cache=True)
def called(x):
    return twice(x) + 1.0
"""
CALL = """\
import {first}
import {second}
from {package}.caller import called
print(called(3.0), sum(called.stats.cache_hits.values()))
"""


def write(folder: Path, expression: str, factor: float) -> None:
    package = folder / "loops"
    package.mkdir(exist_ok=True)
    for name, text in {
        "__init__": "", "numbers": f"FACTOR = {factor}\n", "middle": MIDDLE, "caller": CALLER,
        "callee": CALLEE,
    }.items():  # fmt: skip
        content = text.replace("{package}", "loops").replace("{expression}", expression)
        (package / f"{name}.py").write_text(content)


def call(folder: Path, first: str = "stack", second: str = "numba") -> tuple[float, int]:
    """Return the result in a new process, and how much of it came from the cache."""
    script = CALL.format(first=first, second=second, package="loops")
    found = subprocess.run(
        [sys.executable, "-B", "-c", script], cwd=folder, capture_output=True, text=True,
        check=True, timeout=120, env={"PYTHONPATH": f"{ROOT}:{folder}", "HOME": str(folder)},
    )  # fmt: skip
    result, hits = found.stdout.split()
    return float(result), int(hits)


@pytest.mark.slow
@pytest.mark.parametrize("order", [("stack", "numba"), ("numba", "stack")])
def test_a_kernel_is_compiled_again_when_what_it_contains_has_changed(tmp_path, order):
    write(tmp_path, "x", 2.0)
    assert call(tmp_path, *order) == (7.0, 0)
    assert call(tmp_path, *order) == (7.0, 1)
    write(tmp_path, "FACTOR * x", 2.0)  # the callee of a callee in another module
    assert call(tmp_path, *order) == (13.0, 0)
    write(tmp_path, "FACTOR * x", 4.0)  # a number that it imports
    assert call(tmp_path, *order) == (25.0, 0)
    assert call(tmp_path, *order) == (25.0, 1)

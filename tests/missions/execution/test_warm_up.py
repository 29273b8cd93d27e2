"""Kernels are compiled before the first step: all that the run calls, announced, and only once."""

from __future__ import annotations

import os
import re
import sys
import tempfile
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from numba import f8
from numba.core.dispatcher import Dispatcher

import missions
from missions.execution import warm_up
from missions.execution.prepare import RunOptions, prepare
from missions.execution.supervision.supervisor import OutputCopier
from missions.execution.warm_up import kernels_of
from stack.compilation import compile_kernel, missing
from stack.components import Component
from tests.missions.execution.test_engine import until

ROOT = Path(__file__).parents[3]
BEFORE_A_RUN = {ROOT / "stack/sim/sdf/kernels.py", ROOT / "stack/mapping/kernels.py"}
"""Kernels that read worlds and draw `doctor`'s passages: no robot moves while they compile."""
MODULES = sorted(
    {file for top in ("stack", "missions") for file in (ROOT / top).rglob("kernels.py")}
    - BEFORE_A_RUN
)

SHORT_DRIVE = """\
mission: warm
robot: scout
world: small_room
navigation:
  planner: {planner}
  controller: {controller}
run:
  navigate_to_pose: {{goal: [2.4, 1.4, 90 deg]}}
  timeout: 20 s
"""
PEOPLE = """\
world: people
format: 1
start: [1, 1, 0]
walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4]], closed: true}]
people: [{name: Bo, model: social_force, waypoints: [[5, 3], [1, 3]]}]
"""
UNKNOWN_START = """\
mission: warm
robot: scout
world: office
initial_pose: unknown
run: {relocalise: {}, timeout: 1 s}
"""
CASES = {
    "pure_pursuit, astar": SHORT_DRIVE.format(planner="astar", controller="pure_pursuit"),
    "mppi, hybrid_astar": SHORT_DRIVE.format(planner="hybrid_astar", controller="mppi"),
    "dwb, lattice": SHORT_DRIVE.format(planner="lattice", controller="dwb"),
    "graceful, theta_star": SHORT_DRIVE.format(planner="theta_star", controller="graceful"),
    "unknown start": UNKNOWN_START,
    "blind behind": SHORT_DRIVE.format(planner="astar", controller="pure_pursuit").replace(
        "scout", "jackal"
    ),
    "people": "mission: warm\nrobot: scout\nworld: ./people.yaml\nrun: {wait: 1 s}\n",
}


def modules() -> list[ModuleType]:
    names = [".".join(file.relative_to(ROOT).with_suffix("").parts) for file in MODULES]
    return [import_module(name) for name in names]


def entry_points(module: ModuleType) -> dict[str, Dispatcher]:
    """The kernels of a module."""
    return {
        name: thing
        for name, thing in vars(module).items()
        if isinstance(thing, Dispatcher) and thing.py_func.__module__ == module.__name__
    }


def signatures() -> set[tuple[Any, ...]]:
    """Every kernel of the project with the types for which its code is loaded."""
    return {
        (module.__name__, name, types)
        for module in modules()
        for name, kernel in entry_points(module).items()
        for types in kernel.signatures
    }


@pytest.mark.parametrize("case", CASES)
def test_a_run_needs_no_kernel_that_was_not_compiled_before_its_first_step(case, tmp_path):
    file = tmp_path / "warm.yaml"
    file.write_text(CASES[case], "utf-8")
    (tmp_path / "people.yaml").write_text(PEOPLE, "utf-8")
    for module in modules():  # other tests of this process have loaded some
        for kernel in entry_points(module).values():
            kernel._reset_overloads()
    for kernels in kernels_of(prepare(file, RunOptions())).values():
        for kernel, types in kernels:
            compile_kernel(kernel, types)
    before = signatures()
    missions.run(file, seed=1)
    assert signatures() - before == set()


@pytest.mark.parametrize("file", MODULES, ids=lambda file: str(file.parent.relative_to(ROOT)))
def test_each_kernel_that_is_called_from_python_is_listed_with_its_types(file):
    module = import_module(".".join(file.relative_to(ROOT).with_suffix("").parts))
    tables = [table for table in vars(module).values() if isinstance(table, tuple)]
    listed = {entry[0].py_func.__name__ for table in tables for entry in table if is_entry(entry)}
    users = [user for user in file.parent.rglob("*.py") if user.name != "kernels.py"]
    named = re.findall(r"kernels\.(\w+)", "".join(user.read_text("utf-8") for user in users))
    assert listed
    assert set(named) & set(entry_points(module)) <= listed


def is_entry(thing: object) -> bool:
    return isinstance(thing, tuple) and len(thing) == 2 and isinstance(thing[0], Dispatcher)


@pytest.fixture
def kernel(tmp_path, monkeypatch):
    """A kernel in a file of its own, not compiled yet."""
    source = tmp_path / "own_kernels.py"
    source.write_text(
        "from numba import f8, njit\n\n@njit(cache=True)\ndef half(x):\n    return 0.5 * x\n\n"
        "HALF = ((half, (f8,)),)\n", "utf-8",
    )  # fmt: skip
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    yield import_module("own_kernels").HALF
    del sys.modules["own_kernels"]


def test_a_kernel_is_missing_until_it_is_compiled_and_then_in_no_other_process(kernel):
    assert missing(kernel) == kernel
    compile_kernel(*kernel[0])
    assert missing(kernel) == ()
    kernel[0][0]._reset_overloads()  # what another process has loaded: nothing
    assert missing(kernel) == ()
    assert kernel[0][0].signatures == []  # looking did not load it


def test_a_kernel_without_jit_is_a_python_function_and_never_missing():
    def half(x: float) -> float:
        return 0.5 * x

    assert missing(((half, (f8,)),)) == ()


def test_the_announcement_counts_the_kernels_of_each_part_once(monkeypatch):
    plan, compiled, lines = prepare("01_drive_to_a_point", RunOptions()), [], []
    monkeypatch.setattr(warm_up, "missing", tuple)
    monkeypatch.setattr(warm_up, "compile_kernel", lambda *call: compiled.append(call))
    warm_up.warm_up(plan, RunOptions(), lines.append)
    total = len(compiled)
    assert total == len(set(compiled)) > 0
    # 1.5 s for each, as warm_up assumes
    assert (
        lines[0] == f"compiling {total} kernels, for the first run only (about {1.5 * total:.0f} s)"
    )
    parts = dict(line.split(": ") for line in lines[1:-1])
    assert list(parts) == [
        "  sensors", "  costmap", "  perception", "  safety", "  navigation", "  planner",
        "  controller", "  localisation",
    ]  # fmt: skip
    assert sum(map(int, parts.values())) == total
    assert all(count != "0" for count in parts.values())
    assert re.fullmatch(rf"compiled {total} kernels in \d+ s", lines[-1])


def test_nothing_is_shown_when_every_kernel_is_in_the_cache(monkeypatch):
    lines = []
    monkeypatch.setattr(warm_up, "missing", lambda kernels: ())
    warm_up.warm_up(prepare("01_drive_to_a_point", RunOptions()), RunOptions(), lines.append)
    assert lines == []


def test_a_signal_ends_the_warm_up_after_the_current_kernel(monkeypatch):
    compiled = []
    monkeypatch.setattr(warm_up, "missing", tuple)
    monkeypatch.setattr(warm_up, "compile_kernel", lambda *call: compiled.append(call))
    plan = prepare("01_drive_to_a_point", RunOptions())
    warm_up.warm_up(plan, RunOptions(), lambda line: None, lambda: len(compiled) == 2)
    assert len(compiled) == 2


def test_a_component_of_a_plugin_compiles_nothing_unless_it_says_so():
    assert Component.kernels(None, prepare("01_drive_to_a_point", RunOptions()).robot) == ()


def test_the_lines_of_the_engine_are_shown_before_its_dashboard_opens(capfd):
    with tempfile.TemporaryFile() as output:
        copier = OutputCopier(output, show=True)
        copier.start()
        os.write(output.fileno(), b"compiling 2 kernels (about 3 s)\n")
        until(lambda: copier.shown == 32)
        copier.hide()
        os.write(output.fileno(), b"behind the dashboard\n")
        copier.show()
        os.write(output.fileno(), b"after it\n")
        copier.finish()
    assert capfd.readouterr().err == "compiling 2 kernels (about 3 s)\nafter it\n"

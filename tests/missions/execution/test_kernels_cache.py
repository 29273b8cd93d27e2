"""Who is told that kernels are being compiled: only who has to wait for it."""

from importlib.machinery import ModuleSpec

import pytest

from missions.execution import kernels_cache
from missions.execution.kernels_cache import NOTICE, first_run_notice
from stack.control.mppi.controller import Mppi
from stack.control.pure_pursuit import PurePursuit


@pytest.fixture
def stack_folder(tmp_path, monkeypatch):
    """An installed copy with two rooms' kernels compiled, and those of one component not."""
    root = tmp_path / "stack"
    for place, compiled in (("safety", True), ("control", True), ("control/mppi", False)):
        folder = root / place
        (folder / "__pycache__").mkdir(parents=True)
        (folder / "kernels.py").touch()
        if compiled:
            (folder / "__pycache__" / "kernels.sweep-1.py311.nbi").touch()
    spec = ModuleSpec("stack", None, is_package=True)
    spec.submodule_search_locations = [str(root)]
    monkeypatch.setattr(kernels_cache, "find_spec", lambda _: spec)
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    return root


def test_kernels_of_a_component_count_only_where_it_is_chosen(stack_folder):
    assert first_run_notice([PurePursuit]) == ""
    assert first_run_notice([PurePursuit, Mppi]) == NOTICE


def test_kernels_of_a_room_count_always(stack_folder):
    (stack_folder / "safety" / "__pycache__" / "kernels.sweep-1.py311.nbi").unlink()
    assert first_run_notice() == NOTICE

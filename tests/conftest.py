"""What holds for all tests."""

from __future__ import annotations

import gc
import os
import sys
from functools import cache
from pathlib import Path
from typing import Any

import pytest

SWITCH, FOLDER = "PYTHONDONTWRITEBYTECODE", "PYTHONPYCACHEPREFIX"


def keep_bytecode() -> None:
    """Where bytecode is switched off, keep it beside pytest's cache, out of the sources.

    Each of the processes that tests start would compile treepilot again (0.2 s), and each process
    of pytest would rewrite the assertions of all tests (9 s).
    """
    if os.environ.pop(SWITCH, ""):
        folder = Path(__file__).parents[1] / ".pytest_cache" / "bytecode"
        os.environ[FOLDER] = sys.pycache_prefix = str(folder)
        sys.dont_write_bytecode = False


keep_bytecode()  # before tests are imported, and before pytest-xdist starts its processes


@cache
def shares_fixtures(file: Path) -> bool:
    """Return whether the tests of a file share a fixture."""
    return 'scope="module"' in file.read_text("utf-8")


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Let one process run all tests of a file that share a fixture, for `--dist loadgroup`.

    The others go to any process, one by one; each process would make the fixture for its share of
    them. pytest-xdist's own groups, marks, do nothing with pytest 9.2 (pytest-xdist#1386).
    """
    if config.getvalue("dist") != "loadgroup":
        return None
    from xdist.scheduler import LoadScopeScheduling

    class Scheduler(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            file = nodeid.partition("::")[0]
            return file if shares_fixtures(config.rootpath / file) else nodeid

    return Scheduler(config, log)


def pytest_collection_finish() -> None:
    """Leave the collected tests out of garbage collection: they live until the end.

    Some 6000 test items and their modules would be searched again and again; without them the
    tests need about 8 % less processor time. They make few cycles, so searches are also rarer.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(50_000, 20, 20)

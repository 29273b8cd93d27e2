"""What holds for all tests."""

from __future__ import annotations

import gc
import os
import signal
import sys
from collections import Counter
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

settings.register_profile("same", derandomize=True)
settings.load_profile("same")
"""Property tests take the same examples in each run; new ones: --hypothesis-profile default."""

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


def heed_interrupts() -> None:
    """Let SIGINT end the programs that tests start.

    What a shell script starts in the background ignores it, and so would they.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


heed_interrupts()
keep_bytecode()  # before tests are imported, and before pytest-xdist starts its processes


SLOW = "pytest.mark.slow"

CHUNK = 25
"""Tests of a quick file that one process gets at a time."""

MANY = 1000
"""Tests of a run that is worth a compilation of kernels in advance."""


@cache
def text_of(file: Path) -> str:
    """Return the source of tests."""
    return file.read_text("utf-8")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put the files with slow tests first, so that the last tests of a run are quick ones."""
    items.sort(key=lambda item: SLOW not in text_of(item.path))  # keeps the order of a file


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Hand out whole files, for `--dist loadgroup`.

    One process runs all tests of a file that share a fixture; each would make the fixture for its
    share of them. Slow tests go to any process, one by one, the others in chunks of a file: one by
    one, 7400 tests need 14 s more processor time, most of it in the scheduler.
    pytest-xdist's own groups, marks, do nothing with pytest 9.2 (pytest-xdist#1386).
    """
    if config.getvalue("dist") != "loadgroup":
        return None
    from xdist.scheduler import LoadScopeScheduling

    class Scheduler(LoadScopeScheduling):
        def __init__(self, config: pytest.Config, log: Any) -> None:
            super().__init__(config, log)
            self.scopes: dict[str, str] = {}
            self.sizes: Counter[str] = Counter()

        def _split_scope(self, nodeid: str) -> str:
            if nodeid not in self.scopes:
                file = nodeid.partition("::")[0]
                text = text_of(config.rootpath / file)
                chunk = 1 if SLOW in text else CHUNK
                shared = 'scope="module"' in text
                self.scopes[nodeid] = file if shared else f"{file}::{self.sizes[file] // chunk}"
                self.sizes[file] += 1
            return self.scopes[nodeid]

    config.option.loadscopereorder = False  # as collected
    return Scheduler(config, log)


def pytest_collection_finish(session: pytest.Session) -> None:
    """Leave the collected tests out of garbage collection: they live until the end.

    Some 6000 test items and their modules would be searched again and again; without them the
    tests need about 8 % less processor time. They make few cycles, so searches are also rarer.
    """
    worker, count = (os.environ.get(f"PYTEST_XDIST_WORKER{end}", "") for end in ("", "_COUNT"))
    if worker and len(session.items) >= MANY:
        compile_share(int(worker.removeprefix("gw")), int(count))
    gc.collect()
    gc.freeze()
    gc.set_threshold(50_000, 20, 20)


def compile_share(number: int, count: int) -> None:
    """Compile one of `count` shares of the kernels that most missions call, if not in the cache.

    In a new checkout all processes would begin with a mission and compile the same kernels.
    """
    from missions.execution.prepare import RunOptions, prepare
    from missions.execution.warm_up import kernels_of
    from stack.compilation import compile_kernel, missing

    parts = kernels_of(prepare("02_office_patrol", RunOptions())).values()
    kernels = tuple(dict.fromkeys(kernel for part in parts for kernel in part))
    for kernel, types in missing(kernels[number::count]):
        compile_kernel(kernel, types)

"""Says, once per installed copy, that the numeric kernels are being compiled."""

from __future__ import annotations

import os
from collections.abc import Iterable
from importlib.util import find_spec
from pathlib import Path

NOTICE = "compiling numeric kernels for this machine: once, about half a minute"


def first_run_notice(components: Iterable[type] = ()) -> str:
    """The notice when kernels that a run needs have no compiled code cached yet, else nothing.

    Args:
        components: the planner, the controller… chosen. Kernels that lie deeper than a room
            (stack/<room>/kernels.py) belong to one component and load with it alone.
    """
    spec = find_spec("stack")
    if spec is None or spec.submodule_search_locations is None:
        return ""
    root = Path(next(iter(spec.submodule_search_locations)))
    folders = [root.parent.joinpath(*cls.__module__.split(".")).parent for cls in components]
    own = [folder for folder in folders if folder.parent != root]
    needed = [
        module
        for module in sorted(root.rglob("kernels.py"))
        if module.parent.parent == root or any(module.is_relative_to(folder) for folder in own)
    ]
    elsewhere = os.environ.get("NUMBA_CACHE_DIR")
    missing = [
        module
        for module in needed
        if not elsewhere and not any((module.parent / "__pycache__").glob("kernels.*.nbi"))
    ]
    return NOTICE if missing or (elsewhere and not Path(elsewhere).is_dir()) else ""

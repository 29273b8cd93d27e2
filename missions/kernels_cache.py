"""Says, once per installed copy, that the numeric kernels are being compiled."""

from __future__ import annotations

import os
from importlib.util import find_spec
from pathlib import Path

NOTICE = "compiling numeric kernels for this machine: once, about half a minute"


def first_run_notice() -> str:
    """The notice when some kernel module has no compiled code cached yet, else an empty text."""
    spec = find_spec("stack")
    if spec is None or spec.submodule_search_locations is None:
        return ""
    root = Path(next(iter(spec.submodule_search_locations)))
    modules = sorted(root.rglob("kernels.py"))
    elsewhere = os.environ.get("NUMBA_CACHE_DIR")
    missing = [
        module
        for module in modules
        if not elsewhere and not any((module.parent / "__pycache__").glob("kernels.*.nbi"))
    ]
    return NOTICE if missing or (elsewhere and not Path(elsewhere).is_dir()) else ""

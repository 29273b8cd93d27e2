"""Notice that the numeric kernels will be compiled, once per installed copy."""

from __future__ import annotations

import os
from collections.abc import Iterable
from importlib.util import find_spec
from pathlib import Path

NOTICE = "compiling numeric kernels for this machine (only once, takes about 30 s)"


def first_run_notice(components: Iterable[type] = ()) -> str:
    """Return the notice if a kernel of the run has no compiled code in the cache, else "".

    Args:
        components: classes of the chosen components. Kernels deeper than
            stack/<package>/kernels.py belong to one component and load only with it.
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
    cache_folder = os.environ.get("NUMBA_CACHE_DIR")
    missing = [
        module
        for module in needed
        if not cache_folder and not any((module.parent / "__pycache__").glob("kernels.*.nbi"))
    ]
    return NOTICE if missing or (cache_folder and not Path(cache_folder).is_dir()) else ""

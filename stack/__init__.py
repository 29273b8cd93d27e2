"""The navigation stack: how a robot moves; independent of missions and dashboards."""

import os
import sys

# The last two are numba's own, for functions that have no file.
os.environ.setdefault(
    "NUMBA_CACHE_LOCATOR_CLASSES",
    "stack.kernel_cache.UserProvided,stack.kernel_cache.InTree,stack.kernel_cache.UserWide,"
    "IPythonCacheLocator,ZipCacheLocator",
)
if "numba" in sys.modules:  # loaded before: it has read its environment
    sys.modules["numba"].config.reload_config()

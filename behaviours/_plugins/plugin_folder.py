"""Imports the files of a plugin folder as modules, without changing sys.path.

Each folder becomes a package named after its path. Its files can import each other
(`from ._shelf import Shelf`), and two folders can contain files with the same name.
"""

from __future__ import annotations

import importlib
import sys
import traceback
from collections.abc import Callable
from contextlib import chdir, redirect_stdout, suppress
from functools import partial
from hashlib import sha256
from importlib.machinery import ModuleSpec
from importlib.util import cache_from_source, module_from_spec
from pathlib import Path
from types import ModuleType

OUR_CODE = Path(__file__).parents[1]
"""The package of the built-in behaviours; errors in plugins are reported with lines of plugins."""


def is_path(plugin: str) -> bool:
    """Return whether a plugin is written as a path, not as a dotted module."""
    return plugin.startswith((".", "~")) or "/" in plugin or plugin.endswith(".py")


def path_of(plugin: str, folder: Path | None) -> Path:
    """Return the path of a plugin; a relative one begins in the folder, default: the current."""
    return (folder or Path()) / Path(plugin).expanduser()


def _plugin_files(path: Path) -> list[Path]:
    """Return the files that may define behaviours, sorted; tests and private files excluded."""
    if path.is_file():
        return [path]
    return [
        file
        for file in sorted(path.glob("*.py"))
        if not file.name.startswith(("_", "test_")) and file.name != "conftest.py"
    ]


def loads(path: Path) -> dict[Path, Callable[[], ModuleType]]:
    """Return a function for each file of a plugin, which imports it, as the file is now.

    The functions raise what the file raises.

    Args:
        path: folder or file; one that does not exist has no files.
    """
    if not path.exists():
        return {}
    folder = path if path.is_dir() else path.parent
    package = f"treepilot_plugin_{sha256(str(folder.resolve()).encode()).hexdigest()[:12]}"
    for name in [n for n in sys.modules if n.partition(".")[0] == package]:
        del sys.modules[name]
    spec = ModuleSpec(package, None, is_package=True)
    spec.submodule_search_locations = [str(folder.resolve())]
    sys.modules[package] = module_from_spec(spec)
    for file in folder.glob("*.py"):
        with suppress(OSError):  # bytecode has the second and the size of its source only
            Path(cache_from_source(str(file))).unlink()
    importlib.invalidate_caches()
    return {file: partial(_load, f"{package}.{file.stem}") for file in _plugin_files(path)}


def _load(name: str) -> ModuleType:
    with chdir("."):  # the file cannot change the working directory: relative paths are read later
        return import_quietly(name)


def import_quietly(name: str) -> ModuleType:
    """Import a module of a plugin; what it prints goes to stderr, away from a command's output.

    Raises:
        Exception: any exception that the module raises.
    """
    with redirect_stdout(sys.stderr):
        return importlib.import_module(name)


def sentence_for(error: BaseException) -> str:
    """Describe an exception in a plugin: line and message, without a traceback."""
    if isinstance(error, SyntaxError):
        return f"line {error.lineno}: {error.msg}"
    frames = traceback.extract_tb(error.__traceback__)
    own = [
        frame.lineno
        for frame in frames
        if not frame.filename.startswith("<")
        and "importlib" not in frame.filename
        and not Path(frame.filename).is_relative_to(OUR_CODE)
    ]
    line = f"line {own[-1]}: " if own else ""
    if isinstance(error.__cause__, TypeError):  # Python 3.11 wraps what __set_name__ raises
        error = error.__cause__
    if isinstance(error, ImportError):
        return f"{line}cannot import: {error}"
    return f"{line}{type(error).__name__}: {error}"

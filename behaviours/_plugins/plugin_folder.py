"""Imports the files of a plugin folder as modules, without changing sys.path.

Each folder becomes a package named after its path. Its files can import each other
(`from ._shelf import Shelf`), and two folders can contain files with the same name.
"""

from __future__ import annotations

import importlib
import sys
import traceback
from contextlib import chdir, redirect_stdout, suppress
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


def plugin_files(path: Path) -> list[Path]:
    """Return the files that may define behaviours, sorted; tests and private files excluded."""
    if path.is_file():
        return [path]
    return [
        file
        for file in sorted(path.glob("*.py"))
        if not file.name.startswith(("_", "test_")) and file.name != "conftest.py"
    ]


class FolderLoader:
    """Imports the files of one folder; a new loader imports them again."""

    def __init__(self, folder: Path) -> None:
        digest = sha256(str(folder.resolve()).encode()).hexdigest()[:12]
        self._package = f"treepilot_plugin_{digest}"
        for name in [n for n in sys.modules if n.partition(".")[0] == self._package]:
            del sys.modules[name]
        spec = ModuleSpec(self._package, None, is_package=True)
        spec.submodule_search_locations = [str(folder.resolve())]
        sys.modules[self._package] = module_from_spec(spec)
        for file in folder.glob("*.py"):
            with suppress(OSError):  # bytecode has the second and the size of its source only
                Path(cache_from_source(str(file))).unlink()
        importlib.invalidate_caches()

    def load(self, file: Path) -> ModuleType:
        """Import a file of the folder; it cannot change the working directory.

        Raises:
            Exception: any exception that the file raises.
        """
        with chdir("."):  # relative paths of the mission are read afterwards
            return import_quietly(f"{self._package}.{file.stem}")


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

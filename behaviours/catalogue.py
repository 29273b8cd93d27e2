"""Catalogue of behaviours: built-in, plugins by folder or module, and installed packages.

Any py_trees leaf can also be used by its dotted name, e.g. py_trees.behaviours.Success. A broken
plugin is reported with its file and a sentence; the other plugins still work.
"""

from __future__ import annotations

import inspect
import pkgutil
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache, partial
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import ModuleType

from behaviours._plugins import plugin_folder
from behaviours._plugins.plugin_folder import import_quietly
from behaviours.kind import BehaviourKind, UnusableClass, is_leaf, kind_of, name_of
from stack.parameters import suggestion

GROUP = "treepilot.behaviours"
"""Entry-point group; an entry is a module or module:Class."""

OWN_MODULES = ("py_trees", "behaviours")
"""Modules of which missions can use leaves by dotted names without listing them."""


@dataclass(frozen=True)
class Problem:
    """A plugin, or part of one, that cannot be used.

    Attributes:
        file: file or module.
        plugin: index in the list of requested plugins; -1 for an installed package.
    """

    file: str
    sentence: str
    plugin: int = -1


@dataclass(frozen=True)
class Catalogue:
    """The behaviours that were found.

    Attributes:
        kinds: behaviours by name, built-in ones first.
        problems: plugins that cannot be used.
        modules: modules whose leaves, also in modules below, can be used by their dotted names.
    """

    kinds: Mapping[str, BehaviourKind]
    problems: tuple[Problem, ...] = ()
    modules: tuple[str, ...] = OWN_MODULES

    def names(self) -> list[str]:
        """Return the names that missions can use, sorted; dotted names are not included."""
        return sorted(self.kinds)

    def get(self, name: str) -> BehaviourKind | None:
        """Return the behaviour with this name, or the py_trees leaf with this dotted name."""
        found = self._look_up(name)
        return found if isinstance(found, BehaviourKind) else None

    def why_not(self, name: str) -> str:
        """Return why `get` returns None, as a sentence; empty if it does not."""
        found = self._look_up(name)
        return found if isinstance(found, str) else ""

    def _look_up(self, name: str) -> BehaviourKind | str:
        if name in self.kinds:
            return self.kinds[name]
        if "." not in name:
            return f"there is no behaviour {name!r}; {suggestion(name, self.kinds)}"
        try:
            return kind_of(name, _class_named(name, self.modules))
        except UnusableClass as error:
            return f"{name!r} cannot be used: {error}"


def find_behaviours(
    plugins: Sequence[str] = (), folder: Path | None = None, reserved: Collection[str] = ()
) -> Catalogue:
    """Find all behaviours: built-in, of installed packages, and of these plugins.

    Args:
        plugins: folders or files (with a slash, or ending in .py), or dotted modules.
        folder: base of relative paths; default: the current folder.
        reserved: the words of the mission language; no behaviour can have one of these names.
    """
    built_in = _built_in()
    search = _Search(dict(built_in.kinds), list(built_in.problems), reserved)
    entries = sorted(entry_points(group=GROUP), key=lambda entry: (entry.name, entry.value))
    for entry in entries:
        search.attempt(_entry_label(entry), partial(search.add_entry, entry))
    for search.plugin, plugin in enumerate(plugins):
        if plugin_folder.is_path(plugin):
            search.add_path(plugin_folder.path_of(plugin, folder))
        else:
            search.attempt(plugin, partial(search.add_dotted, plugin))
    dotted = [plugin for plugin in plugins if not plugin_folder.is_path(plugin)]
    return Catalogue(search.kinds, tuple(search.problems), (*OWN_MODULES, *dotted))


@cache
def _built_in() -> Catalogue:
    """Search this package once: unlike plugins, it does not change while the process runs."""
    search = _Search()
    search.add_dotted("behaviours")
    for package in _public_modules("behaviours"):
        if package.ispkg:
            search.add_dotted(package.name)
    return Catalogue(dict(sorted(search.kinds.items())), tuple(search.problems))


def plugin_modules(plugins: Sequence[str], folder: Path | None = None) -> Iterator[ModuleType]:
    """Import the modules of plugins, for components that they define besides behaviours.

    Modules that cannot be imported are skipped; `find_behaviours` reports why.

    Args:
        plugins: as in `find_behaviours`.
        folder: as in `find_behaviours`.
    """
    for plugin in plugins:
        if plugin_folder.is_path(plugin):
            loads = list(plugin_folder.loads(plugin_folder.path_of(plugin, folder)).values())
        else:
            loads = [partial(import_quietly, plugin)]
        for load in loads:
            with suppress(Exception, SystemExit):
                yield load()


def plugin_sources(plugins: Sequence[str], folder: Path | None = None) -> list[Path]:
    """Return the files in plugin folders, private ones included; dotted modules are skipped.

    Args:
        plugins: as in `find_behaviours`.
        folder: as in `find_behaviours`.
    """
    paths = [plugin_folder.path_of(name, folder) for name in plugins if plugin_folder.is_path(name)]
    return [
        file for path in paths for file in (sorted(path.glob("*.py")) if path.is_dir() else [path])
    ]


@dataclass
class _Search:
    """Search results so far.

    Attributes:
        reserved: names that no behaviour can have.
        plugin: index of the current plugin, as in `Problem`.
    """

    kinds: dict[str, BehaviourKind] = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)
    reserved: Collection[str] = ()
    plugin: int = -1

    def report(self, label: str, sentence: str) -> None:
        self.problems.append(Problem(label, sentence, self.plugin))

    def attempt(self, label: str, action: Callable[[], None]) -> None:
        """Run an action on plugin code; an exception becomes a problem of `label`."""
        try:
            action()
        except (Exception, SystemExit) as error:
            self.report(label, plugin_folder.sentence_for(error))

    def add_path(self, path: Path) -> None:
        if not path.exists():
            what = "file" if path.suffix == ".py" else "folder"
            self.report(str(path), f"there is no such plugin {what}")
            return
        loads = plugin_folder.loads(path)
        if not loads:
            self.report(str(path), "this folder contains no plugin file (*.py)")
        for file, load in loads.items():
            self.attempt(str(file), partial(self.add_module, load, str(file)))

    def add_dotted(self, name: str) -> None:
        """Add the leaves of a module; for a package, also those of its public modules."""
        for module in (name, *sorted(module.name for module in _public_modules(name))):
            self.attempt(module, partial(self.add_module, partial(import_quietly, module)))

    def add_entry(self, entry: EntryPoint) -> None:
        if entry.attr:
            self.add(entry.load(), _entry_label(entry))
        else:
            self.add_dotted(entry.module)

    def add_module(self, load: Callable[[], ModuleType], label: str = "") -> None:
        """Add every leaf that a module itself defines; names with an underscore are private."""
        module = load()
        for item in vars(module).copy().values():
            if inspect.isclass(item) and item.__module__ == module.__name__ and is_leaf(item):
                self.add(item, label or str(module.__file__))

    def add(self, cls: type, label: str) -> None:
        name = name_of(cls)
        try:
            kind = kind_of(name, cls)
            if name in self.reserved:
                raise UnusableClass(f"{name!r} is a word of the mission language; rename the class")
            other = self.kinds.get(name)
            if other is not None and other.cls is not cls:
                raise UnusableClass(
                    f"{name!r} is already defined in {other.source}; rename the class"
                )
        except UnusableClass as error:
            self.report(label, f"{cls.__name__}: {error}")
        else:
            self.kinds.setdefault(name, kind)


def _class_named(dotted: str, modules: Sequence[str]) -> type:
    """Return a class; only listed modules and those below are imported.

    Raises:
        UnusableClass: the module is not listed or cannot be imported, or has no such name.
    """
    module, _, attribute = dotted.rpartition(".")
    if not any(f"{module}.".startswith(f"{listed}.") for listed in modules):
        raise UnusableClass(f"add its module to the mission: `plugins: [{module}]`")
    try:
        found: type = getattr(import_quietly(module), attribute)
    except AttributeError:
        raise UnusableClass(f"the module {module} has no {attribute!r}") from None
    except (Exception, SystemExit) as error:
        raise UnusableClass(plugin_folder.sentence_for(error)) from error
    return found


def _public_modules(name: str) -> list[pkgutil.ModuleInfo]:
    """Return the modules and packages directly in a package; private ones and tests excluded."""
    spec = import_quietly(name).__spec__
    places = (spec and spec.submodule_search_locations) or ()
    hidden = ("_", "test_")
    found = pkgutil.iter_modules(places, f"{name}.")
    return [module for module in found if not module.name.rpartition(".")[2].startswith(hidden)]


def _entry_label(entry: EntryPoint) -> str:
    package = f" of {entry.dist.name}" if entry.dist is not None else ""
    return f"entry point {entry.name} = {entry.value}{package}"

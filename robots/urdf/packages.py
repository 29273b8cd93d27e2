"""Finds the files that a URDF names: `package://NAME/…`, `file://…` and relative paths.

A package is a folder with that name or with a package.xml of that name. It is searched for among
the folders above the file and beside those, then in the folders that the robot file lists, then
where ROS looks (ROS_PACKAGE_PATH, AMENT_PREFIX_PATH), then among the installed Python packages.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from urllib.parse import unquote, urlparse

from stack.documents.files import read_input
from stack.documents.xml_file import parse_xml
from stack.errors import InputError

MANIFEST = "package.xml"
MOST_FOLDERS = 5000
"""Folders that are looked at for one package below a listed folder."""

PRUNED = {"build", "log", "node_modules"}
"""Folders of a workspace that are not searched: they hold no sources."""


@dataclass(frozen=True)
class PackageSearch:
    """Where packages are searched for.

    Attributes:
        file: the URDF.
        listed: folders of the robot file, each a package or a folder that contains packages.
    """

    file: Path
    listed: tuple[Path, ...] = ()
    _found: dict[str, Path | None] = field(default_factory=dict, compare=False)

    def package(self, name: str) -> Path | None:
        """The absolute path of a package; None if there is none."""
        if name not in self._found:
            found = next(self._candidates(name), None)
            self._found[name] = None if found is None else found.resolve()
        return self._found[name]

    def resolve(self, filename: str, beside: Path) -> Path | None:
        """The path that a file name in a URDF means; None if its package is not found.

        Args:
            filename: as in the URDF.
            beside: folder to which a relative path refers.
        """
        scheme, _, rest = filename.partition("://")
        if scheme == "package":
            name, _, inside = rest.partition("/")
            folder = self.package(name)
            return None if folder is None else folder / inside
        if scheme == "file":
            return Path(unquote(urlparse(filename).path))
        return beside / filename

    def _candidates(self, name: str) -> Iterator[Path]:
        for parent in self.file.absolute().parents:
            if is_package(parent, name):
                yield parent
            yield from (folder for folder in (parent / name,) if is_package(folder, name))
        for folder in self.listed:
            yield from _packages_in(folder, name)
        for folder in ros_folders():
            yield from (at for at in (folder, folder / name) if is_package(at, name))
        yield from python_package(name)


def is_package(folder: Path, name: str) -> bool:
    """Whether a folder is the package of this name."""
    manifest = folder / MANIFEST
    if not manifest.is_file():
        return folder.name == name and folder.is_dir()
    return folder.name == name or package_name(manifest) == name


def package_name(manifest: Path) -> str:
    """The name in a package.xml; empty if it cannot be read."""
    try:
        return parse_xml(read_input(manifest, "package manifest"), str(manifest)).text_of("name")
    except InputError:
        return ""


def ros_folders(environment: Iterable[tuple[str, str]] | None = None) -> list[Path]:
    """The folders in which ROS looks for packages, of the environment's variables."""
    variables = dict(os.environ if environment is None else environment)
    prefixes = variables.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    paths = [entry for entry in variables.get("ROS_PACKAGE_PATH", "").split(os.pathsep) if entry]
    return [*map(Path, paths), *(Path(prefix) / "share" for prefix in prefixes if prefix)]


def python_package(name: str) -> list[Path]:
    """The folders of an installed Python package, which is not imported; empty without one."""
    spec = find_spec(name) if name.isidentifier() else None
    return [] if spec is None else [Path(at) for at in spec.submodule_search_locations or ()]


def _packages_in(top: Path, name: str) -> Iterator[Path]:
    """Packages of this name in a folder, at any depth."""
    for count, (folder, below, _) in enumerate(os.walk(top)):
        if count >= MOST_FOLDERS:
            return
        below[:] = sorted(item for item in below if item not in PRUNED and item[0] != ".")
        if is_package(Path(folder), name):
            yield Path(folder)

"""Finds the models and meshes that a Gazebo file names.

A URI is tried below the folder of the file that names it and below the three folders above, each
with and without `models/`; then below the folders of Gazebo's environment variables, and where
Gazebo keeps the models that it has downloaded. Nothing is downloaded.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import unquote

from stack.documents.xml_file import read_xml

VARIABLES = ("GZ_SIM_RESOURCE_PATH", "IGN_GAZEBO_RESOURCE_PATH", "SDF_PATH", "GAZEBO_MODEL_PATH")
DOWNLOADED = (".gazebo/models", ".gz/models", ".ignition/models")
"""Folders of models in the home folder."""

FUEL = (".gz/fuel", ".ignition/fuel")
"""Folders of models in the home folder that Gazebo has downloaded: server/owner/models/name."""

ABOVE = 3
"""Folders above that of the file: a world of a ROS package lies in worlds/ or worlds/KIND/."""

NEWEST = (1, 11)
"""Newest version of the format; of a model in several versions the newest up to this is read."""

SCHEMES = ("model://", "package://", "file://")
ON_FUEL = re.compile(
    r"https?://[^/]*/(?:[^/]*/)?(?P<owner>[^/]+)/models/(?P<name>[^/]+)(?P<rest>.*)"
)


def model_folders(folder: Path) -> Iterator[Path]:
    """The folders in which a file of this folder finds models, in order; each exists."""
    near = [folder, *list(folder.parents)[:ABOVE]]
    named = [
        Path(part)
        for variable in VARIABLES
        for part in os.environ.get(variable, "").split(os.pathsep)
        if part
    ]
    home = [Path.home() / name for name in DOWNLOADED]
    for root in dict.fromkeys((*near, *named, *home)):
        yield from (path for path in (root, root / "models") if path.is_dir())


def find_model(uri: str, folder: Path) -> Path | None:
    """The file or folder that a file of this folder means by a URI or a relative path, or None."""
    uri = unquote(uri.strip())
    fuel = ON_FUEL.fullmatch(uri)
    if fuel is not None:
        return _downloaded(fuel, folder)
    relative = uri
    for scheme in SCHEMES:
        relative = relative.removeprefix(scheme)
    if "://" in relative or not relative.strip("/."):
        return None
    if relative.startswith("/") and Path(relative).exists():
        return Path(relative)
    found = (root / relative.strip("/") for root in model_folders(folder))
    return next((path for path in found if _exists(path)), None)


def _downloaded(fuel: re.Match[str], folder: Path) -> Path | None:
    """The copy of a model of Gazebo's server: by name beside the file, or downloaded before."""
    name, rest = fuel["name"], re.sub(r"^/(\d+|tip)(/files)?", "", fuel["rest"]).strip("/")
    for root in model_folders(folder):
        for spelling in dict.fromkeys((name, name.lower(), name.replace(" ", "_").lower())):
            if (root / spelling).is_dir() and _exists(root / spelling / rest):
                return root / spelling / rest
    kept = f"*/{fuel['owner'].lower()}/models/{name.lower()}/*"
    copies = [copy for cache in FUEL for copy in (Path.home() / cache).glob(kept)]
    copies.sort(key=lambda copy: int(copy.name) if copy.name.isdecimal() else -1)
    return next((copy / rest for copy in reversed(copies) if _exists(copy / rest)), None)


def name_of(uri: str) -> str:
    """The name of the model of a URI, such as `ground_plane`."""
    fuel = ON_FUEL.fullmatch(unquote(uri.strip()))
    name = uri.strip().removeprefix("model://").strip("/") if fuel is None else fuel["name"]
    return name.lower().replace(" ", "_") if fuel is not None else name


def description_of(model: Path) -> Path:
    """The SDF file of a model's folder, the newest version that its model.config lists.

    Raises:
        InputError: the model.config cannot be read.
    """
    config = model / "model.config"
    if model.is_file() or not config.is_file():
        return model if model.is_file() else model / "model.sdf"
    listed = [
        (_version(entry.attributes.get("version", "")), entry.text)
        for entry in read_xml(config, "model.config").all("sdf")
        if entry.text
    ]
    readable = [item for item in listed if item[0] <= NEWEST] or listed
    return model / max(readable, default=((), "model.sdf"), key=lambda item: item[0])[1]


def _version(text: str) -> tuple[int, ...]:
    return tuple(int(part) for part in text.strip().split(".") if part.isdecimal())


def _exists(path: Path) -> bool:
    try:
        return path.exists()
    except (OSError, ValueError):  # a name that is too long, or has a null character
        return False

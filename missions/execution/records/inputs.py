"""What a run was made of, in its folder: copies of all files that it read, options, versions.

    inputs.json    options, versions, each file with its digest, and facts (plan_facts.py)
    inputs/        the files, in the places that they had relative to each other; files of treepilot
                   itself in inputs/treepilot

Of a file of an installed Python package, such as the meshes of pybullet_data, only digest and name
are kept: a repetition reads it there, too. Of a file above LARGEST only digest and place are kept.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from hashlib import file_digest
from pathlib import Path
from shutil import copyfile
from sysconfig import get_path
from typing import Any

from missions.execution.prepare import PreparedMission
from missions.execution.records.plan_facts import FACTS, LIST, facts_of
from missions.execution.resources import MISSIONS, versions
from missions.run_options import RunOptions
from robots.urdf.packages import python_package
from stack.documents.files import JSON_BYTES, read_bytes
from stack.errors import InputError
from stack.telemetry.recorder import RunFolder

FORMAT = 1
COPIES, SHIPPED, PACKAGE = "inputs", "treepilot", "packages"

REPEATS = "repeats"
"""Folder of the repetitions of a run, in its folder."""

LARGEST = 50_000_000
"""Largest file that is copied, bytes."""

KEPT_COPY = "kept.json"
"""Copy of the values that the run kept from earlier ones, in the folder of the copies."""

CHOSEN = (
    "seed", "arguments", "robot", "world", "start", "camera", "renderer", "parameters",
    "breakpoints", "forced", "body", "replay", "faults",
)  # fmt: skip
"""The options of a run on which its result depends."""

PACKAGES = tuple(MISSIONS.parent / name for name in ("missions", "robots", "behaviours", "stack"))
"""Folders of treepilot."""

INSTALLED = Path(get_path("purelib")).resolve()
"""Folder of installed Python packages."""


@dataclass(frozen=True, slots=True)
class InputFile:
    """A file that a run read.

    Attributes:
        path: relative to the folder of the copies.
        sha256: digest of its content.
        source: where it is, of a file that is too large to be copied; else empty.
        package: name of the installed package that has it, and that is not copied; else empty.
    """

    path: str
    sha256: str
    source: str = ""
    package: str = ""


def keep_inputs(
    folder: RunFolder, plan: PreparedMission, options: RunOptions, files: Iterable[Path],
    kept: Path | None,
) -> Copies:  # fmt: skip
    """Copy what a run was made of into its folder; return the places of the copies.

    A file that cannot be copied is noted as lost, like any other record.

    Args:
        folder: of the run.
        plan: that is run.
        options: of the run.
        files: all that were read for it.
        kept: the values that the run keeps from earlier ones; None if it keeps none.
    """
    every = [*files, *plan.files, *_played(plan)]
    copies = Copies({_resolved(file) for file in every})
    try:
        listed = [copies.keep(folder, file) for file in sorted(copies.files)]
        if kept is not None and kept.exists():
            folder.write(f"{COPIES}/{KEPT_COPY}", kept.read_bytes())
        content = {
            "format": FORMAT,
            "mission": copies.name_of(plan.mission.source),
            "options": copies.options(options),
            FACTS: facts_of(plan, options.parameters or {}).plain(),
            "versions": versions(),
            "files": [asdict(item) for item in listed],
        }
        folder.write(LIST, json.dumps(content, indent=2, ensure_ascii=False).encode() + b"\n")
    except OSError as error:
        folder.on_loss(LIST, error.strerror or str(error))
    return copies


def _played(plan: PreparedMission) -> list[Path]:
    """The files of the recording that is played: a bag is a folder."""
    if plan.recording is None:
        return []
    file = plan.recording.file
    return [item for item in file.rglob("*") if item.is_file()] if file.is_dir() else [file]


class Copies:
    """Places of the files of a run among its copies.

    Args:
        files: of the run, resolved.
    """

    def __init__(self, files: set[Path]) -> None:
        self.files = files
        own = [file.parent for file in files if not (_is_shipped(file) or _package_of(file))]
        self._base = Path(os.path.commonpath(own)) if own else MISSIONS.parent

    def name_of(self, file: Path) -> str:
        """The path of a file relative to the folder of the copies."""
        file = _resolved(file)
        if _is_shipped(file):
            return f"{SHIPPED}/{file.relative_to(MISSIONS.parent).as_posix()}"
        if _package_of(file):
            return f"{PACKAGE}/{file.resolve().relative_to(INSTALLED).as_posix()}"
        return file.relative_to(self._base).as_posix()

    def keep(self, folder: RunFolder, file: Path) -> InputFile:
        """Copy a file unless an installed package has it, or it is too large."""
        name, digest = self.name_of(file), _digest(file)
        if package := _package_of(file):
            return InputFile(name, digest, package=package)
        if file.stat().st_size > LARGEST:
            return InputFile(name, digest, str(file))
        target = folder.path / COPIES / name
        target.parent.mkdir(parents=True, exist_ok=True)
        copyfile(file, target)
        return InputFile(name, digest)

    def options(self, options: RunOptions) -> dict[str, Any]:
        """The options; the files that they name by their places among the copies."""
        chosen: dict[str, Any] = {name: getattr(options, name) for name in CHOSEN}
        for name in ("robot", "world", "replay"):
            if chosen[name] is not None:
                file = self.file_of(str(chosen[name]), is_replay=name == "replay")
                if file is None or _is_shipped(file):
                    chosen[name] = str(chosen[name])
                else:
                    chosen[name] = f"{COPIES}/{self.name_of(file)}"
        if chosen["faults"] is not None:
            chosen["faults"] = "+".join(map(self._fault, chosen["faults"].split("+")))
        return chosen

    def _fault(self, name: str) -> str:
        """A fault; a file of faults by its place among the copies."""
        file = self.file_of(name.strip())
        return name if file is None else f"{COPIES}/{self.name_of(file)}"

    def file_of(self, text: str, *, is_replay: bool = False) -> Path | None:
        """The file of the run that an option names; None if it names none.

        A robot may be named by its folder, and a recording may be one.
        """
        file = _resolved(Path(text))
        if not is_replay and file.is_dir():
            file = file / "robot.yaml"
        return file if file in self.files or (is_replay and file.is_dir()) else None


def _is_shipped(file: Path) -> bool:
    return any(file.is_relative_to(package) for package in PACKAGES)


def _package_of(file: Path) -> str:
    """Return the installed Python package that has a file; empty for none and for treepilot."""
    real = file.resolve()
    if _is_shipped(file) or not real.is_relative_to(INSTALLED):
        return ""
    name = real.relative_to(INSTALLED).parts[0]
    is_package = any(folder.resolve() == INSTALLED / name for folder in python_package(name))
    return name if is_package else ""


def _resolved(file: Path) -> Path:
    """The path without `..`; links stay, so that relative paths between files stay right."""
    return Path(os.path.normpath(file.absolute()))


def _digest(file: Path) -> str:
    """SHA-256 of a file; empty if it cannot be read."""
    try:
        with file.open("rb") as content:
            return file_digest(content, "sha256").hexdigest()
    except OSError:
        return ""


@dataclass(frozen=True)
class RunInputs:
    """What a run was made of, read from its folder.

    Attributes:
        folder: of the run.
        mission: the copy of the mission.
        options: of the run.
        versions: of treepilot and the libraries that its results depend on.
        files: that the run read.
    """

    folder: Path
    mission: Path
    options: RunOptions
    versions: dict[str, str]
    files: tuple[InputFile, ...]

    @property
    def kept(self) -> Path:
        """Copy of the values that the run kept from earlier ones; it need not exist."""
        return self.folder / COPIES / KEPT_COPY

    def link_large_files(self) -> None:
        """Put links to the files that were too large to be copied in their places.

        Raises:
            InputError: one is not there any more, or is another one.
        """
        for item in self.files:
            place = self.folder / COPIES / item.path
            if not item.source or place.exists():
                continue
            if _digest(Path(item.source)) != item.sha256:
                raise InputError(
                    f"the run read {item.source}, which was too large to be copied: it is gone"
                    " or has changed"
                )
            place.parent.mkdir(parents=True, exist_ok=True)
            place.symlink_to(item.source)

    def changes(self, read: Iterable[Path]) -> list[str]:
        """What is different for a new run, as sentences.

        Args:
            read: files that the new run has read.
        """
        now, copies = versions(), _resolved(self.folder / COPIES)
        found = [
            f"{name} was {before}, is {now.get(name, 'not installed')}"
            for name, before in self.versions.items()
            if now.get(name) != before
        ]
        known = {item.sha256 for item in self.files}
        for file in map(_resolved, read):
            if _digest(file) in known:
                continue
            if file.is_relative_to(copies):
                found.append(f"{COPIES}/{file.relative_to(copies)} has been changed")
            elif package := _package_of(file):
                name = file.resolve().relative_to(INSTALLED)
                found.append(f"{name} of the package {package} has changed")
            elif _is_shipped(file):
                found.append(f"{file.relative_to(MISSIONS.parent)} of treepilot has changed")
            else:
                found.append(f"{file}, named by its full path, is a different file now")
        return found


def read_inputs(folder: Path) -> RunInputs:
    """Return what a run was made of.

    Raises:
        InputError: its folder does not say, or in another format.
    """
    file = folder / LIST
    try:
        content = json.loads(read_bytes(file, JSON_BYTES))
        if content["format"] != FORMAT:
            raise InputError(f"{file} has the format {content['format']!r}; {FORMAT} is read")
        options = _read_options(folder, content["options"])
        listed = tuple(InputFile(**item) for item in content["files"])
        mission, known = str(content["mission"]), dict(content["versions"])
    except OSError as error:
        raise InputError(f"{folder} does not say what it was made of: {error.strerror}") from None
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
        raise InputError(f"{file} is damaged: {error!r:.100}") from None
    places = [mission, *(item.path for item in listed)]
    for place in places:
        if not _resolved(folder / COPIES / place).is_relative_to(_resolved(folder / COPIES)):
            raise InputError(f"{file} is damaged: {place!r} is not in the run folder")
    return RunInputs(folder, folder / COPIES / mission, options, known, listed)


def _read_options(folder: Path, chosen: Mapping[str, Any]) -> RunOptions:
    values = {name: chosen[name] for name in CHOSEN if name in chosen}
    for name in ("robot", "world", "replay"):
        value = values.get(name)
        if isinstance(value, str) and value.startswith(f"{COPIES}/"):
            values[name] = str(folder.absolute() / value)
    copied = (values.get("faults") or "").replace(f"{COPIES}/", f"{folder.absolute()}/{COPIES}/")
    values["faults"] = copied or values.get("faults")
    options = RunOptions(**values)
    played = values.get("replay")
    return replace(
        options, breakpoints=tuple(options.breakpoints), replay=Path(played) if played else None
    )

"""What a run was made of, in its folder: copies of all files that it read, options, versions.

    inputs.json    options, versions, and each file with its digest
    inputs/        the files, in the places that they had relative to each other

Files of treepilot itself are not copied, and no recording that a robot plays: only their digests
are kept.
"""

from __future__ import annotations

import json
import os
from collections.abc import Collection, Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

from missions.execution.prepare import PreparedMission
from missions.execution.resources import MISSIONS, versions
from missions.run_options import RunOptions
from stack.documents.files import JSON_BYTES, read_bytes
from stack.errors import InputError
from stack.telemetry.recorder import RunFolder

FORMAT = 1
LIST, COPIES = "inputs.json", "inputs"

REPEATS = "repeats"
"""Folder of the repetitions of a run, in its folder."""

LARGEST = 50_000_000
"""Largest file that is copied, bytes; of a larger one only the digest is kept."""

KEPT_COPY = "kept.json"
"""Copy of the values that the run kept from earlier ones, in the folder of the copies."""

CHOSEN = (
    "seed", "arguments", "robot", "world", "start", "camera", "renderer", "parameters",
    "breakpoints", "forced", "body", "replay",
)  # fmt: skip
"""The options of a run on which its result depends."""

ROOT = MISSIONS.parent
"""Folder of the packages of treepilot."""


@dataclass(frozen=True, slots=True)
class InputFile:
    """A file that a run read.

    Attributes:
        path: relative to the folder of the copies; of a file of treepilot, to its packages.
        place: `copied` | `treepilot` | `elsewhere` (too large to be copied, or not a part of it).
        sha256: digest of its content.
    """

    path: str
    place: str
    sha256: str


def keep_inputs(
    folder: RunFolder, plan: PreparedMission, options: RunOptions, files: Iterable[Path],
    kept: Path | None,
) -> None:  # fmt: skip
    """Copy what a run was made of into its folder.

    A file that cannot be copied is noted as lost, like any other record.

    Args:
        folder: of the run.
        plan: that is run.
        options: of the run.
        files: all that were read for it.
        kept: the values that the run keeps from earlier ones; None if it keeps none.
    """
    played = plan.recording.file if plan.recording is not None else None
    every = list(dict.fromkeys(_resolved(file) for file in (*files, *plan.files)))
    own = [file for file in every if not file.is_relative_to(ROOT)]
    base = _common_folder([plan.mission.source.absolute(), *own])
    try:
        listed = [_keep(folder, file, base, is_played=file == played) for file in every]
        if kept is not None and kept.exists():
            folder.write(f"{COPIES}/{KEPT_COPY}", kept.read_bytes())
        content = {
            "format": FORMAT,
            "mission": _name(_resolved(plan.mission.source), base),
            "options": _chosen(options, every, base),
            "versions": versions(),
            "files": [asdict(item) for item in listed],
        }
        folder.write(LIST, json.dumps(content, indent=2, ensure_ascii=False).encode() + b"\n")
    except OSError as error:
        folder.on_loss(LIST, error.strerror or str(error))


def _keep(folder: RunFolder, file: Path, base: Path, *, is_played: bool) -> InputFile:
    content = b"" if is_played else file.read_bytes()
    digest = sha256(content).hexdigest()
    if file.is_relative_to(ROOT):
        return InputFile(file.relative_to(ROOT).as_posix(), "treepilot", digest)
    name = file.relative_to(base).as_posix()
    if is_played or len(content) > LARGEST:
        return InputFile(name, "elsewhere", digest)
    folder.write(f"{COPIES}/{name}", content)
    return InputFile(name, "copied", digest)


def _resolved(file: Path) -> Path:
    """The path without `..`; links stay, so that relative paths between files stay right."""
    return Path(os.path.normpath(file.absolute()))


def _common_folder(files: Collection[Path]) -> Path:
    return Path(os.path.commonpath([file.parent for file in files]))


def _name(file: Path, base: Path) -> str:
    """How a file is found again: by its place among the copies, or as a shipped one by its name."""
    return file.stem if file.is_relative_to(ROOT) else file.relative_to(base).as_posix()


def _chosen(options: RunOptions, files: Collection[Path], base: Path) -> dict[str, Any]:
    """The options; the files that they name by their places among the copies."""
    chosen: dict[str, Any] = {name: getattr(options, name) for name in CHOSEN}
    for name in ("robot", "world", "replay"):
        value = chosen[name]
        if value is None:
            continue
        named = _resolved(Path(value))
        if named.is_dir():
            named /= "robot.yaml"
        if named in files and not named.is_relative_to(ROOT):
            chosen[name] = f"{COPIES}/{named.relative_to(base).as_posix()}"
        else:
            chosen[name] = str(value)
    return chosen


@dataclass(frozen=True)
class RunInputs:
    """What a run was made of, read from its folder.

    Attributes:
        folder: of the run.
        mission: the copy of the mission, or the name of a shipped one.
        options: of the run.
        versions: of treepilot and the libraries that its results depend on.
        files: that the run read.
    """

    folder: Path
    mission: str
    options: RunOptions
    versions: dict[str, str]
    files: tuple[InputFile, ...]

    @property
    def kept(self) -> Path:
        """Copy of the values that the run kept from earlier ones; it need not exist."""
        return self.folder / COPIES / KEPT_COPY

    def changes(self, read: Iterable[Path]) -> list[str]:
        """What a new run has not found as it was, as sentences.

        Args:
            read: files that the new run has read.
        """
        now, copies = versions(), self.folder / COPIES
        found = [
            f"{name} was {before}, is {now.get(name, 'not installed')}"
            for name, before in self.versions.items()
            if now.get(name) != before
        ]
        for item in self.files:
            base, what = (
                (ROOT, f"{item.path} of treepilot is another one")
                if item.place == "treepilot"
                else (copies, f"{COPIES}/{item.path} has been changed")
            )
            if item.place != "elsewhere" and _digest(base / item.path) != item.sha256:
                found.append(what)
        known = {item.sha256 for item in self.files}
        for file in map(_resolved, read):
            inside = file.is_relative_to(_resolved(copies)) or file.is_relative_to(ROOT)
            if not inside and _digest(file) not in known:
                found.append(f"{file}, named by its full path, is not the file of the run")
        return found


def _digest(file: Path) -> str:
    try:
        return sha256(file.read_bytes()).hexdigest()
    except OSError:
        return ""


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
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise InputError(f"{file} is damaged: {error!r:.100}") from None
    copy = folder / COPIES / mission
    if not copy.resolve().is_relative_to(folder.resolve()):
        raise InputError(f"{file} is damaged: the mission {mission!r} is not in the run folder")
    return RunInputs(folder, str(copy) if copy.is_file() else mission, options, known, listed)


def _read_options(folder: Path, chosen: Mapping[str, Any]) -> RunOptions:
    values = {name: chosen[name] for name in CHOSEN if name in chosen}
    for name in ("robot", "world", "replay"):
        value = values.get(name)
        if isinstance(value, str) and value.startswith(f"{COPIES}/"):
            values[name] = str(folder.absolute() / value)
    options = RunOptions(**values)
    played = values.get("replay")
    return replace(
        options, breakpoints=tuple(options.breakpoints), replay=Path(played) if played else None
    )

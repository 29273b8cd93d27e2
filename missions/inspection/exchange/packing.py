"""Run folders as zip files, for another machine."""

from __future__ import annotations

import os
import shutil
import stat
import zipfile
from pathlib import Path, PurePosixPath

from missions.execution.records.inputs import REPEATS
from missions.inspection.run_folders import is_run_folder
from stack.errors import InputError
from stack.telemetry.recorder import RunFolder

LARGEST = 20_000_000_000
"""Largest unpacked run, bytes: a small archive may unpack to an endless file."""

MOST = 100_000
"""Most files of a packed run."""


def pack(folder: Path, target: Path) -> int:
    """Write a run folder into a zip file; return its size in bytes.

    The file appears under its name when it is complete. Links are left out.

    Raises:
        InputError: it is no run folder, the file exists, or it cannot be written.
    """
    if not is_run_folder(folder):
        raise InputError(f"{folder} is not a run folder: it lacks events.jsonl or mission.yaml")
    if target.exists():
        raise InputError(f"{target} exists; choose another name with -o")
    unfinished = target.with_name(f".{target.name}.new")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with zipfile.ZipFile(unfinished, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as packed:
            for file in _files(folder):
                packed.write(file, PurePosixPath(folder.name, *file.relative_to(folder).parts))
        unfinished.replace(target)
    except OSError as error:
        unfinished.unlink(missing_ok=True)
        raise InputError(f"cannot write {target}: {error.strerror}") from None
    return target.stat().st_size


def _files(folder: Path) -> list[Path]:
    """The regular files of a folder, sorted, without repetitions and what can be drawn again."""
    found = []
    for base, folders, names in os.walk(folder):
        folders[:] = sorted(name for name in folders if name != REPEATS)
        found += [Path(base) / name for name in sorted(names)]
    drawn = RunFolder(folder).recording
    return [
        file for file in found if file.absolute() != drawn and stat.S_ISREG(file.lstat().st_mode)
    ]


def unpack(packed: Path, parent: Path) -> Path:
    """Unpack a run below a folder of runs; return its folder.

    If the run is there already, it is not touched.

    Raises:
        InputError: the file is no packed run, is damaged, or cannot be unpacked.
    """
    try:
        with zipfile.ZipFile(packed) as archive:
            name, members = _checked(packed, archive)
            folder = parent / name
            if folder.exists():
                if is_run_folder(folder):
                    return folder
                raise InputError(f"{folder} exists and is not a run folder; move it away")
            unfinished = parent / f".{name}.new"
            shutil.rmtree(unfinished, ignore_errors=True)
            for member in members:
                target = unfinished / PurePosixPath(member.filename).relative_to(name)
                target.parent.mkdir(parents=True, exist_ok=True)
                with archive.open(member) as source, target.open("xb") as file:
                    shutil.copyfileobj(source, file)
            unfinished.replace(folder)
    except (zipfile.BadZipFile, NotImplementedError, EOFError, RuntimeError) as error:
        raise InputError(f"{packed} is not a packed run: {error}") from None
    except OSError as error:
        raise InputError(f"cannot unpack {packed}: {error.strerror or error}") from None
    if not is_run_folder(folder):
        shutil.rmtree(folder, ignore_errors=True)
        raise InputError(f"{packed} is not a packed run: it lacks events.jsonl or mission.yaml")
    return folder


def _checked(packed: Path, archive: zipfile.ZipFile) -> tuple[str, list[zipfile.ZipInfo]]:
    """The name of the run, and its files.

    Raises:
        InputError: there is more than one folder in it, a name that leads out of it, or too much.
    """
    members = [member for member in archive.infolist() if not member.is_dir()]
    names = {PurePosixPath(member.filename).parts[:1] for member in members}
    if len(names) != 1:
        raise InputError(f"{packed} is not a packed run: expected one folder in it")
    for member in members:
        path = PurePosixPath(member.filename)
        if path.is_absolute() or ".." in path.parts or len(path.parts) < 2 or "\\" in str(path):
            raise InputError(f"{packed} is not a packed run: it has a file {member.filename!r:.80}")
    if len(members) > MOST or sum(member.file_size for member in members) > LARGEST:
        raise InputError(f"{packed} is not a packed run: more than {LARGEST / 1e9:g} GB unpacked")
    return members[0].filename.partition("/")[0], members

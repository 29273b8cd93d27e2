"""Writes files and groups of files whole or not at all; groups keep what they replace as `.bak`.

The content is written to temporary files on the same disk first, and renamed at the end. A failure
before the renames leaves the old files; a failure between them restores the old files.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path

BACKUP = ".bak"


def replace_file(path: Path, content: bytes) -> None:
    """Write a file; other processes read the old content or the new one, whole.

    Raises:
        OSError: the folder cannot be written to, or the disk is full; an old file is unchanged.
    """
    temporary = _written(path, content)
    try:
        os.replace(temporary, path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def replace_files(contents: Mapping[Path, bytes]) -> None:
    """Write files in the order of the mapping; what they replace is kept beside them as `.bak`.

    Raises:
        OSError: a folder cannot be written to, or the disk is full; the old files are unchanged.
    """
    ready: list[tuple[Path, Path]] = []
    replaced: list[Path] = []
    try:
        for path, content in contents.items():
            ready.append((_written(path, content), path))
        for path in contents:
            _keep(path)
        for temporary, path in ready:
            os.replace(temporary, path)
            replaced.append(path)
    except BaseException:
        for temporary, _ in ready:
            temporary.unlink(missing_ok=True)
        for path in replaced:
            _restore(path)
        raise


def replace_folder(folder: Path, contents: Mapping[str, bytes]) -> None:
    """Write a folder with files by name; the folder that it replaces is kept as `.bak`.

    Raises:
        OSError: it cannot be written; the old folder is unchanged.
    """
    folder.parent.mkdir(parents=True, exist_ok=True)
    temporary = Path(tempfile.mkdtemp(dir=folder.parent, prefix=f".{folder.name}."))
    try:
        for name, content in contents.items():
            _write(os.open(temporary / name, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o644), content)
        os.chmod(temporary, 0o755)
        backup = backup_of(folder)
        if folder.is_dir():
            shutil.rmtree(backup, ignore_errors=True)
            os.replace(folder, backup)
        try:
            os.replace(temporary, folder)
        except OSError:
            if backup.is_dir() and not folder.exists():
                os.replace(backup, folder)
            raise
    except BaseException:
        shutil.rmtree(temporary, ignore_errors=True)
        raise


def backup_of(path: Path) -> Path:
    """Return the path under which a replaced file or folder is kept."""
    return path.with_name(path.name + BACKUP)


def _written(path: Path, content: bytes) -> Path:
    """Write a temporary file in the target's folder; return its path."""
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        _write(handle, content)
        os.chmod(temporary, 0o644)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise
    return Path(temporary)


def _write(handle: int, content: bytes) -> None:
    with os.fdopen(handle, "wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


def _keep(path: Path) -> None:
    """Copy a file to its `.bak`, whole or not at all."""
    if not path.is_file():
        return
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    os.close(handle)
    try:
        shutil.copy2(path, temporary)
        os.replace(temporary, backup_of(path))
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def _restore(path: Path) -> None:
    """Put the kept file back; a file that did not exist before is removed."""
    backup = backup_of(path)
    if backup.is_file():
        shutil.copy2(backup, path)
    else:
        path.unlink(missing_ok=True)

"""Writes a file or a folder whole or not at all: under a temporary name first, then renamed."""

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
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        _write(handle, content)
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
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


def _write(handle: int, content: bytes) -> None:
    with os.fdopen(handle, "wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())

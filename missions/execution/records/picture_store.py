"""Stores of the run folder: the pictures that behaviours take, and the maps that they save."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

from stack.mapping.whole_files import replace_folder
from stack.robot import JsonValue
from stack.telemetry.hub import reason_of
from stack.telemetry.recorder import RunFolder
from stack.types import Image


class PictureStore:
    """Writes pictures into the run folder."""

    def __init__(self, folder: RunFolder | None) -> None:
        self._folder = folder

    def save(self, image: Image, name: str, details: Mapping[str, JsonValue] | None = None) -> str:
        """Write a picture as JPEG, and details beside it as JSON; return the picture's path.

        Each file is written whole or not at all. Without a run folder nothing is written; the
        returned path, relative to it, is the same. A file that cannot be written, e.g. on a full
        disk, is noted as a lost record.
        """
        import cv2

        path = f"pictures/{name}.jpg"
        if self._folder is not None:
            self._write(path, cv2.imencode(".jpg", image.pixels[:, :, ::-1])[1].tobytes())
            if details is not None:
                text = json.dumps({"picture": path, **details}, indent=2, ensure_ascii=False)
                self._write(f"pictures/{name}.json", text.encode() + b"\n")
        return path

    def _write(self, path: str, content: bytes) -> None:
        assert self._folder is not None
        try:
            self._folder.write(path, content)
        except OSError as error:
            self._folder.on_loss(path, reason_of(error))


class FolderMapStore:
    """Saves maps as folders: under the run folder, or where an absolute path says.

    Args:
        folder: of the run; without one, maps with relative names are not written.
        beside: folder of the mission, in which maps are looked for that the run has not saved.
    """

    def __init__(self, folder: RunFolder | None, beside: Path) -> None:
        self._folder, self._beside = folder, beside

    def save(self, name: str, files: dict[str, bytes]) -> str:
        """Write the folder of a map whole or not at all; return its name.

        An existing folder is kept as `.bak`.

        Raises:
            OSError: it cannot be written.
        """
        path = Path(name).expanduser()
        if path.is_absolute():
            replace_folder(path, files)
        elif self._folder is not None:
            replace_folder(self._folder.path / path, files)
        return name

    def find(self, name: str) -> Path:
        """Return the path of a saved map: in the run folder, else beside the mission."""
        path = Path(name).expanduser()
        if path.is_absolute():
            return path
        own = None if self._folder is None else self._folder.path / path
        return own if own is not None and own.exists() else self._beside / path

"""Store of the pictures that behaviours take."""

from __future__ import annotations

from stack.telemetry.hub import reason_of
from stack.telemetry.recorder import RunFolder
from stack.types import Image


class PictureStore:
    """Writes pictures into the run folder."""

    def __init__(self, folder: RunFolder | None) -> None:
        self._folder = folder

    def save(self, image: Image, name: str) -> str:
        """Write a picture as JPEG, atomically; return its path relative to the run folder.

        Without a run folder nothing is written; the returned path is the same. A picture that
        cannot be written, e.g. on a full disk, is noted as a lost record.
        """
        import cv2

        path = f"pictures/{name}.jpg"
        if self._folder is not None:
            encoded = cv2.imencode(".jpg", image.pixels[:, :, ::-1])[1].tobytes()
            try:
                self._folder.write(path, encoded)
            except OSError as error:
                self._folder.on_loss(path, reason_of(error))
        return path

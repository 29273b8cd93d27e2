"""Keeps the pictures that behaviours take in the run's folder."""

from __future__ import annotations

from stack.telemetry.recorder import RunFolder
from stack.types import Image


class PictureStore:
    """The pilot's image store."""

    def __init__(self, folder: RunFolder | None) -> None:
        self._folder = folder

    def save(self, image: Image, name: str) -> str:
        """Write a picture as JPEG, whole; its path relative to the run's folder.

        Without a run folder nothing is written and the path says where it would have been.
        """
        import cv2

        path = f"pictures/{name}.jpg"
        if self._folder is not None:
            encoded = cv2.imencode(".jpg", image.pixels[:, :, ::-1])[1].tobytes()
            self._folder.write(path, encoded)
        return path

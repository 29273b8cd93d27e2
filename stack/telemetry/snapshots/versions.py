"""Layers and pictures of a recording: of each, the newest version before a snapshot."""

from __future__ import annotations

from array import array
from bisect import bisect_right
from dataclasses import replace
from typing import Any

import numpy as np

from stack.telemetry.codec import MalformedError
from stack.telemetry.records import Layer
from stack.telemetry.snapshots.format import PATCH
from stack.telemetry.snapshots.message_file import MessageFile
from stack.telemetry.snapshots.picture_codes import EncodedPicture, decoded_depth, decoded_image
from stack.types import CameraModel, DepthImage, Image


class VersionIndex:
    """Where the versions of something are, and between which snapshots."""

    def __init__(self) -> None:
        self.places, self._snapshots = array("Q"), array("L")

    def note(self, snapshots: int, place: int) -> None:
        """Add a version that is written after so many snapshots."""
        self._snapshots.append(snapshots)
        self.places.append(place)

    def newest(self, snapshot: int) -> int:
        """Number of the newest version before a snapshot; -1: none."""
        return bisect_right(self._snapshots, snapshot) - 1


class RecordedLayer:
    """The versions of a layer; the last one that was asked for is held in memory."""

    def __init__(self, file: MessageFile) -> None:
        self.index = VersionIndex()
        self._file = file
        self._loaded: Layer | None = None
        self._number = -1

    def before(self, snapshot: int) -> Layer | None:
        """The newest version that was written before a snapshot.

        Raises:
            InputError: the file is damaged.
        """
        which = self.index.newest(snapshot)
        if which < 0 or (self._loaded is not None and self._number == which):
            return None if which < 0 else self._loaded
        steps: list[dict[str, Any]] = []
        first = which
        while first >= 0:
            if self._loaded is not None and self._number == first:
                break
            steps.append(self._file.message(self.index.places[first]))
            if PATCH not in steps[-1]:
                break
            first -= 1
        for content in reversed(steps):
            self._loaded = self._layer_of(content, self._loaded)
        self._number = which
        return self._loaded

    def _layer_of(self, content: dict[str, Any], before: Layer | None) -> Layer:
        patch = content.get(PATCH)
        if patch is None:
            return self._file.record(Layer, content, "Layer")
        try:
            assert before is not None
            top, left, rows, columns, cells = patch
            grid: Any = before.content
            changed = grid.cells.copy()
            part = np.frombuffer(cells, changed.dtype).reshape(rows, columns)
            changed[top : top + rows, left : left + columns] = part
            return Layer(int(content["version"]), replace(grid, cells=changed))
        except (AssertionError, AttributeError, LookupError, TypeError, ValueError) as error:
            raise self._file.damaged(f"a malformed change of a layer: {error!r}") from None


class RecordedPictures:
    """The pictures of one name; the last one that was asked for is held in memory.

    Args:
        file: with the pictures.
        is_depth: whether they are those of a depth camera.
    """

    def __init__(self, file: MessageFile, *, is_depth: bool) -> None:
        self.pictures, self.cameras = VersionIndex(), VersionIndex()
        self._file, self._is_depth = file, is_depth
        self._number = -1
        self._loaded: Image | DepthImage | None = None

    def before(self, snapshot: int) -> Image | DepthImage | None:
        """The newest picture that was written before a snapshot.

        Raises:
            InputError: the file is damaged.
        """
        which, camera = self.pictures.newest(snapshot), self.cameras.newest(snapshot)
        if which < 0 or camera < 0:
            return None
        if self._number != which:
            seen = self._file.message(self.pictures.places[which])
            by = self._file.message(self.cameras.places[camera])
            self._loaded = self._decoded(
                self._file.record(EncodedPicture, seen, "Picture"),
                self._file.record(CameraModel, by, "Camera"),
            )
            self._number = which
        return self._loaded

    def _decoded(self, picture: EncodedPicture, camera: CameraModel) -> Image | DepthImage:
        decode = decoded_depth if self._is_depth else decoded_image
        try:
            return decode(picture, camera)
        except MalformedError as error:
            raise self._file.damaged(str(error)) from None

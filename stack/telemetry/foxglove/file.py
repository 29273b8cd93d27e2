"""MCAP files for Foxglove."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import foxglove

from stack.telemetry.foxglove.drawing import FoxgloveDrawing
from stack.telemetry.recorder import write_all
from stack.telemetry.records import RunInfo

CLOCK = "seconds since the start of the robot's clock, shown as 1970-01-01T00:00:00Z"


@dataclass(frozen=True, slots=True)
class TopicSummary:
    """What a file has of a topic.

    Attributes:
        name: of the topic.
        schema: name of its messages' schema.
        messages: their number.
    """

    name: str
    schema: str
    messages: int


class FoxgloveFile:
    """An MCAP file with Foxglove's schemas; it appears with its name when it is complete.

    Args:
        path: of the file; replaced if it exists.
        info: of the run.
        about: texts about the run, stored as metadata.

    Raises:
        OSError: it cannot be written.

    Attributes:
        drawing: logs what the file shall contain.
    """

    def __init__(self, path: Path, info: RunInfo, about: Mapping[str, str]) -> None:
        self._path, self._part = path, path.with_name(f"{path.name}.part")
        self._output = _Output(self._part)
        context: Any = foxglove.Context()
        self._writer: Any = foxglove.open_mcap(self._output, context=context)
        self._writer.write_metadata("treepilot", {"clock": CLOCK, **about})
        if info.urdf:
            self.attach("robot.urdf", "application/xml", info.urdf.encode())
        self.drawing = FoxgloveDrawing(info, context)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        self._writer.close()
        self._output.close()
        if kind is None and self._output.error is None:
            os.replace(self._part, self._path)
            return
        self._part.unlink()
        if self._output.error is not None:
            raise self._output.error

    def attach(self, name: str, media_type: str, content: bytes) -> None:
        """Add a file as an attachment."""
        self._writer.attach(
            log_time=0, create_time=0, name=name, media_type=media_type, data=content
        )


class _Output:
    """A file that only counts bytes after an error.

    The library neither stops at an error nor says which one it was, and fails itself where its
    position is not what it has written.

    Args:
        path: of the file.

    Raises:
        OSError: it cannot be created.

    Attributes:
        error: the first one.
    """

    def __init__(self, path: Path) -> None:
        self._path, self._file = path, path.open("wb", buffering=0)
        self._position = self._end = 0
        self.error: OSError | None = None

    def write(self, data: bytes | bytearray) -> int:
        """Write as a whole, unless an earlier write has failed."""
        if self.error is None:
            try:
                write_all(self._file.fileno(), bytes(data))
            except OSError as error:
                self.error = OSError(error.errno, error.strerror, str(self._path))
        self._position += len(data)
        self._end = max(self._end, self._position)
        return len(data)

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Go to a position."""
        begins = {os.SEEK_SET: 0, os.SEEK_CUR: self._position, os.SEEK_END: self._end}
        self._position = begins[whence] + offset
        self._file.seek(self._position)
        return self._position

    def flush(self) -> None:
        """Nothing is buffered."""

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def summary_of(path: Path) -> list[TopicSummary]:
    """The topics of an MCAP file in alphabetical order, from its index."""
    from mcap.reader import make_reader

    with path.open("rb") as file:
        found = make_reader(file).get_summary()
    assert found is not None and found.statistics is not None, "FoxgloveFile writes an index"
    counts = found.statistics.channel_message_counts
    return sorted(
        (
            TopicSummary(channel.topic, found.schemas[channel.schema_id].name, counts[number])
            for number, channel in found.channels.items()
        ),
        key=lambda topic: topic.name,
    )

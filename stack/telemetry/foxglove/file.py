"""MCAP files for Foxglove."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import foxglove

from stack.telemetry.foxglove.drawing import FoxgloveDrawing
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
        self._file = self._part.open("wb")
        context: Any = foxglove.Context()
        self._writer: Any = foxglove.open_mcap(self._file, context=context)
        self._writer.write_metadata("treepilot", {"clock": CLOCK, **about})
        if info.urdf:
            self.attach("robot.urdf", "application/xml", info.urdf.encode())
        self.drawing = FoxgloveDrawing(info, context)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        self._writer.close()
        self._file.close()
        if kind is None:
            os.replace(self._part, self._path)
        else:
            self._part.unlink()

    def attach(self, name: str, media_type: str, content: bytes) -> None:
        """Add a file as an attachment."""
        self._writer.attach(
            log_time=0, create_time=0, name=name, media_type=media_type, data=content
        )


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

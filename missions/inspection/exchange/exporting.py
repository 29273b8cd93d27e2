"""`treepilot export`: a run as one file for other programs."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stack.columns import columns
from stack.documents.files import JSON_BYTES, YAML_BYTES, read_bytes
from stack.errors import InputError
from stack.optional_packages import FOXGLOVE
from stack.telemetry.hub import SENSORS, SNAPSHOTS
from stack.telemetry.sensor_log import read_observations
from stack.telemetry.snapshots.format import PICTURES
from stack.telemetry.snapshots.recording import SnapshotRecording
from stack.types import DepthImage, Image, Observation, Scan

if TYPE_CHECKING:
    from stack.telemetry.foxglove.drawing import FoxgloveDrawing
    from stack.telemetry.foxglove.file import TopicSummary

FILE = "foxglove.mcap"
"""Name of an exported file in the run folder."""

ATTACHED = {
    "mission.yaml": ("application/yaml", YAML_BYTES),
    "report.json": ("application/json", JSON_BYTES),
}
"""Files of the run folder that the export contains, if they are there."""


def export_mcap(folder: Path, file: Path) -> list[TopicSummary]:
    """Write a run as an MCAP file with Foxglove's schemas; return what it contains.

    Args:
        folder: of the run; of a live one, what is recorded so far is exported.
        file: to write; replaced if it exists.

    Raises:
        InputError: foxglove-sdk is not installed, the run has no snapshots or damaged records, or
            the file is one of its records.
        OSError: the file cannot be written.
    """
    FOXGLOVE.require("Foxglove's messages need")
    from stack.telemetry.foxglove.file import FoxgloveFile, summary_of

    if file.resolve() in {(folder / record).resolve() for record in (SNAPSHOTS, SENSORS)}:
        raise InputError(f"{file} is a record of the run and would be lost; choose another name")
    with SnapshotRecording(folder) as recording:
        info = recording.info
        about = {
            "run": info.run_id, "mission": info.title or info.mission, "robot": info.robot,
            "world": info.world, "seed": str(info.seed),
        }  # fmt: skip
        with FoxgloveFile(file, info, about) as exported:
            for name, (media_type, limit) in ATTACHED.items():
                if (folder / name).is_file():
                    exported.attach(name, media_type, read_bytes(folder / name, limit))
            _draw(recording, _observations(folder), exported.drawing)
    return summary_of(file)


def write_layout(file: Path) -> None:
    """Write a layout of Foxglove's panels for runs.

    Raises:
        InputError: foxglove-sdk is not installed.
        OSError: the file cannot be written.
    """
    FOXGLOVE.require("Foxglove's layouts need")
    from stack.telemetry.foxglove.layout import layout_json

    file.write_text(layout_json(), "utf-8")


def summary_lines(topics: list[TopicSummary]) -> list[str]:
    """A table of the topics of a file."""
    rows = [(topic.name, topic.schema, str(topic.messages)) for topic in topics]
    return columns([("TOPIC", "SCHEMA", "MESSAGES"), *rows], right=(2,))


def _draw(
    recording: SnapshotRecording, observations: Iterator[Observation], drawing: FoxgloveDrawing
) -> None:
    """Log everything in order of time."""
    taken: dict[str, Any] = {}
    told, waiting = 0, next(observations, None)
    if waiting is not None:  # the sensor log has all pictures, the snapshots one a second
        taken = dict.fromkeys(PICTURES.values())
    for number, time in enumerate(recording.times):
        while waiting is not None and waiting.time <= time:
            _draw_sensors(waiting, drawing)
            waiting = next(observations, None)
        end = recording.events_before(number)
        for event in recording.events(told, end):
            drawing.event(event)
        told = max(told, end)
        drawing.draw(replace(recording.snapshot(number), **taken))
    for event in recording.events(told, sys.maxsize):
        drawing.event(event)
    for observation in () if waiting is None else chain([waiting], observations):
        _draw_sensors(observation, drawing)


def _observations(folder: Path) -> Iterator[Observation]:
    """The measurements of the run, if they were recorded."""
    log = folder / SENSORS
    if log.is_file():
        yield from read_observations(log)


def _draw_sensors(observation: Observation, drawing: FoxgloveDrawing) -> None:
    """Log all measurements: scans and pictures as such, others as JSON."""
    for name, measurement in observation.measurements.items():
        if isinstance(measurement, Scan):
            drawing.scan(f"/sensors/{name}", measurement)
        elif isinstance(measurement, Image | DepthImage):
            drawing.image(name, measurement)
        else:
            drawing.value(f"/sensors/{name}", measurement.stamp, measurement)

"""Damages of run folders: what other versions wrote otherwise, and what a full disk cut off."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import msgpack
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.records import Message, Schema
from mcap.stream_reader import StreamReader

from stack.telemetry.snapshots.format import MAGIC

NOVELTY = {"of": ["a later version", 1, None]}
"""Value of a field that no version has."""

RECORDS = ("events.jsonl", "snapshots.mcap", "sensors.mcap", "report.json", "inputs.json")

Way = tuple[str | int, ...]
"""Keys and indices from the whole to a part of it."""


def cut(file: Path, share: float) -> None:
    """Cut a file after a share of its bytes."""
    with file.open("r+b") as content:
        content.truncate(int(share * file.stat().st_size))


def mappings(value: Any, way: Way = ()) -> Iterator[Way]:
    """Yield the ways to all mappings in a value."""
    if isinstance(value, dict):
        yield way
    items = value.items() if isinstance(value, dict) else enumerate(value)
    for key, item in items:
        if isinstance(item, dict | list):
            yield from mappings(item, (*way, key))


def fields(value: Any) -> Iterator[Way]:
    """Yield the ways to all fields of mappings in a value."""
    for way in mappings(value):
        yield from ((*way, key) for key in at(value, way))


def at(value: Any, way: Way) -> Any:
    """Return the part of a value."""
    for key in way:
        value = value[key]
    return value


def without(value: Any, way: Way) -> Any:
    """Remove a field from a value; return the value."""
    del at(value, way[:-1])[way[-1]]
    return value


def with_novelty(value: Any, way: Way) -> Any:
    """Add a field to the mapping at the end of a way; return the value."""
    at(value, way)["novelty"] = NOVELTY
    return value


def rewrite(file: Path, change: Callable[[Any], Any]) -> None:
    """Change the content of a JSON file, or all events together of an event log."""
    if file.suffix == ".jsonl":
        events = change([json.loads(line) for line in file.read_text("utf-8").splitlines()])
        file.write_text("".join(json.dumps(event) + "\n" for event in events), "utf-8")
    else:
        file.write_text(json.dumps(change(json.loads(file.read_text("utf-8")))), "utf-8")


def read(file: Path) -> Any:
    """Return the content of a JSON file, or the events of an event log."""
    found: list[Any] = []
    text = file.read_text("utf-8")
    if file.suffix == ".jsonl":
        found.extend(json.loads(line) for line in text.splitlines())
        return found
    return json.loads(text)


def rewrite_mcap(file: Path, schema: str, change: Callable[[dict[str, Any]], None]) -> None:
    """Change the fields of all messages of a schema, and of the schema itself if it is recorded.

    Args:
        file: snapshots.mcap or sensors.mcap.
        schema: name of the schema.
        change: changes the fields in place; of a schema they are texts.
    """
    packed = file.name == "snapshots.mcap"
    builder: Any = RecordBuilder()
    numbers: set[int] = set()
    channels: set[int] = set()
    with file.open("rb") as source:
        for record in StreamReader(source).records:
            if isinstance(record, Schema) and record.name == schema:
                numbers.add(record.id)
                if packed:
                    record.data = json.dumps(_changed(json.loads(record.data), change)).encode()
            if getattr(record, "schema_id", None) in numbers:
                channels.add(record.id)  # type: ignore[attr-defined]
            if isinstance(record, Message) and record.channel_id in channels:
                record.data = _encoded(_changed(_decoded(record.data, packed), change), packed)
            record.write(builder)
    file.write_bytes(MAGIC + builder.end() + MAGIC)


def _changed(values: dict[str, Any], change: Callable[[dict[str, Any]], None]) -> dict[str, Any]:
    change(values)
    return values


def _decoded(data: bytes, packed: bool) -> Any:
    return msgpack.unpackb(zstandard.ZstdDecompressor().decompress(data) if packed else data)


def _encoded(values: Any, packed: bool) -> bytes:
    data: bytes = msgpack.packb(values)
    return zstandard.ZstdCompressor().compress(data) if packed else data

"""Events as lines of JSON: the encoding that is written to events.jsonl and hashed (hub.py).

The hash of a run's events is the SHA-256 of the bytes of its events.jsonl.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from itertools import count
from math import isfinite
from pathlib import Path
from typing import Any

from stack.documents.files import RECORD_BYTES, open_regular
from stack.errors import TelemetryError
from stack.parameters import values_of
from stack.telemetry.codec import plain
from stack.telemetry.records import Event

_FIELDS = {
    "number": int,
    "step": int,
    "time": float,
    "level": str,
    "source": str,
    "kind": str,
    "text": str,
    "fields": dict,
}
_REQUIRED = ("number", "time", "kind")

_ADDRESS = re.compile(r"\b0x[0-9a-fA-F]{6,}\b")
_PATH = re.compile(r"(?<![\w.:/])/(?:[\w.+-]+/)+(?=[\w.+-])")


def without_local_details(text: str) -> str:
    """Remove memory addresses and the folders of absolute paths from a text.

    They differ between runs and machines, and the log is hashed.
    """
    if "/" not in text and "0x" not in text:
        return text
    return _PATH.sub("", _ADDRESS.sub("0x…", text))


def json_value(value: Any) -> Any:
    """Convert a value to JSON types: infinities and NaN become text, arrays become lists.

    Raises:
        TypeError: it contains something that is neither number, text, list nor mapping.
    """
    return _finite(plain(value))


def event_line(event: Event) -> bytes:
    """One line of JSON with a newline: sorted keys, shortest floats that round-trip exactly."""
    text = json.dumps(
        json_value(values_of(event)),
        sort_keys=True,
        ensure_ascii=False,
        allow_nan=False,
        separators=(",", ":"),
    )
    return text.encode("utf-8", "backslashreplace") + b"\n"


def read_events(path: Path) -> Iterator[Event]:
    """The events of an events.jsonl in order.

    A last line without newline, as a killed run leaves it, is skipped.

    Raises:
        TelemetryError: a complete line is not an event, or longer than RECORD_BYTES; names file and
            line.
        OSError: it cannot be read, or is not a regular file.
    """
    with open_regular(path) as lines:
        for number in count(1):
            line = lines.readline(RECORD_BYTES)
            if len(line) == RECORD_BYTES:
                raise TelemetryError(f"{path}:{number}: not an event: {RECORD_BYTES} bytes or more")
            if not line.endswith(b"\n"):
                return
            yield event_of(line, f"{path}:{number}")


def event_of(line: bytes, where: str) -> Event:
    """The event of a line. Another version may have written more fields, or fewer.

    Raises:
        TelemetryError: it is not an event; names the place `where`.
    """
    try:
        values = json.loads(line)
    except (ValueError, RecursionError) as error:
        raise TelemetryError(f"{where}: not an event: {error}") from None
    if not isinstance(values, dict) or not values.keys() >= {*_REQUIRED}:
        raise TelemetryError(f"{where}: not an event: expected the keys {', '.join(_REQUIRED)}")
    values = {"level": "info", **values}
    known = {name: values.get(name, kind()) for name, kind in _FIELDS.items()}
    for name, kind in _FIELDS.items():
        if type(known[name]) is not kind:
            raise TelemetryError(f"{where}: {name}: expected {kind.__name__}, got {known[name]!r}")
    return Event(**known)


def _finite(value: Any) -> Any:
    if isinstance(value, float) and not isfinite(value):
        return repr(value)
    if isinstance(value, Mapping):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_finite(item) for item in value]
    return value

"""Topics of a run, live or recorded: fields of its snapshots, its events and its sensors.

A message is what a topic said at one time. A snapshot is a message of its fields; a measurement
or a layer that is in several snapshots is one message.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, closing
from dataclasses import dataclass, fields, is_dataclass
from math import inf
from pathlib import Path
from time import monotonic  # noqa: TID251 - of a live run the rate is that of its messages
from types import NoneType
from typing import Any, get_args, get_type_hints

import numpy as np

from missions.execution.client import connect
from missions.inspection.run_folders import NEWEST, find_run
from stack.documents.yaml_nodes import as_yaml
from stack.errors import InputError
from stack.parameters import suggestion, values_of
from stack.telemetry.event_log import json_value, read_events
from stack.telemetry.hub import EVENTS as EVENT_FILE
from stack.telemetry.hub import SENSORS
from stack.telemetry.records import Layer, Snapshot
from stack.telemetry.rendezvous import matching_runs
from stack.telemetry.sensor_log import read_observations
from stack.telemetry.snapshots.recording import SnapshotRecording
from stack.types import DepthImage, Image, Scan

EVENTS, SENSOR, LAYERS = "events", "sensors.", "layers"
FIELDS = tuple(item.name for item in fields(Snapshot) if item.name not in ("time", "events"))

LONGEST_LIST = 12
"""Items that `echo` prints of a list; a longer one is summarised."""

MOST_SAMPLES = 40
"""Snapshots of a recording in which `list` looks for values."""

WINDOW = 1.0
"""Wall seconds of messages in one line of `hz` of a live run."""


@dataclass(frozen=True)
class Message:
    """What a topic said.

    Attributes:
        time: robot's clock, s.
        stamp: when it was measured; of what is not measured, `time`.
        received: wall seconds of the arrival; of a recorded run, `time`.
    """

    time: float
    stamp: float
    received: float
    value: Any


class LiveTopics:
    """Topics of a live run."""

    def __init__(self, run: str) -> None:
        self._open = ExitStack()
        self._robot = self._open.enter_context(connect(run))

    def snapshots(self) -> Iterator[tuple[float, Snapshot]]:
        """Yield the snapshots from now on with their wall times of arrival."""
        for snapshot in self._robot.snapshots():
            yield monotonic(), snapshot

    def samples(self) -> Iterator[Snapshot]:
        """Yield the newest snapshot."""
        yield next(self._robot.snapshots())

    def events(self) -> Iterator[Message]:
        """Yield the events from now on."""
        for event in self._robot.events():
            yield Message(event.time, event.time, monotonic(), values_of(event))

    def sensors(self) -> Mapping[str, str]:
        """Only a recording has them."""
        return {}

    def close(self) -> None:
        """Disconnect."""
        self._open.close()


class RecordedTopics:
    """Topics of a run folder."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._recording = folder, SnapshotRecording(folder)

    def snapshots(self) -> Iterator[tuple[float, Snapshot]]:
        """Yield all snapshots with their times."""
        for number, time in enumerate(self._recording.times):
            yield time, self._recording.snapshot(number)

    def samples(self) -> Iterator[Snapshot]:
        """Yield some snapshots, spread over the run."""
        count = len(self._recording.times)
        for number in sorted({*range(0, count, -(-count // MOST_SAMPLES)), count - 1}):
            yield self._recording.snapshot(number)

    def events(self) -> Iterator[Message]:
        """Yield all events."""
        for event in read_events(self._folder / EVENT_FILE):
            yield Message(event.time, event.time, event.time, values_of(event))

    def sensors(self) -> Mapping[str, str]:
        """Kind of the measurements by name of the sensor; empty if they are not recorded."""
        if not (self._folder / SENSORS).is_file():
            return {}
        kinds: dict[str, str] = {}
        for observation in read_observations(self._folder / SENSORS):
            for name, measurement in observation.measurements.items():
                kinds.setdefault(name, type(measurement).__name__)
        return kinds

    def measurements(self, sensor: str) -> Iterator[Message]:
        """Yield the measurements of a sensor."""
        for observation in read_observations(self._folder / SENSORS):
            if sensor in observation.measurements:
                found = observation.measurements[sensor]
                yield Message(observation.time, found.stamp, observation.time, found)

    def close(self) -> None:
        """Close the files."""
        self._recording.close()


Topics = LiveTopics | RecordedTopics


def topics_of(run: str) -> Topics:
    """Return the topics of a run.

    Args:
        run: folder, name or first digits of the identity of a live run; or folder of a recorded
            one, its name in ./runs, or `newest`. Empty: the only live run, else the newest one.

    Raises:
        InputError: there is no such run, or it has no snapshots.
        TelemetryError: several live runs match, or the run does not answer.
    """
    if matching_runs(run):
        return LiveTopics(run)
    return RecordedTopics(find_run(run or NEWEST, Path("runs")))


def list_lines(topics: Topics) -> Iterator[tuple[str, str, str]]:
    """Yield name and type of each topic, and whether it has no message so far."""
    with closing(topics):
        types = _field_types(topics.samples())
        for name in FIELDS:
            if name == LAYERS:
                layers = [one for one in types if one.startswith(f"{LAYERS}.")]
                yield from ((layer, types[layer], "") for layer in layers)
            elif name in types:
                yield name, types[name], ""
            else:
                yield name, _declared_type(name), "no message"
        yield EVENTS, "Event", ""
        for sensor, kind in topics.sensors().items():
            yield f"{SENSOR}{sensor}", kind, ""


def _field_types(snapshots: Iterable[Snapshot]) -> dict[str, str]:
    """Type of each field and layer that has a value in one of the snapshots."""
    types: dict[str, str] = {}
    for snapshot in snapshots:
        for name, layer in snapshot.layers.items():
            types.setdefault(f"{LAYERS}.{name}", type(layer.content).__name__)
        for name, value in values_of(snapshot).items():
            if value is not None:
                types.setdefault(name, _type_name(value))
    return types


def _declared_type(field: str) -> str:
    """Type of a field that may have no value: `Scan` of `Scan | None`."""
    kinds = [kind for kind in get_args(get_type_hints(Snapshot)[field]) if kind is not NoneType]
    return next(
        (kind.__name__ for kind in kinds if isinstance(kind, type) and is_dataclass(kind)), "array"
    )


def messages(topics: Topics, name: str) -> Iterator[Message]:
    """Yield the messages of a topic; a live run does not end.

    Args:
        topics: of the run.
        name: of a topic, or of a part of one: `pose.x`, `counters.replans`, `layers.map`.

    Raises:
        InputError: there is no such topic.
    """
    if name == EVENTS:
        return topics.events()
    if name.startswith(SENSOR):
        sensor, known = name.removeprefix(SENSOR), topics.sensors()
        if not isinstance(topics, RecordedTopics) or sensor not in known:
            hint = suggestion(sensor, known) if known else "run with `--record sensors`"
            raise InputError(f"no measurements of {sensor!r} are recorded; {hint}")
        return topics.measurements(sensor)
    if name.partition(".")[0] not in FIELDS:
        raise InputError(f"there is no topic {name!r}; {suggestion(name, [*FIELDS, EVENTS])}")
    return _fields(topics, name)


def echo(found: Iterable[Message], name: str, *, as_json: bool, full: bool) -> Iterator[str]:
    """Yield each message as text: a document of YAML, or a line of JSON."""
    for message in found:
        value = json_value(message.value if full or as_json else _shortened(message.value))
        if as_json:
            yield json.dumps({"time": message.time, "topic": name, "value": value})
        else:
            yield f"{as_yaml({'time': round(message.time, 3), name: value})}---"


def spaced(found: Iterable[Message], every: float) -> Iterator[Message]:
    """Yield the messages that are at least so many robot seconds apart."""
    last = -inf
    for message in found:
        if message.time - last >= every - 1e-9:
            last = message.time
            yield message


def rates(found: Iterable[Message], name: str, *, live: bool) -> Iterator[str]:
    """Yield a line with rate, periods and age: of each second of a live run, else of the whole."""
    window: list[Message] = []
    for message in found:
        window.append(message)
        if live and message.received - window[0].received >= WINDOW:
            yield _rate(window)
            window = [message]
    if not live or len(window) > 1:
        yield _rate(window)
    if not live and len(window) > 1 and name != EVENTS and not name.startswith(SENSOR):
        yield (
            "this is the rate of the recording (parameter recording.rate), not that of the robot; "
            "`--record sensors` records every measurement"
        )


def _rate(window: list[Message]) -> str:
    stamps = np.array([message.stamp for message in window])
    if len(stamps) < 2 or stamps[-1] <= stamps[0]:
        return f"{len(stamps)} message{'' if len(stamps) == 1 else 's'}, no rate"
    periods = np.diff(stamps)
    age = max(message.time - message.stamp for message in window)
    return (
        f"{len(periods) / (stamps[-1] - stamps[0]):.2f} Hz, period {periods.min():.3f} to "
        f"{periods.max():.3f} s, deviation {periods.std():.3f} s, age up to {age:.3f} s, "
        f"{len(stamps)} messages"
    )


def _fields(topics: Topics, name: str) -> Iterator[Message]:
    last: object = None
    for received, snapshot in topics.snapshots():
        value = _part(snapshot, name)
        if value is None:
            continue
        stamp, version = snapshot.time, object()
        if isinstance(value, Scan | Image | DepthImage):
            stamp = version = value.stamp
        elif isinstance(value, Layer):
            version = value.version
        else:
            version = snapshot.time
        if version != last:
            last = version
            yield Message(snapshot.time, stamp, received, value)


def _part(value: Any, name: str) -> Any:
    """The part of a value that a dotted name means; None while there is none."""
    rest = name
    while rest and value is not None:
        if isinstance(value, Mapping):
            return _entry(value, rest, name)
        head, _, rest = rest.partition(".")
        known = values_of(value) if is_dataclass(value) else {}
        if head not in known:
            hint = suggestion(head, known) if known else f"a {type(value).__name__} has no parts"
            raise InputError(f"there is no {head!r} in the topic {name!r}; {hint}")
        value = known[head]
    return value


def _entry(values: Mapping[str, Any], rest: str, name: str) -> Any:
    """The entry of a mapping, whose keys may have dots, and what of it is meant."""
    for key, value in values.items():
        if rest == key or rest.startswith(f"{key}."):
            return _part(value, rest[len(key) + 1 :])
    raise InputError(f"there is no {rest!r} in the topic {name!r}; {suggestion(rest, values)}")


def _shortened(value: Any) -> Any:
    """A value in which long lists are replaced by their size and range."""
    if isinstance(value, np.ndarray):
        return _summary(value) if value.size > LONGEST_LIST else value
    if isinstance(value, Mapping):
        return {key: _shortened(item) for key, item in value.items()}
    if is_dataclass(value) and not isinstance(value, type):
        return {key: _shortened(item) for key, item in values_of(value).items()}
    if isinstance(value, list | tuple):
        return [_shortened(item) for item in value]
    return value


def _summary(array: np.ndarray[Any, Any]) -> str:
    size = " × ".join(map(str, array.shape))
    known = array[np.isfinite(array)] if array.dtype.kind == "f" else array
    if known.size == 0 or known.dtype.kind not in "fiu":
        return f"{size} values"
    return f"{size} values, {known.min():g} to {known.max():g}"


def _type_name(value: Any) -> str:
    return f"array {value.dtype}" if isinstance(value, np.ndarray) else type(value).__name__


def take(count: int | None, items: Iterable[str], show: Callable[[str], None]) -> None:
    """Show so many of the items, or all."""
    for number, item in enumerate(items, start=1):
        show(item)
        if number == count:
            return

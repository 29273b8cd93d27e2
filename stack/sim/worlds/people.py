"""Readers of the people of a world file, and of recorded tracks."""

from __future__ import annotations

from pathlib import Path as FilePath

import numpy as np

from stack.documents import Section
from stack.documents.files import TooLargeError, read_bytes
from stack.parameters import Declaration
from stack.sim.worlds.values import PLACEMENT, SHAPE, Reading, fields_of
from stack.sim.worlds.world import Person
from stack.types import FloatArray, Pose2D

NAME = Declaration("name", str, "name for reports")
TRACK = Declaration("track", str, "file of recorded tracks", default="")
FRAME_RATE = Declaration(
    "frame_rate", float, "frames per second", "Hz", 25.0, above=0.0, at_most=1000.0
)

ONLY_OF = {
    "yields": ("loop",),
    "waypoints": ("loop", "social_force"),
    "speed": ("loop", "social_force"),
    "pause": ("loop", "social_force"),
    "start": ("loop", "social_force"),
    "attention": ("social_force",),
    "group": ("social_force",),
    "track": ("recorded",),
    "frame_rate": ("recorded",),
    "at": ("recorded",),
}
"""The models that a key is for; the others are for all."""

MAX_TRACKS = 1000
MAX_BYTES = 20_000_000

SMOOTHING = np.array([1.0, 2.0, 3.0, 2.0, 1.0])
"""Weights of a sample and its neighbours: hand-made tracks are rough."""


def people(reading: Reading, section: Section) -> tuple[Person, ...] | None:
    """Read an entry of `people`: one person, or all of a recording."""
    name, values = section.value(NAME), fields_of(section, Person)
    model = values["model"]
    track, rate = section.value(TRACK), section.value(FRAME_RATE)
    at = section.node_of("at")
    pose = Pose2D(0.0, 0.0) if at is None else reading.pose(section, "at", at)
    recorded = model == "recorded"
    waypoints = None
    if not recorded:
        waypoints = reading.points(section, "waypoints", 1 if model == "social_force" else 2)
    _refuse_others(reading, section, model)
    named = section.node.get("name")
    if name is not None and named is not None:
        reading.take("person", name, named.mark)
    if name is None or model is None:
        return None
    if recorded:
        if pose is None or not rate:
            return None
        return _recorded(reading, section, name, track, rate, pose, values["radius"])
    return None if waypoints is None else (Person(name, waypoints, **values),)


def _refuse_others(reading: Reading, section: Section, model: str | None) -> None:
    """Report the keys that are for another model."""
    for key, models in ONLY_OF.items():
        node = section.node.get(key)
        if model is not None and node is not None and model not in models:
            sentence = f"{key!r} has no effect with model: {model}"
            hint = f"it is for {' and '.join(models)}"
            reading.findings.add(SHAPE, node.mark, sentence, hint)


def _recorded(  # noqa: PLR0913 - the keys of one entry
    reading: Reading, section: Section, name: str, file: str, rate: float, at: Pose2D,
    radius: float,
) -> tuple[Person, ...] | None:  # fmt: skip
    node = section.node.get("track")
    if node is None or not file:
        hint = "add track: FILE, with lines of frame, number, x and y"
        reading.findings.add(SHAPE, section.node.mark, "a recording needs its track", hint)
        return None
    try:
        tracks = read_tracks(reading.folder / FilePath(file).expanduser(), rate, at)
    except OSError as error:
        reading.findings.add(PLACEMENT, node.mark, f"track {file!r:.80}: {error.strerror}")
    except ValueError as error:
        reading.findings.add(PLACEMENT, node.mark, f"track {file!r:.80}: {error}")
    else:
        duration = max(float(track[-1, 0]) for track in tracks.values())
        return tuple(
            Person(
                f"{name} {number}", track[:, 1:3].copy(), radius=radius, yields=False,
                model="recorded", track=track, recorded_duration=duration,
            )
            for number, track in tracks.items()
        )  # fmt: skip
    return None


def read_tracks(path: FilePath, rate: float, at: Pose2D) -> dict[int, FloatArray]:
    """Read tracks of pedestrians: lines of frame, number of the person, x and y.

    Args:
        path: text file; the columns are separated by spaces, tabs or commas.
        rate: frames per second.
        at: pose of the recording's frame in the world.

    Returns:
        number -> (n, 5) seconds from the first frame, smoothed x, y, metres, and velocity, m/s, of
        each person with two samples or more.

    Raises:
        OSError: the file cannot be read.
        ValueError: it is no such file.
    """
    table = _table(path)
    table[:, 0] = (table[:, 0] - table[:, 0].min()) / rate
    numbers = [int(number) for number in np.unique(table[:, 1])]
    if len(numbers) > MAX_TRACKS:
        raise ValueError(f"{len(numbers)} people; at most {MAX_TRACKS} are possible")
    found = {}
    for number in numbers:
        own = table[table[:, 1] == number]
        own = own[np.unique(own[:, 0], return_index=True)[1]]
        if len(own) > 1:
            found[number] = _smoothed(own[:, 0], own[:, 2:], at)
    if not found:
        raise ValueError("nobody in it has two samples")
    return found


def _table(path: FilePath) -> FloatArray:
    """Return the lines of a file of tracks: (n, 4) frame, number, x and y."""
    try:
        text = read_bytes(path, MAX_BYTES).decode("utf-8", "replace")
    except TooLargeError:
        raise ValueError(f"larger than {MAX_BYTES // 1_000_000} MB") from None
    rows = []
    for count, line in enumerate(text.splitlines(), 1):
        words = line.replace(",", " ").split()
        if not words or words[0].startswith("#"):
            continue
        try:
            row = [float(word) for word in words]
        except ValueError:
            row = []
        if len(row) != 4 or not all(np.isfinite(row)):
            wanted = "expected frame, number, x and y"
            raise ValueError(f"line {count}: {wanted}, got {line.strip()!r:.60}")
        rows.append(row)
    if not rows:
        raise ValueError("the file has no tracks")
    return np.array(rows)


def _smoothed(times: FloatArray, points: FloatArray, at: Pose2D) -> FloatArray:
    """Return (n, 5) times, smoothed points in the world, and their velocities."""
    c, s = np.cos(at.heading), np.sin(at.heading)
    world = points @ np.array([[c, s], [-s, c]]) + (at.x, at.y)
    weights = SMOOTHING / SMOOTHING.sum()
    smooth = world.copy()
    if len(world) >= 5:
        for axis in range(2):
            smooth[2:-2, axis] = np.convolve(world[:, axis], weights, "valid")
    velocities = np.gradient(smooth, times, axis=0)
    return np.ascontiguousarray(np.column_stack([times, smooth, velocities]))

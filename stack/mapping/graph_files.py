"""Files of a pose graph: a folder with graph.json and graph.npz, and g2o.

graph.json has the format version and the numbers of keyframes and edges; graph.npz has the arrays,
which keep every bit; graphs with markers have arrays of landmarks, sightings and their candidates.
g2o (R. Kümmerle et al., "g2o: A general framework for graph optimization", ICRA 2011) has
VERTEX_SE2 and EDGE_SE2 lines of the keyframes, and no scans; it is written for other programs only.
Code: E403.
"""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Callable, Iterable
from math import cos, sin
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stack.documents.files import JSON_BYTES, RECORD_BYTES, decoded, read_input
from stack.errors import Finding, InputError, Mark, ParameterError
from stack.mapping.slam.graph import (
    EDGE_KINDS,
    Edge,
    Keyframe,
    Landmark,
    PoseGraph,
    Sighting,
)
from stack.types import FloatArray, Pose2D, RelativePose, Scan

GRAPH = "E403"
FORMAT = "treepilot pose graph"
VERSION = 1
HEADER, ARRAYS = "graph.json", "graph.npz"
ARRAY_BYTES = RECORD_BYTES * 64
"""Of graph.npz: about 10 million beams."""

UPPER = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
"""Entries of an information matrix in the order of g2o."""

SCAN_FIELDS = ("angle_min", "angle_increment", "range_min", "range_max", "time_increment")

Columns = dict[str, tuple[type, tuple[int, ...], Callable[[Any], Any]]]
"""Arrays with one row for each of some things: type, shape of a row, and the row of a thing."""

KEYFRAMES: Columns = {
    "ids": (np.int64, (), attrgetter("id")),
    "stamps": (np.float64, (), attrgetter("stamp")),
    "poses": (np.float64, (3,), lambda frame: _row(frame.pose)),
    "odometry": (np.float64, (3,), lambda frame: _row(frame.odometry)),
    "sessions": (np.int64, (), attrgetter("session")),
    "mounts": (np.float64, (3,), lambda frame: _row(frame.scan.mount)),
    "geometry": (np.float64, (5,), lambda frame: attrgetter(*SCAN_FIELDS)(frame.scan)),
    "scan_stamps": (np.float64, (), attrgetter("scan.stamp")),
    "beams": (np.int64, (), attrgetter("scan.ranges.size")),
    "deskewed": (np.bool_, (), lambda frame: frame.scan.bearings is not None),
}
EDGES: Columns = {
    "sources": (np.int64, (), attrgetter("source")),
    "targets": (np.int64, (), attrgetter("target")),
    "relatives": (np.float64, (3,), lambda edge: _row(edge.relative)),
    "informations": (np.float64, (3, 3), attrgetter("information")),
    "kinds": (np.int64, (), lambda edge: EDGE_KINDS.index(edge.kind)),
}
LANDMARKS: Columns = {
    "landmark_dictionaries": (np.str_, (), lambda item: item[0][0]),
    "landmark_numbers": (np.int64, (), lambda item: item[0][1]),
    "landmark_sizes": (np.float64, (), lambda item: item[1].size),
    "landmark_placed": (np.bool_, (), lambda item: item[1].pose is not None),
    "landmark_poses": (np.float64, (3,), lambda item: _row(item[1].pose or Pose2D(0.0, 0.0))),
}
"""Of dictionary and number, and landmark."""

SIGHTINGS: Columns = {
    "sighting_landmarks": (np.int64, (), lambda item: item[0]),
    "sighting_keyframes": (np.int64, (), lambda item: item[1]),
    "sighting_heights": (np.float64, (), lambda item: item[2].height),
}
"""Of the row of the landmark, keyframe, and sighting."""

CANDIDATES: Columns = {
    "candidate_sightings": (np.int64, (), lambda item: item[0]),
    "candidate_poses": (np.float64, (3,), lambda item: _row(item[1].pose)),
    "candidate_covariances": (np.float64, (3, 3), lambda item: item[1].covariance),
    "candidate_shares": (np.float64, (), lambda item: item[1].share),
}
"""Of the row of the sighting, and candidate."""


def graph_contents(graph: PoseGraph, epoch: float = 0.0) -> dict[str, bytes]:
    """Return the contents of the files of a graph, by name.

    Args:
        graph: the graph.
        epoch: time at which the stamps are 0, seconds since 1970.
    """
    frames = list(graph.keyframes.values())
    scans = [frame.scan for frame in frames]
    bearings = [scan.bearings for scan in scans if scan.bearings is not None]
    arrays: dict[str, Any] = {
        **_arrays(KEYFRAMES, frames),
        "ranges": np.concatenate([np.zeros(0, np.float32), *(scan.ranges for scan in scans)]),
        "bearings": np.concatenate([np.zeros(0), *bearings]),
        **_arrays(EDGES, graph.edges),
        **_landmark_arrays(graph),
    }
    packed = io.BytesIO()
    np.savez_compressed(packed, allow_pickle=False, **arrays)
    header = {
        "format": FORMAT, "version": VERSION, "keyframes": len(frames),
        "edges": len(graph.edges), "kinds": list(EDGE_KINDS), "epoch": epoch,
    }  # fmt: skip
    return {HEADER: (json.dumps(header, indent=2) + "\n").encode(), ARRAYS: packed.getvalue()}


def saved_files(graph: PoseGraph) -> dict[str, bytes]:
    """Return the contents of the files of a graph, with g2o and trajectory of the keyframes."""
    frames = list(graph.keyframes.values())
    stamps = np.array([frame.stamp for frame in frames], dtype=np.float64)
    poses = [frame.pose for frame in frames]
    return {
        **graph_contents(graph),
        "graph.g2o": g2o_text(graph).encode(),
        "trajectory.tum": tum_text(stamps, poses).encode(),
        "trajectory.txt": plain_text(stamps, poses).encode(),
    }


def check_graph(folder: Path) -> None:
    """Check the header of a saved map's graph.

    Raises:
        InputError: it is missing, of another version, or damaged.
    """
    if not (folder / HEADER).is_file():
        raise InputError(
            f"the map has no pose graph ({HEADER}): it was not saved with `localisation: slam`;"
            " use `localisation: mcl`"
        )
    _header(folder / HEADER)


def read_graph(folder: Path) -> PoseGraph:
    """Read the graph of a folder.

    Raises:
        InputError: a file is missing, of another version, or damaged.
    """
    header = _header(folder / HEADER)
    file = folder / ARRAYS
    raw = read_input(file, "pose graph", ARRAY_BYTES)
    try:
        with np.load(io.BytesIO(raw), allow_pickle=False) as packed:
            arrays = {name: packed[name] for name in packed.files}
        _check(arrays, header)
        return _graph(arrays, [str(kind) for kind in header["kinds"]])
    except (
        ValueError, KeyError, IndexError, TypeError, EOFError, OSError, zipfile.BadZipFile,
        ParameterError, NotImplementedError,
    ) as error:  # fmt: skip
        words = " ".join(str(error).split())[:200] or type(error).__name__
        raise _refusal(file, f"the pose graph is damaged: {words}") from None


def g2o_text(graph: PoseGraph) -> str:
    """Return a graph in the format of g2o; the first keyframe is fixed."""
    lines = [
        f"VERTEX_SE2 {frame.id} {_numbers(frame.pose)}\n" for frame in graph.keyframes.values()
    ]
    lines += [f"FIX {number}\n" for number in list(graph.keyframes)[:1]]
    for edge in graph.edges:
        weights = " ".join(repr(float(edge.information[at])) for at in UPPER)
        lines.append(f"EDGE_SE2 {edge.source} {edge.target} {_numbers(edge.relative)} {weights}\n")
    return "".join(lines)


def tum_text(stamps: FloatArray, poses: list[Pose2D]) -> str:
    """Return a trajectory with the lines `t x y z qx qy qz qw`; stamps (n,) seconds.

    J. Sturm et al., "A Benchmark for the Evaluation of RGB-D SLAM Systems", IROS 2012.
    """
    return "".join(
        f"{stamp:.6f} {pose.x!r} {pose.y!r} 0 0 0 {sin(pose.heading / 2)!r} "
        f"{cos(pose.heading / 2)!r}\n"
        for stamp, pose in zip(stamps.tolist(), poses, strict=True)
    )


def plain_text(stamps: FloatArray, poses: list[Pose2D]) -> str:
    """Return a trajectory with the lines `t x y theta`; stamps (n,) seconds."""
    return "".join(
        f"{stamp:.6f} {pose.x!r} {pose.y!r} {pose.heading!r}\n"
        for stamp, pose in zip(stamps.tolist(), poses, strict=True)
    )


def _header(file: Path) -> dict[str, Any]:
    text = decoded(read_input(file, "pose graph", JSON_BYTES), file)
    try:
        header = json.loads(text)
    except ValueError as error:
        raise _refusal(file, f"this is not JSON: {error}") from None
    if not isinstance(header, dict) or header.get("format") != FORMAT:
        raise _refusal(file, "this is not a pose graph of treepilot")
    if header.get("version") != VERSION:
        sentence = f"this version reads format {VERSION}, the file has {header.get('version')!r}"
        raise _refusal(file, sentence)
    return header


def _check(arrays: dict[str, Any], header: dict[str, Any]) -> None:
    """Check the shapes of the arrays.

    Raises:
        ValueError: an array is missing, has another shape, or holds numbers that are not finite.
    """
    _check_group(arrays, KEYFRAMES, header["keyframes"])
    _check_group(arrays, EDGES, header["edges"])
    if "landmark_numbers" in arrays:
        for columns in (LANDMARKS, SIGHTINGS, CANDIDATES):
            _check_group(arrays, columns)
    beams = arrays["beams"]
    if arrays["ranges"].shape != (beams.sum(),) or (beams < 0).any():
        raise ValueError(f"ranges has the shape {arrays['ranges'].shape}, not ({beams.sum()},)")
    if arrays["bearings"].shape != (beams[arrays["deskewed"]].sum(),):
        raise ValueError(f"bearings has the shape {arrays['bearings'].shape}")


def _check_group(arrays: dict[str, Any], columns: Columns, count: int | None = None) -> None:
    """Check arrays with one row for each of `count` things; by default as many as the first has."""
    for name, (_, shape, _) in columns.items():
        if name not in arrays:
            raise ValueError(f"{name} is missing")
        count = len(arrays[name]) if count is None else count
        if arrays[name].shape != (count, *shape):
            raise ValueError(f"{name} has the shape {arrays[name].shape}, not {(count, *shape)}")
        if arrays[name].dtype.kind != "U" and not np.isfinite(arrays[name]).all():
            raise ValueError(f"{name} has numbers that are not finite")


def _landmark_arrays(graph: PoseGraph) -> dict[str, Any]:
    """Return the arrays of the landmarks; none of a graph without them."""
    seen = [(n, keyframe, sighting) for n, mark in enumerate(graph.landmarks.values())
            for keyframe, sighting in mark.sightings.items()]  # fmt: skip
    rows = [(n, one) for n, (_, _, sighting) in enumerate(seen) for one in sighting.candidates]
    if not graph.landmarks:
        return {}
    return {
        **_arrays(LANDMARKS, graph.landmarks.items()),
        **_arrays(SIGHTINGS, seen),
        **_arrays(CANDIDATES, rows),
    }


def _arrays(columns: Columns, things: Iterable[Any]) -> dict[str, NDArray[Any]]:
    """Return the arrays of some things, one row for each."""
    things = list(things)
    return {
        name: np.array([value(thing) for thing in things], kind).reshape(-1, *shape)
        for name, (kind, shape, value) in columns.items()
    }


def _add_landmarks(graph: PoseGraph, arrays: dict[str, Any]) -> None:
    """Add the landmarks of the arrays to a graph."""
    candidates: dict[int, list[RelativePose]] = {}
    for n, sighting in enumerate(arrays["candidate_sightings"].tolist()):
        pose, share = _pose(arrays["candidate_poses"][n].tolist()), arrays["candidate_shares"][n]
        covariance = arrays["candidate_covariances"][n].astype(np.float64)
        candidates.setdefault(sighting, []).append(RelativePose(pose, covariance, float(share)))
    names, numbers = arrays["landmark_dictionaries"].tolist(), arrays["landmark_numbers"].tolist()
    keys = list(zip(names, numbers, strict=True))
    for n, key in enumerate(keys):
        placed = _pose(arrays["landmark_poses"][n].tolist())
        is_placed = bool(arrays["landmark_placed"][n])
        size = float(arrays["landmark_sizes"][n])
        graph.landmarks[key] = Landmark(size, {}, placed if is_placed else None)
    for n, landmark in enumerate(arrays["sighting_landmarks"].tolist()):
        key, keyframe = keys[landmark], int(arrays["sighting_keyframes"][n])
        height = float(arrays["sighting_heights"][n])
        seen = Sighting(tuple(candidates[n]), height)
        graph.add_sighting(key, graph.landmarks[key].size, keyframe, seen)


def _graph(arrays: dict[str, Any], kinds: list[str]) -> PoseGraph:
    graph = PoseGraph()
    ends = np.cumsum(arrays["beams"])
    turned = np.cumsum(np.where(arrays["deskewed"], arrays["beams"], 0))
    for n, number in enumerate(arrays["ids"].tolist()):
        beams = int(arrays["beams"][n])
        ranges = arrays["ranges"][ends[n] - beams : ends[n]].astype(np.float32)
        bearings: FloatArray | None = None
        if arrays["deskewed"][n]:
            bearings = arrays["bearings"][turned[n] - beams : turned[n]].astype(np.float64)
        geometry = dict(zip(SCAN_FIELDS, arrays["geometry"][n].tolist(), strict=True))
        scan = Scan(
            float(arrays["scan_stamps"][n]), ranges, mount=_pose(arrays["mounts"][n].tolist()),
            bearings=bearings, **geometry,
        )  # fmt: skip
        pose, odometry = (_pose(arrays[name][n].tolist()) for name in ("poses", "odometry"))
        stamp, session = float(arrays["stamps"][n]), int(arrays["sessions"][n])
        graph.add_keyframe(Keyframe(number, stamp, pose, odometry, scan, session))
    known = {kind: kind for kind in EDGE_KINDS}
    for n, source in enumerate(arrays["sources"].tolist()):
        target, relative = int(arrays["targets"][n]), _pose(arrays["relatives"][n].tolist())
        information = arrays["informations"][n].astype(np.float64)
        kind = known[kinds[arrays["kinds"][n]]]
        graph.add_edge(Edge(source, target, relative, information, kind))
    if "landmark_numbers" in arrays:
        _add_landmarks(graph, arrays)
    return graph


def _row(pose: Pose2D) -> tuple[float, float, float]:
    return pose.x, pose.y, pose.heading


def _numbers(pose: Pose2D) -> str:
    return " ".join(repr(float(value)) for value in _row(pose))


def _pose(values: list[float]) -> Pose2D:
    return Pose2D(*values)


def _refusal(file: Path, sentence: str) -> InputError:
    return InputError([Finding(Mark(str(file)), GRAPH, sentence)])

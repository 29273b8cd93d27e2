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
from collections.abc import Mapping
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np

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
from stack.mapping.trajectories import plain_text, tum_text
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
KEYFRAME_ARRAYS = {
    "ids": (), "stamps": (), "poses": (3,), "odometry": (3,), "sessions": (), "mounts": (3,),
    "geometry": (len(SCAN_FIELDS),), "scan_stamps": (), "beams": (), "deskewed": (),
}  # fmt: skip
EDGE_ARRAYS = {
    "sources": (), "targets": (), "relatives": (3,), "informations": (3, 3), "kinds": (),
}  # fmt: skip
LANDMARK_ARRAYS = {
    "landmark_dictionaries": (), "landmark_numbers": (), "landmark_sizes": (),
    "landmark_placed": (), "landmark_poses": (3,),
}  # fmt: skip
SIGHTING_ARRAYS = {"sighting_landmarks": (), "sighting_keyframes": (), "sighting_heights": ()}
CANDIDATE_ARRAYS = {
    "candidate_sightings": (), "candidate_poses": (3,), "candidate_covariances": (3, 3),
    "candidate_shares": (),
}  # fmt: skip


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
        "ids": np.array([frame.id for frame in frames], np.int64),
        "stamps": np.array([frame.stamp for frame in frames], np.float64),
        "poses": _rows([frame.pose for frame in frames]),
        "odometry": _rows([frame.odometry for frame in frames]),
        "sessions": np.array([frame.session for frame in frames], np.int64),
        "mounts": _rows([scan.mount for scan in scans]),
        "geometry": np.array(
            [attrgetter(*SCAN_FIELDS)(scan) for scan in scans], np.float64
        ).reshape(-1, len(SCAN_FIELDS)),
        "scan_stamps": np.array([scan.stamp for scan in scans], np.float64),
        "beams": np.array([scan.ranges.size for scan in scans], np.int64),
        "deskewed": np.array([scan.bearings is not None for scan in scans], np.bool_),
        "ranges": np.concatenate([np.zeros(0, np.float32), *(scan.ranges for scan in scans)]),
        "bearings": np.concatenate([np.zeros(0), *bearings]),
        "sources": np.array([edge.source for edge in graph.edges], np.int64),
        "targets": np.array([edge.target for edge in graph.edges], np.int64),
        "relatives": _rows([edge.relative for edge in graph.edges]),
        "informations": np.array(
            [edge.information for edge in graph.edges], np.float64
        ).reshape(-1, 3, 3),
        "kinds": np.array([EDGE_KINDS.index(edge.kind) for edge in graph.edges], np.int64),
        **_landmark_arrays(graph),
    }  # fmt: skip
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
    """Check the header of a folder's graph.

    Raises:
        InputError: it is missing, of another version, or damaged.
    """
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
    _check_group(arrays, KEYFRAME_ARRAYS, header["keyframes"])
    _check_group(arrays, EDGE_ARRAYS, header["edges"])
    if "landmark_numbers" in arrays:
        _check_group(arrays, LANDMARK_ARRAYS)
        _check_group(arrays, SIGHTING_ARRAYS)
        _check_group(arrays, CANDIDATE_ARRAYS)
    beams = arrays["beams"]
    if arrays["ranges"].shape != (beams.sum(),) or (beams < 0).any():
        raise ValueError(f"ranges has the shape {arrays['ranges'].shape}, not ({beams.sum()},)")
    if arrays["bearings"].shape != (beams[arrays["deskewed"]].sum(),):
        raise ValueError(f"bearings has the shape {arrays['bearings'].shape}")


def _check_group(
    arrays: dict[str, Any], wanted: Mapping[str, tuple[int, ...]], count: int | None = None
) -> None:
    """Check arrays with one row for each of `count` things; by default as many as the first has."""
    for name, shape in wanted.items():
        if name not in arrays:
            raise ValueError(f"{name} is missing")
        count = len(arrays[name]) if count is None else count
        if arrays[name].shape != (count, *shape):
            raise ValueError(f"{name} has the shape {arrays[name].shape}, not {(count, *shape)}")
        if arrays[name].dtype.kind != "U" and not np.isfinite(arrays[name]).all():
            raise ValueError(f"{name} has numbers that are not finite")


def _landmark_arrays(graph: PoseGraph) -> dict[str, Any]:
    """Return the arrays of the landmarks; none of a graph without them."""
    marks = list(graph.landmarks.values())
    if not marks:
        return {}
    seen = [(n, number, one) for n, mark in enumerate(marks)
            for number, one in mark.sightings.items()]  # fmt: skip
    rows = [(n, one) for n, (_, _, sighting) in enumerate(seen) for one in sighting.candidates]
    covariances = np.array([one.covariance for _, one in rows], np.float64)
    return {
        "landmark_dictionaries": np.array([dictionary for dictionary, _ in graph.landmarks]),
        "landmark_numbers": np.array([number for _, number in graph.landmarks], np.int64),
        "landmark_sizes": np.array([mark.size for mark in marks], np.float64),
        "landmark_placed": np.array([mark.pose is not None for mark in marks], np.bool_),
        "landmark_poses": _rows([mark.pose or Pose2D(0.0, 0.0) for mark in marks]),
        "sighting_landmarks": np.array([n for n, _, _ in seen], np.int64),
        "sighting_keyframes": np.array([number for _, number, _ in seen], np.int64),
        "sighting_heights": np.array([one.height for _, _, one in seen], np.float64),
        "candidate_sightings": np.array([n for n, _ in rows], np.int64),
        "candidate_poses": _rows([one.pose for _, one in rows]),
        "candidate_covariances": covariances.reshape(-1, 3, 3),
        "candidate_shares": np.array([one.share for _, one in rows], np.float64),
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
        graph.add_keyframe(
            Keyframe(
                number,
                float(arrays["stamps"][n]),
                _pose(arrays["poses"][n].tolist()),
                _pose(arrays["odometry"][n].tolist()),
                scan,
                int(arrays["sessions"][n]),
            )
        )
    known = {kind: kind for kind in EDGE_KINDS}
    for n, source in enumerate(arrays["sources"].tolist()):
        graph.add_edge(
            Edge(
                source,
                int(arrays["targets"][n]),
                _pose(arrays["relatives"][n].tolist()),
                arrays["informations"][n].astype(np.float64),
                known[kinds[arrays["kinds"][n]]],
            )
        )
    if "landmark_numbers" in arrays:
        _add_landmarks(graph, arrays)
    return graph


def _rows(poses: list[Pose2D]) -> FloatArray:
    rows = [(pose.x, pose.y, pose.heading) for pose in poses]
    return np.array(rows, dtype=np.float64).reshape(-1, 3)


def _numbers(pose: Pose2D) -> str:
    return f"{float(pose.x)!r} {float(pose.y)!r} {float(pose.heading)!r}"


def _pose(values: list[float]) -> Pose2D:
    x, y, heading = values
    return Pose2D(x, y, heading)


def _refusal(file: Path, sentence: str) -> InputError:
    return InputError([Finding(Mark(str(file)), GRAPH, sentence)])

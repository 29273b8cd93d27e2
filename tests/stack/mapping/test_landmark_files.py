"""Landmarks in the files of a pose graph: round trips, older files, damaged ones."""

import io

import numpy as np
import pytest

from stack.errors import InputError
from stack.mapping.graph_files import ARRAYS, graph_contents, read_graph
from stack.mapping.slam.graph import Keyframe, PoseGraph, Sighting
from stack.mapping.whole_files import replace_folder
from stack.types import Pose2D, RelativePose, Scan

SCAN = Scan(0.0, np.array([1.0, 2.0], np.float32), -1.0, 0.1, 0.05, 12.0)


def graph_with_landmarks() -> PoseGraph:
    """One landmark with two sightings, of which one is ambiguous; one that is not placed yet."""
    graph = PoseGraph()
    for number in (3, 5):
        pose = Pose2D(0.5 * number, 0.25)
        graph.add_keyframe(Keyframe(number, float(number), pose, pose, SCAN))
    poses = [RelativePose(Pose2D(1.0, 0.5, k), (1.0 + k) * np.eye(3) / 7, 0.5) for k in (0.1, 0.2)]
    graph.add_sighting(("DICT_4X4_50", 7), 0.2, 3, Sighting(tuple(poses), 0.41))
    graph.add_sighting(("DICT_4X4_50", 7), 0.2, 5, Sighting((poses[1],), 0.39))
    graph.add_sighting(("DICT_5X5_100", 7), 0.1, 5, Sighting((poses[0],), 0.8))
    graph.landmarks["DICT_4X4_50", 7].pose = Pose2D(1 / 3, -2.0, 3.0)
    return graph


def test_landmarks_read_back_bit_for_bit(tmp_path):
    graph = graph_with_landmarks()
    replace_folder(tmp_path / "map", graph_contents(graph))
    read = read_graph(tmp_path / "map")
    assert list(read.landmarks) == list(graph.landmarks)
    for key, mark in graph.landmarks.items():
        other = read.landmarks[key]
        assert (other.size, other.pose, other.height) == (mark.size, mark.pose, mark.height)
        assert list(other.sightings) == list(mark.sightings)
        for number, seen in mark.sightings.items():
            for one, its in zip(seen.candidates, other.sightings[number].candidates, strict=True):
                assert (one.pose, one.share) == (its.pose, its.share)
                assert np.array_equal(one.covariance, its.covariance)


def changed(folder, **arrays):
    """Replace arrays of the file, or remove those that are None."""
    with np.load(folder / ARRAYS) as packed:
        kept = {name: packed[name] for name in packed.files} | arrays
    raw = io.BytesIO()
    np.savez_compressed(raw, **{name: value for name, value in kept.items() if value is not None})
    (folder / ARRAYS).write_bytes(raw.getvalue())


def test_a_graph_from_before_landmarks_is_read(tmp_path):
    graph = graph_with_landmarks()
    graph.landmarks.clear()
    contents = graph_contents(graph)
    with np.load(io.BytesIO(contents[ARRAYS])) as packed:
        assert not [name for name in packed.files if "landmark" in name or "sighting" in name]
    replace_folder(tmp_path / "map", contents)
    assert read_graph(tmp_path / "map").landmarks == {}


@pytest.mark.parametrize(
    "arrays, sentence",
    [
        ({"sighting_heights": None}, "sighting_heights is missing"),
        ({"landmark_poses": np.zeros((2, 2))}, "landmark_poses has the shape"),
        ({"candidate_shares": np.full(4, np.nan)}, "numbers that are not finite"),
        ({"sighting_keyframes": np.array([3, 5, 99])}, "there is no keyframe 99"),
        ({"candidate_sightings": np.array([0, 0, 1, 1])}, "2"),
    ],
)
def test_damaged_landmarks_are_refused_with_the_reason(tmp_path, arrays, sentence):
    replace_folder(tmp_path / "map", graph_contents(graph_with_landmarks()))
    changed(tmp_path / "map", **arrays)
    with pytest.raises(InputError, match=sentence):
        read_graph(tmp_path / "map")

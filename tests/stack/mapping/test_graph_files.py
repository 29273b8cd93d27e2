"""Pose graphs and trajectories as files: round trips bit for bit, damaged files."""

import json
from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.errors import InputError
from stack.mapping.graph_files import g2o_text, graph_contents, plain_text, read_graph, tum_text
from stack.mapping.slam.graph import EDGE_KINDS, Edge, Keyframe, PoseGraph
from stack.mapping.whole_files import backup_of, replace_file, replace_folder
from stack.types import Pose2D, Scan

NUMBERS = st.floats(-1e3, 1e3, allow_nan=False)
POSES = st.builds(Pose2D, NUMBERS, NUMBERS, st.floats(-3.1, 3.1))


@st.composite
def graphs(draw):
    """A graph of up to 6 keyframes with scans of different kinds, and edges between them."""
    graph = PoseGraph()
    ids = draw(st.lists(st.integers(0, 50), min_size=1, max_size=6, unique=True))
    for number in ids:
        count = draw(st.integers(0, 5))
        ranges = np.array(draw(st.lists(st.sampled_from([1.5, np.inf, np.nan, 0.25]),
                                        min_size=count, max_size=count)), np.float32)  # fmt: skip
        bearings = np.linspace(-1, 1, count) if draw(st.booleans()) else None
        scan = Scan(float(number), ranges, -pi, 0.1, 0.05, 12.0, draw(POSES), 1e-4, bearings)
        graph.add_keyframe(Keyframe(number, draw(NUMBERS), draw(POSES), draw(POSES), scan,
                                    draw(st.integers(0, 3))))  # fmt: skip
    for _ in range(draw(st.integers(0, 6)) if len(ids) > 1 else 0):
        one, other = draw(st.lists(st.sampled_from(ids), min_size=2, max_size=2, unique=True))
        half = np.array(draw(st.lists(NUMBERS, min_size=9, max_size=9))).reshape(3, 3)
        kind = draw(st.sampled_from(EDGE_KINDS))
        graph.add_edge(Edge(one, other, draw(POSES), half + half.T, kind))
    return graph


def same(one: Keyframe, other: Keyframe) -> bool:
    """Whether two keyframes are equal, bit for bit."""
    plain = (one.id, one.stamp, one.pose, one.odometry, one.session, one.scan.mount)
    there = (other.id, other.stamp, other.pose, other.odometry, other.session, other.scan.mount)
    geometry = [
        (s.stamp, s.angle_min, s.angle_increment, s.range_min, s.range_max, s.time_increment)
        for s in (one.scan, other.scan)
    ]
    bearings = [s.bearings for s in (one.scan, other.scan)]
    return (
        plain == there and geometry[0] == geometry[1]
        and np.array_equal(one.scan.ranges, other.scan.ranges, equal_nan=True)
        and ((bearings[0] is None) == (bearings[1] is None))
        and (bearings[0] is None or np.array_equal(*bearings))
    )  # fmt: skip


@settings(deadline=None, max_examples=40)
@given(graph=graphs())
def test_a_graph_reads_back_the_same(tmp_path_factory, graph):
    folder = tmp_path_factory.getbasetemp() / "graph"
    replace_folder(folder, graph_contents(graph, 123.5))
    read = read_graph(folder)
    assert list(read.keyframes) == list(graph.keyframes)
    assert all(same(read.keyframes[n], graph.keyframes[n]) for n in graph.keyframes)
    assert len(read.edges) == len(graph.edges)
    for mine, theirs in zip(read.edges, graph.edges, strict=True):
        assert (mine.source, mine.target, mine.relative, mine.kind) == (
            theirs.source, theirs.target, theirs.relative, theirs.kind,
        )  # fmt: skip
        assert np.array_equal(mine.information, theirs.information)


def test_g2o_has_the_lines_of_the_format(tmp_path):
    """VERTEX_SE2 id x y theta; EDGE_SE2 from to x y theta and the upper triangle."""
    scan = Scan(0.0, np.zeros(0, np.float32), 0.0, 0.1, 0.0, 1.0)
    graph = PoseGraph()
    for number in (0, 1):
        graph.add_keyframe(Keyframe(number, 0.0, Pose2D(number, 0.5), Pose2D(0, 0), scan))
    information = np.array([[1.0, 2.0, 3.0], [2.0, 4.0, 5.0], [3.0, 5.0, 6.0]])
    graph.add_edge(Edge(0, 1, Pose2D(1.0, 0.0, 0.25), information, "odometry"))
    assert g2o_text(graph).splitlines() == [
        "VERTEX_SE2 0 0.0 0.5 0.0", "VERTEX_SE2 1 1.0 0.5 0.0", "FIX 0",
        "EDGE_SE2 0 1 1.0 0.0 0.25 1.0 2.0 3.0 4.0 5.0 6.0",
    ]  # fmt: skip


@pytest.fixture
def saved(tmp_path):
    """A saved graph of one keyframe."""
    scan = Scan(0.0, np.ones(3, np.float32), 0.0, 0.1, 0.0, 1.0)
    graph = PoseGraph()
    graph.add_keyframe(Keyframe(0, 0.0, Pose2D(0, 0), Pose2D(0, 0), scan))
    folder = tmp_path / "map"
    replace_folder(folder, graph_contents(graph))
    return folder


def test_damaged_and_foreign_graphs_are_refused(saved):
    arrays, header = saved / "graph.npz", saved / "graph.json"
    whole, text = arrays.read_bytes(), header.read_text()
    arrays.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(InputError, match=r"graph\.npz:1:1 error\[E403\] the pose graph is damaged"):
        read_graph(saved)
    arrays.write_bytes(whole)
    header.write_text(text.replace('"keyframes": 1', '"keyframes": 2'))
    with pytest.raises(InputError, match=r"ids has the shape \(1,\), not \(2,\)"):
        read_graph(saved)
    header.write_text(json.dumps({**json.loads(text), "version": 9}))
    with pytest.raises(InputError, match="reads format 1, the file has 9"):
        read_graph(saved)
    header.write_text("{}")
    with pytest.raises(InputError, match="not a pose graph of treepilot"):
        read_graph(saved)
    header.unlink()
    with pytest.raises(InputError, match="there is no such pose graph"):
        read_graph(saved)


def test_a_folder_is_replaced_whole_and_kept_as_bak(saved, monkeypatch):
    before = (saved / "graph.npz").read_bytes()
    replace_folder(saved, {"a": b"new"})
    assert (backup_of(saved) / "graph.npz").read_bytes() == before
    assert [file.name for file in saved.iterdir()] == ["a"]

    def no_space(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", no_space)
    with pytest.raises(OSError, match="No space"):
        replace_folder(saved, {"b": b"newer"})
    with pytest.raises(OSError, match="No space"):
        replace_file(saved / "a", b"newer")
    assert [(file.name, file.read_bytes()) for file in saved.iterdir()] == [("a", b"new")]
    assert sorted(file.name for file in saved.parent.iterdir()) == ["map", "map.bak"]


@settings(deadline=None, max_examples=40)
@given(st.lists(st.tuples(st.integers(0, 2_000_000_000), POSES), max_size=10))
def test_trajectories_read_back_the_same(tmp_path_factory, rows):
    """Stamps to a microsecond; TUM's quaternion keeps the heading to rounding."""
    stamps = np.array([stamp for stamp, _ in rows], np.float64) + 0.25
    poses = [pose for _, pose in rows]
    rows = [
        (stamp, pose.x, pose.y, pose.heading) for stamp, pose in zip(stamps, poses, strict=True)
    ]
    assert read(plain_text(stamps, poses)) == [list(row) for row in rows]
    for (stamp, x, y, *zeros, qz, qw), row in zip(read(tum_text(stamps, poses)), rows, strict=True):
        assert (stamp, x, y) == row[:3] and zeros == [0.0, 0.0, 0.0]
        assert 2.0 * np.arctan2(qz, qw) == pytest.approx(row[3], abs=1e-12)


def read(text):
    return [[float(word) for word in line.split()] for line in text.splitlines()]

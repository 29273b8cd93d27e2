"""Merging of two mapping runs: halves of generated flats, and maps without a common place."""

import numpy as np
import pytest
from typer.testing import CliRunner

from missions.cli.app import app
from stack.errors import InputError
from stack.mapping.graph_files import read_graph
from stack.mapping.ros_map import read_ros_map
from stack.mapping.slam.mapper import Mapper
from stack.mapping.slam.merging import merge
from stack.mapping.slam.parameters import SlamParameters
from stack.types import FloatArray, Pose2D
from tests.stack.mapping.slam.drives import line, saved
from tests.stack.mapping.slam.rooms import box, scan_at

LEFT = line((1, 1.9), (3.2, 1.9), (5, 1.9), (7, 1.9), (7, 2.2), (5, 1.8), step=0.12)
RIGHT = line((11, 1.9), (9, 2), (7.2, 1.9), (5.2, 2.0), (6.5, 1.7), (10, 2), step=0.12)
"""Drives through the left and the right room; both see the middle one."""

ELSEWHERE = Pose2D(5.0, -3.0, 2.0)
"""The second run begins its map in a frame of its own."""


def flat(seed: int) -> FloatArray:
    """Three rooms of 4 x 4 m in a row, with doors and furniture at random places."""
    generator = np.random.default_rng(seed)
    walls = [*box(0, 0, 12, 4)]
    for x in (4, 8):
        door = generator.uniform(1.0, 2.2)
        walls += [(x, 0, x, door), (x, door + 0.9, x, 4)]
    for room in range(3):
        for y in (0.05, 3.3):
            width, depth = generator.uniform(0.4, 0.9), generator.uniform(0.3, 0.6)
            walls += box(4 * room + generator.uniform(0.2, 2.9), y, width, depth)
    return np.array(walls)


def explored(walls: FloatArray, poses: list[Pose2D], seed: int, frame: Pose2D) -> Mapper:
    """Map with odometry that drives and turns 2 % too far, in a frame of its own."""
    generator, mapper, odometry = (
        np.random.default_rng(seed),
        Mapper(SlamParameters()),
        Pose2D(0, 0),
    )
    mapper.start(frame.compose(poses[0]))
    for k, pose in enumerate(poses):
        if k:
            moved = pose.relative_to(poses[k - 1])
            turn = 1.02 * moved.heading + generator.normal(0.0, 0.004)
            odometry = odometry.compose(Pose2D(1.02 * moved.x, moved.y, turn))
        mapper.add(0.1 * k, odometry, scan_at(walls, pose, 0.1 * k, 0.01, 1000 * seed + k))
    return mapper


@pytest.mark.parametrize("seed", [101, 102])
def test_two_halves_of_a_flat_merge_within_five_centimetres(seed):
    walls = flat(seed)
    first = explored(walls, LEFT, seed, Pose2D(0, 0))
    second = explored(walls, RIGHT, seed + 500, ELSEWHERE)
    merged = merge(first.graph, second.graph)
    keyframes = merged.mapper.graph.keyframes.values()
    assert {keyframe.session for keyframe in keyframes} == {0, 1}
    assert len(keyframes) == len(first.graph.keyframes) + len(second.graph.keyframes)
    for keyframe in keyframes:
        true = (RIGHT if keyframe.session else LEFT)[round(keyframe.stamp / 0.1)]
        assert keyframe.pose.distance_to(true) < 0.05
    placed = merged.placement.pose.compose(ELSEWHERE)
    assert placed.distance_to(Pose2D(0, 0)) < 0.3  # before the optimisation


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """Saved maps: two halves of a flat, and a room of another flat."""
    folder, walls = tmp_path_factory.mktemp("maps"), flat(103)
    other = np.array([*box(0, 0, 5, 7), *box(2, 3, 1.5, 0.3), (3, 7, 3.5, 5)])
    return [
        saved(explored(walls, LEFT, 1, Pose2D(0, 0)), folder / "left"),
        saved(explored(walls, RIGHT, 2, ELSEWHERE), folder / "right"),
        saved(explored(other, line((1, 1), (4, 1), (4, 6)), 3, Pose2D(0, 0)), folder / "other"),
    ]


def test_maps_without_a_common_place_are_refused(folders):
    left, _, other = map(read_graph, folders)
    with pytest.raises(InputError, match="the maps have no common place"):
        merge(left, other)


def test_the_command_writes_the_folder_or_nothing(folders, tmp_path):
    left, right, other = map(str, folders)
    out = tmp_path / "both"
    done = CliRunner().invoke(app, ["map", "merge", left, right, "--out", str(out)])
    assert done.exit_code == 0, done.output
    assert "matches between the maps" in done.output
    assert len(read_graph(out).keyframes) > len(read_graph(folders[0]).keyframes)
    grid = read_ros_map(out / "map.yaml")
    # 12 m of rooms, both ends included, and a margin of 1 m
    assert 12.0 < grid.cells.shape[1] * grid.resolution < 14.5
    refused = CliRunner().invoke(app, ["map", "merge", left, other, "--out", str(tmp_path / "no")])
    assert isinstance(refused.exception, InputError)  # `main` gives it exit code 2
    assert not (tmp_path / "no").exists()

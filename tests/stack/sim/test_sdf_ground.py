"""What a robot stands on at its start is the ground of a Gazebo world."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.sim.import_world import read_any_world
from stack.sim.worlds.world import World
from stack.types import Pose2D
from tests.stack.sim.gazebo_text import GROUND, collision_model, gazebo_world


def box(size: str, pose: str, name: str) -> str:
    return collision_model(f"<box><size>{size}</size></box>", pose, name)


WALL = "<box><size>0.2 8 2</size></box>"


def read(folder: Path, inside: str, start: Pose2D | None = None) -> World:
    (folder / "a.world").write_text(gazebo_world(inside))
    return read_any_world(folder / "a.world", start)


@settings(deadline=None, max_examples=40)
@given(
    top=st.floats(-0.45, 0.45), thickness=st.floats(0.005, 0.5),
    x=st.floats(-7, 5), y=st.floats(-8, 8), plane=st.booleans(),
)  # fmt: skip
def test_a_slab_below_the_start_is_the_ground_at_any_height(
    tmp_path_factory: pytest.TempPathFactory, top: float, thickness: float, x: float, y: float,
    plane: bool,
) -> None:  # fmt: skip
    """The wall reaches 2 m above its slab: as high above the ground. A plane above hides a slab."""
    slab = box(f"20 20 {thickness!r}", f"0 0 {top - thickness / 2!r} 0 0 0", "asphalt")
    wall = box("0.2 8 2", f"6 0 {top + 1.0!r} 0 0 0", "wall")
    world = read(tmp_path_factory.mktemp("w"), (GROUND if plane else "") + slab + wall,
                 Pose2D(x, y))  # fmt: skip
    assert [found.name for found in world.boxes] == ["wall"]
    ground = max(top, 0.0) if plane else top
    expected = top + 2.0 - (ground if abs(ground) > 0.01 else 0.0)
    assert world.boxes[0].size[2] == pytest.approx(expected)


def test_the_height_of_the_ground_is_said(tmp_path: Path) -> None:
    world = read(
        tmp_path,
        box("20 20 0.1", "0 0 0 0 0 0", "asphalt") + box("1 1 1", "6 0 0.5 0 0 0", "crate"),
    )
    assert [item.sentence for item in world.warnings] == [
        "heights count from the surface below the start: 0.05 m above the origin"
    ]


@pytest.mark.parametrize("size", ["1.2 0.8 0.14", "2 1.6 0.45", "2 2 0.6"])
def test_a_pallet_a_bed_and_a_stage_are_obstacles(tmp_path: Path, size: str) -> None:
    """The start is in the middle of the first two, which cover less than half of 1.5 m around.

    The stage is higher than any floor.
    """
    height = float(size.split()[2])
    world = read(tmp_path, GROUND + box(size, f"0 0 {height / 2} 0 0 0", "thing"), Pose2D(0, 0))
    assert [found.size[2] for found in world.boxes] == [pytest.approx(height)]


def test_a_platform_beside_the_start_is_an_obstacle_and_below_it_the_ground(
    tmp_path: Path,
) -> None:
    hall = box("20 20 0.1", "0 0 -0.05 0 0 0", "floor") + box("4 4 0.3", "5 0 0.15 0 0 0", "stage")
    pillar = box("1 1 2", "-5 0 1 0 0 0", "pillar")
    beside = read(tmp_path, hall + pillar, Pose2D(0.0, 0.0))
    assert [(b.name, b.size[2]) for b in beside.boxes] == [("stage", 0.3), ("pillar", 2.0)]
    above = read(tmp_path, hall + pillar, Pose2D(5.0, 0.0))
    assert [(b.name, b.size[2]) for b in above.boxes] == [("pillar", pytest.approx(1.7))]


def test_floors_of_nearly_the_same_height_are_one_ground(tmp_path: Path) -> None:
    """A ground plane, asphalt of 5 cm on it and slabs that lie 8 mm higher."""
    inside = GROUND + box("20 20 0.1", "0 0 0 0 0 0", "asphalt")
    inside += "".join(box("2 2 0.02", f"{x} 0 0.048 0 0 0", f"slab_{x}") for x in (-4, 0, 4))
    world = read(tmp_path, inside + box("1 1 1", "7 0 0.5 0 0 0", "crate"))
    assert [found.name for found in world.boxes] == ["crate"]


def test_without_a_start_the_nearest_free_place_is_taken(tmp_path: Path) -> None:
    """A block of 4 x 4 m around the origin: 2 m to its face and 0.5 m more, in cells of 0.1 m."""
    world = read(
        tmp_path,
        GROUND + box("4 4 2", "0 0 1 0 0 0", "block") + box("1 1 1", "9 9 0.5 0 0 0", "far"),
    )
    assert max(abs(world.start.x), abs(world.start.y)) == pytest.approx(2.55, abs=0.1)
    free = read(tmp_path, GROUND + box("1 1 2", "4 0 1 0 0 0", "block"))
    assert free.start == Pose2D(0.0, 0.0)


def test_a_mesh_floor_is_the_ground_and_its_walls_stand_on_it(tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    floor = trimesh.creation.box(extents=(8, 6, 0.2))
    wall = trimesh.creation.box(extents=(8, 0.2, 2.0))
    wall.apply_translation((0, 2.9, 1.1))
    trimesh.util.concatenate([floor, wall]).export(tmp_path / "room.obj")
    mesh = collision_model("<mesh><uri>room.obj</uri></mesh>", "0 0 0.25 0 0 0", "room")
    (found,) = read(tmp_path, GROUND + mesh).boxes
    assert found.size == pytest.approx((8.0, 0.2, 2.0), abs=0.021)
    assert (found.pose.x, found.pose.y) == pytest.approx((0.0, 2.9), abs=0.011)

"""Gazebo's frames, quaternions and meshes."""

from __future__ import annotations

from math import cos, pi, sin
from pathlib import Path

import numpy as np
import pytest

from stack.errors import InputError
from stack.sim.import_world import read_any_world
from stack.sim.sdf.mesh_parts import convex_parts
from stack.sim.worlds.world import World
from tests.stack.sim.gazebo_text import collision_model, gazebo_world

trimesh = pytest.importorskip("trimesh")

BOX = "<box><size>2 1 0.6</size></box>"
MESH = "<mesh><uri>{uri}</uri><scale>{scale}</scale></mesh>"


def read(tmp_path: Path, inside: str) -> World:
    path = tmp_path / "a.sdf"
    path.write_text(gazebo_world(inside, version="1.9"), "utf-8")
    return read_any_world(path)


def block(size: tuple[float, float, float], at: tuple[float, float, float]) -> object:
    made = trimesh.creation.box(extents=size)
    made.apply_translation(at)
    return made


def l_shape(folder: Path, name: str) -> Path:
    """Two walls that meet at a corner, 4 m along x at y = 0 and 4 m along y at x = -1.9."""
    whole = trimesh.util.concatenate(
        [block((4.0, 0.2, 2.0), (0.0, 0.0, 1.0)), block((0.2, 4.0, 2.0), (-1.9, 1.9, 1.0))]
    )
    whole.export(folder / name)
    return folder / name


@pytest.mark.parametrize(
    "rotation", ["rotation_format='quat_xyzw'>1 2 0.3 0 0 {s} {c}", ">1 2 0.3 0 0 {angle}"]
)
def test_a_quaternion_means_the_same_as_its_angles(tmp_path: Path, rotation: str) -> None:
    angle = 0.7
    pose = rotation.format(s=sin(angle / 2), c=cos(angle / 2), angle=angle)
    text = collision_model(BOX).replace("<pose>0 0 0 0 0 0</pose>", f"<pose {pose}</pose>")
    box = read(tmp_path, text).boxes[0]
    assert (box.pose.x, box.pose.y) == pytest.approx((1.0, 2.0))
    assert box.pose.heading % pi == pytest.approx(angle)


def test_a_zero_quaternion_is_refused(tmp_path: Path) -> None:
    pose = "<pose rotation_format='quat_xyzw'>1 2 0.3 0 0 0 0</pose>"
    with pytest.raises(InputError, match="the quaternion 0 0 0 0 is not a rotation"):
        read(tmp_path, collision_model(BOX).replace("<pose>0 0 0 0 0 0</pose>", pose))


FRAMES = """
<frame name='gate'><pose>5 0 0 0 0 1.5707963267948966</pose></frame>
<frame name='post' attached_to='gate'><pose relative_to='gate'>2 0 0 0 0 0</pose></frame>
<model name='a'><static>1</static>
  <pose relative_to='post'>0 1 0 0 0 0</pose>
  <link name='arm'><pose>0 0 1 0 0 0</pose></link>
  <link name='hand'><pose relative_to='arm'>0 0 -0.7 0 0 0</pose>
    <collision name='c'><pose relative_to='__model__'>1 0 0.3 0 0 0</pose>
      <geometry><box><size>2 1 0.6</size></box></geometry></collision>
    <collision name='d'>
      <geometry><box><size>2 1 0.6</size></box></geometry></collision>
  </link>
</model>
"""


def test_poses_refer_to_frames_of_their_model_and_of_the_world(tmp_path: Path) -> None:
    """The gate at (5, 0) looks along y: the post is at (5, 2), and one to its left is (4, 2).

    The first box is 1 m ahead of the model, at (4, 3); the second in the hand, over the origin.
    """
    first, second = read(tmp_path, FRAMES).boxes
    assert (first.pose.x, first.pose.y) == pytest.approx((4.0, 3.0))
    assert (second.pose.x, second.pose.y) == pytest.approx((4.0, 2.0))
    assert (first.size[2], second.size[2]) == pytest.approx((0.6, 0.6))


@pytest.mark.parametrize("frame", ["nowhere", "a"])
def test_an_unknown_or_cyclic_frame_is_reported(tmp_path: Path, frame: str) -> None:
    lost = collision_model(BOX, name="a").replace("<pose>", f"<pose relative_to='{frame}'>")
    world = read(tmp_path, lost + collision_model(BOX, name="b"))
    assert [box.name for box in world.boxes] == ["b"]
    assert world.warnings[0].sentence == (
        f"elements relative to the unknown frame {frame!r} are ignored: a"
    )


@pytest.mark.parametrize("name", ["house.stl", "house.obj", "house.dae"])
def test_a_mesh_becomes_boxes_around_its_convex_parts(tmp_path: Path, name: str) -> None:
    """The corner stays open: an L-shaped house is two walls, and not the block round both."""
    l_shape(tmp_path, name)
    world = read(tmp_path, collision_model(MESH.format(uri=f"model://{name}", scale="1 1 1")))
    sides = sorted(max(box.size[:2]) for box in world.boxes)
    assert len(sides) == 2
    assert sides == pytest.approx([4.0, 4.0], abs=0.3)
    assert all(min(box.size[:2]) == pytest.approx(0.2, abs=0.08) for box in world.boxes)
    inside = np.array([1.0, 2.0])  # the open corner
    assert all(
        abs(box.pose.x - inside[0]) > box.size[0] / 2
        or abs(box.pose.y - inside[1]) > box.size[1] / 2
        for box in world.boxes
    )
    assert "<mesh> shapes are replaced by boxes" in world.warnings[0].sentence


def test_a_mesh_is_scaled_and_placed(tmp_path: Path) -> None:
    block((1.0, 2.0, 1.0), (0.0, 0.0, 0.5)).export(tmp_path / "crate.stl")  # type: ignore[attr-defined]
    mesh = MESH.format(uri="crate.stl", scale="0.5 0.5 0.5")
    box = read(tmp_path, collision_model(mesh, "3 4 0 0 0 1.5707963267948966")).boxes[0]
    assert (box.pose.x, box.pose.y) == pytest.approx((3.0, 4.0), abs=0.02)
    assert sorted(box.size[:2]) == pytest.approx([0.5, 1.0], abs=0.04)
    assert abs(sin(box.pose.heading)) == pytest.approx(0.0 if box.size[0] > 0.7 else 1.0, abs=0.05)


def test_a_broken_mesh_is_ignored_with_the_reason(tmp_path: Path) -> None:
    (tmp_path / "bad.stl").write_bytes(b"solid nonsense")
    world = read(tmp_path, collision_model(MESH.format(uri="bad.stl", scale="1 1 1"))
                 + collision_model(BOX, name="b"))  # fmt: skip
    assert [box.name for box in world.boxes] == ["b"]
    assert "bad.stl" in world.warnings[0].sentence


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        ("a.dae", b'<!DOCTYPE a [<!ENTITY b "c">]><a/>', "a.dae has a document type"),
        ("a.obj", b"v hunter2 0 0", "a.obj is not a readable obj mesh"),
        ("a.stl", b"root:hunter2", "a.stl has no faces"),
        ("a.zip", b"PK", "a.zip is not a mesh of a known kind: stl, obj, dae, ply, off, glb"),
    ],
)
def test_unusable_meshes_are_named_and_not_quoted(
    tmp_path: Path, name: str, content: bytes, sentence: str
) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=sentence) as refused:
        convex_parts(tmp_path / name)
    assert "hunter2" not in str(refused.value)


def test_a_mesh_of_500_mb_is_not_read(tmp_path: Path) -> None:
    with (tmp_path / "a.stl").open("wb") as file:
        file.truncate(500_000_000)
    with pytest.raises(InputError, match=r"a.stl cannot be read: 500000000 bytes or more; at most"):
        convex_parts(tmp_path / "a.stl")

"""Gazebo's frames, quaternions and meshes."""

from __future__ import annotations

from math import cos, pi, sin
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.errors import InputError
from stack.sim.import_world import read_any_world
from stack.sim.sdf.mesh_boxes import MAX_BOXES
from stack.sim.sdf.mesh_files import read_triangles
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
        read_triangles(tmp_path / name)
    assert "hunter2" not in str(refused.value)


def test_a_mesh_of_500_mb_is_not_read(tmp_path: Path) -> None:
    with (tmp_path / "a.stl").open("wb") as file:
        file.truncate(500_000_000)
    with pytest.raises(InputError, match=r"a.stl cannot be read: 500000000 bytes or more; at most"):
        read_triangles(tmp_path / "a.stl")


UNIT = "<unit meter='{meter}' name='{name}'/>"


def cube_dae(half: float, unit: str) -> str:
    """A Collada cube with this half side, in the unit."""
    corners = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    faces = block((1.0, 1.0, 1.0), (0.0, 0.0, 0.0)).faces  # type: ignore[attr-defined]
    numbers = " ".join(repr(half * value) for corner in corners for value in corner)
    order = " ".join(map(str, faces.reshape(-1).tolist()))
    axes = "".join(f"<param name='{axis}' type='float'/>" for axis in "XYZ")
    return f"""<COLLADA xmlns='http://www.collada.org/2005/11/COLLADASchema' version='1.4.1'>
      <asset>{unit}<up_axis>Y_UP</up_axis></asset>
      <library_geometries><geometry id='g' name='g'><mesh>
        <source id='p'><float_array id='a' count='24'>{numbers}</float_array><technique_common>
          <accessor source='#a' count='8' stride='3'>{axes}</accessor></technique_common></source>
        <vertices id='v'><input semantic='POSITION' source='#p'/></vertices>
        <triangles count='12'><input semantic='VERTEX' source='#v' offset='0'/><p>{order}</p>
        </triangles></mesh></geometry></library_geometries>
      <library_visual_scenes><visual_scene id='s'><node id='n'><instance_geometry url='#g'/></node>
      </visual_scene></library_visual_scenes>
      <scene><instance_visual_scene url='#s'/></scene></COLLADA>"""


@pytest.mark.parametrize("metres", [1.0, 0.01, 0.0254, 0.001, 0.3048, 0.002539999969303608, None])
def test_the_unit_of_a_collada_file_is_applied(tmp_path: Path, metres: float | None) -> None:
    """Side 1 m in every unit; the name is free text, and without a unit numbers are metres."""
    unit = "" if metres is None else UNIT.format(meter=metres, name="centimeter")
    (tmp_path / "cube.dae").write_text(cube_dae(0.5 / (metres or 1.0), unit), "utf-8")
    mesh = MESH.format(uri="cube.dae", scale="1 2 1")
    (box,) = read(tmp_path, collision_model(mesh, "5 0 0.5 0 0 0")).boxes
    assert box.size == pytest.approx((1.0, 2.0, 1.0), abs=1e-4)


@settings(deadline=None, max_examples=30)
@given(
    size=st.tuples(*[st.floats(0.03, 5.0)] * 2), square=st.booleans(), thick=st.floats(0.02, 2.0),
    heading=st.floats(-pi, pi), rise=st.floats(0.0, 0.9),
)  # fmt: skip
def test_a_cuboid_of_triangles_is_a_box_of_its_size(
    tmp_path_factory: pytest.TempPathFactory, size: tuple[float, float], *, square: bool,
    thick: float, heading: float, rise: float,
) -> None:  # fmt: skip
    """Plates with equal sides, posts, thin boards, at any heading: one box, extended to the floor.

    A face that lies on the edge of a cell can make it one cell of 2 cm larger.
    """
    folder = tmp_path_factory.mktemp("m")
    sides = (size[0], size[0] if square else size[1], thick)
    block(sides, (0.0, 0.0, thick / 2)).export(folder / "m.stl")  # type: ignore[attr-defined]
    mesh = collision_model("<mesh><uri>m.stl</uri></mesh>", f"9 4 {rise!r} 0 0 {heading!r}")
    boxes = read(folder, mesh).boxes
    assert len(boxes) == 1
    assert sorted(boxes[0].size[:2]) == pytest.approx(sorted(sides[:2]), abs=0.021)
    assert boxes[0].size[2] == pytest.approx(rise + thick, abs=1e-4)
    assert (boxes[0].pose.x, boxes[0].pose.y) == pytest.approx((9.0, 4.0), abs=0.011)


def test_a_closed_mesh_around_the_start_is_a_room(tmp_path: Path) -> None:
    """Its faces are walls; seen from outside the same mesh is a block."""
    block((6.0, 5.0, 3.0), (0.0, 0.0, 1.4)).export(tmp_path / "hall.stl")  # type: ignore[attr-defined]
    mesh = "<mesh><uri>hall.stl</uri></mesh>"
    inside = read(tmp_path, collision_model(mesh))
    assert all(min(box.size[:2]) < 0.03 for box in inside.boxes)
    assert 2.0 * sum(max(box.size[:2]) for box in inside.boxes) == pytest.approx(44.0, abs=0.3)
    outside = read(tmp_path, collision_model(mesh, "9 9 0 0 0 0"))
    assert [box.size[:2] for box in outside.boxes] == [pytest.approx((6.0, 5.0), abs=0.021)]


def test_a_round_mesh_is_covered_to_a_cell(tmp_path: Path) -> None:
    """Area of a disc of radius 1 m, 32 sides: 3.12 m2; a rim of one cell of 2 cm adds 0.13 m2."""
    trimesh.creation.cylinder(radius=1.0, height=0.5, sections=32).export(tmp_path / "drum.stl")
    world = read(tmp_path, collision_model("<mesh><uri>drum.stl</uri></mesh>", "9 0 0.25 0 0 0"))
    assert 3.1 < sum(box.size[0] * box.size[1] for box in world.boxes) < 3.26
    assert len(world.boxes) <= 100


def test_a_table_of_any_shape_reaches_to_the_floor_and_a_ceiling_does_not(tmp_path: Path) -> None:
    """A robot cannot be sure to pass below a top at 0.7 m; below a shelf at 1.2 m it passes."""
    parts = [block((2.0, 1.0, 0.04), (0.0, 0.0, 0.72)), block((0.1, 0.1, 0.7), (0.9, 0.4, 0.35)),
             block((2.0, 3.0, 0.04), (0.0, 0.0, 1.2))]  # fmt: skip
    trimesh.util.concatenate(parts).export(tmp_path / "desk.stl")
    world = read(tmp_path, collision_model("<mesh><uri>desk.stl</uri></mesh>", "9 0 0 0 0 0"))
    assert sum(box.size[0] * box.size[1] for box in world.boxes) == pytest.approx(2.0, abs=0.1)
    assert {round(box.size[2], 2) for box in world.boxes} == {0.74}


def test_a_mesh_of_any_size_needs_a_bounded_number_of_boxes(tmp_path: Path) -> None:
    """A field of 40 x 40 m with hills: its cells become coarser, and it stays covered."""
    steps = np.linspace(-20.0, 20.0, 61)
    xs, ys = np.meshgrid(steps, steps)
    points = np.column_stack(
        [xs.ravel(), ys.ravel(), (0.4 + 0.3 * np.sin(xs) * np.cos(ys)).ravel()]
    )
    corner = np.arange(60 * 61).reshape(60, 61)[:, :60].ravel()
    faces = np.vstack([np.column_stack([corner, corner + 1, corner + 62]),
                       np.column_stack([corner, corner + 62, corner + 61])])  # fmt: skip
    trimesh.Trimesh(points, faces).export(tmp_path / "hills.stl")
    world = read(tmp_path, collision_model("<mesh><uri>hills.stl</uri></mesh>", "30 0 0 0 0 0"))
    assert 1 < len(world.boxes) <= MAX_BOXES
    assert sum(box.size[0] * box.size[1] for box in world.boxes) >= 1599.0


def test_triangles_that_overlap_everywhere_take_bounded_time(tmp_path: Path) -> None:
    """2000 triangles across 200 x 200 m: at 2 cm their columns would be 10^11."""
    corners = np.random.default_rng(0).uniform(-100, 100, (6000, 3)) * (1.0, 1.0, 0.005)
    trimesh.Trimesh(corners, np.arange(6000).reshape(-1, 3)).export(tmp_path / "noise.stl")
    world = read(tmp_path, collision_model("<mesh><uri>noise.stl</uri></mesh>", "300 0 0 0 0 0"))
    assert 1 <= len(world.boxes) <= MAX_BOXES


def test_a_mesh_that_changes_is_read_again(tmp_path: Path) -> None:
    mesh = collision_model("<mesh><uri>m.stl</uri></mesh>", "9 0 0.5 0 0 0")
    for side in (1.0, 2.0):
        block((side, side, 1.0), (0.0, 0.0, 0.0)).export(tmp_path / "m.stl")  # type: ignore[attr-defined]
        assert max(read(tmp_path, mesh).boxes[0].size[:2]) == pytest.approx(side, abs=0.021)

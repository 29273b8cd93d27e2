"""Gazebo files as worlds: the solids, and the warnings about the rest."""

from __future__ import annotations

from math import pi, sqrt

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.errors import InputError
from stack.sim.import_world import read_any_world
from tests.stack.sim.gazebo_text import GROUND, collision_model, cylinder_world, gazebo_world

BOX = "<box><size>2 1 0.6</size></box>"


def read(tmp_path, text, name="a.world"):
    path = tmp_path / name
    path.write_text(text, "utf-8")
    return read_any_world(path)


def refusals(tmp_path, text):
    with pytest.raises(InputError) as caught:
        read(tmp_path, text)
    return caught.value.findings


def sentences(world):
    return [warning.sentence for warning in world.warnings]


def test_a_world_of_cylinders_as_the_benchmarks(tmp_path):
    grid = [(-4.425 + 0.15 * i, 0.075 + 0.15 * j) for i in range(20) for j in range(0, 40, 2)]
    world = read(tmp_path, cylinder_world(grid))
    assert [(c.x, c.y) for c in world.cylinders] == [pytest.approx(place) for place in grid]
    assert {c.radius for c in world.cylinders} == {0.075}
    assert {c.height for c in world.cylinders} == {0.5}  # 1 m long, its middle on the floor
    assert world.cylinders[0].name == "unit_cylinder_0"
    assert world.warnings == ()
    x_min, y_min, x_max, y_max = world.bounds
    assert x_min <= -4.5 - 0.5 and y_max >= 0.075 + 0.15 * 38 + 0.075 + 0.5
    assert y_min <= 0.0 and x_max >= 0.0  # the start


@settings(deadline=None, max_examples=50)
@given(
    *[st.floats(-20, 20) for _ in range(4)], *[st.floats(-pi, pi) for _ in range(2)],
)  # fmt: skip
def test_nested_poses_compose_as_the_formats_frames_do(tmp_path_factory, x, y, u, v, outer, inner):
    """A box in a link in a model in a model, against Pose2D's composition."""
    from stack.types import Pose2D

    text = gazebo_world(f"""
        <model name='outer'><static>true</static><pose>{x!r} {y!r} 0 0 0 {outer!r}</pose>
          <model name='inner'><pose>{u!r} 0 0 0 0 {inner!r}</pose>
            <link name='l'><pose>0 {v!r} 0 0 0 0</pose>
              <collision name='c'><pose>0 0 0.3 0 0 0</pose><geometry>{BOX}</geometry></collision>
            </link>
          </model>
        </model>""")
    (box,) = read(tmp_path_factory.mktemp("w"), text).boxes
    expected = Pose2D(x, y, outer).compose(Pose2D(u, 0.0, inner)).compose(Pose2D(0.0, v))
    assert box.pose.distance_to(expected) < 1e-9
    assert abs(box.pose.relative_to(expected).heading) < 1e-9
    assert box.size == pytest.approx((2.0, 1.0, 0.6))


def test_boxes_on_their_sides_keep_their_shape(tmp_path):
    # 90 degrees about x lays the width up: 2 long, 0.6 wide, 1 high
    text = gazebo_world(collision_model(BOX, "3 4 0.5 1.5707963267948966 0 0"))
    (box,) = read(tmp_path, text).boxes
    half = sorted(box.size[:2])
    assert half == pytest.approx([0.6, 2.0]) and box.size[2] == pytest.approx(1.0)
    assert (box.pose.x, box.pose.y) == pytest.approx((3.0, 4.0))


def test_a_tilted_box_becomes_its_upright_bounding_box_with_a_warning(tmp_path):
    text = gazebo_world(collision_model(BOX, "0 0 1 0 0.7853981633974483 0", "ramp"))
    world = read(tmp_path, text)
    (box,) = world.boxes
    # 2 x 0.6 turned by 45 degrees in the x-z plane: (2 + 0.6) / sqrt 2 in both
    assert box.size == pytest.approx((2.6 / sqrt(2), 1.0, 1.0 + 1.3 / sqrt(2)))
    assert sentences(world) == ["tilted shapes are replaced by upright boxes: ramp"]


def test_a_horizontal_cylinder_becomes_a_box_and_a_sphere_a_cylinder(tmp_path):
    lying = "<cylinder><radius>0.2</radius><length>3</length></cylinder>"
    ball = "<sphere><radius>0.4</radius></sphere>"
    text = gazebo_world(
        collision_model(lying, "1 0 0.2 1.5707963267948966 0 0", "log")
        + collision_model(ball, "5 5 0.4 0 0 0", "ball")
    )
    world = read(tmp_path, text)
    (box,), (drum,) = world.boxes, world.cylinders
    assert sorted(box.size[:2]) == pytest.approx([0.4, 3.0])
    assert box.size[2] == pytest.approx(0.4)
    assert (drum.x, drum.y, drum.radius, drum.height) == pytest.approx((5.0, 5.0, 0.4, 0.8))
    assert world.warnings == ()


def test_a_saved_state_sets_the_poses_of_models(tmp_path):
    text = gazebo_world(
        "<state world_name='default'><model name='crate'><pose>7 8 0.3 0 0 0</pose></model></state>"
        + collision_model(BOX, "0 0 0.3 0 0 0", "crate")
    )
    (box,) = read(tmp_path, text).boxes
    assert (box.pose.x, box.pose.y) == (7.0, 8.0)


def test_includes_of_the_same_file_are_read_and_others_reported(tmp_path):
    text = gazebo_world(
        """
        <include><uri>model://sun</uri></include>
        <include><uri>model://ground_plane</uri></include>
        <include><uri>model://crate</uri><name>one</name><pose>1 0 0 0 0 0</pose></include>
        <include><uri>crate</uri><pose>2 0 0 0 0 0</pose></include>
        <include><uri>model://cafe_table</uri></include>
        """,
        beside=collision_model(BOX, "0 0 0.3 0 0 0", "crate"),
    )
    world = read(tmp_path, text)
    assert [box.pose.x for box in world.boxes] == [1.0, 2.0]
    assert sentences(world) == [
        "<include> of models that are not found is ignored: model://cafe_table"
    ]
    assert world.warnings[0].mark.line == 8


def test_a_model_that_includes_itself_is_an_error(tmp_path):
    loop = "<model name='a'><static>1</static><include><uri>model://a</uri></include></model>"
    text = gazebo_world(
        "<include><uri>model://a</uri></include>" + collision_model(BOX), beside=loop
    )
    (finding,) = refusals(tmp_path, text)
    assert finding.code == "E201" and finding.mark.line > 2
    assert finding.sentence == "the model 'a' includes itself: a -> a"


def test_unsupported_elements_are_reported_once_per_kind(tmp_path):
    mesh = "<mesh><uri>model://house/{}.dae</uri></mesh>"
    models = [collision_model(mesh.format(n), name=f"house_{n}") for n in range(7)]
    text = gazebo_world(
        GROUND
        + "".join(models)
        + collision_model("<plane><normal>1 0 0</normal></plane>", name="glass")
        + collision_model(BOX, "0 0 3 0 0 0", "lamp")
        + collision_model(BOX, "9 9 0.3 0 0 0", "trolley", extra="")
        + "<actor name='walker'/>"
        + "<model name='sign'><static>1</static><link name='l'><visual name='v'/></link></model>"
    )
    world = read(tmp_path, text)
    assert [box.name for box in world.boxes] == ["trolley"]
    assert sentences(world) == [
        "<mesh> shapes whose files are not found are ignored: "
        "house_0 (model://house/0.dae), "
        "house_1 (model://house/1.dae), house_2 (model://house/2.dae), "
        "house_3 (model://house/3.dae), house_4 (model://house/4.dae) and 2 more",
        "<plane> shapes that are not horizontal are ignored: glass",
        "shapes 1 m or more above the floor are ignored: lamp",
        "not static in Gazebo, static here: trolley",
        "<actor> is ignored: walker",
        "links without collision shapes are ignored: sign",
    ]
    assert all(warning.severity == "warning" for warning in world.warnings)


@pytest.mark.parametrize(
    ("geometry", "sentence"),
    [
        ("<box><size>1 2</size></box>", "<size>: expected 3 numbers, got '1 2'"),
        ("<box><size>1 2 x</size></box>", "<size>: expected 3 numbers, got '1 2 x'"),
        ("<box><size>1 nan 1</size></box>", "<size>: expected 3 numbers, got '1 nan 1'"),
        ("<box/>", "<box> needs <size>"),
        ("<sphere><radius>-1</radius></sphere>", "<radius> '-1': expected metres above 0, up to"),
        ("<cylinder><radius>1</radius></cylinder>", "<cylinder> needs <length>"),
        ("", "the collision 'body' of 'thing' has no geometry"),
    ],
)
def test_wrong_values_are_errors_with_their_place(tmp_path, geometry, sentence):
    (finding,) = refusals(tmp_path, gazebo_world(collision_model(geometry)))
    assert finding.code == "E201" and sentence in finding.sentence
    assert finding.mark.file.endswith("a.world") and finding.mark.line > 2


def test_every_wrong_value_is_reported_in_one_go(tmp_path):
    text = gazebo_world(
        collision_model(BOX, "0 0") + collision_model("<box><size>0 1 1</size></box>")
    )
    assert len(refusals(tmp_path, text)) == 2


@pytest.mark.parametrize(
    ("text", "code", "line"),
    [
        ("<sdf><world></sdf>", "E207", 1),
        ("<sdf>\n<world>\n</sdf>", "E207", 3),
        ("", "E005", 1),
        ("<!DOCTYPE a [<!ENTITY b 'c'>]><sdf>&b;</sdf>", "E207", 1),
        ("<robot name='x'/>", "E007", 1),
        ("<sdf/>", "E007", 1),
        ("<sdf><world name='empty'/></sdf>", "E206", 1),
        ("<?xml version='1.0' encoding='klingon'?><sdf><world/></sdf>", "E207", 1),
        ("<sdf><world>" * 200, "E207", 1),
    ],
)
def test_files_that_are_not_worlds_are_refused(tmp_path, text, code, line):
    (finding,) = refusals(tmp_path, text)
    assert (finding.code, finding.mark.line) == (code, line)


def test_a_missing_file_suggests_the_nearest(tmp_path):
    (tmp_path / "world_17.world").write_text("")
    with pytest.raises(InputError, match=r"E001.*there is no such Gazebo world.*world_17"):
        read_any_world(tmp_path / "world_18.world")


@settings(deadline=None, max_examples=60)
@given(st.data())
def test_damaged_files_are_refused_or_read_never_a_crash(tmp_path_factory, data):
    text = cylinder_world([(1.0, 1.0)])
    begin = data.draw(st.integers(0, len(text)))
    damaged = text[:begin] + data.draw(st.text(max_size=3)) + text[begin + 1 :]
    path = tmp_path_factory.mktemp("w") / "a.sdf"
    path.write_bytes(damaged.encode("utf-8", "replace"))
    try:
        read_any_world(path)
    except InputError as error:
        assert all(finding.mark.line >= 1 for finding in error.findings)

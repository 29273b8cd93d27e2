"""World files: what they mean, and that each mistake is reported where it stands."""

import re
from dataclasses import replace
from itertools import pairwise
from math import pi, radians
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.errors import InputError
from stack.mavlink.origin import GeoOrigin
from stack.sim.worlds.outlines import Rectangle
from stack.sim.worlds.rasterise import rasterise
from stack.sim.worlds.world import Dock, Drop, Push, Shadow, Trigger, Wall, WorldEvent
from stack.sim.worlds.world_file import find_world, read_world
from stack.types import FREE, OCCUPIED, Pose2D

ROOT = Path(__file__).parents[3]
WORLDS = ROOT / "missions" / "worlds"
SHIPPED = sorted(WORLDS.glob("*.yaml"))

ROOM = """\
world: room
walls:
  - {points: [[0, 0], [4, 0], [4, 3], [0, 3]], closed: true}
start: [1, 1, 90 deg]
"""


@pytest.fixture
def read(tmp_path):
    def read_text(text):
        file = tmp_path / "w.yaml"
        file.write_text(text)
        return read_world(file)

    return read_text


@pytest.fixture
def findings(read):
    def of_text(text):
        with pytest.raises(InputError) as caught:
            read(text)
        return [
            f"{finding.mark.line}:{finding.mark.column} {finding.code} {finding.sentence}"
            + (f"; {finding.hint}" if finding.hint else "")
            for finding in caught.value.findings
        ]

    return of_text


def test_a_closed_wall_returns_to_its_first_point(read):
    world = read(ROOM)
    assert world.walls[0].points.tolist() == [[0, 0], [4, 0], [4, 3], [0, 3], [0, 0]]
    assert world.start == Pose2D(1.0, 1.0, pi / 2)


def test_bounds_default_to_everything_and_half_a_metre(read):
    # The walls reach 0.05 m beyond their points; -0.55 and 4.55 round out to tenths.
    assert read(ROOM).bounds == (-0.6, -0.6, 4.6, 3.6)


def test_all_keys_of_a_world_file(read):
    world = read(
        ROOM
        + """\
bounds: [-1, -1, 5, 4]
friction: 0.7
places: {home: [1, 1], far: [3 m, 200 cm, 180 deg]}
boxes: [{name: desk, at: [3, 1, 90 deg], size: [1, 50 cm, 0.7], on_map: false, elevation: 20 cm}]
drops: [{name: stairs, from: [2, 3], to: [1, 2], depth: 1.5}]
cylinders: [{at: [3.5, 2.5], radius: 20 cm}]
doors: [{name: front, from: [0, 1], to: [0, 2], closed: true}]
markers: [{id: 7, at: [3.94, 1], facing: 180 deg}]
friction_zones: [{from: [2, 2], to: [1, 1], friction: 0.3}]
people: [{name: Ada, waypoints: [[1, 2], [3, 2]], pause: 1 s, start: 0.5}]
docks: [{at: [1, 1]}]
light: 0.4
shadows: [{from: [1, 1], to: [0, 2], light: 0.3}, {from: [2, 1], to: [3, 2]}]
lines: [{points: [[1, 1], [3, 1], [3, 2]], width: 3 cm, colour: [1, 0, 0]}]
timeline:
  - {when: {time: 20 s}, close_door: front}
  - {when: {near: [3, 2, 50 cm], time: 1 min}, after: 2 s, move_robot: home}
  - {when: {time: 5}, battery: 20 %}
  - {when: {time: 6}, push: {by: [30 cm, 0, 20 deg], over: 800 ms, frame: map}}
  - {when: {time: 7}, push: {by: [0, 1, 0]}}
"""
    )
    assert world.bounds == (-1, -1, 5, 4) and world.friction == 0.7
    assert world.places["far"] == Pose2D(3.0, 2.0, pi)
    assert world.boxes[0].size == (1.0, 0.5, 0.7) and not world.boxes[0].on_map
    assert world.boxes[0].elevation == 0.2
    assert world.drops == (Drop((1, 2, 2, 3), 1.5, "stairs"),)
    assert world.cylinders[0].radius == pytest.approx(0.2)
    assert world.doors[0].closed and world.doors[0].end == (0.0, 2.0)
    assert world.markers[0].heading == pi and world.markers[0].dictionary == "DICT_4X4_50"
    assert world.friction_zones[0].bounds == (1, 1, 2, 2)
    assert world.shadows == (Shadow((0, 1, 1, 2), 0.3), Shadow((2, 1, 3, 2), 0.4))
    assert world.lines[0].points.tolist() == [[1, 1], [3, 1], [3, 2]] and world.light == 0.4
    assert world.lines[0].width == pytest.approx(0.03) and world.lines[0].colour == (1, 0, 0)
    assert world.people[0].waypoints.shape == (2, 2) and world.people[0].start == 0.5
    assert world.timeline == (
        WorldEvent(Trigger(time=20.0), close_door="front"),
        WorldEvent(Trigger(60.0, (3.0, 2.0, 0.5), 2.0), move_robot=Pose2D(1.0, 1.0)),
        WorldEvent(Trigger(time=5.0), battery=0.2),
        WorldEvent(Trigger(time=6.0), push=Push(Pose2D(0.3, 0.0, radians(20)), 0.8, "map")),
        WorldEvent(Trigger(time=7.0), push=Push(Pose2D(0.0, 1.0, 0.0))),
    )


WRONG = {  # `^` marks the place that must be reported
    "^cylinder: []": "E201 a world file has no key 'cylinder'; did you mean 'cylinders'?",
    "cylinders: [{at: [1, 2], radius: ^3 deg}]": "E201 radius: '3 deg' is in deg, expected a len",
    "cylinders: [{at: [1, ^2000], radius: 1}]": "E201 y: 2000 m must be at most 1000 m",
    "cylinders: [^{at: [1, 2]}]": "E201 a cylinder needs the key 'radius'",
    "cylinders: [{at: [1, 2], radius: ^0}]": "E201 radius: 0 m must be above 0 m",
    "lines: [{points: ^[[1, 2]]}]": "E201 points needs at least two points [x, y]",
    "lines: [{points: [[1, 2], [2, 2]], width: ^2 m}]": "E201 width: 2 m must be at most 1 m",
    "light: ^-1": "E201 light: -1 must be at least 0",
    "cylinders: [^plant]": "E201 a cylinder must be a mapping of keys, got 'plant'",
    "cylinders: ^plant": "E201 cylinders: expected a list, got 'plant'",
    "boxes: [{at: ^[1], size: [1, 1, 1]}]": "E201 at: expected [x, y, heading], got a list of 1",
    "boxes: [{at: [3, 2], size: [1, 1, ^tall]}]": "E201 height: expected a length, got 'tall'",
    "boxes: [{at: [3, 2], size: [1, 1, 1], ^colr: 1}]": "E201 a box has no key 'colr'; did you me",
    "boxes: [{at: [3, 2], size: [1, 1, 1], colour: [1, ^2, 0]}]": "E201 green: 2 must be at most 1",
    "people: [{name: A, waypoints: ^[[1, 2]]}]": "E201 waypoints needs at least two points [x, y]",
    "people: [{name: A, waypoints: [[1, 2], ^[1, 2]]}]": "E201 waypoints: the point [1.0, 2.0] is ",
    "people: [{name: A, waypoints: [[1, 2], [2, 2]]}, {name: ^A, waypoints: [[1, 2], [2, 2]]}]": (
        "E202 duplicate person 'A'; the first is in line 5"
    ),
    "doors: [^{name: d, from: [1, 1], to: [1, 1]}]": "E201 `from` and `to` of the door are the sa",
    "markers: [{id: ^50, at: [1, 1], facing: 0}]": "E203 DICT_4X4_50 has no marker 50; its ids ar",
    "markers: [{id: 1, at: ^[4, 1], facing: 0}]": "E204 marker 1 at [4, 1] is 5.0 cm inside a wal",
    "markers: [{id: 1, at: [3, 1], facing: 0}, {id: ^1, at: [3, 1], facing: 0}]": (
        "E202 duplicate DICT_4X4_50 marker 1; the first is in line 5"
    ),
    "bounds: ^[0, 0, -1, 2]": "E204 bounds [0.0, 0.0, -1.0, 2.0] enclose nothing",
    "places: {a: ^[3, 3.02]}": "E204 the place 'a' at [3, 3.02] is 3.0 cm inside a wall",
    "friction: ^3": "E201 friction: 3 must be at most 2",
    "format: ^2": "E201 format: 2 must be at most 1",
    "timeline: [{when: {time: ^2 m}, battery: 1}]": "E201 time: '2 m' is in m, expected a duration",
    "timeline: [{when: ^{}, battery: 1}]": "E201 `when` needs `time: 20 s` or `near: [x, y, radi",
    "timeline: [^{battery: 1}]": "E201 a timeline entry needs the key 'when'",
    "timeline: [^{when: {time: 1}}]": "E201 a timeline entry has exactly one action, got none",
    "timeline: [^{when: {time: 1}, battery: 1, move_robot: [1, 1]}]": (
        "E201 a timeline entry has exactly one action, got move_robot and battery"
    ),
    "timeline: [{when: {time: 1}, ^push: {over: 1}}]": "E201 `push` needs the key 'by'",
    "timeline: [{when: {time: 1}, push: {by: ^[1, 2]}}]": "E201 by: expected [dx, dy, dheading]",
    "timeline: [{when: {time: 1}, push: {by: [^11, 0, 0]}}]": "E201 dx: 11 m must be at most 10 m",
    "timeline: [{when: {time: 1}, push: {by: [1, 0, 0], frame: ^odom}}]": "E201 frame: ",
    "timeline: [{when: {time: 1}, open_door: ^frnt}]": "E203 open_door: there is no door 'frnt'",
    "timeline: [{when: {time: 1}, move_robot: ^hom}]": "E203 move_robot: there is no place 'hom'",
    "timeline: [{when: {near: ^[1, 1]}, battery: 1}]": "E201 near: expected [x, y, radius], got a",
}


@pytest.mark.parametrize("addition", WRONG)
def test_a_mistake_is_reported_where_it_stands(findings, addition):
    found = findings(f"{ROOM}{addition.replace('^', '')}\n")
    expected = f"5:{addition.index('^') + 1} {WRONG[addition]}"
    assert [line[: len(expected)] for line in found] == [expected]


def test_a_start_outside_the_bounds_or_in_a_wall_is_reported_at_the_start(findings):
    outside = findings(f"{ROOM}bounds: [2, 0, 4, 2]\n")
    assert outside[0].startswith("4:8 E204 the start at [1, 1] is outside the bounds [2.0, 0.0,")
    assert findings(ROOM.replace("[1, 1, 90 deg]", "[1, 0, 90 deg]"))[0].startswith(
        "4:8 E204 the start at [1, 0] is 5.0 cm inside a wall"
    )


def test_all_mistakes_are_reported_at_once(findings):
    found = findings(f"{ROOM}frction: 1\ncylinders: [{{at: [1, b], radius: -1}}]\ndoors: [{{}}]\n")
    assert [line.split()[0] for line in found] == ["5:1", "6:22", "6:34", "7:9", "7:9", "7:9"]


def test_two_dictionaries_may_have_the_same_marker_id(read):
    other = "dictionary: DICT_APRILTAG_36h11"
    one, two = "{id: 1, at: [3.9, 1], facing: 0}", f"{{id: 1, at: [3, 1], facing: 0, {other}}}"
    assert len(read(f"{ROOM}markers: [{one}, {two}]").markers) == 2


def test_a_world_without_anything_solid_is_refused(findings):
    assert findings("world: void\n")[0].startswith("1:1 E206 this world is empty")


def test_every_box_is_compared_with_all_places_at_once(read, monkeypatch):
    calls = []
    distance_to = Rectangle.distance_to
    monkeypatch.setattr(
        Rectangle, "distance_to", lambda self, at: calls.append(len(at)) or distance_to(self, at)
    )
    boxes = ", ".join(f"{{at: [3, {1 + 0.1 * n:g}], size: [0.05, 0.05, 1]}}" for n in range(9))
    places = ", ".join(f"p{n}: [1, {1 + 0.1 * n:g}, 0]" for n in range(7))
    read(f"{ROOM}boxes: [{boxes}]\nplaces: {{{places}}}\n")
    # 4 sides of the room and 9 boxes, each with the start and 7 places
    assert calls == 13 * [8]


def test_more_than_5000_things_are_refused(findings):
    many = ", ".join(["{at: [3, 2], radius: 0.01}"] * 4995)  # and a wall with its five points
    assert "5001 items" in findings(f"{ROOM}cylinders: [{many}]\n")[0]


@settings(deadline=None, max_examples=150)
@given(
    text=st.recursive(
        st.sampled_from(["1", "-3", "2 m", "90 deg", "true", "a", "~", "1e9", "''"]),
        lambda inner: (
            st.lists(inner, max_size=4).map(lambda items: f"[{', '.join(items)}]")
            | st.dictionaries(
                st.sampled_from(
                    ["at", "points", "radius", "size", "name", "from", "to", "when", "near", "id",
                     "battery", "waypoints", "facing", "time", "closed"]
                ),
                inner,
                max_size=4,
            ).map(lambda items: "{" + ", ".join(f"{k}: {v}" for k, v in items.items()) + "}")
        ),
        max_leaves=12,
    ),
    key=st.sampled_from(
        ["walls", "boxes", "cylinders", "doors", "markers", "people", "places", "timeline", "start"]
    ),
)  # fmt: skip
def test_no_yaml_makes_the_reader_raise_anything_but_findings(tmp_path_factory, key, text):
    file = tmp_path_factory.getbasetemp() / "any.yaml"
    file.write_text(f"world: any\n{key}: {text}\n")
    try:
        read_world(file)
    except InputError as error:
        assert error.findings and all(finding.mark.line >= 1 for finding in error.findings)


def test_a_name_finds_a_shipped_world_and_a_path_is_relative_to_the_mission(tmp_path):
    mission = tmp_path / "mission.yaml"
    mission.write_text("mission: x")
    assert find_world("office", mission, WORLDS) == WORLDS / "office.yaml"
    assert find_world("./mine.yaml", mission, WORLDS) == tmp_path / "mine.yaml"
    assert find_world("maps/mine.yaml", tmp_path, WORLDS) == tmp_path / "maps" / "mine.yaml"
    with pytest.raises(InputError, match=r"no world 'offce'; did you mean 'office'\?"):
        find_world("offce", mission, WORLDS)
    with pytest.raises(InputError, match="there is no world"):
        find_world("x" * 300, mission, WORLDS)  # longer than any file system allows for a name


def test_all_the_worlds_in_the_documentation_s_table_are_there():
    listed = re.findall(r"^\| `(\w+)` \|.*\|.*\|$", (ROOT / "docs" / "worlds.md").read_text(), re.M)
    assert {file.stem for file in SHIPPED} <= set(listed)


def clearance(grid):
    """(rows, columns) metres from each cell's middle to the nearest wall or thing on the map."""
    import cv2

    passable = (grid.cells != OCCUPIED).astype(np.uint8)
    return cv2.distanceTransform(passable, cv2.DIST_L2, cv2.DIST_MASK_PRECISE) * grid.resolution


@pytest.mark.parametrize("file", SHIPPED, ids=lambda file: file.stem)
def test_shipped_places_have_room_and_can_be_reached(file):
    import cv2

    world = read_world(file)
    if world.blocks:
        return  # for an arm that stands at a bench
    grid = rasterise(world, 0.05)
    room = clearance(grid)
    _, labels = cv2.connectedComponents((room > 0.30).astype(np.uint8), connectivity=4)
    home = labels[grid.cell_at(world.start.x, world.start.y)]
    assert home != 0
    for name, pose in world.places.items():
        cell = grid.cell_at(pose.x, pose.y)
        assert room[cell] >= 0.35, name
        assert labels[cell] == home, name


@pytest.mark.parametrize("file", SHIPPED, ids=lambda file: file.stem)
def test_people_in_shipped_worlds_walk_through_nothing(file):
    world = read_world(file)
    grid = rasterise(world, 0.05)
    room = clearance(grid)
    for person in world.people:
        # With social forces people find their way; only where they stop must be free.
        shares = np.linspace(0.0, 1.0, 100) if person.model == "loop" else np.zeros(1)
        for start, end in pairwise(np.vstack([person.waypoints, person.waypoints[:1]])):
            for share in shares:
                cell = grid.cell_at(*(start + share * (end - start)))
                assert room[cell] > person.radius and grid.cells[cell] == FREE, person.name


@pytest.mark.parametrize("file", SHIPPED, ids=lambda file: file.stem)
def test_markers_in_shipped_worlds_hang_on_a_wall_and_face_free_floor(file):
    world = read_world(file)
    grid = rasterise(world, 0.05)
    for marker in world.markers:
        board = Pose2D(*marker.position[:2], marker.heading)
        behind, before = board.compose(Pose2D(-0.03, 0.0)), board.compose(Pose2D(0.5, 0.0))
        assert grid.cells[grid.cell_at(behind.x, behind.y)] == OCCUPIED, marker.number
        assert grid.cells[grid.cell_at(before.x, before.y)] == FREE, marker.number


def test_the_twin_rooms_are_alike_on_the_map_and_differ_in_markers():
    world = read_world(WORLDS / "twin_rooms.yaml")
    grid = rasterise(world, 0.05)
    row, west = grid.cell_at(0.025, 2.125)
    room_a, room_b = grid.cells[row:, west : west + 100], grid.cells[row:, west + 100 : west + 200]
    assert np.array_equal(room_a[:, :99], room_b[:, :99])
    assert len({marker.number for marker in world.markers}) == len(world.markers)
    (lifted,) = world.timeline
    x, y, _ = lifted.trigger.near
    # Seen from its room the new place is another one: rooms are 5 m apart.
    assert lifted.move_robot.distance_to(Pose2D(x + 5.0, y)) - lifted.trigger.near[2] > 1.0


def test_with_the_short_cut_closed_there_is_a_longer_path():
    world = read_world(WORLDS / "two_corridors.yaml")
    (door,) = world.doors
    shut = Wall(np.array([door.start, door.end]), door.thickness)
    closed = rasterise(replace(world, walls=(*world.walls, shut)), 0.05)
    lengths = [
        steps_between(grid, world.places["west"], world.places["east"])
        for grid in (rasterise(world, 0.05), closed)
    ]
    # 11 m straight ahead; round it is up from y = 2 to y = 7.4 and down again.
    assert lengths[0] == 11.0 / 0.05
    assert 20.0 / 0.05 < lengths[1] < 24.0 / 0.05


def steps_between(grid, start, goal):
    """Length of the shortest 4-connected way with 0.3 m to each side, in cells."""
    import cv2

    free = (clearance(grid) > 0.30).astype(np.uint8)
    reached = np.zeros_like(free)
    reached[grid.cell_at(start.x, start.y)] = 1
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    for steps in range(free.size):
        if reached[grid.cell_at(goal.x, goal.y)]:
            return steps
        reached = cv2.dilate(reached, cross) & free
    raise AssertionError("there is no way")


def test_a_dock_that_faces_a_direction_is_a_block_with_a_slot(read):
    world = read(ROOM + "docks: [{at: [2.0, 0.25], facing: 90 deg}]\n")
    assert world.docks == (Dock(2.0, 0.25, 0.35, pi / 2),)
    # 40 x 20 cm with a slot of 16 x 10 cm: 0.064 m².
    assert sum(box.size[0] * box.size[1] for box in world.boxes) == pytest.approx(0.064)
    assert all(box.pose.y < 0.25 for box in world.boxes)


@pytest.mark.parametrize(
    ("robot", "charged"),
    [
        ((2.0, 0.49, -90), True),  # 2 cm in front of the face, facing it
        ((2.0, 0.53, -90), False),  # 6 cm
        ((2.03, 0.49, -90), False),  # 3 cm to the side
        ((2.0, 0.49, -84), False),  # 6 degrees off
        ((2.0, 0.49, 90), False),  # with its back to it
    ],
)
def test_contacts_charge_only_a_robot_that_stands_at_them(robot, charged):
    x, y, heading = robot
    dock = Dock(2.0, 0.25, facing=pi / 2)
    assert dock.charges(Pose2D(x, y, radians(heading)), front=0.22) is charged


def test_a_world_has_a_place_on_earth(read, findings):
    assert read(ROOM).origin is None
    placed = read(
        f"{ROOM}origin: {{latitude: 48.1, longitude: 11.5, altitude: 500, east: 90 deg}}\n"
    )
    assert placed.origin == GeoOrigin(48.1, 11.5, 500.0, pi / 2)
    (found,) = findings(f"{ROOM}origin: {{latitude: 91, longitude: 11.5}}\n")
    assert found.startswith("5:20 E201 ") and "85" in found
    (found,) = findings(f"{ROOM}origin: {{latitude: 48.1, longitud: 11.5}}\n")[:1]
    assert "longitud" in found

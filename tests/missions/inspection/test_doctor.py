"""`treepilot doctor` on worlds that close or open by known widths."""

import cv2
import numpy as np
import pytest

from missions.execution.resources import MISSIONS
from missions.inspection.doctor.lidars import is_robot
from missions.inspection.doctor.passages import examine, show_world
from missions.map_picture import FOOTER, GRID, TEXT
from robots.load import find_robot
from stack.errors import InputError
from tests.stack.sim.gazebo_text import collision_model, gazebo_world

WORLD = """\
world: narrow
format: 1
start: west
places:
  west: [1.0, 1.5, 0 deg]
  east: [4.0, 1.5, 0 deg]
  wedge: [0.2, 0.2, 0 deg]
walls:
  - {{points: [[0, 0], [5, 0], [5, 3], [0, 3]], closed: true}}
  - {{points: [[2.5, 0], [2.5, {low}]]}}
  - {{points: [[2.5, {high}], [2.5, 3]]}}
"""


def world_with_a_gap(tmp_path, width):
    """Walls are 10 cm thick and their ends are cut square, so the gap is as wide as said."""
    path = tmp_path / "narrow.yaml"
    text = WORLD.format(low=1.5 - width / 2, high=1.5 + width / 2)
    path.write_text(text, "utf-8")
    return str(path)


@pytest.mark.pain("n5625")
def test_a_gap_narrower_than_the_robot_closes_the_place_behind_it(tmp_path):
    found = examine(world_with_a_gap(tmp_path, 0.40), "scout", None)
    text = "\n".join(found.lines)
    assert "closed; the footprint needs 0.44 m" in text
    assert "place east (4.00, 1.50): not reachable" in text
    assert "place wedge (0.20, 0.20): blocked" in text
    assert found.closed == 3  # the passage, the place behind it, the place in the corner


def test_a_world_too_large_for_a_map_is_the_finding_of_check(tmp_path):
    """205 m / 2.5 cm = 8200 cells a side; 8192 are possible."""
    file = tmp_path / "wide.yaml"
    post = "boxes:\n  - {at: [9, 9, 0], size: [1, 1, 1]}\n"
    file.write_text(f"world: wide\nbounds: [0, 0, 205, 205]\nstart: [1, 1, 0]\n{post}", "utf-8")
    with pytest.raises(InputError) as refused:
        examine(str(file), "scout", None)
    (finding,) = refused.value.findings
    assert finding.code == "E413" and finding.mark.file == str(file)
    assert finding.sentence == (
        "wide is 205 x 205 m: its map would have 67240000 cells of 0.025 m,"
        " at most 67108864 are possible"
    )


@pytest.mark.pain("n5625")
def test_a_wide_gap_is_open_and_the_picture_is_drawn(tmp_path):
    picture = tmp_path / "found.png"
    found = examine(world_with_a_gap(tmp_path, 0.9), "scout", picture)
    assert found.closed == 1  # the corner stays too small
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert found.lines[-2] == "1 passage or place closed to scout"


DOCK_WORLD = """\
world: bay
format: 1
start: [2.5, 1.5, 0]
places:
  charger: [0.3, 1.5, {heading}]
walls:
  - {{points: [[0, 0], [5, 0], [5, 3], [0, 3]], closed: true}}
{post}docks:
  - {{at: [0.3, 1.5], facing: 0 deg}}
"""


@pytest.mark.parametrize(
    ("heading", "post", "closed"),
    [
        ("0 deg", "", 0),
        ("180 deg", "", 1),  # not the direction out of the face: a robot cannot stand there
        ("0 deg", "cylinders:\n  - {at: [1.2, 1.5], radius: 10 cm}\n", 1),
    ],
)
def test_a_place_at_the_face_of_a_dock_is_the_place_before_it(tmp_path, heading, post, closed):
    """docs/worlds.md: "Give the mission a place at the face, with `facing` as its heading"."""
    file = tmp_path / "bay.yaml"
    file.write_text(DOCK_WORLD.format(heading=heading, post=post), "utf-8")
    found = examine(str(file), "scout", None)
    assert found.closed == closed
    assert any("before the face of the dock" in line for line in found.lines) == (
        "180" not in heading
    )


def test_a_gazebo_world_is_diagnosed_drawn_and_its_parts_are_announced(tmp_path):
    """A room of 6 x 6 m with a wall across that leaves 0.4 m: closed to the scout (0.44 m)."""
    walls = {"a": (0, 3, 6, 0.1), "b": (0, -3, 6, 0.1), "c": (3, 0, 0.1, 6), "d": (-3, 0, 0.1, 6),
             "e": (1.45, 1.7, 0.1, 2.6), "f": (1.45, -1.5, 0.1, 3.0)}  # fmt: skip
    models = [
        collision_model(f"<box><size>{x} {y} 1</size></box>", f"{at_x} {at_y} 0.5 0 0 0", name)
        for name, (at_x, at_y, x, y) in walls.items()
    ]
    file = tmp_path / "room.world"
    file.write_text(gazebo_world("".join(models)), "utf-8")
    said: list[str] = []
    found = examine(str(file), "scout", None, said.append)
    assert "0.38 m wide: closed" in found.lines[1]  # cells of 2.5 cm that the walls touch
    assert said == [f"reading {file}", "passages of 288 x 288 cells"]
    assert show_world(str(file), tmp_path / "room.png").endswith("default, 7.2 x 7.2 m, 0 places")


def test_a_clean_world_says_so():
    found = examine("small_room", "scout", None)
    assert found.closed == 0
    assert found.lines[-1] == "clean: scout can use 0 passages and 5 places without difficulty"


def test_pictures_show_names_and_a_scale(tmp_path):
    """7 x 6 m at 120 pixels a metre; the bar is the longest of at most a quarter: 1 m."""
    line = show_world("small_room", tmp_path / "room.png")
    assert line.endswith("room.png: small room, 7.0 x 6.0 m, 5 places")
    image = cv2.imread(str(tmp_path / "room.png"))
    assert image.shape == (round(6.0 * 120) + FOOTER, round(7.0 * 120), 3)
    row = image[-FOOTER // 2 + 8]
    bar = np.flatnonzero((row == TEXT).all(axis=1))
    assert (bar[0], bar[-1]) == pytest.approx((840 - 16 - 120, 840 - 16), abs=2)
    # `home` stands right above (1, 1) m, and the map begins at (-0.5, -0.5) m.
    label = image[720 - 180 - 24 : 720 - 180 - 4, 180 + 8 : 180 + 48]
    assert (label.min(axis=2) > 120).sum() > 40
    with pytest.raises(InputError, match=r"must end in \.png"):
        show_world("small_room", tmp_path / "room.jpg")


def test_pictures_show_coordinates(tmp_path):
    """Lines every metre from the corner (-0.5, -0.5) m on, with their coordinates at the border."""
    show_world("small_room", tmp_path / "room.png")
    image = cv2.imread(str(tmp_path / "room.png"))[:-FOOTER]
    lines = (image == GRID).all(axis=2)
    columns, rows = (np.flatnonzero(lines.mean(axis=axis) > 0.5) for axis in (0, 1))
    assert columns.tolist() == [60 + 120 * x for x in range(7)]
    assert rows.tolist() == [60 + 120 * y for y in range(6)]
    for column in columns:  # a number right of each line, at the lower border
        assert (image[-20:-4, column + 4 : column + 14].min(axis=2) > 120).any()


def test_a_door_askew_to_the_cells_is_open_to_whom_it_lets_through():
    """54 cm, of which at 5 cm a cell no more than 45 would be seen; the robot needs 44."""
    found = examine(str(MISSIONS / "bench" / "narrow_door.yaml"), "scout", None)
    assert found.closed == 0
    passage = next(line for line in found.lines if "passage" in line)
    assert "2.5 cm" in found.lines[0]
    assert 0.48 <= float(passage.split("), ")[1].split()[0]) <= 0.54


@pytest.mark.parametrize("ahead", ["100 cm", "60 cm", "40 cm"])
def test_the_width_of_a_robot_does_not_depend_on_the_place_of_its_base(tmp_path, ahead):
    back = int(ahead.split()[0]) - 120
    shape = f"[[{ahead}, -35 cm], [{ahead}, 35 cm], [{back} cm, 35 cm], [{back} cm, -35 cm]]"
    file = find_robot("scout", tmp_path)
    folder, text = file.parent, file.read_text("utf-8")
    lines = [line for line in text.splitlines() if not line.startswith("footprint")]
    lines = [line.replace("urdf: ", f"urdf: {folder}/") for line in lines]
    (tmp_path / "robot.yaml").write_text("\n".join([*lines, f"footprint: {shape}"]), "utf-8")
    for gap, closed in ((0.6, True), (0.8, False)):
        world = world_with_a_gap(tmp_path, gap)
        found = examine(world, str(tmp_path / "robot.yaml"), None)
        text = "\n".join(found.lines)
        assert "is 0.70 m wide" in text
        assert ("place east (4.00, 1.50): not reachable" in text) is closed


def test_a_damaged_robot_file_is_not_read_as_a_world(tmp_path):
    file = tmp_path / "mine.yaml"
    file.write_text("robot: mine\nurdf: mine.urdf\nfootprint: {radius: 20 cm\n")
    assert is_robot(str(file))


def test_findings_name_the_file_as_it_was_given(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "hall.yaml").write_text("world: hall\nwals: []\n")
    with pytest.raises(InputError) as refused:
        examine("hall.yaml", "scout", None)
    assert {finding.mark.file for finding in refused.value.findings} == {"hall.yaml"}

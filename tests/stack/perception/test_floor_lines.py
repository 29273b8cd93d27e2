"""Lines on the floor: rendered pictures of painted lines, in dim and bright light."""

from dataclasses import replace
from math import cos, radians, sin
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robots.load import find_robot, read_robot
from stack.perception.floor_lines import CELL, FloorLineDetector
from stack.perception.rolling_grid import shifted
from stack.sim.sensors.rendering import CameraRenderer
from stack.sim.sensors.requests import RenderRequest, RenderSetup
from stack.sim.worlds.world import Box, FloorLine
from stack.types import Image, Pose2D
from tests.stack.sim.sim_rover import EMPTY

SCOUT = read_robot(find_robot("scout", Path()))
CAMERA = SCOUT.camera
AHEAD = FloorLine(np.array([[0.0, 0.0], [3.0, 0.0]]))
NOTHING = np.empty((0, 2))


def seen(*lines, light=1.0, way=(Pose2D(0.0, 0.0),), colour="dark", width=0.05, **parts):
    """What is known after a picture at each pose of a way, 0.2 s apart."""
    obstacles = parts.pop("obstacles", NOTHING)
    world = replace(EMPTY, lines=lines, light=light, **parts)
    renderer = CameraRenderer(RenderSetup(world, SCOUT.model, CAMERA, "camera"))
    detector = FloorLineDetector()
    try:
        for number, at in enumerate(way):
            turn = (0.0, 0.0, sin(at.heading / 2), cos(at.heading / 2))
            request = RenderRequest(number, (at.x, at.y, 0.0), turn, np.empty((0, 3)), {})
            image = Image(0.2 * number, renderer.render(request), CAMERA.model)
            found = detector.see(image, at, colour, width, obstacles)
    finally:
        renderer.close()
    return found


def marked(lines):
    return lines.points(np.argwhere(lines.marked))


@pytest.mark.parametrize("light", [0.3, 1.0, 2.0])
def test_a_line_is_where_it_was_painted_in_any_light(light):
    points = marked(seen(AHEAD, light=light))
    # The camera is 0.12 m ahead of the base and 0.35 m high, with a half view of
    # atan(tan(35 deg) * 240 / 320) = 27.7 deg: it sees the floor from 0.12 + 0.35 / tan(27.7 deg).
    assert points[:, 0].min() == pytest.approx(0.79, abs=0.03)
    assert points[:, 0].max() > 1.7
    assert points[:, 1].mean() == pytest.approx(0.0, abs=0.5 * CELL)
    near = points[points[:, 0] < 1.2]
    # The threshold, 1 / 1.4 of the floor's brightness, is in the lighter half of a blurred edge.
    assert len(near) * CELL**2 / np.ptp(near[:, 0]) == pytest.approx(0.055, abs=0.01)


@pytest.mark.parametrize("away", [0.95, 1.2, 1.5, 1.8])
def test_a_line_across_the_view_is_as_far_away_as_it_was_painted(away):
    # At 1.8 m a row of pixels is 1.8^2 / (0.35 fx) = 4 cm of floor; paint that is h high would be
    # seen h x away / 0.35 too far away.
    ray = np.array([cos(0.5), -sin(0.5)])
    middle, side = [0.12, 0.0] + away * ray, np.array([sin(0.5), cos(0.5)])
    line = FloorLine(np.array([middle - 0.25 * side, middle + 0.25 * side]))
    points = marked(seen(line))
    assert ((points - middle) @ ray).mean() == pytest.approx(0.0, abs=0.006)


def test_a_bare_floor_has_no_line():
    lines = seen()
    assert not lines.marked.any() and lines.seen.sum() * CELL**2 > 1.0


def test_a_line_turned_and_moved_stays_where_it_is_in_the_odom_frame():
    turn = radians(30.0)
    line = FloorLine(np.array([[0.0, 0.0], [4.0 * cos(turn), 4.0 * sin(turn)]]))
    way = [Pose2D(d * cos(turn), d * sin(turn), turn + 0.1) for d in np.arange(0.0, 1.0, 0.1)]
    points = marked(seen(line, way=way))
    across = points @ [-sin(turn), cos(turn)]
    assert np.abs(across).max() < 0.045 and np.abs(across.mean()) < 0.5 * CELL
    assert np.ptp(points @ [cos(turn), sin(turn)]) > 1.8


COLOURS = {"red": (0.8, 0.1, 0.1), "yellow": (0.9, 0.8, 0.1), "green": (0.1, 0.6, 0.2),
           "blue": (0.1, 0.2, 0.8), "light": (1.0, 1.0, 1.0)}  # fmt: skip


@pytest.mark.parametrize("light", [0.3, 1.0])
@pytest.mark.parametrize("colour", ["red", "yellow", "green", "blue"])
def test_a_coloured_line_is_told_from_one_of_another_colour(colour, light):
    other = next(name for name in COLOURS if name not in (colour, "light"))
    lines = (
        FloorLine(np.array([[0.0, 0.2], [3.0, 0.2]]), colour=COLOURS[colour]),
        FloorLine(np.array([[0.0, -0.2], [3.0, -0.2]]), colour=COLOURS[other]),
    )
    points = marked(seen(*lines, colour=colour, light=light))
    assert len(points) > 300 and np.abs(points[:, 1] - 0.2).max() < 0.05


def test_a_white_line_is_light():
    points = marked(seen(replace(AHEAD, colour=COLOURS["light"]), colour="light", light=0.8))
    assert len(points) > 300 and np.abs(points[:, 1]).max() < 0.05


def test_a_wide_dark_area_is_no_line():
    carpet = FloorLine(np.array([[0.0, 0.0], [3.0, 0.0]]), width=0.6)
    assert not seen(carpet).marked.any()


def test_what_an_obstacle_hides_is_not_floor():
    box = Box(Pose2D(1.3, 0.0), (0.05, 0.05, 1.0), colour=(0.1, 0.1, 0.1))
    face = np.array([[1.275, -0.02], [1.275, 0.0], [1.275, 0.02]])
    free, hidden = seen(boxes=(box,)), seen(boxes=(box,), obstacles=face)
    assert free.marked.any() and not hidden.marked.any()
    assert 0 < hidden.seen.sum() < free.seen.sum()


def test_the_same_picture_changes_nothing_and_a_late_one_begins_anew():
    pixels = np.full((240, 320, 3), 100, np.uint8)
    detector, base = FloorLineDetector(), Pose2D(0.0, 0.0)
    first = detector.see(Image(1.0, pixels, CAMERA.model), base, "dark", 0.05, NOTHING)
    again = detector.see(Image(1.0, pixels, CAMERA.model), base, "dark", 0.05, NOTHING)
    assert again is first
    turned = Pose2D(0.0, 0.0, 3.0)
    late = detector.see(Image(9.0, pixels, CAMERA.model), turned, "dark", 0.05, NOTHING)
    assert late.seen.sum() == pytest.approx(first.seen.sum(), rel=0.02)


def test_a_camera_that_sees_no_floor_sees_no_line():
    model = replace(CAMERA.model, pitch=-0.6)
    image = Image(0.0, np.zeros((240, 320, 3), np.uint8), model)
    lines = FloorLineDetector().see(image, Pose2D(0.0, 0.0), "dark", 0.05, NOTHING)
    assert not lines.seen.any() and not lines.marked.any()


@settings(deadline=None)
@given(st.integers(-12, 12), st.integers(-12, 12))
def test_a_grid_that_follows_keeps_what_stays_inside(rows, columns):
    cells = np.arange(100).reshape(10, 10)
    moved = shifted(cells, rows, columns, -1)
    for row in range(10):
        for column in range(10):
            inside = 0 <= row + rows < 10 and 0 <= column + columns < 10
            wanted = cells[row + rows, column + columns] if inside else -1
            assert moved[row, column] == wanted

"""Perception through a distorting lens: each consumer of pictures finds what is there.

Pictures are rendered through the lens. The last argument of each test says what a consumer that
ignores the lens would get wrong: the same picture, with a model without the distortion.
"""

from dataclasses import replace
from math import atan2, cos, pi, sin
from pathlib import Path

import numpy as np
import pytest

from robots.load import find_robot, read_robot
from stack.drivetrain.description import DepthCameraDescription
from stack.perception.colour_parameters import ColourParameters
from stack.perception.coloured_objects import ColouredObjectDetector
from stack.perception.depth.obstacles import obstacle_points, projected
from stack.perception.depth.parameters import DepthParameters
from stack.perception.floor_lines import FloorLineDetector
from stack.perception.markers.detector import MarkerDetector
from stack.sim.sensors.rendering import CameraRenderer
from stack.sim.sensors.requests import RenderRequest, RenderSetup
from stack.sim.worlds.world import Box, FloorLine
from stack.types import DepthImage, Image, Marker, Pose2D, wrap_angle
from tests.stack.sim.sim_rover import EMPTY

SCOUT = read_robot(find_robot("scout", Path()))
LENS = replace(
    SCOUT.camera.model, distortion=(-0.28, 0.09, 0.001, -0.0008, -0.005), focal_length_y=224.0,
    principal_point=(164.0, 116.0),
)  # fmt: skip
CAMERA = replace(SCOUT.camera, model=LENS)
NOTHING = np.empty((0, 2))


def rendered(camera, base=Pose2D(0.0, 0.0), **parts):
    setup = RenderSetup(replace(EMPTY, **parts), SCOUT.model, camera, "camera")
    renderer = CameraRenderer(setup)
    try:
        turn = (0.0, 0.0, sin(base.heading / 2), cos(base.heading / 2))
        return renderer.render(RenderRequest(0, (base.x, base.y, 0.0), turn, np.empty((0, 3)), {}))
    finally:
        renderer.close()


def image(base=Pose2D(0.0, 0.0), model=LENS, **parts):
    return Image(0.2, rendered(replace(CAMERA, model=model), base, **parts), model)


def without_lens(picture):
    return replace(picture, camera=replace(picture.camera, distortion=()))


def marker_errors(pictures, marker):
    errors = []
    for base, picture in pictures:
        (sighting,) = MarkerDetector([marker]).sightings(picture)
        best = min(sighting.candidates, key=lambda c: c.pose.distance_to(base))
        turned = abs(wrap_angle(best.pose.heading - base.heading))
        errors.append((best.pose.distance_to(base), turned))
    return np.array(errors)


def test_markers_anywhere_in_the_picture_give_the_pose():
    marker = Marker(7, 0.2, (1.4, 0.0, 0.55), pi)
    random = np.random.default_rng(1)
    pictures = []
    for _ in range(18):
        angle, away, aside = random.uniform([-0.7, 0.9, -0.42], [0.7, 1.5, 0.42])
        x, y = 1.4 - away * cos(angle), away * sin(angle)
        base = Pose2D(x, y, atan2(-y, 1.4 - x) + aside)
        pictures.append((base, image(base, markers=(marker,))))
    errors = marker_errors(pictures, marker)
    # The same camera without distortion: 1.3 cm and 0.6 degrees. The lens shows the marker with
    # three quarters of the pixels where these poses have it.
    assert np.median(errors[:, 0]) < 0.022
    assert np.median(errors[:, 1]) < 0.02
    wrong = marker_errors([(base, without_lens(picture)) for base, picture in pictures], marker)
    assert np.median(wrong[:, 0]) > 3 * np.median(errors[:, 0])


def test_a_floor_line_at_the_side_is_where_it_is_painted():
    line = FloorLine(np.array([[0.0, -0.5], [3.0, 0.5]]))

    def across(picture):
        lines = FloorLineDetector().see(picture, Pose2D(0.0, 0.0), "dark", 0.05, NOTHING)
        points = lines.points(np.argwhere(lines.marked))
        assert np.ptp(points[:, 0]) > 0.8
        # distance from the line y = x / 3 - 0.5
        return (points[:, 1] - points[:, 0] / 3 + 0.5) / np.hypot(1.0, 1.0 / 3.0)

    picture = image(lines=(line,))
    assert np.abs(across(picture)).max() < 0.045  # half its width and two cells
    assert abs(across(picture).mean()) < 0.006
    assert np.abs(across(without_lens(picture))).max() > 0.05


@pytest.mark.parametrize("y", [-0.9, 0.0, 0.9])
def test_a_coloured_box_at_the_side_is_where_it_stands(y):
    def place(picture):
        detector = ColouredObjectDetector(ColourParameters())
        (found,) = detector.detect(picture, "red", Pose2D(0.0, 0.0), NOTHING)
        return found

    box = Box(Pose2D(1.8, y), (0.2, 0.2, 0.2), (0.8, 0.1, 0.1))
    picture = image(boxes=(box,))
    found = place(picture)
    through_a_pinhole = place(image(boxes=(box,), model=replace(LENS, distortion=())))
    x, left = found.position
    # The camera sees the near corners: between the face at x = 1.7 and the middle.
    assert x == pytest.approx(1.73, abs=0.1)
    assert left == pytest.approx(y * x / 1.8, abs=0.06)
    assert found.width == pytest.approx(through_a_pinhole.width, abs=0.03)
    assert found.height == pytest.approx(through_a_pinhole.height, abs=0.03)
    if y:
        wrong = place(without_lens(picture))
        assert np.hypot(wrong.position[0] - x, wrong.position[1] - left) > 0.1


def test_depth_points_of_a_flat_wall_are_flat():
    model = replace(SCOUT.depth_cameras["depth"].model, distortion=(-0.15, 0.02, 0, 0, 0), pitch=0)
    camera = DepthCameraDescription(model, noise=0.0, dropout=0.0)
    wall = Box(Pose2D(2.1, 0.0), (0.2, 6.0, 2.0))
    picture = DepthImage(0.0, rendered(camera, boxes=(wall,)), model, 0.15, 4.0)

    def ends(picture):
        found = obstacle_points(picture, DepthParameters(least_pixels=1), 0.6)
        return found[:, 0].min(), np.ptp(found[:, 1])

    nearest, width = ends(picture)
    # x = 2 m in the whole picture; its width is what the rays of the border span at 1.86 m.
    span = 1.86 * np.ptp(model.rays(np.array([[0.5, 60.0], [159.5, 60.0]]))[:, 0])
    assert nearest == pytest.approx(2.0, abs=0.02)
    assert width == pytest.approx(span, abs=0.1)
    assert ends(without_lens(picture))[1] < span - 0.2


def test_a_depth_point_is_looked_up_where_the_lens_shows_it():
    camera = replace(SCOUT.depth_cameras["depth"].model, distortion=(-0.15, 0.02, 0.001, 0, 0))
    points = np.array([[1.5, 0.9, 0.2], [1.5, -0.9, 0.2], [-1.0, 0.0, 0.2]])
    rows, columns, depth = projected(camera, points)
    x, y = camera.rays(np.column_stack([columns, rows])[:2] + 0.5).T
    back = np.column_stack([x, y, np.ones(2)]) * depth[:2, None]
    seen = back @ camera.base_from_optical()[:3, :3].T + camera.position
    # Half a pixel at 1.5 m: 1.5 / 84 * 0.7; more at the side, where the lens compresses.
    assert np.abs(seen - points[:2]).max() < 0.025
    assert (rows[2], columns[2]) == (-1, -1)

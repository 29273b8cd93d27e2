"""Mirrors: what lidars, sonars, maps and cameras make of them, against plane geometry."""

from dataclasses import replace
from math import atan2, cos, hypot, inf, pi, radians, sin, sqrt, tan

import cv2
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from stack.drivetrain.description import DepthCameraDescription, SonarDescription
from stack.errors import InputError
from stack.sim.physics.meshes import static_meshes
from stack.sim.physics.mirrors import MirrorFace, in_front, mirror_faces
from stack.sim.scene_state import RobotShape, SceneState
from stack.sim.sensors import kernels
from stack.sim.sensors.lidar import Lidar
from stack.sim.sensors.rendering import CameraRenderer
from stack.sim.sensors.requests import RenderRequest, RenderSetup
from stack.sim.sensors.sonar import Sonar
from stack.sim.worlds.rasterise import rasterise
from stack.sim.worlds.world import Box, Cylinder, Person, Wall
from stack.sim.worlds.world_file import read_world
from stack.types import Marker, Pose2D
from tests.stack.sim.sim_rover import CAMERA, EMPTY, LIDAR, ROVER, square_room
from tests.stack.sim.test_gl_drawing import reason

needs_gl = pytest.mark.skipif(bool(reason()), reason="OpenGL on EGL cannot be used here")

CENTRED = replace(LIDAR, mount=Pose2D(0.0, 0.0))
AHEAD = 180
"""Beam of CENTRED that looks along the robot's heading."""


def upright(x: float, **kind) -> Wall:
    """A wall whose face towards the origin is at x, from y = -3 to 3, 1 m high."""
    centre = x + 0.05 if x > 0.0 else x - 0.05
    return Wall(np.array([[centre, -3.0], [centre, 3.0]]), **kind)


MIRROR = upright(2.0, mirror=True)
HALL = replace(EMPTY, walls=(MIRROR, upright(-1.0)))
"""A mirror 2 m ahead of the origin and a wall 1 m behind it."""


def ahead(world, pose=Pose2D(0.0, 0.0), scene=None, lidar=CENTRED, carrier=None):
    """Range of the beam ahead."""
    sensor = Lidar(lidar, world, 1, carrier=carrier)
    scan = sensor.scan([(0.0, pose)], scene or SceneState(), 0, 0.0)
    assert scan.angles[AHEAD] == pytest.approx(0.0, abs=1e-9)
    return scan.ranges[AHEAD]


@pytest.mark.parametrize("degrees", [0.0, 10.0, 30.0, -25.0])
def test_the_angle_of_reflection_is_that_of_incidence(degrees):
    """2 m to the mirror and 3 m back to the wall, both at the angle of incidence."""
    turn = radians(degrees)
    assert ahead(HALL, Pose2D(0.0, 0.0, turn)) == pytest.approx(5.0 / cos(turn), abs=1e-5)


def test_a_beam_leaves_a_mirror_on_the_other_side_of_its_normal():
    """At 50 degrees: (2, 2.38), then up and back to the box's near side at y = 2.9."""
    up = replace(HALL, boxes=(Box(Pose2D(1.5, 3.0), (1.0, 0.2, 1.0)),))
    turn = radians(50.0)
    assert 2.0 * tan(turn) < 2.9
    assert ahead(up, Pose2D(0.0, 0.0, turn)) == pytest.approx(2.9 / sin(turn), abs=1e-5)


def test_a_second_mirror_gives_no_return():
    between = replace(EMPTY, walls=(MIRROR, upright(-1.0, mirror=True)))
    assert ahead(between, Pose2D(0.0, 0.0, 0.1)) == inf
    assert ahead(replace(EMPTY, walls=(MIRROR,)), Pose2D(0.0, 0.0, 0.1)) == inf  # nothing there


def test_the_range_limit_is_that_of_the_whole_way():
    assert ahead(HALL, lidar=replace(CENTRED, range_max=5.1)) == pytest.approx(5.0, abs=1e-5)
    assert ahead(HALL, lidar=replace(CENTRED, range_max=4.9)) == inf


def test_people_and_robots_are_seen_in_a_mirror_and_so_is_the_robot_itself():
    """The images of (1, 1) and of the origin are (3, 1) and (4, 0)."""
    aim = Pose2D(0.0, 0.0, atan2(1.0, 3.0))
    person = SceneState(np.array([[1.0, 1.0, 0.2]]))
    assert ahead(HALL, aim, person) == pytest.approx(sqrt(10.0) - 0.2, abs=1e-5)
    turned = RobotShape(Pose2D(1.0, 1.0, pi - aim.heading), ROVER.footprint, 0.5)  # its front is -x
    other = SceneState(robots=(turned,))
    assert ahead(HALL, aim, other) == pytest.approx(sqrt(10.0) - 0.18, abs=1e-5)
    low = SceneState(robots=(replace(turned, height=0.1),))
    assert ahead(HALL, aim, low) == pytest.approx(5.0 / cos(aim.heading), abs=1e-5)
    own = RobotShape(Pose2D(7.0, 7.0), ROVER.footprint, ROVER.height)
    assert ahead(HALL, carrier=own) == pytest.approx(4.0 - 0.18, abs=1e-5)
    assert ahead(HALL, carrier=replace(own, height=0.1)) == pytest.approx(5.0, abs=1e-5)


def test_a_turning_lidar_sees_the_same():
    turning = replace(CENTRED, rotation_time=0.1)
    pose = Pose2D(0.2, -0.3, 0.4)
    still = Lidar(CENTRED, HALL, 1).scan([(0.0, pose)], SceneState(), 0, 0.2)
    trail = [(0.0, pose), (0.2, pose)]
    scan = Lidar(turning, HALL, 1).scan(trail, SceneState(), 0, 0.2)
    assert scan.ranges == pytest.approx(still.ranges, abs=1e-5)


def test_without_mirrors_nothing_is_followed(monkeypatch):
    """The ranges are those of the ray caster, and the second one is neither called nor compiled."""
    monkeypatch.setattr(Lidar, "_follow_reflections", None)
    world = square_room(3.0)
    pose = Pose2D(0.5, -0.2, 0.3)
    lidar = Lidar(CENTRED, world, 1)
    scan = lidar.scan([(0.0, pose)], SceneState(), 0, 0.0)
    at = np.tile([0.5, -0.2], (360, 1))
    expected = kernels.cast(at, 0.3 + CENTRED.angles, *lidar._scene.outlines(SceneState()))
    assert (scan.ranges == expected.astype(np.float32)).all()
    assert Lidar.kernels(CENTRED, world) == kernels.CAST
    assert Lidar.kernels(CENTRED, HALL) == (*kernels.CAST, *kernels.CAST_RAYS)


def test_beams_that_meet_no_mirror_have_the_same_ranges():
    plain = replace(HALL, walls=(replace(MIRROR, mirror=False), HALL.walls[1]))
    pose = Pose2D(0.3, 0.4, 0.2)
    seen, before = (
        Lidar(CENTRED, world, 1).scan([(0.0, pose)], SceneState(), 0, 0.0)
        for world in (HALL, plain)
    )
    ends = before.ranges * np.cos(before.angles + pose.heading) + pose.x
    met = np.isclose(ends, 2.0, atol=1e-5)
    assert 80 < met.sum() < 180
    assert (seen.ranges[~met] == before.ranges[~met]).all()
    assert (seen.ranges[met] > before.ranges[met] + 0.5).all()


def test_a_box_reflects_at_the_heights_of_its_sides():
    box = Box(Pose2D(2.5, 0.0), (1.0, 2.0, 0.3), elevation=0.1, mirror=True)  # 10 to 40 cm
    world = replace(EMPTY, boxes=(box,), walls=(upright(-1.0), upright(4.0)))
    assert ahead(world) == pytest.approx(5.0, abs=1e-5)
    under = replace(CENTRED, height=0.05)
    assert ahead(world, lidar=under) == pytest.approx(4.0, abs=1e-5)


coordinates = st.floats(-4.0, 4.0)


@settings(max_examples=60, deadline=None)
@given(coordinates, coordinates, coordinates, coordinates, st.floats(-pi, pi), st.floats(0.2, 4.0))
def test_a_beam_at_the_image_of_a_target_reaches_the_target(x, y, u, v, turn, offset):
    """The way over the mirror is as long as the straight one to the mirror image."""
    normal, along = np.array([cos(turn), sin(turn)]), np.array([-sin(turn), cos(turn)])
    face = -offset * normal  # a point of the mirror's face, which faces along the normal
    middle = face - 0.05 * normal
    mirror = Wall(np.array([middle - 40.0 * along, middle + 40.0 * along]), mirror=True)
    sensor, target, radius = np.array([x, y]), np.array([u, v]), 0.05
    heights = (sensor - face) @ normal, (target - face) @ normal
    assume(min(heights) > 0.2)
    image = target - 2.0 * heights[1] * normal
    way = image - sensor
    meets = sensor + way * heights[0] / sum(heights)
    to_target = np.clip((target - sensor) @ (meets - sensor) / ((meets - sensor) ** 2).sum(), 0, 1)
    assume(np.hypot(*(sensor + to_target * (meets - sensor) - target)) > 2.0 * radius)
    world = replace(EMPTY, walls=(mirror,), cylinders=(Cylinder(u, v, radius),))
    measured = ahead(
        world, Pose2D(x, y, atan2(way[1], way[0])), lidar=replace(CENTRED, range_max=50.0)
    )
    assert measured == pytest.approx(hypot(*way) - radius, abs=1e-4)
    faces = mirror_faces(world)
    plane = next(item for item in faces if item.normal[:2] @ normal > 0.999)
    assert plane.reflection() @ [u, v, 0.3, 1.0] == pytest.approx([*image, 0.3, 1.0], abs=1e-9)
    assert plane.reflection() @ plane.reflection() == pytest.approx(np.eye(4), abs=1e-9)


def test_triangles_are_cut_at_the_plane_of_a_mirror():
    face = MirrorFace((0.0, 1.0), (0.0, -1.0), 0.0, 1.0)  # faces -x
    assert face.normal == pytest.approx([-1.0, 0.0, 0.0])
    across = np.array([[-1.001, 0.0, 0.0], [0.999, 0.0, 0.0], [-1.001, 2.0, 0.0]])
    away = np.array([3.0, 0.0, 0.0])
    behind, before = across + away, across - away
    parts = in_front(np.array([behind, across, before]), face)
    areas = (
        np.linalg.norm(np.cross(parts[:, 1] - parts[:, 0], parts[:, 2] - parts[:, 0]), axis=1) / 2.0
    )
    # 1 mm in front of the plane is the middle of the triangle's base: 3/4 of its area of 2 remain.
    assert areas.sum() == pytest.approx(2.0 + 1.5)
    assert parts[:, :, 0].max() == pytest.approx(-0.001)


def test_a_mirror_is_solid_to_sonars_bodies_and_maps():
    plain = replace(HALL, walls=(replace(MIRROR, mirror=False), HALL.walls[1]))
    sonar = SonarDescription(Pose2D(0.2, 0.0), noise=0.0)
    reading = Sonar(sonar, HALL, 1, "front").reading(Pose2D(0.0, 0.0), SceneState(), 0, 0.0)
    assert reading.distance == pytest.approx(1.8, abs=1e-9)
    assert (rasterise(HALL).cells == rasterise(plain).cells).all()
    solid, wall = (np.concatenate(list(static_meshes(world).values())) for world in (HALL, plain))
    assert (solid == wall).all()


SHOT = RenderRequest(0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), np.zeros((0, 3)), {})
DEPTH = DepthCameraDescription(CAMERA.model, noise=0.0, dropout=0.0, range_max=9.0)


def picture(world, camera, request=SHOT):
    renderer = CameraRenderer(RenderSetup(world, ROVER.model, camera))
    try:
        return renderer.render(request)
    finally:
        renderer.close()


PEOPLE = (
    Person("seen", np.array([[0.0, 0.0], [1.0, 0.0]])),
    Person("behind", np.array([[0.0, 0.0], [1.0, 0.0]])),
)


@pytest.mark.parametrize("renderer", ["tiny", pytest.param("gl", marks=needs_gl)])
def test_depths_in_a_mirror_are_those_of_the_whole_way(renderer):
    """From the lens at x = 0.15: 1.85 m to the mirror and 3 m to the wall; a person on the way."""
    people = np.array([[-0.4, 1.2, 0.2], [2.6, 0.3, 0.2]])
    world = replace(HALL, people=PEOPLE)
    camera = replace(DEPTH, renderer=renderer)
    depth = picture(world, camera, replace(SHOT, people=people))
    model = CAMERA.model
    # The image of the person's axis is at (4.4, 1.2): 4.25 m ahead, 1.2 m to the left.
    column, aside = round(model.cx - model.fx * 1.2 / 4.25), atan2(1.2, 4.25)
    assert depth[110, column] == pytest.approx(4.25 - 0.2 * cos(aside), abs=0.012)
    assert depth[110, [200, 250, 300]] == pytest.approx(4.85, abs=0.005)
    # The second person stands behind the mirror, where the straight line to the image passes.
    assert depth[110, round(model.cx - model.fx * 0.3 / 2.45)] == pytest.approx(4.85, abs=0.005)
    # The floor goes on in the mirror as if there were none: 0.25 m below the lens.
    row = 140
    assert depth[row, 300] == pytest.approx(0.25 * model.fy / (row + 0.5 - model.cy), rel=0.01)
    # Over the mirror, 1 m high and 1.85 m away, nothing is seen.
    assert depth[3, 300] == inf


def test_a_mirror_in_a_mirror_has_no_depth():
    between = replace(EMPTY, walls=(MIRROR, upright(-1.0, mirror=True)))
    depth = picture(between, DEPTH)
    assert depth[110, 300] == inf
    assert depth[200, 300] < 2.0  # the floor before the mirror


@pytest.mark.parametrize("renderer", ["tiny", pytest.param("gl", marks=needs_gl)])
def test_a_marker_is_seen_reversed_where_its_image_is(renderer):
    """The image of (-0.9, 0.5, 0.4) is (4.9, 0.5, 0.4); the lens has an odd principal point."""
    model = replace(CAMERA.model, principal_point=(140.0, 130.0))
    marker = Marker(7, 0.4, (-0.98, 0.5, 0.4), 0.0)
    pixels = picture(
        replace(HALL, markers=(marker,)), replace(CAMERA, model=model, renderer=renderer)
    )
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50))
    flipped = np.ascontiguousarray(cv2.cvtColor(pixels, cv2.COLOR_RGB2GRAY)[:, ::-1])
    corners, numbers, _ = detector.detectMarkers(flipped)
    assert np.ravel(numbers).tolist() == [7]
    centre = corners[0].reshape(4, 2).mean(axis=0) + 0.5
    depth = 4.98 - 0.15
    expected = [140.0 - model.fx * 0.5 / depth, 130.0 - model.fy * 0.15 / depth]
    assert [320.0 - centre[0], centre[1]] == pytest.approx(expected, abs=0.7)


def test_a_camera_without_a_mirror_in_view_draws_as_before():
    away = replace(SHOT, orientation=(0.0, 0.0, 1.0, 0.0))  # looks along -x
    plain = replace(HALL, walls=(replace(MIRROR, mirror=False), HALL.walls[1]))
    for camera in (CAMERA, DEPTH):
        assert (picture(HALL, camera, away) == picture(plain, camera, away)).all()


FILE = """\
world: w
walls:
  - {{points: [[0, 0], [4, 0], [4, 3], [0, 3]], closed: true{wall}}}
boxes:
  - {{at: [3, 2, 0], size: [0.2, 0.2, 1]{box}}}
start: [1, 1, 90 deg]
"""


@pytest.mark.parametrize(
    ("wall", "box", "message"),
    [
        (
            ", glass: true, mirror: true", "",
            "3:5 a wall cannot be of `glass` and a `mirror`; remove one: light passes through glass"
            " and is reflected by a mirror",
        ),
        (", mirror: 3", "", "mirror"),
        ("", ", mirror: shiny", "mirror"),
        ("", ", miror: true", "mirror"),
    ],
)  # fmt: skip
def test_mistakes_in_world_files(tmp_path, wall, box, message):
    file = tmp_path / "w.yaml"
    file.write_text(FILE.format(wall=wall, box=box))
    with pytest.raises(InputError) as caught:
        read_world(file)
    (finding,) = caught.value.findings
    where = f"{finding.mark.line}:{finding.mark.column}"
    assert message in f"{where} {finding.sentence}; {finding.hint}"


def test_mirrors_of_a_world_file(tmp_path):
    file = tmp_path / "w.yaml"
    file.write_text(FILE.format(wall=", mirror: true", box=", mirror: true"))
    world = read_world(file)
    assert world.walls[0].mirror and world.boxes[0].mirror
    assert len(mirror_faces(world)) == 4 * 4 + 4
    assert mirror_faces(square_room(3.0)) == ()

import os
import re
import select
import subprocess
import sys
from dataclasses import replace
from math import pi

import cv2
import numpy as np
import pytest

from stack.child_process import Worker
from stack.drivetrain.description import DepthCameraDescription
from stack.errors import BodyError
from stack.patience import Patience
from stack.sim.sensors.camera import Camera
from stack.sim.sensors.rendering import CameraRenderer
from stack.sim.sensors.requests import RenderRequest, RenderSetup
from stack.sim.worlds.world import Box, Door, Person, Shadow, Wall
from stack.types import Marker, Pose2D
from tests.stack.sim.sim_rover import CAMERA, EMPTY, EQUIPPED, ROVER

LENS = {
    "distortion": (-0.3, 0.09, 0.001, -0.001, 0.0), "principal_point": (166.0, 115.0),
    "focal_length_y": 276.0,
}  # fmt: skip
"""Of a wide-angle camera, as intrinsics of CAMERA."""

MARKER = Marker(7, 0.2, (1.65, 0.1, 0.3), pi)
WORLD = replace(
    EMPTY,
    markers=(MARKER,),
    boxes=(Box(Pose2D(1.75, 0.1), (0.2, 0.8, 0.8)),),
    doors=(Door("gate", (1.2, -1.0), (1.2, -0.3)),),
    people=(Person("p", np.array([[2.0, 1.0], [2.0, 2.0]])),),
)
SHOT = RenderRequest(
    0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), np.array([[4.0, 1.5, 0.2]]), {"gate": False}
)


def setup(camera=CAMERA, world=WORLD):
    return RenderSetup(world, ROVER.model, camera)


def picture(request=SHOT, **choices):
    renderer = CameraRenderer(setup(**choices))
    try:
        return renderer.render(request)
    finally:
        renderer.close()


def corners_in(pixels, marker):
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, marker.dictionary))
    detector = cv2.aruco.ArucoDetector(dictionary, parameters)
    corners, numbers, _ = detector.detectMarkers(cv2.cvtColor(pixels, cv2.COLOR_RGB2GRAY))
    return {
        int(n): c[0]
        for n, c in zip(np.ravel([] if numbers is None else numbers), corners, strict=True)
    }


def corners_predicted(marker, camera):
    """Top left, top right, bottom right, bottom left as its viewer sees them; base at 0."""
    normal = np.array([np.cos(marker.heading), np.sin(marker.heading), 0.0])
    right, up = np.array([-normal[1], normal[0], 0.0]), np.array([0.0, 0.0, 1.0])
    half = marker.size / 2
    signs = [(-1, 1), (1, 1), (1, -1), (-1, -1)]
    points = np.array([marker.position + half * (u * right + v * up) for u, v in signs])
    optical = np.linalg.inv(camera.base_from_optical())
    return camera.project(points @ optical[:3, :3].T + optical[:3, 3])


@pytest.mark.parametrize(
    ("marker", "model"),
    [
        (MARKER, {}),
        (
            replace(MARKER, number=3, heading=pi + 0.4, dictionary="DICT_APRILTAG_36h11"),
            {"width": 640, "height": 480, "focal_length": 560.0},
        ),
        (MARKER, {"pitch": 0.1, "yaw": 0.15}),
        (
            replace(MARKER, position=(1.65, 0.6, 0.6)),
            {"principal_point": (171.0, 108.5), "focal_length_y": 271.0},
        ),
        (replace(MARKER, position=(1.65, 0.6, 0.6)), LENS),
        (replace(MARKER, position=(1.65, -0.5, 0.15)), {"distortion": (0.3, 0.1, 0.0, 0.0, 0.0)}),
    ],
    ids=["facing", "aslant", "camera turned", "principal point", "barrel lens", "pincushion lens"],
)
def test_a_marker_is_found_where_the_camera_model_says(marker, model):
    camera = replace(CAMERA, model=replace(CAMERA.model, **model))
    alone = replace(SHOT, people=np.zeros((0, 3)), doors={})
    pixels = picture(alone, camera=camera, world=replace(EMPTY, markers=(marker,)))
    found = corners_in(pixels, marker)
    # OpenCV's origin is the centre of the first pixel, the camera model's origin is its corner.
    errors = found[marker.number] + 0.5 - corners_predicted(marker, camera.model)
    assert np.abs(errors).max() < 1.5
    assert np.abs(errors.mean(axis=0)).max() < 0.3  # no half-pixel shift of the whole picture


def test_the_lens_moves_the_marker_by_many_pixels():
    """The last two cases above mean something: without the lens the marker is elsewhere."""
    far = replace(MARKER, position=(1.65, 0.6, 0.6))
    lens = replace(CAMERA.model, **LENS)
    plain = replace(lens, distortion=())
    assert np.abs(corners_predicted(far, lens) - corners_predicted(far, plain)).max() > 8.0


def test_a_depth_camera_with_a_lens_measures_along_the_axis():
    wall = replace(EMPTY, boxes=(Box(Pose2D(2.25, 0.0), (0.2, 4.0, 4.0)),))
    model = replace(CAMERA.model, **LENS)
    depth = picture(
        replace(SHOT, people=np.zeros((0, 3)), doors={}), world=wall,
        camera=DepthCameraDescription(model, noise=0.0, dropout=0.0),
    )  # fmt: skip
    # The wall's face at x = 2.15 is 2 m from the lens at x = 0.15, in every direction; the rest of
    # the picture is floor, which is nearer.
    assert np.nanmax(depth) == pytest.approx(2.0, abs=0.01)
    assert np.abs(depth[:120] - 2.0).max() < 0.01


def test_moving_objects_are_drawn_at_their_current_pose():
    empty = picture(replace(SHOT, people=np.array([[-5.0, 0.0, 0.2]])))
    with_person = picture()
    changed = np.argwhere((empty != with_person).any(axis=2))
    # Person at (4, 1.5): 3.85 m ahead of the lens, 1.5 m to the left
    assert changed[:, 1].mean() == pytest.approx(160 - 280 * 1.5 / 3.85, abs=2)
    with_door = picture(replace(SHOT, doors={"gate": True}))
    columns = np.argwhere((with_person != with_door).any(axis=2))[:, 1]
    # The door's near face at x = 1.16 reaches from y = -0.3 out of the picture
    assert columns.min() == pytest.approx(160 + 280 * 0.3 / 1.05, abs=3)


def test_the_camera_moves_with_the_robot():
    turned = RenderRequest(0, (1.0, 0.0, 0.0), (0.0, 0.0, np.sin(pi / 2), np.cos(pi / 2)),
                  np.array([[4.0, 1.5, 0.2]]), {"gate": False})  # fmt: skip
    assert MARKER.number in corners_in(picture(), MARKER)
    assert MARKER.number not in corners_in(picture(turned), MARKER)


def test_noise_has_the_stated_deviation_and_belongs_to_the_step():
    noisy = replace(CAMERA, noise=3.0)
    clean, first = picture().astype(float), picture(camera=noisy)
    middle = (clean > 20) & (clean < 235)
    assert np.std((first - clean)[middle]) == pytest.approx(3.0, rel=0.05)
    assert (picture(camera=noisy) == first).all()
    assert (picture(replace(SHOT, step=5), camera=noisy) != first).any()
    assert (picture(replace(SHOT, seed=2), camera=noisy) != first).any()


def test_another_process_renders_the_same_picture_and_delivers_on_time():
    chosen = setup(EQUIPPED.camera)
    camera = Camera(chosen)
    try:
        assert camera.is_ready(1.0)
        camera.expose(1.0, SHOT)
        assert not camera.is_ready(1.0)
        assert camera.take(1.05) is None
        image = camera.take(1.1)
        assert camera.take(1.2) is None
        assert image.stamp == 1.0
        assert (image.pixels == picture(camera=EQUIPPED.camera)).all()
        assert not camera.is_ready(1.15)  # 5 Hz
        assert camera.is_ready(1.2)
    finally:
        camera.close()
        camera.close()


def test_an_unknown_marker_raises_when_its_picture_is_due():
    camera = Camera(setup(world=replace(EMPTY, markers=(replace(MARKER, number=50),))))
    try:
        camera.expose(0.0, SHOT)
        with pytest.raises(BodyError, match="DICT_4X4_50 has the markers 0 to 49, got 50"):
            camera.take(0.1)
    finally:
        camera.close()


def test_a_killed_renderer_costs_a_picture_and_the_next_one_starts_another():
    camera = Camera(setup())
    try:
        camera.expose(0.0, SHOT)
        camera._renderer._process.kill()
        assert camera.take(0.1) is None
        assert camera.take_problems() == [
            "the renderer of the camera camera was killed (SIGKILL);"
            " the next picture starts another one"
        ]
        camera.expose(0.2, SHOT)
        assert camera.take(0.3).stamp == 0.2
        assert camera.take_problems() == []
    finally:
        camera.close()


RENDERERS = {
    "is suspended": ("suspending", "gave no answer for 0.2 s"),
    "raises": ("unprepared", "failed: TypeError: .*"),
}


@pytest.mark.parametrize(("target", "how"), RENDERERS.values(), ids=RENDERERS)
def test_a_renderer_that_fails_costs_a_picture_and_no_more(monkeypatch, target, how):
    """The step loop waits in naps; the mission goes on without the picture."""
    monkeypatch.setattr(Patience, "LONGEST", 0.2 if target == "suspending" else 30.0)
    camera = Camera(setup())
    name = "the renderer of the camera camera"
    camera._renderer = Worker(name, f"tests.stack.worker_targets:{target}")
    try:
        camera.expose(0.0, SHOT)
        while not camera.await_picture(0.1, 0.01):
            pass
        assert camera.take(0.1) is None
        (problem,) = camera.take_problems()
        begin = f"the renderer of the camera camera {how}; the next picture starts another one"
        assert re.fullmatch(begin, problem)
        assert camera.await_picture(0.2, 1000.0)  # nothing is waited for
    finally:
        camera.close()


def test_a_camera_whose_renderer_always_ends_stays_off():
    camera = Camera(setup())
    try:
        for number in range(3):
            assert camera.is_ready(float(number))
            camera.expose(float(number), SHOT)
            camera._renderer._process.kill()
            assert camera.take(number + 0.1) is None
        assert camera.take_problems()[-1].endswith("was killed (SIGKILL); the camera stays off")
        assert not camera.is_ready(10.0)
    finally:
        camera.close()


def test_a_truncated_answer_is_delivered_as_it_is():
    camera = Camera(setup())
    try:
        camera.expose(0.0, SHOT)
        camera._renderer.receive = lambda: (bytes(1000), "")
        assert camera.take(0.1).pixels.shape == (1000,)  # the camera watch refuses it
    finally:
        camera.close()


ORPHAN = """
import os, sys
from tests.stack.sim.test_camera import SHOT, Camera, setup
camera = Camera(setup())
camera.expose(0.0, SHOT)
camera.take(0.1)
print(camera._renderer._process.pid, flush=True)
sys.stdin.read()
os._exit(9)
"""


def test_the_renderer_ends_with_its_parent():
    with subprocess.Popen(
        [sys.executable, "-c", ORPHAN], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as parent:
        renderer = os.pidfd_open(int(parent.stdout.readline()))
        try:
            parent.stdin.close()  # the parent ends without a word
            assert select.select([renderer], [], [], 10.0)[0] == [renderer]
        finally:
            os.close(renderer)


def test_importing_the_physics_prints_nothing():
    code = "from stack.sim.physics.pybullet_engine import loader; print(loader.load().DIRECT)"
    answer = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert answer.stdout == "2\n"
    assert answer.stderr == ""


def test_glass_tints_colours_and_not_depths():
    pane = Wall(np.array([[1.0, 0.0], [1.0, 3.0]]), 0.04, 1.5, (0.1, 0.4, 0.1), glass=True)
    world = replace(EMPTY, boxes=(Box(Pose2D(2.25, 0.0), (0.2, 4.0, 4.0), (0.9, 0.9, 0.9)),))
    alone = replace(SHOT, people=np.zeros((0, 3)), doors={})
    plain = picture(alone, world=world).astype(int)
    tinted = picture(alone, world=replace(world, walls=(pane,))).astype(int)
    changed = (plain != tinted).any(axis=2)
    # The pane reaches from y = 0 to the left border, up to 1.5 m: 1.25 m above the lens, 0.83 m
    # in front of it, which is above the picture.
    assert changed[:120, :155].all() and not changed[:, 165:].any()
    change = np.abs(tinted - plain)[:120, :155]
    assert 2 < change.max() < 0.2 * 255
    assert (tinted[:120, :155, 1] > tinted[:120, :155, 0]).all()  # green
    depth = DepthCameraDescription(CAMERA.model, noise=0.0, dropout=0.0)
    seen = picture(alone, world=replace(world, walls=(pane,)), camera=depth)
    assert (seen == picture(alone, world=world, camera=depth)).all()


def test_a_shadow_darkens_what_stands_in_it_and_nothing_else():
    bright = picture()
    shaded = picture(world=replace(WORLD, shadows=(Shadow((1.6, 0.0, 2.0, 0.6), 0.5),)))
    half = np.abs(shaded - np.rint(0.5 * bright)) <= 1.0
    same = shaded == bright
    assert (half | same).all()
    # The box of WORLD faces the camera at x = 1.65 m, from y = -0.3 to 0.5 m, beside the marker.
    optical = np.linalg.inv(CAMERA.model.base_from_optical())
    points = np.array([(1.65, 0.4, 0.3), (1.65, -0.2, 0.3)])
    pixels = CAMERA.model.project(points @ optical[:3, :3].T + optical[:3, 3])
    (in_shadow, row), (lit, _) = np.floor(pixels).astype(int)
    assert half[row, in_shadow].all() and not same[row, in_shadow].any()
    assert same[row, lit].all() and not half[row, lit].any()
    depth = DepthCameraDescription(CAMERA.model)
    world = replace(WORLD, shadows=(Shadow((-9.0, -9.0, 9.0, 9.0), 0.0),))
    assert np.array_equal(picture(camera=depth), picture(camera=depth, world=world))

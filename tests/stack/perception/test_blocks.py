"""Blocks in pictures of the simulated bench, and in computed pictures of boxes."""

from math import atan2, cos, degrees, hypot, pi, radians, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.geometry.rotations import from_angles
from stack.perception.blocks import BlockDetector
from stack.perception.planes import level_plane
from stack.sim.worlds.world import Block as WorldBlock
from stack.types import CameraModel, DepthImage, Image, Pose2D
from tests.stack.perception.block_scene import BASE_FROM_LINK, COLOURS, Bench, in_link
from tests.stack.sim.arm_world import TOP

SIZES = {
    "red": (0.05, 0.05, 0.05), "yellow": (0.05, 0.05, 0.05), "green": (0.04, 0.04, 0.08),
    "blue": (0.08, 0.03, 0.04),
}  # fmt: skip


def on_bench(sizes=SIZES, **more):
    return Bench(
        *(
            WorldBlock(name, Pose2D(0, 0), size, elevation=TOP, colour=COLOURS[name.split()[0]])
            for name, size in sizes.items()
        ),
        **more,
    )


def standing(x, y, heading, size, on=TOP):
    return (x, y, on + size[2] / 2, heading)


def placements(random, sizes):
    """Poses on the bench, with centres at least 10 cm apart."""
    found = []
    for size in sizes:
        while True:
            x, y = random.uniform(0.35, 0.85), random.uniform(-0.45, 0.45)
            if all(hypot(x - one[0], y - one[1]) > 0.1 for one in found):
                break
        found.append(standing(x, y, random.uniform(-pi, pi), size))
    return found


def errors(block, pose, size):
    """Position error (3,), yaw error up to the symmetry of the block, size error (3,)."""
    symmetry = pi / 2 if size[0] == size[1] else pi
    yaw = atan2(block.pose[1, 0], block.pose[0, 0]) - pose[3]
    turn = (yaw + symmetry / 2) % symmetry - symmetry / 2
    return block.pose[:3, 3] - in_link(*pose)[:3, 3], turn, block.size - np.array(size)


def found_in(pictures):
    return BlockDetector(BASE_FROM_LINK).detect(*pictures)


@pytest.mark.parametrize("light", [0.35, 1.0, 1.5])
def test_blocks_on_the_bench_are_found_in_any_light(light):
    scene, random = on_bench(light=light), np.random.default_rng(round(10 * light))
    places, turns, sizes, normed = [], [], [], []
    try:
        for number in range(7):
            poses = placements(random, SIZES.values())
            found = found_in(scene.pictures(poses, seed=number))
            assert sorted(block.colour for block in found) == sorted(SIZES)
            by_colour = {block.colour: block for block in found}
            for (colour, size), pose in zip(SIZES.items(), poses, strict=True):
                block = by_colour[colour]
                assert block.stamp == 0.2
                place, turn, sized = errors(block, pose, size)
                off = np.array([*place, turn])
                normed.append(off @ np.linalg.solve(block.covariance, off) / 4.0)
                places.append(place)
                turns.append(abs(degrees(turn)))
                sizes.append(sized)
    finally:
        scene.close()
    # 0.3 mm, 0.9 deg and 0.6 mm (RMS) are measured; a pixel is 4.5 mm wide at that distance.
    assert np.linalg.norm(places, axis=1).max() < 0.002
    assert np.sqrt(np.mean(np.square(places))) < 0.0005
    assert np.sqrt(np.mean(np.square(turns))) < 1.2 and max(turns) < 4.0
    assert np.abs(sizes).max() < 0.003
    assert 0.2 < np.mean(normed) < 1.5  # the covariance tells how large the errors are


@pytest.fixture
def scene():
    made = []

    def make(**more):
        made.append(on_bench(**more))
        return made[-1]

    yield make
    for one in made:
        one.close()


CUBE = (0.05, 0.05, 0.05)


def test_a_block_on_another_one_has_its_own_height(scene):
    size = (0.04, 0.04, 0.04)
    pair = scene(sizes={"red": CUBE, "blue": size})
    poses = [standing(0.5, 0.1, 0.3, CUBE), standing(0.5, 0.1, 0.5, size, on=TOP + 0.05)]
    blue = next(block for block in found_in(pair.pictures(poses)) if block.colour == "blue")
    place, turn, sized = errors(blue, poses[1], size)
    assert np.abs(place).max() < 0.003 and abs(degrees(turn)) < 3.0 and np.abs(sized).max() < 0.004


def test_a_neighbour_of_another_colour_carries_nothing(scene):
    """A lower block before a higher one, as the camera sees them, with no gap."""
    tall, low = (0.05, 0.05, 0.08), (0.05, 0.05, 0.04)
    pair = scene(sizes={"green": tall, "red": low})
    poses = [standing(0.5, 0.0, 0.0, tall), standing(0.551, 0.0, 0.0, low)]
    found = {block.colour: block for block in found_in(pair.pictures(poses))}
    for colour, size, pose in zip(("green", "red"), (tall, low), poses, strict=True):
        place, _, sized = errors(found[colour], pose, size)
        assert np.abs(place).max() < 0.004 and np.abs(sized).max() < 0.006


def test_touching_blocks_of_one_colour_are_one_that_does_not_fit(scene):
    pair = scene(sizes={"red": CUBE, "red 2": CUBE})
    close = [standing(0.5, 0.0, 0.0, CUBE), standing(0.5, 0.051, 0.0, CUBE)]
    (both,) = found_in(pair.pictures(close))
    # Side by side along y: 10.1 cm long, turned by a quarter.
    assert both.size == pytest.approx((0.101, 0.05, 0.05), abs=0.004)
    assert both.pose[:2, 3] == pytest.approx((0.5, 0.0255), abs=0.003)
    apart = [standing(0.5, 0.0, 0.0, CUBE), standing(0.5, 0.075, 0.0, CUBE)]  # 2.5 cm
    assert len(found_in(pair.pictures(apart))) == 2


def test_what_is_hidden_cuts_nothing_off(scene):
    """A high block of another colour hides the near edge of the top of a red one."""
    tall = (0.02, 0.06, 0.12)
    pair = scene(sizes={"red": CUBE, "green": tall})
    poses = [standing(0.5, 0.0, 0.2, CUBE), standing(0.575, 0.02, 0.0, tall)]
    red = next(block for block in found_in(pair.pictures(poses)) if block.colour == "red")
    place, _, sized = errors(red, poses[0], CUBE)
    assert np.abs(place).max() < 0.005 and np.abs(sized).max() < 0.01


def test_a_bare_bench_has_no_blocks(scene):
    pair = scene(sizes={"red": CUBE})
    assert found_in(pair.pictures([(0.5, 0.0, -5.0, 0.0)])) == ()


def computed_pictures(camera, box, size, table, random, noise):
    """Pictures of a red box on an endless table, by intersecting rays; noise as at 1 m.

    Args:
        box: (4, 4) pose of its centre, base frame.
        table: (4, 4) pose whose x-y plane is the table.
    """
    pixels = camera.rays(camera.pixel_centres())
    optical = camera.base_from_optical()
    rays = np.column_stack([pixels, np.ones(len(pixels))]) @ optical[:3, :3].T
    eye = optical[:3, 3]
    local_eye, local = (eye - box[:3, 3]) @ box[:3, :3], rays @ box[:3, :3]
    ends = (np.array([-0.5, 0.5])[:, None, None] * np.array(size) - local_eye) / local
    near, far = ends.min(axis=0).max(axis=1), ends.max(axis=0).min(axis=1)
    on_box = (near < far) & (near > 0.0)
    down = rays @ table[:3, 2]
    on_table = np.where(down < -1e-3, (table[:3, 3] - eye) @ table[:3, 2] / down, np.inf)
    depth = np.where(on_box, near, on_table)
    depth += noise * depth**2 * random.standard_normal(len(depth))
    shape = camera.height, camera.width
    colours = np.where(on_box[:, None], [200, 20, 20], [150, 120, 95]).astype(np.uint8)
    return Image(1.0, colours.reshape(*shape, 3), camera), DepthImage(
        1.0, depth.reshape(shape).astype(np.float32), camera, 0.1, 3.0
    )


@settings(max_examples=15, deadline=None)
@given(
    st.integers(0, 2**32 - 1), st.floats(-pi, pi), st.floats(-pi, pi), st.floats(0.7, 1.5),
    st.floats(-0.3, 0.3), st.floats(0.0, 0.08), st.floats(0.0, 0.003),
    st.tuples(st.floats(0.03, 0.1), st.floats(0.03, 0.1), st.floats(0.03, 0.1)),
)  # fmt: skip
def test_a_box_is_found_from_any_side_on_any_level_table(
    seed, heading, bearing, pitch, roll, tilt, noise, size
):
    """The camera is 0.8 m away, 40 to 86 deg above the horizon; the table is tilted by 4.6 deg."""
    random = np.random.default_rng(seed)
    table = from_angles(random.uniform(-1.0, 1.0, 3), (tilt, 0.0, 0.0))
    box = table @ from_angles((0.0, 0.0, size[2] / 2), (0.0, 0.0, heading))
    forward = np.array([cos(bearing) * cos(pitch), sin(bearing) * cos(pitch), -sin(pitch)])
    aim = box[:3, 3] + random.uniform(-0.1, 0.1, 3)
    camera = CameraModel(
        320, 240, 300.0, tuple((aim - 0.8 * forward).tolist()), pitch=pitch, yaw=bearing, roll=roll
    )
    pictures = computed_pictures(camera, box, size, table, random, noise)
    (found,) = BlockDetector(np.eye(4)).detect(*pictures)
    # A pixel is 2.7 mm wide there.
    assert np.linalg.norm(found.pose[:3, 3] - box[:3, 3]) < 0.005
    assert found.size[2] == pytest.approx(size[2], abs=0.003)
    assert found.size[:2] == pytest.approx(sorted(size[:2], reverse=True), abs=0.006)
    assert found.pose[:3, 2] @ box[:3, 2] > cos(radians(1.0))
    if abs(size[0] - size[1]) > 0.01:
        along = box[:3, 0] if size[0] > size[1] else box[:3, 1]
        assert abs(found.pose[:3, 0] @ along) > cos(radians(3.0))


@given(st.floats(-3.0, 3.0), st.floats(-0.15, 0.15), st.floats(-0.15, 0.15), st.integers(0, 1000))
def test_a_level_plane_is_found_among_other_points(height, along_x, along_y, seed):
    random = np.random.default_rng(seed)
    xy = random.uniform(-0.2, 0.2, (200, 2))
    on = np.column_stack([xy, height + xy @ [along_x, along_y] + random.normal(0.0, 0.001, 200)])
    other = random.uniform([-0.2, -0.2, height], [0.2, 0.2, height + 0.3], (150, 3))
    plane = level_plane(np.concatenate([on, other]))
    normal = np.array([-along_x, -along_y, 1.0]) / np.sqrt(along_x**2 + along_y**2 + 1.0)
    assert plane.normal @ normal > cos(radians(1.5))
    assert plane.heights(np.array([0.0, 0.0, height])) == pytest.approx(0.0, abs=0.002)


def test_points_without_a_level_plane_have_none():
    random = np.random.default_rng(1)
    assert level_plane(random.uniform(-0.2, 0.2, (20, 3))) is None  # too few
    assert level_plane(random.uniform(-0.2, 0.2, (500, 3))) is None  # no plane
    wall = random.uniform(-0.2, 0.2, (500, 3)) * [0.0, 1.0, 1.0]
    assert level_plane(wall) is None


def test_a_place_that_is_seen_empty_is_told_from_one_that_is_hidden():
    """The camera on the mast looks towards the arm: a high block hides what is behind it."""
    sizes = {"red": (0.04, 0.04, 0.03), "green": (0.05, 0.08, 0.12)}
    scene, detector = on_bench(sizes), BlockDetector(BASE_FROM_LINK)
    low, away = (standing(x, y, 0.0, sizes["red"]) for x, y in ((0.45, 0.0), (0.6, 0.4)))
    beside, before = (standing(x, y, 0.0, sizes["green"]) for x, y in ((0.45, -0.3), (0.512, 0.0)))
    try:
        colour, depth = scene.pictures([low, beside])
        [red] = [it for it in detector.detect(colour, depth) if it.colour == "red"]
        assert not detector.is_gone(red, depth)
        assert detector.is_gone(red, scene.pictures([away, beside])[1])
        hidden = scene.pictures([low, before])
        assert [it.colour for it in detector.detect(*hidden)] == ["green"]
        assert not detector.is_gone(red, hidden[1])
        assert not detector.is_gone(red, scene.pictures([away, before])[1]), "nobody sees that"
    finally:
        scene.close()

"""Keyframes of posters on a wall 2 m ahead: the picture of a camera that looks straight at it."""

from math import pi

import numpy as np
import pytest

from stack.errors import InputError
from stack.frames.buffer import TransformBuffer
from stack.perception.places.features import detect, matches
from stack.perception.places.keyframe_files import FILE, keyframe_file, read_keyframes
from stack.perception.places.keyframes import consistent, keyframe_of
from stack.perception.places.landmarks import landmarks
from stack.perception.places.memory import PlaceMemory
from stack.perception.places.parameters import PlaceParameters
from stack.perception.places.recogniser import PlaceRecogniser
from stack.perception.places.verification import verified
from stack.perception.places.vocabulary import trained
from stack.sim.physics.textures import poster_picture
from stack.types import (
    STANDSTILL,
    CameraModel,
    Image,
    Observation,
    Odometry,
    Pose2D,
    PoseEstimate,
    Scan,
)

CAMERA = CameraModel(320, 240, 228.0, (0.12, 0.0, 0.75))
"""High enough that the lowest row of a wall 2 m away is above the floor."""

WALL = 2.0
BEAMS = 720
SETTLED = PlaceParameters(record=True, settling_time=1.0)


def wall_scan(stamp=0.0, distance=WALL):
    """A flat wall straight ahead of the base, seen within 60 degrees on both sides."""
    angles = -pi + 2.0 * pi / BEAMS * np.arange(BEAMS)
    near = np.abs(angles) < pi / 3
    ranges = np.where(near, distance / np.where(near, np.cos(angles), 1.0), np.inf)
    return Scan(stamp, ranges.astype(np.float32), -pi, 2.0 * pi / BEAMS, 0.05, 12.0)


def poster(number, stamp=0.0):
    """A poster that fills the picture: 2 m by 1.5 m at 160 pixels per metre are 320 x 240."""
    return Image(stamp, poster_picture(number, (2.0, 1.5)), CAMERA)


def keyframe(number, pose):
    found = keyframe_of(poster(number), pose, wall_scan().points(), 400)
    assert found is not None
    return found


def frames_at(pose, *stamps):
    frames = TransformBuffer(30.0)
    for stamp in stamps:
        frames.add(Odometry(stamp, Pose2D(0.0, 0.0), STANDSTILL))
    frames.correct(PoseEstimate(pose, np.eye(3), 1.0, pose, stamps[0]))
    return frames


def test_a_pixel_is_where_its_ray_meets_the_wall():
    pixels = np.array([[160.0, 120.0], [46.0, 120.0], [160.0, 6.0], [160.0, 239.0]])
    found = landmarks(pixels, CAMERA, wall_scan().points())
    way = WALL - 0.12  # from the camera to the wall
    assert found[0] == pytest.approx([WALL, 0.0, 0.75], abs=1e-4)
    assert found[1] == pytest.approx([WALL, way * 114 / 228, 0.75], abs=1e-4)  # to the left
    assert found[2] == pytest.approx([WALL, 0.0, 0.75 + way * 114 / 228], abs=1e-4)
    # The lowest row looks way * 119 / 228 = 0.98 m down, below the floor: no landmark.
    assert np.isnan(found[3]).all()


def test_there_is_no_landmark_between_two_surfaces_or_where_nothing_was_measured():
    gap = np.array([[2.0, -0.30], [2.0, -0.02], [3.0, 0.02], [3.0, 0.3]])
    assert np.isnan(landmarks(np.array([[160.0, 120.0]]), CAMERA, gap)).all()
    assert np.isnan(landmarks(np.array([[160.0, 120.0]]), CAMERA, np.zeros((0, 2)))).all()


def test_features_of_the_same_picture_match_and_those_of_another_do_not():
    one, other = detect(poster(1)).descriptors, detect(poster(2)).descriptors
    own = matches(one, one)
    assert len(own) > 100 and (own[:, 0] == own[:, 1]).mean() > 0.99
    assert len(matches(one, other)) < 0.2 * len(own)  # straight edges and corners are alike


def test_a_picture_is_most_similar_to_its_own_keyframe():
    pictures = [detect(poster(number)).descriptors for number in range(6)]
    vocabulary = trained(pictures)
    rows = np.array([vocabulary.describe(one) for one in pictures])
    assert np.linalg.norm(rows, axis=1) == pytest.approx(1.0)
    similarity = rows @ rows.T - 2.0 * np.eye(len(rows))
    assert similarity.max() < 0.5  # of another poster
    assert (trained(pictures).words == vocabulary.words).all()


@pytest.mark.parametrize("outliers", [0.0, 0.4])
def test_the_pose_on_the_floor_is_found_among_outliers(outliers):
    random = np.random.default_rng(5)
    truth = Pose2D(1.0, -2.0, 0.7)
    ahead = np.column_stack(
        [random.uniform(1.5, 4.0, 60), random.uniform(-0.8, 0.8, 60), random.uniform(0.2, 1.4, 60)]
    )
    in_map = np.column_stack([truth.transform(ahead[:, :2]), ahead[:, 2]])
    optical = np.column_stack([ahead, np.ones(60)]) @ np.linalg.inv(CAMERA.base_from_optical()).T
    pixels = 228.0 * optical[:, :2] / optical[:, 2:3] + (160.0, 120.0)
    pixels += random.normal(0.0, 0.5, pixels.shape)
    wrong = round(outliers * 60)
    pixels[:wrong] = random.uniform((0.0, 0.0), (320.0, 240.0), (wrong, 2))
    found = verified(pixels, in_map, CAMERA, 3.0)
    # 0.5 pixels of noise move a point 3 m away by 7 mm; 36 points and more average it.
    assert found is not None and found.pose.distance_to(truth) < 0.03
    assert abs(found.pose.heading - truth.heading) < 0.01
    assert 60 - wrong <= found.inliers.sum() <= 60 - wrong + 3


def test_unrelated_pairs_give_no_pose():
    random = np.random.default_rng(6)
    pixels = random.uniform((0.0, 0.0), (320.0, 240.0), (30, 2))
    somewhere = random.uniform((-5.0, -5.0, 0.1), (5.0, 5.0, 1.5), (30, 3))
    found = verified(pixels, somewhere, CAMERA, 3.0)
    assert found is None or found.inliers.sum() < 10
    assert verified(pixels[:5], somewhere[:5], CAMERA, 3.0) is None


def test_a_picture_from_elsewhere_gives_its_own_pose():
    """The camera has moved 0.3 m back: the poster is smaller by 1.88 / 2.18."""
    import cv2

    poses = {number: Pose2D(4.0 * number, 1.0, 0.5) for number in range(4)}
    recogniser = PlaceRecogniser([keyframe(*item) for item in poses.items()], PlaceParameters())
    back, scale = 0.3, (WALL - 0.12) / (WALL + 0.3 - 0.12)
    shrink = np.array([[scale, 0.0, 160 * (1 - scale)], [0.0, scale, 120 * (1 - scale)]])
    shrink[:, 2] += 0.5 * (scale - 1.0)  # OpenCV's origin is the centre of the first pixel
    pixels = cv2.warpAffine(poster(2).pixels, shrink, (320, 240), borderValue=(128, 128, 128))
    points = wall_scan(distance=WALL + back).points()
    (best, *_) = recogniser.recognise(Image(0.0, pixels, CAMERA), points)
    expected = poses[2].compose(Pose2D(-back, 0.0))
    assert best.pose.distance_to(expected) < 0.03 and best.inliers >= 30
    assert abs(best.pose.heading - 0.5) < 0.01
    assert recogniser.recognise(poster(77), wall_scan().points()) == ()


def test_a_landmark_that_the_neighbours_see_elsewhere_is_dropped():
    good = [keyframe(1, Pose2D(0.0, 0.0, 0.0)) for _ in range(3)]
    moved = keyframe(1, Pose2D(0.0, 0.0, 0.0))
    moved.landmarks[:20] += (0.4, 0.0, 0.0)
    checked = consistent([moved, *good])
    assert len(moved.landmarks) - 20 - 3 <= len(checked[0].landmarks) <= len(moved.landmarks) - 17
    assert len(checked[1].landmarks) >= 0.95 * len(good[0].landmarks)


def seen(memory, number, pose, stamp, estimate=None):
    """A step in which a picture of a poster arrives."""
    observation = Observation(
        stamp + 0.1, {"lidar": wall_scan(stamp), "camera": poster(number, stamp)}
    )
    estimate = estimate or PoseEstimate(pose, np.eye(3) * 1e-3, 1.0)
    memory.update(observation, frames_at(pose, stamp - 1.0, stamp + 0.2), estimate, 0.0)


def quiet(memory, time, **estimate):
    values = {"health": 1.0, **estimate}
    pose = values.get("map_from_odom", Pose2D(0.0, 0.0))
    now = PoseEstimate(pose, np.eye(3) * 1e-3, **values)
    memory.update(Observation(time, {}), TransformBuffer(1.0), now, 0.0)


def test_keyframes_are_kept_once_the_pose_has_stayed_good():
    memory = PlaceMemory("lidar", has_camera=True, parameters=SETTLED)
    for number in range(4):
        seen(memory, number, Pose2D(2.0 * number, 0.0, 0.0), 10.0 + 0.2 * number)
    quiet(memory, 11.35)  # the last two are younger than a second
    assert memory.count == 0
    assert not memory.wants_picture  # the estimate is where the first keyframe was taken
    quiet(memory, 11.7)
    assert memory.count == 4
    elsewhere = PoseEstimate(Pose2D(0.0, 3.0), np.eye(3) * 1e-3, 1.0)
    memory.update(Observation(11.8, {}), TransformBuffer(1.0), elsewhere, 0.0)
    assert memory.wants_picture
    seen(memory, 9, Pose2D(0.1, 0.0, 0.1), 12.0)  # nearer than 0.8 m to the first, same direction
    quiet(memory, 20.0)
    assert memory.count == 4


@pytest.mark.parametrize("doubt", [{"health": 0.1}, {"map_from_odom": Pose2D(0.0, 4.0)}])
def test_keyframes_from_just_before_a_doubt_are_dropped(doubt):
    memory = PlaceMemory("lidar", has_camera=True, parameters=SETTLED)
    for number in range(4):
        seen(memory, number, Pose2D(2.0 * number, 0.0, 0.0), 10.0)
    quiet(memory, 10.5, **doubt)
    quiet(memory, 20.0, **{**doubt, "health": 1.0})
    assert memory.count == 0 and memory.files() == {}


def test_a_robot_without_camera_or_lidar_records_nothing():
    assert not PlaceMemory("lidar", has_camera=False, parameters=SETTLED).is_recording
    assert not PlaceMemory("", has_camera=True, parameters=SETTLED).is_recording
    assert not PlaceMemory("lidar", has_camera=True, parameters=PlaceParameters()).is_recording


def test_saved_keyframes_recognise_the_same_places(tmp_path):
    memory = PlaceMemory("lidar", has_camera=True, parameters=SETTLED)
    for number in range(4):
        seen(memory, number, Pose2D(2.0 * number, 0.0, 0.0), 10.0)
    quiet(memory, 12.0)
    for name, content in memory.files().items():
        (tmp_path / name).write_bytes(content)
    fresh = PlaceMemory("lidar", has_camera=True, parameters=PlaceParameters())
    fresh.load(tmp_path)
    assert fresh.count == 4 and fresh.files() == memory.files()
    scan = Observation(30.0, {"lidar": wall_scan(30.0)})
    estimate = PoseEstimate(Pose2D(0.0, 0.0), np.eye(3), 0.0)
    frames = frames_at(Pose2D(0.0, 0.0), 29.0, 31.0)
    fresh.update(scan, frames, estimate, 0.0)
    (best, *_) = fresh.sightings(poster(3, 30.0), frames)
    assert best.pose.distance_to(Pose2D(6.0, 0.0)) < 0.01
    fresh.load(tmp_path / "no_such_folder")
    assert fresh.count == 0 and fresh.sightings(poster(3, 30.0), frames) == ()


def written(tmp_path, **changes):
    keyframes = [keyframe(number, Pose2D(2.0 * number, 0.0, 0.0)) for number in range(3)]
    content = keyframe_file(keyframes, trained([one.descriptors for one in keyframes]))
    file = tmp_path / FILE
    file.write_bytes(content)
    if changes:
        with np.load(file) as packed:
            arrays = {**{name: packed[name] for name in packed.files}, **changes}
        np.savez(file, **arrays)
    return file


@pytest.mark.parametrize(
    "changes, expected",
    [
        ({"version": np.array(2)}, "this version reads format 1, the file has 2"),
        ({"counts": np.array([1, 2, -3])}, "counts must be whole numbers, at least 0"),
        ({"poses": np.zeros((2, 3))}, "poses is float64 (2, 3), expected shape (3, 3)"),
        ({"stamps": np.array([0.0, np.nan, 0.0])}, "stamps has numbers that are not finite"),
        ({"words": np.array(["a", None], dtype=object)}, "allow_pickle=False"),
    ],
)
def test_a_damaged_file_is_refused_with_its_name(tmp_path, changes, expected):
    file = written(tmp_path, **changes)
    with pytest.raises(InputError) as caught:
        read_keyframes(tmp_path)
    (finding,) = caught.value.findings
    assert finding.code == "E407" and finding.mark.file == str(file)
    assert expected in finding.sentence


def test_a_cut_off_file_is_refused(tmp_path):
    file = written(tmp_path)
    file.write_bytes(file.read_bytes()[:500])
    with pytest.raises(InputError, match="the keyframes are damaged"):
        read_keyframes(tmp_path)

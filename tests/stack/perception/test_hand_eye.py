"""Hand-eye calibration from computed views with the noise of markers."""

from math import degrees, radians

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.errors import InputError
from stack.geometry.rotations import from_angles
from stack.perception.hand_eye import HandEyeView, calibrate_hand_eye

MOVE, TURN = 0.001, radians(0.2)


def turned(vector):
    found = np.eye(4)
    found[:3, :3] = cv2.Rodrigues(np.array(vector, dtype=float))[0]
    return found


def noise(random, move, turn):
    """A small transform with a deviation of its distance and of its angle in space."""
    found = turned(random.normal(0.0, turn / np.sqrt(3.0), 3))
    found[:3, 3] = random.normal(0.0, move / np.sqrt(3.0), 3)
    return found


def hand_poses(random, count, tilt=0.5):
    return [
        from_angles(
            random.uniform([0.3, -0.3, 0.3], [0.6, 0.3, 0.6]),
            [np.pi + random.uniform(-tilt, tilt), random.uniform(-tilt, tilt),
             random.uniform(-1.0, 1.0)],
        )
        for _ in range(count)
    ]  # fmt: skip


def some_pose(random, reach):
    found = turned(random.normal(0.0, 1.0, 3))
    found[:3, 3] = random.uniform(-reach, reach, 3)
    return found


def views_of(random, poses, mount, marker, *, in_hand, move=MOVE, turn=TURN):
    """Views in which the picture has the noise."""
    inv = np.linalg.inv
    return [
        HandEyeView(
            pose,
            (inv(mount) @ inv(pose) @ marker if in_hand else inv(mount) @ pose @ marker)
            @ noise(random, move, turn),
        )
        for pose in poses
    ]


def errors(found, true):
    """Distance, mm, and angle, degrees."""
    off = np.linalg.inv(true) @ found
    angle = float(np.linalg.norm(cv2.Rodrigues(off[:3, :3])[0]))
    return 1000.0 * float(np.linalg.norm(off[:3, 3])), degrees(angle)


def scene(seed, *, in_hand, count=15, **more):
    random = np.random.default_rng(seed)
    mount, marker = some_pose(random, 0.1 if in_hand else 1.0), some_pose(random, 0.1)
    if in_hand:
        marker[:3, 3] += [0.45, 0.0, 0.0]
    views = views_of(random, hand_poses(random, count), mount, marker, in_hand=in_hand, **more)
    return views, mount, marker


@pytest.mark.parametrize("in_hand", [True, False])
def test_fifteen_views_with_noise_determine_the_mount(in_hand):
    """Noise of 1 mm and 0.2 deg."""
    found = []
    for seed in range(20):
        views, mount, _ = scene(seed, in_hand=in_hand)
        result = calibrate_hand_eye(views, in_hand=in_hand)
        found.append(errors(result.mount, mount))
        # The residuals are those of the noise, less the 12 of 90 numbers that were fitted.
        assert result.rms[0] == pytest.approx(MOVE, rel=0.4)
        assert result.rms[1] == pytest.approx(TURN, rel=0.4)
        # Root of the sum of three variances; the errors are within three deviations.
        assert found[-1][0] < 3.0 * 1000.0 * np.linalg.norm(result.deviations[:3])
        assert found[-1][1] < 3.0 * degrees(np.linalg.norm(result.deviations[3:]))
    # 0.6 and 1.1 mm, 0.06 and 0.07 deg (RMS) are measured, the smaller ones in the hand. The mast
    # is a metre away, where 0.2 deg are 3 mm.
    move, turn = np.max(found, axis=0)
    assert move < (2.0 if in_hand else 3.0) and turn < 0.3


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.booleans())
def test_without_noise_it_is_exact(seed, in_hand):
    views, mount, marker = scene(seed, in_hand=in_hand, count=8, move=0.0, turn=0.0)
    result = calibrate_hand_eye(views, in_hand=in_hand)
    assert errors(result.mount, mount) == pytest.approx((0.0, 0.0), abs=1e-4)
    assert errors(result.marker, marker) == pytest.approx((0.0, 0.0), abs=1e-4)


def test_turns_about_one_axis_are_refused():
    random = np.random.default_rng(2)
    poses = hand_poses(random, 12, tilt=0.0)
    views = views_of(random, poses, np.eye(4), from_angles((0.5, 0, 0), (0, 0, 0)), in_hand=True)
    with pytest.raises(InputError, match=r"about a second one .* tilt the hand"):
        calibrate_hand_eye(views, in_hand=True)


def test_too_few_views_are_refused():
    views, _, _ = scene(1, in_hand=True, count=4)
    with pytest.raises(InputError, match="4 views show the marker, at least 5 are needed"):
        calibrate_hand_eye(views, in_hand=True)


def test_the_wrong_side_of_the_camera_is_refused():
    views, _, _ = scene(1, in_hand=True)
    with pytest.raises(InputError, match=r"do not fit together.*check which of camera and marker"):
        calibrate_hand_eye(views, in_hand=False)


def test_a_view_that_does_not_fit_is_named():
    views, _, _ = scene(3, in_hand=True)
    slipped = views[6].camera_from_marker @ from_angles((0.02, 0.0, 0.0), (0.0, 0.0, 0.0))
    views[6] = HandEyeView(views[6].base_from_tool, slipped)
    assert calibrate_hand_eye(views, in_hand=True).doubtful == (6,)

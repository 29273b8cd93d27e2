"""Matching of scans to a keyframe: known displacements, corridors, search after a push."""

from __future__ import annotations

from math import inf, radians

import numpy as np
import pytest

from stack.localisation.fusion.scan_matching import matcher as matching
from stack.localisation.fusion.scan_matching.matcher import ScanMatcher
from stack.types import FloatArray, Pose2D, Scan

ROOM = [
    (-3.0, -2.0),
    (4.0, -2.0),
    (4.0, 2.5),
    (1.5, 2.5),
    (1.5, 1.2),
    (0.6, 1.2),
    (0.6, 3.0),
    (-3.0, 3.0),
]
"""Corners of a room with a pillar at a wall, metres."""

CORRIDOR = [(-30.0, -1.0), (30.0, -1.0), (30.0, 1.0), (-30.0, 1.0)]


def scan_at(pose: Pose2D, corners: list[tuple[float, float]], seed: int = 0) -> Scan:
    """360 beams with 1 cm of noise from a pose inside a polygon, up to 12 m."""
    angles = -np.pi + 2.0 * np.pi * np.arange(360) / 360
    directions = np.column_stack([np.cos(angles + pose.heading), np.sin(angles + pose.heading)])
    ranges = np.full(360, inf)
    for (ax, ay), (bx, by) in zip(corners, corners[1:] + corners[:1], strict=True):
        wall, to = np.array([bx - ax, by - ay]), np.array([ax - pose.x, ay - pose.y])
        across = directions[:, 0] * wall[1] - directions[:, 1] * wall[0]
        with np.errstate(divide="ignore", invalid="ignore"):
            away = (to[0] * wall[1] - to[1] * wall[0]) / across
            along = (to[0] * directions[:, 1] - to[1] * directions[:, 0]) / across
        hit = (away > 0.0) & (along >= 0.0) & (along <= 1.0)
        ranges = np.where(hit, np.minimum(ranges, away), ranges)
    noise = np.random.default_rng(seed).normal(0.0, 0.01, 360)
    ranges = np.where(ranges < 12.0, ranges + noise, inf).astype(np.float32)
    return Scan(0.0, ranges, -np.pi, 2.0 * np.pi / 360, 0.05, 12.0)


def row(pose: Pose2D) -> FloatArray:
    return np.array([pose.x, pose.y, pose.heading])


HERE = np.zeros((1, 4))


def matcher_at(pose: Pose2D, corners: list[tuple[float, float]]) -> ScanMatcher:
    matcher = ScanMatcher(0.01)
    matcher.set_keyframe(matcher.points_of(scan_at(pose, corners, 99), HERE))
    return matcher


def matched(matcher: ScanMatcher, scan: Scan, predicted: Pose2D):
    points = matcher.points_of(scan, HERE)
    return matcher.match(points, row(predicted), lambda: row(predicted))


START = Pose2D(-0.5, 0.3, 0.2)


@pytest.mark.parametrize(
    "moved", [Pose2D(0.0, 0.0), Pose2D(0.4, -0.1, 0.3), Pose2D(-0.2, 0.3, -0.25)]
)
def test_a_displacement_is_found_to_millimetres(moved):
    """180 points with 1 cm of noise: about 1 cm / sqrt(90) = 1 mm for each direction."""
    matcher, errors = matcher_at(START, ROOM), []
    for seed in range(8):
        scan = scan_at(START.compose(moved), ROOM, seed)
        found = matched(matcher, scan, moved.compose(Pose2D(0.05, -0.04, 0.03)))
        assert found is not None and found.share > 0.8
        errors.append(found.pose - row(moved))
    errors = np.array(errors)
    assert np.abs(errors[:, :2]).max() < 0.008
    assert np.abs(errors[:, 2]).max() < 0.004
    # normalised by the stated covariance, of three degrees of freedom
    distances = np.einsum("ni,ij,nj->n", errors, np.linalg.inv(found.covariance), errors)
    assert distances.mean() < 3.0


def test_along_a_corridor_the_prediction_stays_and_no_confidence_is_stated():
    matcher = matcher_at(Pose2D(0.0, 0.0, 0.0), CORRIDOR)
    for seed in range(5):
        scan = scan_at(Pose2D(0.3, 0.1, 0.02), CORRIDOR, seed)
        found = matched(matcher, scan, Pose2D(0.5, 0.05, 0.0))
        assert found is not None
        assert found.pose[0] == pytest.approx(0.5, abs=0.005)  # wheels alone measure this
        assert found.pose[1:] == pytest.approx([0.1, 0.02], abs=0.006)
        deviations = np.sqrt(found.covariance.diagonal())
        assert deviations[0] > 1.0
        assert deviations[1] < 0.03 and deviations[2] < 0.02


@pytest.mark.parametrize(
    "moved", [Pose2D(1.2, -0.8, 0.3), Pose2D(-1.1, 0.9, radians(-55)), Pose2D(0.1, 0.1, 1.0)]
)
def test_after_a_push_the_pose_is_found_in_the_surroundings(moved):
    matcher = matcher_at(START, ROOM)
    scans = [scan_at(START.compose(moved), ROOM, seed) for seed in range(4)]
    found = [matched(matcher, scan, Pose2D(0.0, 0.0)) for scan in scans]
    poses = [match.pose for match in found if match is not None]
    assert poses  # the walls that are hidden from here may need a confirmation by more scans
    for pose in poses:
        assert pose == pytest.approx(row(moved), abs=0.02)


def test_a_pose_that_explains_little_of_a_scan_is_confirmed_by_three():
    """A scan from the corridor has nothing to do with the room; half of it can be explained."""
    matcher = matcher_at(START, ROOM)
    scans = [scan_at(Pose2D(0.0, 0.0, 0.4), CORRIDOR, seed) for seed in range(4)]
    found = [matched(matcher, scan, Pose2D(0.0, 0.0)) for scan in scans]
    assert found[:2] == [None, None]
    assert all(match.share < 0.6 for match in found if match is not None)


@pytest.mark.parametrize(("confirmations", "at"), [(1, 0), (2, 1), (3, 2)])
def test_an_unclear_pose_waits_for_its_confirmations(monkeypatch, confirmations, at):
    """With a clear share of 1 every pose that a search finds waits for its confirmations."""
    matcher, moved = matcher_at(START, ROOM), Pose2D(1.2, -0.8, 0.3)
    monkeypatch.setattr(matching, "CLEAR_SHARE", 1.0)
    monkeypatch.setattr(matching, "CONFIRMATIONS", confirmations)
    scans = [scan_at(START.compose(moved), ROOM, seed) for seed in range(3)]
    found = [matched(matcher, scan, Pose2D(0.0, 0.0)) is not None for scan in scans]
    assert found.index(True) == at


def test_a_pose_that_is_not_known_well_enough_is_not_used(monkeypatch):
    """No pose of this room is known to a tenth of a millimetre."""
    matcher, moved = matcher_at(START, ROOM), Pose2D(1.2, -0.8, 0.3)
    monkeypatch.setattr(matching, "KNOWN_DEVIATION", 1e-4)
    scan = scan_at(START.compose(moved), ROOM)
    assert matched(matcher, scan, Pose2D(0.0, 0.0)) is None


def test_a_scan_taken_on_the_move_is_deskewed():
    """The base moves by 6 cm and turns by 0.1 rad during the scan; the walls stay straight."""
    scan = scan_at(Pose2D(0.0, 0.0), ROOM)
    still = ScanMatcher(0.01).points_of(scan, HERE)
    stamped = Scan(
        1.0, scan.ranges, scan.angle_min, scan.angle_increment, 0.05, 12.0, time_increment=0.1 / 360
    )
    trail = np.array([[0.9, -0.06, 0.0, -0.1], [1.0, 0.0, 0.0, 0.0], [1.1, 0.06, 0.0, 0.1]])
    moving = ScanMatcher(0.01).points_of(stamped, trail)
    share = (np.arange(360) - 179.5) / 360
    angle = 0.1 * share
    returned = np.isfinite(scan.ranges)
    expected = np.column_stack([
        0.06 * share[returned]
        + np.cos(angle[returned]) * still[:, 0] - np.sin(angle[returned]) * still[:, 1],
        np.sin(angle[returned]) * still[:, 0] + np.cos(angle[returned]) * still[:, 1],
    ])  # fmt: skip
    assert moving == pytest.approx(expected, abs=1e-9)

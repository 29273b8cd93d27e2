"""Scan matching against known transforms."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.mapping.slam.matching.local_map import LocalMap, align_pair
from stack.mapping.slam.matching.scans import prepare
from stack.types import Pose2D
from tests.stack.mapping.slam.rooms import ROOM, scan_at

HERE = Pose2D(4.0, 3.0, 0.4)
SMALL = st.tuples(*(st.floats(-limit, limit) for limit in (0.12, 0.12, 0.06)))


def prepared(pose, **options):
    return prepare(scan_at(ROOM, pose, **options), 30.0, 0.01)


@settings(max_examples=25, deadline=None)
@given(SMALL, SMALL)
def test_a_pair_of_scans_is_aligned_to_five_millimetres(moved, error):
    true = Pose2D(*moved)
    start = true.compose(Pose2D(*(0.5 * part for part in error)))
    found = align_pair(prepared(HERE), prepared(HERE.compose(true)), start)
    assert found.pose.distance_to(true) < 0.005
    assert abs(found.pose.heading - true.heading) < 0.003
    assert found.overlap > 0.8


@settings(max_examples=25, deadline=None)
@given(st.floats(-0.8, 0.8), st.floats(-0.8, 0.8), st.floats(-0.4, 0.4))
def test_search_and_alignment_find_a_pose_within_the_window(dx, dy, turn):
    local = LocalMap([(HERE, prepared(HERE))], 0.05)
    pose = HERE.compose(Pose2D(0.1, -0.1, 0.1))
    expected = Pose2D(pose.x + dx, pose.y + dy, pose.heading + turn)
    found = local.search(prepared(pose, noise=0.01), expected, (1.0, 0.5))
    assert found is not None
    match = local.align(prepared(pose, noise=0.01), found)
    assert match.pose.distance_to(pose) < 0.02
    assert abs(match.pose.heading - pose.heading) < 0.01


def test_nothing_holds_a_scan_along_a_corridor_without_ends():
    corridor = np.array([(-50.0, -1.0, 50.0, -1.0), (-50.0, 1.0, 50.0, 1.0)])
    scans = [prepare(scan_at(corridor, Pose2D(x, 0.0)), 30.0, 0.01) for x in (0.0, 0.2)]
    found = align_pair(scans[0], scans[1], Pose2D(0.2, 0.0))
    along, across = found.information[0, 0], found.information[1, 1]
    assert across > 1e4 and along < 1e-3 * across


def test_the_information_is_the_inverse_of_the_scatter_of_noisy_matches():
    # 60 pairs with range noise of 1 cm in both scans; the model assumes 3 cm of one residual.
    found = [
        align_pair(
            prepared(HERE, noise=0.01, seed=2 * k), prepared(HERE, noise=0.01, seed=2 * k + 1),
            Pose2D(0.0, 0.0),
        )
        for k in range(60)
    ]  # fmt: skip
    scatter = np.cov(np.array([[f.pose.x, f.pose.y, f.pose.heading] for f in found]).T)
    stated = np.linalg.inv(found[0].information)
    ratio = np.sqrt(np.diag(stated) / np.diag(scatter))
    assert ((ratio > 0.5) & (ratio < 6.0)).all(), ratio


def test_a_scan_without_returns_matches_nothing():
    empty = prepare(scan_at(np.array([(90.0, 0.0, 90.0, 1.0)]), HERE), 30.0, 0.01)
    local = LocalMap([(HERE, prepared(HERE))], 0.05)
    assert local.search(empty, HERE, (0.5, 0.1)) is None
    assert local.align(empty, HERE).overlap == 0.0
    assert LocalMap([(HERE, empty)], 0.05).align(prepared(HERE), HERE).overlap == 0.0
    assert align_pair(empty, empty, Pose2D(0.1, 0.0)).pose == Pose2D(0.1, 0.0)

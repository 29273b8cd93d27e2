"""A scan is drawn from where it was taken, and says when it is old."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from stack.types import Pose2D
from tests.tui.sample_source import SampleSource
from tui.drawing.scan import PastOdometry
from tui.figures import Figures


def shot(time, x, pose=None):
    return SimpleNamespace(
        time=time, odometry=Pose2D(x, 0.0), pose=pose or Pose2D(x + 10.0, 5.0, np.pi / 2)
    )


def test_an_old_scan_stays_where_it_was_taken():
    """The robot drives north in the map, 1 m/s; its estimate was corrected by (10, 5, 90°)."""
    past = PastOdometry()
    for time in range(5):
        past.add(shot(float(time), float(time)))
    newest = shot(4.0, 4.0, Pose2D(14.0, 9.0, np.pi / 2))
    then = past.pose_at(1.5, newest)
    assert (then.x, then.y) == pytest.approx((14.0, 9.0 - 2.5))
    now = past.pose_at(4.0, newest)
    assert (now.x, now.y) == pytest.approx((14.0, 9.0))


@pytest.mark.parametrize(("x", "speed"), [(0.05, 0.5), (3.0, np.nan)])  # 3 m in 0.1 s: lifted
def test_the_true_speed_is_that_of_the_truth(x, speed):
    figures, source = Figures(), SampleSource()
    snapshot = source.poll()
    figures.add(replace(snapshot, time=1.0, truth=Pose2D(0.0, 0.0)))
    figures.add(replace(snapshot, time=1.1, truth=Pose2D(x, 0.0)))
    assert figures.true_speed == pytest.approx(speed, nan_ok=True)

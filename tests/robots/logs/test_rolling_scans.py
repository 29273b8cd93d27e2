"""Scans of lidars that turn in a bag: odometry covers each of them when it is delivered."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from robots.logs.opening import open_log
from stack.frames.buffer import TransformBuffer
from stack.frames.deskew import Deskewer
from stack.types import Pose2D, Scan
from tests.robots.logs.log_writers import BagWriter

BEAMS = 12


def used(recording):
    """The scans that the step loop uses, and those that it drops."""
    frames, deskewer, scans = TransformBuffer(), Deskewer(), []
    for observation in recording.play():
        frames.add(observation.wheels)
        scans += deskewer.update(observation, frames).of(Scan).values()
    return scans, deskewer.dropped


@settings(max_examples=6, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    odometry=st.floats(3.0, 100.0), rate=st.floats(2.0, 40.0), share=st.floats(0.1, 1.0),
    clockwise=st.booleans(), upside_down=st.booleans(), lidars=st.integers(1, 3),
)  # fmt: skip
def test_no_scan_is_lost_but_those_before_the_first_odometry(
    tmp_path_factory, odometry, rate, share, clockwise, upside_down, lidars
):
    folder = tmp_path_factory.mktemp("rolling") / "bag"
    writer, turn = BagWriter(folder), share / rate
    for n in range(lidars):
        writer.static(1.0, "base_link", f"laser{n}", Pose2D(0.1, 0.0), roll=np.pi * upside_down)
    for n in range(int(2.0 * odometry)):
        writer.odometry(1.0 + n / odometry, Pose2D(0.3 * n / odometry, 0.0), base="base_link")
    sign = -1.0 if clockwise else 1.0
    stamps = [0.9 + n / rate for n in range(int(2.0 * rate))]
    for stamp in stamps:
        for n in range(lidars):
            writer.scan(
                stamp, np.full(BEAMS, 2.0), f"laser{n}", f"/scan{n}", angle_min=-sign * np.pi,
                angle_max=sign * np.pi, angle_increment=sign * 2.0 * np.pi / BEAMS,
                time_increment=turn / BEAMS,
            )  # fmt: skip
    writer.close()
    scans, dropped = used(open_log(folder))
    early = sum(stamp + turn * (BEAMS - 1) / BEAMS < 1.0 for stamp in stamps)
    begun = sum(stamp < 1.0 - 1e-9 for stamp in stamps)
    assert len(scans) == lidars * (len(stamps) - begun)
    assert sum(dropped.values()) == lidars * (begun - early)


@pytest.mark.parametrize("turn", [0.0, 0.1])
def test_a_bag_of_scans_alone_loses_none(tmp_path, turn):
    writer = BagWriter(tmp_path / "bag")
    for n in range(20):
        writer.scan(5.0 + 0.1 * n, np.full(BEAMS, 2.0), time_increment=turn / BEAMS)
    writer.close()
    scans, dropped = used(open_log(tmp_path / "bag"))
    assert (len(scans), dropped) == (20, {})

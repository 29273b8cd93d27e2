"""Lidars that repeat their scans while the robot moves."""

from dataclasses import replace

import numpy as np

from stack.perception.frozen_scans import FrozenScans
from stack.types import Observation, Pose2D, Scan
from tests.stack.sim.sim_rover import EQUIPPED, LIDAR, ROVER


def scan(ranges, stamp=0.0):
    return Scan(stamp, np.array(ranges, np.float32), 0.0, 0.1, 0.1, 10.0)


def delivered(watch, ranges, x, heading=0.0):
    seen = Observation(0.0, {"lidar": scan(ranges)})
    kept, events = watch.removed(seen, Pose2D(x, 0.0, heading))
    return "lidar" in kept.measurements, [event.fault for event in events]


def test_a_repeated_scan_is_used_until_the_robot_has_moved():
    watch = FrozenScans(EQUIPPED)
    assert delivered(watch, [1.0, np.nan, np.inf], 0.0) == (True, [])
    assert delivered(watch, [1.0, np.nan, np.inf], 0.01) == (True, [])
    assert delivered(watch, [1.0, np.nan, np.inf], 0.03) == (False, ["frozen"])
    assert delivered(watch, [1.0, np.nan, np.inf], 0.03) == (False, [])
    assert delivered(watch, [1.1, np.nan, np.inf], 0.03) == (True, [""])


def test_turning_is_motion_and_other_ranges_are_not_frozen():
    watch = FrozenScans(EQUIPPED)
    assert delivered(watch, [1.0, 2.0], 0.0) == (True, [])
    assert delivered(watch, [1.0, 2.0001], 0.0, 0.1) == (True, [])
    assert delivered(watch, [1.0, 2.0001], 0.0, 0.2) == (False, ["frozen"])


def test_nothing_in_sight_and_lidars_without_noise_may_repeat():
    watch = FrozenScans(EQUIPPED)
    exact = FrozenScans(replace(ROVER, lidar=LIDAR))
    for x in (0.0, 1.0, 2.0):
        assert delivered(watch, [np.inf, np.inf], x) == (True, [])
        assert delivered(exact, [1.0, 2.0], x) == (True, [])

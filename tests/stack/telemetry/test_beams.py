"""Beams compared with the map: matched, short and long."""

import numpy as np

from stack.telemetry.beams import LONG, MATCHED, SHORT, beam_classes
from stack.types import FREE, OCCUPIED, UNKNOWN, OccupancyGrid, Pose2D, Scan


def corridor():
    """Free for 4 x 2 m; a wall at x = 2 to 2.1 m, and the end at 3.9 m."""
    cells = np.full((20, 40), FREE, np.int8)
    cells[:, 20] = cells[:, 39] = OCCUPIED
    cells[:3] = UNKNOWN
    return OccupancyGrid(cells, 0.1)


def scan_of(*ranges):
    return Scan(0.0, np.array(ranges, np.float32), 0.0, 0.0, 0.05, 10.0, Pose2D(0.1, 0.0))


def test_beams_that_end_before_at_and_beyond_the_mapped_wall():
    """The lidar is at x = 0.5: the wall at 1.5 to 1.6 m, the end wall at 3.4 m."""
    scan = scan_of(1.52, 0.8, 2.4, 3.42, np.inf, np.nan, 1.42)
    points, classes = beam_classes(scan, Pose2D(0.4, 1.0), corridor())
    assert np.allclose(points[:, 1], 1.0)
    assert np.allclose(points[:, 0], [2.02, 1.3, 2.9, 3.92, 1.92], atol=1e-6)
    # Beyond the wall but at the end wall: something that the map shows is there.
    assert classes.tolist() == [MATCHED, SHORT, LONG, MATCHED, MATCHED]


def test_ends_outside_the_map_and_turned_poses():
    pose = Pose2D(1.0, 1.0, np.pi)
    points, classes = beam_classes(scan_of(5.0, 0.5), pose, corridor())
    assert np.allclose(points, [[-4.1, 1.0], [0.4, 1.0]], atol=1e-6)
    assert classes.tolist() == [SHORT, SHORT]
    assert beam_classes(scan_of(np.inf), pose, corridor())[1].size == 0

from dataclasses import replace

import numpy as np
import pytest

from stack.drivetrain.description import SonarDescription
from stack.perception.sensor_watch import SensorWatch
from stack.types import Imu, Observation, Pose2D, RangeReading, Scan
from tests.stack.sim.sim_rover import EQUIPPED, LIDAR

ROBOT = replace(
    EQUIPPED, lidars={"rear": replace(LIDAR, rate=1.0)},
    sonars={"left": SonarDescription(Pose2D(0.0, 0.0))},
)  # fmt: skip


def measured(names, time):
    found = {}
    for name in names:
        if name == "imu":
            found[name] = Imu(np.array([time]), np.zeros((1, 3)), np.zeros((1, 3)))
        elif name == "left":
            found[name] = RangeReading(time, 1.0, 0.4, 0.1, 2.0)
        else:
            found[name] = Scan(time, np.ones(4, np.float32), 0.0, 1.0, 0.1, 9.0)
    return Observation(time, found)


@pytest.mark.parametrize(("silent", "after"), [("lidar", 1.0), ("left", 1.0), ("imu", 1.0),
                                               ("rear", 5.0)])  # fmt: skip
def test_each_sensor_that_delivers_nothing_is_reported_once(silent, after):
    """After a second, or after five of its periods: the rear lidar measures once a second."""
    watch, others = SensorWatch(ROBOT), {"lidar", "rear", "left", "imu"} - {silent}
    found = []
    for n in range(200):
        time = 0.05 * n
        found += [(time, event) for event in watch.update(measured(others, time), {})]
    ((time, event),) = found
    assert (event.sensor, event.fault) == (silent, "silent")
    assert time == pytest.approx(after + 0.05, abs=0.051)
    (again,) = watch.update(measured({*others, silent}, 10.0), {})
    assert (again.sensor, again.fault) == (silent, "")


def test_the_first_scan_that_is_dropped_is_reported():
    watch = SensorWatch(ROBOT)
    names = {"lidar", "rear", "left", "imu"}
    (event,) = watch.update(measured(names, 0.0), {"lidar": 1})
    assert (event.sensor, event.fault) == ("lidar", "dropped")
    assert watch.update(measured(names, 0.1), {"lidar": 2}) == []

"""How often sensors deliver, against the robot file."""

from math import inf
from pathlib import Path

import numpy as np
import pytest

from robots.load import find_robot, read_robot
from stack.runtime.sensor_rates import SensorRates
from stack.types import Battery, Imu, Observation


def test_one_measurement_has_no_rate():
    rates = SensorRates(read_robot(find_robot("scout", Path())))
    rates.update(Observation(0.0, {"battery": Battery(1.0)}))
    assert {state.name: state.rate for state in rates.states(0.0, ())}["battery"] == 0.0


def test_rates_are_counted_over_five_seconds_and_compared_with_the_robot_file():
    rates = SensorRates(read_robot(find_robot("scout", Path())))
    for step in range(200):  # 10 s at 20 Hz; the lidar falls silent after 8 s
        time = step * 0.05
        measured = {"battery": Battery(1.0)}
        if step % 2 == 0 and time < 8.0:
            measured["lidar"] = Battery(1.0)  # the type does not matter
        stamps = time - 0.05 + 0.01 * np.arange(1, 6)
        measured["imu"] = Imu(stamps, np.zeros((5, 3)), np.zeros((5, 3)))
        rates.update(Observation(time, measured))
    found = {state.name: state for state in rates.states(9.95, ())}
    assert found["imu"].rate == pytest.approx(100.0)  # five samples in each step
    assert found["battery"].rate == pytest.approx(20.0) and found["battery"].expected == 0.0
    assert found["lidar"].rate == pytest.approx(6.0, abs=0.21)  # 3 of 5 s at 10 Hz
    assert found["lidar"].is_slow and found["lidar"].age == pytest.approx(2.05)
    assert found["camera"].expected == 0.0 and found["camera"].age == inf
    assert {s.name: s for s in rates.states(9.95, ("camera",))}["camera"].is_slow

"""Checks of a rover before it drives."""

import pytest

from robots.mavlink.autopilots import ARDUROVER, PX4_ROVER
from robots.mavlink.checks import Subject, checks_of
from robots.mavlink.hearing import Hearing, Rover
from robots.mavlink.measurements import Measurements
from robots.mavlink.parameters import MavlinkParameters
from stack.errors import InputError, ParameterError
from stack.types import Battery

ADDRESS = "udpin:127.0.0.1:14550"


@pytest.fixture
def subject(description):
    """A rover that may drive, at 100 s, with changes."""

    def make(rover=ARDUROVER, **changes):
        heard = Hearing(245, 0, None, lambda ack: None)
        heard.rover = Rover(1, rover, rover.driving, True, 100.0, 100.0)
        measurements = Measurements(description, "auto", "lidar", ())
        measurements.odometry.heard = 99.9
        measurements.battery = Battery(0.8, voltage=24.0)
        for name, value in changes.items():
            part = {"others": heard, "values": heard, "last_text": heard, "mode": heard.rover,
                    "armed": heard.rover, "signs": heard.rover, "battery": measurements,
                    "heard": measurements.odometry}[name]  # fmt: skip
            setattr(part, name, value)
        return Subject(heard, "", measurements, MavlinkParameters(ADDRESS), 100.0, 60.0)

    return make


def failed(subject):
    return {check.name: str(check) for check in checks_of(subject) if not check.passed}


def test_all_is_well(subject):
    assert failed(subject()) == {} == failed(subject(PX4_ROVER))
    assert [check.name for check in checks_of(subject())] == [
        "heartbeat", "one rover", "signature", "odometry", "battery", "setpoint watchdog", "mode",
        "armed",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "name", "text"),
    [
        ({"others": {3}}, "one rover", "several rovers are there: 1, 3; set `system` of the body"),
        ({"signs": True}, "signature", "refuses ours; set `key` of the body"),
        ({"heard": None}, "odometry", "ATTITUDE and LOCAL_POSITION_NED: none yet"),
        ({"heard": 90.0}, "odometry", "none for 10.0 s"),
        ({"battery": Battery(0.05, voltage=20.4)}, "battery", "5%, 20.4 V; charge it above 10%"),
        ({"mode": "HOLD", "last_text": "no fix"}, "mode",
         "HOLD, and GUIDED is not accepted; it says: no fix"),
        ({"armed": False}, "armed", "the autopilot refuses; it does not say why"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named_with_a_remedy(subject, changes, name, text):
    found = failed(subject(**changes))
    assert found.keys() == {name} and text in found[name]


@pytest.mark.parametrize(
    ("rover", "values", "passed", "text"),
    [
        (ARDUROVER, {}, True, "it stops after 3 s without a setpoint"),
        (ARDUROVER, {"FS_GCS_ENABLE": 0.0}, True, "FS_GCS_ENABLE 1 and MAV_GCS_SYSID 245"),
        (ARDUROVER, {"FS_GCS_ENABLE": 1.0, "SYSID_MYGCS": 255.0}, True, "watches system 255"),
        (PX4_ROVER, {"COM_OF_LOSS_T": 1.0}, True, "after 1 s"),
        (PX4_ROVER, {"COM_OF_LOSS_T": 5.0}, False, "set COM_OF_LOSS_T to 1 s or less"),
    ],
)
def test_the_watchdog_of_the_autopilot(subject, rover, values, passed, text):
    made = {check.name: check for check in checks_of(subject(rover, values=values))}
    assert made["setpoint watchdog"].passed is passed
    assert text in str(made["setpoint watchdog"])


@pytest.mark.parametrize(
    ("values", "problem"),
    [
        ({"connect": "udp:0.0.0.0:14550"}, "would listen on 0.0.0.0"),
        ({"connect": ADDRESS, "origin": [48.0]}, "expected \\[latitude, longitude\\]"),
        ({"connect": ADDRESS, "origin": [0.0, 0.0]}, "autopilots refuse"),
        ({"connect": ADDRESS, "origin": [95.0, 0.0]}, "expected \\[latitude, longitude\\]"),
    ],
)
def test_wrong_parameters_are_refused(values, problem):
    with pytest.raises((InputError, ParameterError), match=problem):
        MavlinkParameters(**values)

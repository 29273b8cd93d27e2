"""What held the robot: events, seconds and the sentence that failures quote."""

from math import pi

import pytest

from stack.navigation.landmarks import Landmarks
from stack.runtime.holdups import Holdups, held_seconds, holds_of
from stack.telemetry.records import Event
from stack.types import Limitation, Pose2D

PERIOD = 0.05
AHEAD = Limitation("stopped", "obstacle", "obstacle 0.5 m ahead", (0.5, 0.0))
SLOW = Limitation("slower", "speed limit", "the speed limit here is 0.20 m/s")


class Told:
    def __init__(self):
        self.events = []
        marks = Landmarks({"dock": Pose2D(2.0, 2.0)})
        self.holdups = Holdups(
            lambda kind, text, **fields: self.add(kind, text, fields), PERIOD, marks
        )
        self.now = 0.0

    def add(self, kind, text, fields):
        self.events.append((round(self.now, 2), kind, text, fields))

    def seconds(self):
        """As a report sums up the events until now."""
        told = [
            Event(0, 0, time, "", "", kind, "", fields) for time, kind, _, fields in self.events
        ]
        return held_seconds(holds_of(told, self.now))

    def pass_time(self, seconds, *limitations, pose=Pose2D(2.0, 1.0, pi / 2), kept=0.0):
        for _ in range(round(seconds / PERIOD)):
            self.holdups.update(limitations, pose, self.now, kept)
            self.now += PERIOD


@pytest.fixture
def told():
    return Told()


def test_an_event_tells_after_a_second_what_holds_the_robot_and_where(told):
    told.pass_time(2.0)
    told.pass_time(3.0, AHEAD)
    told.pass_time(2.0)
    (begun, kind, text, fields), (ended, *end) = told.events
    assert kind == "held"
    assert begun == pytest.approx(3.0, abs=0.06)
    # 0.5 m to the north of (2, 1)
    assert text == "stopped: obstacle 0.5 m ahead at (2.00, 1.50), near 'dock'"
    assert fields["cause"] == "obstacle"
    assert fields["begin"] == pytest.approx(2.0)
    assert fields["place"] == pytest.approx([2.0, 1.5])
    assert ended == pytest.approx(5.5, abs=0.1)  # half a second after the last step of it
    assert end[:2] == ["held_end", "no longer stopped by: obstacle, after 3.0 s"]


def test_flicker_is_one_holdup_and_short_ones_are_not_told(told):
    for _ in range(20):
        told.pass_time(0.1, AHEAD)
        told.pass_time(0.1)
    assert [kind for _, kind, *_ in told.events] == ["held"]
    told.pass_time(1.0)
    # 20 times 0.2 s, without the 0.1 s after the last step of it
    assert told.seconds() == {"stopped": {"obstacle": pytest.approx(3.9)}, "slower": {}}
    told.pass_time(0.8, AHEAD)
    told.pass_time(1.0)
    assert [kind for _, kind, *_ in told.events] == ["held", "held_end"]


def test_driving_slower_holds_the_robot_below_half_of_its_velocity(told):
    told.pass_time(5.0, SLOW, kept=0.6)
    assert told.events == []
    told.pass_time(5.0, SLOW, kept=0.4)
    told.pass_time(5.0, SLOW, kept=0.6)
    assert [(kind, text) for _, kind, text, _ in told.events] == [
        ("held", "slower: the speed limit here is 0.20 m/s"),
        ("held_end", "no longer slower by: speed limit, after 5.0 s"),
    ]
    assert told.seconds() == {"stopped": {}, "slower": {"speed limit": 5.0}}
    assert (
        told.holdups.sentence(5.0, 10.0)
        == "held 5.0 of 5.0 s: slower: the speed limit here is 0.20 m/s"
    )


def test_a_holdup_that_has_not_ended_lasts_to_the_end_of_the_run(told):
    """As in a run that was killed: the begin is 1 s, the end 4 s."""
    told.pass_time(1.0)
    told.pass_time(3.0, AHEAD)
    assert told.seconds()["stopped"] == {"obstacle": pytest.approx(3.0, abs=PERIOD)}


def test_a_failure_quotes_what_held_the_robot_most(told):
    told.pass_time(10.0)
    told.pass_time(1.0, Limitation("stopped", "lost", "lost"))
    told.pass_time(5.0, AHEAD)
    told.pass_time(2.0)
    sentence = told.holdups.sentence(told.now - 8.0, told.now)
    told_of = "stopped: obstacle 0.5 m ahead at (2.00, 1.50), near 'dock'"
    assert sentence == f"held 5.0 of 8.0 s: {told_of}"
    assert told.holdups.sentence(told.now - 1.0, told.now) == ""
    assert told.holdups.sentence(0.0, told.now).startswith("held 5.0 of 18.0 s: ")


def test_what_stops_and_slows_the_robot_in_turn_counts_once(told):
    """Each effect has its own hold-up: both last from 0 to nearly 4 s."""
    near = Limitation("slower", "obstacle", "obstacle 0.8 m ahead", (0.8, 0.0))
    for _ in range(20):
        told.pass_time(0.1, AHEAD)
        told.pass_time(0.1, near)
    assert told.holdups.sentence(0.0, told.now).startswith("held 4.0 of 4.0 s: slower: obstacle")


def test_a_holdup_before_the_time_counts_only_from_then_on(told):
    told.pass_time(20.0, AHEAD)
    assert told.holdups.sentence(told.now - 4.0, told.now).startswith("held 4.0 of 4.0 s")

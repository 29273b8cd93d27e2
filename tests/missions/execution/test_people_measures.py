"""Measures of a drive among people, against figures computed by hand."""

from __future__ import annotations

from math import hypot, inf, pi

import numpy as np
import pytest

from missions.execution.people_measures import PeopleMeasures
from stack.types import Pose2D, Twist
from tests.stack.navigation.toy_world import RECTANGLE

PERIOD = 0.05


def driven(robot, person, seconds, speed=0.0, heading=0.0):
    """Robot and person as functions of time: x positions on a line; both of 20 steps a second."""
    measures = PeopleMeasures(RECTANGLE)
    for step in range(round(seconds / PERIOD) + 1):
        time = step * PERIOD
        people = np.array([[person(time), 0.0, 0.2]])
        measures.update(time, Pose2D(robot(time), 0.0, heading), Twist(speed), people)
    return measures


def test_a_robot_that_drives_into_somebody_who_stands():
    """Nose at 0.25 m, surface of the person at 1.8 m: touch (2 cm) after 1.53 m at 0.5 m/s."""
    measures = driven(lambda t: 0.5 * t, lambda t: 2.0, 3.3, speed=0.5)
    (contact,) = measures.contacts
    assert contact.by == "robot"
    assert contact.time == pytest.approx(3.06, abs=0.11)
    assert (contact.robot, contact.person) == pytest.approx((0.5, 0.0), abs=1e-6)
    assert measures.least_distance == 0.0
    # from 0.45 m and 1.2 m between the surfaces on: 2.2 s and 0.7 s after the start
    assert measures.intimate == pytest.approx(3.3 - 2.2, abs=0.06)
    assert measures.personal == pytest.approx(3.3 - 0.7, abs=0.06)
    assert measures.least_collision_time == pytest.approx(0.04, abs=0.06)


@pytest.mark.parametrize(
    ("speed", "turning", "by"),
    [
        (0.0, 0.0, "person, robot standing"), (0.3, 0.0, "person, robot moving"),
        (-0.3, 0.0, "person, robot moving"), (0.0, 0.5, "person, robot moving"),
    ],
)  # fmt: skip
def test_a_person_who_walks_into_the_robot(speed, turning, by):
    measures = PeopleMeasures(RECTANGLE)
    for step in range(100):
        time = step * PERIOD
        people = np.array([[2.0 - 0.8 * time, 0.0, 0.2]])
        measures.update(time, Pose2D(speed * time, 0.0), Twist(speed, turning), people)
        if measures.contacts:
            break
    (contact,) = measures.contacts
    assert contact.by == by
    assert contact.person == pytest.approx(0.8, abs=1e-6)


def test_the_time_to_collision_is_that_of_constant_velocities():
    """Closing at 1.5 m/s; far away the outline counts as its circle of 0.32 m."""
    measures = PeopleMeasures(RECTANGLE)
    for time in (0.0, PERIOD):
        people = np.array([[4.0 - 1.0 * time, 0.0, 0.2]])
        measures.update(time, Pose2D(0.5 * time, 0.0), Twist(0.5), people)
    apart = 4.0 - 0.2 - hypot(0.25, 0.2) - 1.5 * PERIOD
    assert measures.least_collision_time == pytest.approx(apart / 1.5, abs=1e-6)
    aside = PeopleMeasures(RECTANGLE)
    for time in (0.0, PERIOD):
        aside.update(time, Pose2D(0.0, 0.0), Twist(), np.array([[4.0 - time, 2.0, 0.2]]))
    assert aside.least_collision_time == inf


def test_standing_near_somebody_for_long_is_a_standoff_and_counts_once():
    assert driven(lambda t: 0.0, lambda t: 1.0, 19.0).standoffs == 0
    measures = driven(lambda t: 0.0, lambda t: 1.0, 45.0)
    assert measures.standoffs == 1
    assert measures.longest_stand == pytest.approx(45.0)
    assert driven(lambda t: 0.0, lambda t: 4.0, 45.0).standoffs == 0
    assert driven(lambda t: 0.02 * t, lambda t: 1.5, 45.0, speed=0.02).standoffs == 0


def test_without_people_there_is_nothing_to_report():
    measures = PeopleMeasures(RECTANGLE)
    for time in (0.0, 1.0):
        measures.update(time, Pose2D(0.0, 0.0, pi), Twist(), np.empty((0, 3)))
    summary = measures.summary()
    assert summary["least_distance"] is None
    assert (summary["contacts"], summary["standoffs"]) == ([], 0)

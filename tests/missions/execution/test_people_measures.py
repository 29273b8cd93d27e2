"""Measures of a drive among people, against figures computed by hand."""

from __future__ import annotations

from dataclasses import replace
from math import hypot, inf, pi

import numpy as np
import pytest

from missions.execution.ground_truth import SimulationScorer
from missions.execution.people_measures import PeopleMeasures
from robots.simulated import SimulatedBody
from stack.body import BodyCommand
from stack.sim.worlds.world import Person
from stack.types import STANDSTILL, Pose2D, PoseEstimate, Twist
from tests.stack.navigation.toy_world import RECTANGLE
from tests.stack.sim.sim_rover import EMPTY, ROVER

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


def test_somebody_who_leaves_as_another_comes_is_not_the_same_person():
    """One stands 2 m ahead until 0.5 s, another walks away from 3.5 m on: nobody comes nearer.

    Taken for one person they would have walked 1.5 m in a step of 0.05 s, or back.
    """
    measures, nowhere = PeopleMeasures(RECTANGLE), [np.nan, np.nan, 0.2]
    for step in range(21):
        time = step * PERIOD
        one, other = [2.0, 0.0, 0.2], [3.0 + time, 0.0, 0.2]
        here = [nowhere, other] if time > 0.5 else [one, nowhere]
        measures.update(time, Pose2D(0.0, 0.0), Twist(), np.array(here[::-1]))
    assert measures.least_collision_time == inf
    assert measures.least_distance == pytest.approx(2.0 - 0.2 - hypot(0.25, 0.2), abs=1e-6)


def test_the_scorer_keeps_recorded_people_apart():
    """One stands 4 m away in the first half of the recording, another 2.5 m in the second half."""
    tracks = {
        name: np.array([[begin, x, 0.0, 0.0, 0.0], [end, x, 0.0, 0.0, 0.0]])
        for name, x, begin, end in (("far", 4.0, 0.0, 3.0), ("near", 2.5, 3.0001, 6.0))
    }
    people = tuple(
        Person(name, track[:, 1:3], model="recorded", track=track, recorded_duration=6.0)
        for name, track in tracks.items()
    )
    world = replace(EMPTY, people=people)
    body = SimulatedBody(ROVER, world, start=Pose2D(0.0, 0.0), seed=1)
    scorer = SimulationScorer(body, world, ROVER.footprint, lambda: body.time)
    here = PoseEstimate(Pose2D(0.0, 0.0), np.zeros((3, 3)), 1.0)
    seen = set()
    for _ in range(140):
        body.sense()
        scorer.score(here)
        seen |= {round(x, 1) for x, _, _ in body.people.tolist()}
        body.command(BodyCommand(STANDSTILL))
        body.wait(PERIOD)
    body.close()
    assert seen == {4.0, 2.5}
    assert scorer.among_people.least_collision_time == inf


def test_the_contact_with_a_person_beside_whom_another_leaves():
    """They walk in at 0.8 m/s; the other one, behind the robot, is last there in the same step."""
    measures = PeopleMeasures(RECTANGLE)
    for step in range(60):
        time = step * PERIOD
        behind = [-4.0, 0.0, 0.2] if time < 1.91 else [np.nan, np.nan, 0.2]
        people = np.array([behind, [2.0 - 0.8 * time, 0.0, 0.2]])
        measures.update(time, Pose2D(0.0, 0.0), Twist(), people)
    (contact,) = measures.contacts
    # 2 cm before the surfaces meet: (2.0 - 0.2 - 0.25 - 0.02) / 0.8 = 1.91 s
    assert contact.time == pytest.approx(1.9, abs=0.06)
    assert contact.person == pytest.approx(0.8, abs=1e-6)


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

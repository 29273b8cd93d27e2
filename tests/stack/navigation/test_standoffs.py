"""Meetings with people who stand in the way: patience, passing places, and giving way."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import pairwise
from math import hypot, pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.control.evasion.parameters import EvasionParameters
from stack.errors import NavigationError
from stack.navigation.people.give_way import WalkingDirections
from stack.navigation.people.narrow_meeting import find_narrow_meeting, widths_across
from stack.navigation.people.passing_place import (
    LEAST_BODY,
    PASSING_ROOM,
    PLACES_APART,
    find_passing_place,
    way_of,
)
from stack.types import (
    STANDSTILL,
    CostGrid,
    FailureCode,
    Pose2D,
    StandingObject,
    TaskStatus,
    TrackedObject,
)
from tests.stack.navigation.toy_drive import ToyDrive
from tests.stack.navigation.toy_world import ToyCostmap, ToyWorld, outline, robot, room

SCOUT = outline(0.2, 0.33)


def person(x, y, time=0.0, velocity=(0.0, 0.0)) -> TrackedObject:
    return TrackedObject(7, time, (x, y), velocity, 0.25, 0.01 * np.eye(4))


def corridor_with_niche(niche_at: float | None) -> CostGrid:
    """A corridor of 1 m along x from 0 to 10 m, 5 cm cells, with a niche 1.4 m deep and wide."""
    cells = np.full((80, 200), 254, np.uint8)
    cells[20:40] = 0  # y from 1 to 2 m
    cells[20:24] = cells[36:40] = 253  # nearer than 0.2 m to a wall
    if niche_at is not None:
        left = round((niche_at - 0.7) / 0.05)
        cells[36:68, left : left + 28] = 253
        cells[36:64, left + 4 : left + 24] = 0
    return CostGrid(cells, 0.05, (0.0, 0.0))


def test_the_nearest_niche_behind_the_robot_is_the_passing_place():
    trail = np.column_stack([np.arange(0.5, 7.0, 0.15), np.full(44, 1.5)])
    here, faced = Pose2D(7.0, 1.5), person(8.0, 1.5)
    way = way_of(faced, here, trail)
    assert way[0].tolist() == [8.0, 1.5]
    assert way[-1].tolist() == pytest.approx([0.5, 1.5])
    place = find_passing_place(corridor_with_niche(4.0), here, [way], SCOUT, people=[faced])
    assert place is not None
    assert abs(place.x - 4.0) < 0.7
    # 0.25 m of a person, 0.33 m of the robot and 0.15 m between them
    assert place.y - 1.5 >= LEAST_BODY + SCOUT.circumscribed_radius + PASSING_ROOM - 0.05
    assert find_passing_place(corridor_with_niche(None), here, [way], SCOUT, people=[faced]) is None
    beyond = find_passing_place(corridor_with_niche(9.3), here, [way], SCOUT, people=[faced])
    assert beyond is None  # the person is in between


def test_without_a_trail_the_way_leads_straight_past_the_robot():
    way = way_of(person(2.0, 0.0), Pose2D(1.0, 0.0), np.empty((0, 2)))
    assert way == pytest.approx(np.array([[2.0, 0.0], [1.0, 0.0], [-1.0, 0.0]]))


@settings(deadline=None, max_examples=40)
@given(st.floats(0.6, 3.4), st.floats(0.6, 3.4), st.floats(0.6, 3.4), st.floats(0.6, 3.4))
def test_a_passing_place_is_free_reachable_and_off_the_way(x, y, px, py):
    if hypot(px - x, py - y) < 0.8:
        return
    cells = np.zeros((80, 80), np.uint8)
    cells[:10] = cells[-10:] = 254
    cells[:, :10] = cells[:, -10:] = 254
    costs, here, faced = CostGrid(cells, 0.05, (0.0, 0.0)), Pose2D(x, y), person(px, py)
    way = way_of(faced, here, np.empty((0, 2)))
    place = find_passing_place(costs, here, [way], SCOUT, people=[faced])
    if place is None:
        return
    assert cells[costs.cell_at(place.x, place.y)] == 0
    along = np.linspace(0.0, 1.0, 200)[:, None]
    points = np.concatenate([a + along * (b - a) for a, b in pairwise(way)])
    off = np.hypot(points[:, 0] - place.x, points[:, 1] - place.y).min()
    assert off >= LEAST_BODY + SCOUT.circumscribed_radius + PASSING_ROOM - 0.06
    assert hypot(place.x - px, place.y - py) >= faced.radius + SCOUT.inscribed_radius - 0.06


NICHE = [
    (0, 0, 10, 0), (10, 0, 10, 1), (10, 1, 3.5, 1), (3.5, 1, 3.5, 3), (3.5, 3, 1.5, 3),
    (1.5, 3, 1.5, 1), (1.5, 1, 0, 1), (0, 1, 0, 0),
]  # fmt: skip
"""A corridor of 1 m along x, with a room beside it from x = 1.5 to 3.5 m."""


def facing_somebody(walls, **settings) -> ToyDrive:
    """Somebody stands in a corridor at x = 5 m; the global costmap does not show them."""
    world = ToyWorld(walls, robot(), Pose2D(1.0, 0.5), [(5.0, 0.5, 0.25)])
    toy = ToyDrive(world, globe=ToyCostmap(ToyWorld(walls, robot())), **settings)
    toy.tracks = lambda: [person(5.0, 0.5, world.time)] if world.circles else []
    return toy


def test_somebody_who_stands_in_the_way_is_waited_for_and_then_named():
    toy = facing_somebody(room(10.0, 1.0), person_patience=6.0, give_way_attempts=0)
    task = toy.navigator.base.navigate_to(Pose2D(9.0, 0.5))
    assert toy.finish(task) is TaskStatus.FAILED
    assert task.failure.code == FailureCode.BLOCKED_BY_PERSON
    assert "a person has been in the way for 6 s, at (5.00, 0.50)" in task.failure.sentence
    # 4 m at 0.5 m/s and more, 6 s of patience: without it the drive fails after 1 + 5 s of waiting
    assert toy.world.time > 10.0


def test_the_time_of_a_person_is_not_that_of_an_obstacle():
    """Somebody leaves a thing behind: replan_patience, 1 s, and collision_patience, 5 s, for it."""
    toy = facing_somebody(
        room(10.0, 1.0), person_patience=20.0, give_way_attempts=0, person_clearance=0.0
    )
    task = toy.navigator.base.navigate_to(Pose2D(9.0, 0.5))
    toy.run(17.0)
    assert task.feedback.startswith("waiting for a person in the way")
    toy.tracks = list
    left = toy.world.time
    assert toy.finish(task) is TaskStatus.FAILED
    assert task.failure.code == FailureCode.COLLISION_AHEAD
    waited = float(re.search(r"; waited (\S+) s for it to clear", task.failure.sentence)[1])
    assert waited == pytest.approx(6.0, abs=0.11)
    assert toy.world.time - left == pytest.approx(6.0, abs=0.11)


def test_the_drive_goes_on_when_they_leave():
    toy = facing_somebody(room(10.0, 1.0), person_patience=20.0, give_way_attempts=0)
    task = toy.navigator.base.navigate_to(Pose2D(9.0, 0.5))
    toy.run(17.0)
    assert task.running
    toy.world.circles.clear()
    assert toy.finish(task) is TaskStatus.SUCCEEDED


def test_the_robot_waits_in_a_passing_place_and_goes_on():
    toy = facing_somebody(NICHE, person_patience=60.0)
    world = toy.world
    task = toy.navigator.base.navigate_to(Pose2D(9.0, 0.5))
    toy.run(40.0, lambda: world.pose.y > 1.2)
    assert "give_way" in toy.kinds()
    assert world.pose.y > 1.2
    assert task.feedback == "giving way to a person"
    world.circles.clear()  # they have passed
    assert toy.finish(task) is TaskStatus.SUCCEEDED
    assert world.pose.distance_to(Pose2D(9.0, 0.5)) < 0.3


def test_a_robot_that_waits_for_somebody_says_whom_it_waits_for():
    toy = facing_somebody(room(10.0, 1.0), person_patience=6.0, give_way_attempts=0)
    task = toy.navigator.base.navigate_to(Pose2D(9.0, 0.5))
    toy.run(2.0)
    assert toy.navigator.limitation is None
    toy.run(20.0, lambda: toy.commands[-1] == STANDSTILL)
    limitation = toy.navigator.limitation
    assert (limitation.effect, limitation.cause) == ("stopped", "person")
    # 5 m - x to the person, in the base frame
    assert limitation.at == pytest.approx((5.0 - toy.world.pose.x, 0.0), abs=0.2)
    toy.navigator.pause(toy.world.time)
    assert toy.navigator.limitation is None
    task.cancel()
    assert toy.navigator.limitation is None


def test_a_robot_at_its_passing_place_waits_for_a_person():
    toy = facing_somebody(NICHE, give_way_after=1.0)
    toy.navigator.base.navigate_to(Pose2D(9.0, 0.5))
    toy.run(40.0, lambda: toy.world.pose.y > 1.2 and toy.commands[-1] == STANDSTILL)
    toy.run(2.0)
    assert toy.navigator.limitation.detail == "waiting for a person to pass"


def test_off_its_path_the_robot_waits_for_a_new_one_while_somebody_stands_at_the_goal():
    """As couriers that park at each other's goals: one had left the way, its old path was kept."""
    world = ToyWorld(room(8.0, 6.0), robot(), Pose2D(1.0, 3.0))
    toy = ToyDrive(world, person_patience=12.0, give_way_attempts=0)
    goal = Pose2D(5.0, 3.0, pi / 2.0)
    toy.tracks = lambda: [person(5.0, 3.0, world.time)] if world.circles else []
    task = toy.navigator.base.navigate_to(goal)
    toy.run(20.0, lambda: world.pose.x > 4.0)
    world.circles.append((5.0, 3.0, 0.25))
    world.pose = Pose2D(5.0, 1.2, -pi / 2.0)  # 1.3 m from the path and on a level with its end
    toy.run(1.0)
    at = toy.world.time
    toy.commands.clear()
    assert toy.finish(task) is TaskStatus.FAILED
    assert set(toy.commands) == {STANDSTILL}  # no turn to the goal's heading here
    assert task.failure.code == FailureCode.BLOCKED_BY_PERSON  # not NO_PROGRESS after 8 s
    assert toy.world.time - at == pytest.approx(12.0, abs=1.2)


@pytest.mark.parametrize(
    ("place", "code", "seconds"),
    [
        ((6.0, 0.5), "BLOCKED_BY_PERSON", 9.0),
        ((3.0, 0.5), "NO_VALID_PATH", 2.0),
        (None, "NO_VALID_PATH", 2.0),
    ],
)
def test_who_stands_where_the_way_ends_is_waited_for(place, code, seconds):
    """Somebody at x = 7 m closes a corridor; the robot stands 6 m before them."""
    world = ToyWorld(room(14.0, 1.0), robot(), Pose2D(1.0, 0.5), [(7.0, 0.5, 0.25)])
    toy = ToyDrive(world, person_patience=9.0, give_way_attempts=0)
    toy.tracks = lambda: [person(7.0, 0.5, world.time)]
    toy.planner.fails = NavigationError(FailureCode.NO_VALID_PATH, "no path", place)
    task = toy.navigator.base.navigate_to(Pose2D(13.0, 0.5))
    assert toy.finish(task) is TaskStatus.FAILED
    assert task.failure.code == code
    assert world.time == pytest.approx(seconds, abs=1.2)


def test_a_passing_place_is_not_the_goal_of_a_drive_that_has_lost_its_path():
    """Pushed off its path where no plan is found, it gives way, and then drives to its own goal."""
    toy = facing_somebody(NICHE, patience=60.0, person_patience=60.0)
    world, free = toy.world, toy.globe
    world.circles[:] = [(1.9, 0.5, 0.25)]
    toy.tracks = lambda: [person(1.9, 0.5, world.time)]
    task = toy.navigator.base.navigate_to(Pose2D(9.0, 0.5))
    toy.run(3.0)
    assert "plan" in toy.kinds() and toy.commands[-1] == STANDSTILL
    closed = ToyCostmap(ToyWorld(NICHE, robot(), circles=[(4.2, 0.5, 0.6)]))
    toy.globe = toy.navigator.tools.global_costmap = closed
    world.circles[:] = [(2.5, 0.3, 0.25)]
    toy.tracks = lambda: [person(2.5, 0.3, world.time)] if world.circles else []
    world.pose = Pose2D(2.5, 1.25, pi / 2.0)  # 0.8 m off the path
    toy.run(12.0, lambda: world.pose.y > 1.88)
    assert "give_way" in toy.kinds() and world.pose.y > 1.88
    world.pose = replace(world.pose, heading=1.33)  # that of the place, (2.675, 1.975)
    world.circles.clear()
    toy.run(4.0)  # until it gives way no longer, and 2 s within the tolerances of the goal checker
    assert task.running and task.feedback != "giving way to a person"
    toy.globe = toy.navigator.tools.global_costmap = free
    assert toy.finish(task) is TaskStatus.SUCCEEDED
    assert world.pose.distance_to(Pose2D(9.0, 0.5)) < 0.3


TWO_NICHES = [
    (0, 0, 12, 0), (12, 0, 12, 1), (12, 1, 4.5, 1), (4.5, 1, 4.5, 2.6), (4.5, 2.6, 2.9, 2.6),
    (2.9, 2.6, 2.9, 1), (2.9, 1, 1.9, 1), (1.9, 1, 1.9, 3.2), (1.9, 3.2, 0.1, 3.2),
    (0.1, 3.2, 0.1, 1), (0.1, 1, 0, 1), (0, 1, 0, 0),
]  # fmt: skip
"""A corridor of 1 m along x, with rooms beside it from x = 0.1 to 1.9 m and 2.9 to 4.5 m."""


def test_where_somebody_goes_on_standing_the_robot_makes_more_room():
    """They do not use the room that the first niche gives: after 4 s it leaves for the other."""
    toy = facing_somebody(TWO_NICHES, person_patience=60.0, give_way_time=30.0)
    toy.navigator.base.navigate_to(Pose2D(9.0, 0.5))
    waits = []
    toy.run(60.0, lambda: toy.kinds().count("give_way") == 1)
    toy.run(60.0, lambda: waits.append(toy.world.pose.x) or toy.kinds().count("give_way") == 2)
    assert toy.kinds().count("give_way") == 2
    assert waits[-1] > 2.9  # it stood in the near one
    toy.run(15.0, lambda: toy.world.pose.y > 1.2 and toy.world.pose.x < 1.9)
    assert toy.world.pose.y > 1.2


def test_a_place_that_did_not_help_is_not_tried_again():
    costs, here, faced = corridor_with_niche(4.0), Pose2D(6.0, 1.5), person(7.5, 1.5)
    way = way_of(faced, here, np.empty((0, 2)))
    place = find_passing_place(costs, here, [way], SCOUT, people=[faced])
    assert place is not None
    again = find_passing_place(costs, here, [way], SCOUT, people=[faced], tried=[place])
    assert again is None or again.distance_to(place) > PLACES_APART - costs.resolution


def test_the_way_of_who_stands_is_where_they_walked_to():
    ways = WalkingDirections()
    ways.update([person(3.0, 1.0, velocity=(0.0, 0.5))])
    ways.update([person(3.0, 1.2)])
    assert ways.way_of(person(3.0, 1.2)) == pytest.approx(
        np.array([[3.0, 1.2], [3.0, 3.2]])  # 2 m of it
    )
    ways.update([])
    assert ways.way_of(person(3.0, 1.2)) is None


def test_a_robot_without_a_plan_gives_way_too():
    """Somebody stands before it, and on the map there is no way to the goal besides theirs."""
    toy = facing_somebody(NICHE, person_patience=60.0)
    toy.world.circles[:] = [(2.2, 0.5, 0.25)]
    toy.tracks = lambda: [person(2.2, 0.5, toy.world.time)]
    toy.globe = toy.navigator.tools.global_costmap = ToyCostmap(
        ToyWorld(NICHE, robot(), circles=[(3.0, 0.5, 0.6)])
    )
    toy.navigator.base.navigate_to(Pose2D(9.0, 0.5))
    toy.run(10.0, lambda: "give_way" in toy.kinds())
    assert "give_way" in toy.kinds()


def standing(x, y, time, radius=0.25) -> StandingObject:
    """Somebody or something that has stood there since it was seen first."""
    return StandingObject(7, time, (x, y), (0.0, 0.0), radius, 0.01 * np.eye(4))


def before_what_stands(radius=0.25, **settings) -> ToyDrive:
    """Something stands in the corridor at x = 2.2 m, and there is no way past it."""
    toy = facing_somebody(NICHE, **settings)
    world = toy.world
    world.circles[:] = [(2.2, 0.5, 0.25)]
    toy.tracks = list
    toy.standing = lambda: [standing(2.2, 0.5, world.time, radius)] if world.circles else []
    toy.planner.fails = NavigationError(FailureCode.NO_VALID_PATH, "no path", (2.2, 0.5))
    return toy


@pytest.mark.parametrize("goes_at", [0.2, 1.0, 4.0])
def test_who_stood_already_when_seen_first_gets_room(goes_at):
    """A polite person in a doorway is no track: they wait until the robot has left their way."""
    toy = before_what_stands()
    world = toy.world
    task = toy.navigator.base.navigate_to(Pose2D(9.0, 0.5))
    toy.run(10.0, lambda: "give_way" in toy.kinds())
    assert "give_way" in toy.kinds() and task.running
    toy.run(goes_at)
    world.circles.clear()
    toy.planner.fails = None
    toy.run(2.0, lambda: task.feedback != "giving way to a person")
    assert task.feedback != "giving way to a person"
    assert toy.finish(task) is TaskStatus.SUCCEEDED


@pytest.mark.parametrize(
    ("radius", "settings", "latest"),
    [
        # 4 s + 15 s of give_way_after and give_way_time, then 2 s of patience
        (0.25, {}, 22.0),
        (0.25, {"give_way_after": 1.0, "give_way_time": 5.0}, 9.0),
        (0.5, {}, 3.5),  # larger than a person
        (0.25, {"give_way_attempts": 0}, 3.5),
    ],
)
def test_what_stays_when_it_has_room_is_a_thing(radius, settings, latest):
    toy = before_what_stands(radius, **settings)
    task = toy.navigator.base.navigate_to(Pose2D(9.0, 0.5))
    assert toy.finish(task) is TaskStatus.FAILED
    assert task.failure.code == FailureCode.NO_VALID_PATH  # and not BLOCKED_BY_PERSON
    assert toy.world.time <= latest


def test_things_beside_the_way_delay_nobody():
    """A robot that gets on gives way to nothing that stands."""
    toy = facing_somebody(room(10.0, 3.0))
    toy.world.circles[:] = [(3.0, 2.0, 0.25), (5.0, 2.0, 0.25)]
    toy.tracks = list
    toy.standing = lambda: [
        replace(standing(x, y, toy.world.time), id=n)
        for n, (x, y, _) in enumerate(toy.world.circles)
    ]
    task = toy.navigator.base.navigate_to(Pose2D(9.0, 0.5))
    assert toy.finish(task) is TaskStatus.SUCCEEDED
    assert "give_way" not in toy.kinds()


def test_who_stood_while_there_was_no_plan_has_stood_for_that_time():
    toy = facing_somebody(room(10.0, 1.0), person_patience=20.0, give_way_attempts=0)
    toy.world.circles[:] = [(2.4, 0.5, 0.25)]
    toy.tracks = lambda: [person(2.4, 0.5, toy.world.time)]
    toy.planner.fails = NavigationError(FailureCode.NO_VALID_PATH, "no path", (2.4, 0.5))
    toy.navigator.base.navigate_to(Pose2D(9.0, 0.5))
    toy.run(4.0)
    toy.planner.fails = None
    toy.run(3.0, lambda: "plan" in toy.kinds())
    standoff = toy.navigator.activities.current.drive._follower.standoff
    # The first plan failed in the first half second.
    assert standoff.stood(toy.world.time) == pytest.approx(toy.world.time, abs=0.5)


def test_a_pause_holds_the_drive_to_a_passing_place_too():
    toy = facing_somebody(NICHE, person_patience=60.0)
    world = toy.world
    task = toy.navigator.base.navigate_to(Pose2D(9.0, 0.5))
    toy.run(40.0, lambda: "give_way" in toy.kinds())
    toy.navigator.pause(world.time)
    toy.run(20.0)  # longer than give_way_time
    toy.navigator.resume(world.time)
    toy.run(15.0, lambda: world.pose.y > 1.2)
    assert world.pose.y > 1.2
    toy.navigator.cancel_all()
    assert task.status is TaskStatus.CANCELLED


@pytest.mark.parametrize(("speed", "seconds"), [(0.0, 4.0), (0.3, 8.0)])
def test_who_still_moves_may_get_past_before_the_robot_gives_way(speed, seconds):
    """4 s, the default of `give_way_after`, for somebody who waits; twice as long otherwise."""
    toy = facing_somebody(NICHE, person_patience=60.0)
    world, faced_at = toy.world, []

    def tracks():
        sway = speed * (1.0 if round(world.time / world.period) % 2 else -1.0)
        here = [person(5.0, 0.5, world.time, velocity=(0.0, sway))]
        if not faced_at and 5.0 - world.pose.x <= 1.5 + 0.25:  # PERSON_DISTANCE, to the surface
            faced_at.append(world.time)
        return here

    toy.tracks = tracks
    toy.navigator.base.navigate_to(Pose2D(9.0, 0.5))
    toy.run(40.0, lambda: "give_way" in toy.kinds())
    # The count begins again with each 0.5 m of way, three times from 1.5 m to the person, in 5.1 s:
    # the robot creeps up to them.
    assert seconds <= world.time - faced_at[0] <= seconds + 5.5


def test_giving_way_ends_on_the_way_if_the_person_has_passed():
    toy = facing_somebody(NICHE, person_patience=60.0)
    world = toy.world
    task = toy.navigator.base.navigate_to(Pose2D(9.0, 0.5))
    toy.run(40.0, lambda: "give_way" in toy.kinds())
    toy.run(1.0)
    assert world.pose.y < 0.8  # not in the niche, which begins at 1 m
    world.circles.clear()
    # 0.5 s without anybody in front, after 1 s in which the track is still known
    assert toy.run(3.0, lambda: task.feedback != "giving way to a person") < 2.0
    highest = []
    toy.run(60.0, lambda: highest.append(world.pose.y) or not task.running)
    assert task.status is TaskStatus.SUCCEEDED
    assert max(highest) < 1.0


def test_the_controller_does_not_see_who_is_evaded():
    """Somebody 1 m ahead: the robot brakes in time for an obstacle, at 0.3 to 0.4 m/s after 1 s."""

    def top_speed(evaded):
        world = ToyWorld(room(10.0, 6.0), robot(), Pose2D(1.0, 3.0), [(2.0, 3.0, 0.25)])
        toy = ToyDrive(world)
        toy.navigator.evasion.configure(EvasionParameters(when="never"))
        toy.local = toy.navigator.tools.local_costmap = ToyCostmap(
            ToyWorld(room(10.0, 6.0), robot())
        )
        toy.globe = toy.navigator.tools.global_costmap = toy.local
        toy.tracks = lambda: [person(2.0, 3.0, world.time)]
        toy.evaded = toy.tracks if evaded else list
        toy.navigator.base.navigate_to(Pose2D(5.0, 3.0))
        toy.run(1.0)
        return max(twist.linear for twist in toy.commands)

    assert top_speed(evaded=True) > 1.5 * top_speed(evaded=False)


def test_who_walks_away_behind_the_robot_is_not_waited_for():
    # The person who was faced has gone past the robot and walks on along the corridor behind it.
    toy = facing_somebody(NICHE, person_patience=60.0)
    world = toy.world
    task = toy.navigator.base.navigate_to(Pose2D(9.0, 0.5))
    toy.run(40.0, lambda: world.pose.y > 1.2)
    world.circles.clear()
    toy.tracks = lambda: [person(0.4, 0.5, world.time)]
    # Into the niche in strokes 5 s, turned round and out of it 4 s; 15 s is the longest wait.
    assert toy.run(20.0, lambda: world.pose.y < 1.0) < 12.0
    assert toy.finish(task) is TaskStatus.SUCCEEDED


def corridor_between_rooms() -> CostGrid:
    """Two rooms of 4 by 4 m, joined by a corridor of 1 m width from x = 4 to x = 12 m."""
    cells = np.full((80, 320), 254, np.uint8)
    cells[2:78, 2:80] = cells[2:78, 240:318] = 0
    cells[30:50, 80:240] = 0
    return CostGrid(cells, 0.05, (0.0, 0.0))


AHEAD = np.column_stack([np.arange(1.5, 14.0, 0.1), np.full(125, 2.0)])


@pytest.mark.parametrize(
    ("at", "velocity", "meets"),
    [
        ((9.5, 2.0), (-1.0, 0.0), True),  # in the corridor: they meet at x = 1.5 + 8 * 0.4 / 1.4
        ((9.5, 2.0), (1.0, 0.0), False),  # walks on ahead
        ((9.5, 2.0), (0.0, 0.0), False),  # stands
        ((9.5, 2.3), (-0.7, 0.7), True),  # cos 45 deg of the speed is the least that comes
        ((9.5, 2.3), (-0.5, 0.8), False),  # crosses the way
        ((3.5, 2.0), (-1.0, 0.0), False),  # they meet in the room
    ],
)
def test_a_meeting_counts_if_it_comes_where_two_cannot_pass(at, velocity, meets):
    faced = person(*at, velocity=velocity)
    found = find_narrow_meeting(corridor_between_rooms(), AHEAD, [faced], 0.0, SCOUT)
    assert (found is not None) == meets
    if found is not None:
        assert found.seconds == pytest.approx(8.0 / -velocity[0], rel=0.02)
        assert found.way[0] == pytest.approx((9.5, 2.0), abs=0.06)
        assert found.way[-1] == pytest.approx((1.5, 2.0))


def test_the_width_across_a_path_is_that_between_the_walls():
    costs, middle = corridor_between_rooms(), np.array([60.0])  # x = 7.5 m
    assert widths_across(costs, AHEAD, middle, 3.0) == pytest.approx(1.0, abs=0.06)
    aside = AHEAD + np.array([0.0, 0.3])
    assert widths_across(costs, aside, middle, 3.0) == pytest.approx(1.0, abs=0.06)
    assert widths_across(costs, AHEAD, np.array([5.0]), 3.0) == 3.0  # the room is wider


def test_a_door_is_no_narrow_passage():
    """A wall of 20 cm with a door of 0.9 m: who comes is through it before the robot is there."""
    cells = np.zeros((80, 320), np.uint8)
    cells[:, 120:124] = 254
    cells[31:49, 120:124] = 0
    costs = CostGrid(cells, 0.05, (0.0, 0.0))
    faced = person(9.5, 2.0, velocity=(-0.4, 0.0))  # at the same speed: they meet at x = 5.5
    assert find_narrow_meeting(costs, AHEAD + np.array([0.5, 0.0]), [faced], 0.4, SCOUT) is None
    cells[:, 100:140] = 254
    cells[31:49, 100:140] = 0  # a wall of 2 m
    assert find_narrow_meeting(costs, AHEAD + np.array([0.5, 0.0]), [faced], 0.4, SCOUT) is not None


def test_a_door_around_the_robot_is_no_narrow_passage():
    """It is as short as one ahead; what is behind the robot is not on its path."""
    cells = np.zeros((80, 320), np.uint8)
    cells[:, 28:32] = 254
    cells[31:49, 28:32] = 0  # a wall from x = 1.4 to 1.6 m; the path begins at 1.5 m
    costs = CostGrid(cells, 0.05, (0.0, 0.0))
    faced = person(3.2, 2.0, velocity=(-1.0, 0.0))
    assert find_narrow_meeting(costs, AHEAD, [faced], 0.4, SCOUT) is None


def test_the_robot_lets_somebody_out_of_a_narrow_passage():
    # A room of 3 by 3 m and a corridor of 1 m: somebody comes out of it at 0.8 m/s.
    walls = [
        (0, 0, 3, 0), (3, 0, 3, 1), (3, 1, 12, 1), (12, 1, 12, 2), (12, 2, 3, 2), (3, 2, 3, 3),
        (3, 3, 0, 3), (0, 3, 0, 0),
    ]  # fmt: skip
    world = ToyWorld(walls, robot(), Pose2D(1.0, 1.5))
    toy = ToyDrive(world)
    toy.tracks = lambda: [person(8.5 - 0.8 * world.time, 1.5, world.time, velocity=(-0.8, 0.0))]
    task = toy.navigator.base.navigate_to(Pose2D(10.0, 1.5))
    toy.run(4.0, lambda: "give_way" in toy.kinds())
    assert "out of a narrow corridor" in toy.events[toy.kinds().index("give_way")][1]
    toy.run(7.0 - world.time)  # they come out of the corridor, 2.9 m along x
    assert abs(world.pose.y - 1.5) > 0.6
    toy.tracks = list
    assert toy.finish(task) is TaskStatus.SUCCEEDED


def test_a_robot_that_has_evaded_somebody_plans_from_where_it_is():
    """It would first turn back to its path, or turn to the goal's heading beside the goal."""
    toy = ToyDrive(ToyWorld(room(10.0, 6.0), robot(), Pose2D(1.0, 3.0)))
    goal, walk = Pose2D(5.0, 3.0, pi), -0.8
    toy.tracks = lambda: [person(9.0 + walk * toy.world.time, 2.8, toy.world.time, (walk, 0.0))]
    task = toy.navigator.base.navigate_to(goal)
    assert toy.finish(task) is TaskStatus.SUCCEEDED, task.failure
    reasons = [fields["reason"] for kind, _, fields in toy.events if kind == "replan"]
    assert "evasion" in toy.kinds()
    assert any(reason.endswith("m beside the path after an evasion") for reason in reasons), reasons
    assert toy.world.pose.distance_to(goal) < 0.03

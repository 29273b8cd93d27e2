"""Goals to which no way leads: found, without false alarms in passages just wide enough."""

from dataclasses import replace
from math import pi
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from missions.execution.fit.reachability import ReachableFloor
from missions.execution.resources import load_robot
from missions.inspection.diagnosis import findings_of
from stack.sim.worlds.world import Box, Cylinder, Door, Trigger, Wall, World, WorldEvent
from stack.types import Pose2D

SCOUT = load_robot("scout", Path())  # round: inscribed radius 0.22 m; 0.38 m high
WIDTH = 2 * SCOUT.footprint.inscribed_radius
START, GOAL = Pose2D(-1.5, 0.0), Pose2D(1.5, 0.0)


def divided(gap=0.0, heading=0.0, shift=0.0, **things):
    """A closed room, 6 x 6 m, with a wall across it that leaves a gap in its middle."""
    corners = np.array([[-3, -3], [3, -3], [3, 3], [-3, 3], [-3, -3]], dtype=float)
    sides = [np.array([[0.0, side * gap / 2], [0.0, side * 3.0]]) for side in (-1, 1)]
    turn = Pose2D(shift, shift / 2, heading)
    walls = [turn.transform(points) for points in (corners, *sides)]
    walls[0][-1] = walls[0][0]
    things = {"start": START, **things}
    return World("room", (-5.0, -5.0, 5.0, 5.0), tuple(map(Wall, walls)), **things)


def reaches(world, goal=GOAL, start=START, tolerance=0.2, robot=SCOUT):
    return ReachableFloor(world, robot, start).reaches(goal, tolerance)


def turned(pose, heading, shift):
    return Pose2D(shift, shift / 2, heading).compose(pose)


@settings(deadline=None, max_examples=60)
@given(heading=st.floats(-pi, pi), shift=st.floats(0.0, 0.1))
@example(heading=0.0, shift=0.0)
@example(heading=0.0, shift=0.025)
@example(heading=pi / 4, shift=0.0)
def test_a_passage_as_wide_as_the_robot_is_open_and_one_8_cm_narrower_closed(heading, shift):
    # A grid of 5 cm cells is exact to half a diagonal, 3.54 cm, on each side: 7.1 cm.
    start, goal = (turned(pose, heading, shift) for pose in (START, GOAL))
    assert reaches(divided(WIDTH, heading, shift), goal, start)
    assert not reaches(divided(WIDTH - 0.08, heading, shift), goal, start)


def test_walls_boxes_and_cylinders_close_a_passage():
    assert reaches(divided(1.0))
    assert not reaches(divided())
    assert not reaches(divided(1.0, boxes=(Box(Pose2D(0.0, 0.0), (0.2, 0.6, 0.5)),)))
    assert not reaches(divided(1.0, cylinders=(Cylinder(0.0, 0.0, 0.3, on_map=False),)))


def test_a_closed_door_is_open_and_a_box_above_the_robot_no_obstacle():
    door = Door("gate", (0.0, -0.5), (0.0, 0.5), closed=True)
    assert reaches(divided(1.0, doors=(door,)))
    beam = Box(Pose2D(0.0, 0.0), (0.2, 1.0, 0.2), elevation=0.38)
    assert reaches(divided(1.0, boxes=(beam,)))
    assert not reaches(divided(1.0, boxes=(replace(beam, elevation=0.37),)))


def test_where_the_timeline_moves_the_robot_it_can_be():
    lifted = WorldEvent(Trigger(time=5.0), move_robot=Pose2D(2.0, 2.0))
    assert reaches(divided(timeline=(lifted,)))
    assert not reaches(divided(timeline=(replace(lifted, move_robot=Pose2D(-2.0, 2.0)),)))


def test_a_goal_within_the_tolerance_of_the_floor_is_reached():
    # The robot's middle reaches x = -0.27 before the wall, 0.1 m thick, and stands at 0.35 behind.
    near = Pose2D(0.35, 0.0)
    assert reaches(divided(), near, tolerance=0.63)
    assert not reaches(divided(), near, tolerance=0.5)


def test_the_nearest_place_has_room_to_turn_there():
    x, y = ReachableFloor(divided(), SCOUT, START).nearest(GOAL)
    # Half a wall, the circumscribed radius and 6 cm of room; then the middle of the next cell.
    least = 0.05 + SCOUT.footprint.circumscribed_radius + 0.06
    assert -least - 0.05 <= x <= -least
    assert abs(y) <= 0.025 + 1e-9


def test_from_a_start_in_an_obstacle_everything_counts_as_reachable():
    assert reaches(divided(), start=Pose2D(0.0, 1.0))


def test_in_a_large_world_cells_grow_and_walls_stay_closed():
    # 100 x 100 m: cells of 0.1 m, which leave 0.22 - 0.071 m of the radius.
    assert not reaches(replace(divided(), bounds=(-50.0, -50.0, 50.0, 50.0)))
    # In a square of 1 km no radius is left: everything counts as reachable.
    assert reaches(replace(divided(), bounds=(-500.0, -500.0, 500.0, 500.0)))


def found_in(folder, run, head="world: office\nstart: dock\n"):
    file = folder / "mission.yaml"
    file.write_text(f"mission: m\nrobot: scout\n{head}run: {run}\n", "utf-8")
    return findings_of(file)


def test_a_goal_outside_the_building_names_start_width_and_the_nearest_place(tmp_path):
    (found,) = found_in(tmp_path, "{navigate_to_pose: [14.4, 5.0]}")
    assert (found.code, found.severity) == ("W143", "warning")
    assert (found.mark.line, found.mark.column) == (5, 25)
    assert found.sentence.startswith(
        "no way leads from the start (0.8, 5) to the goal (14.4, 5): scout is 0.44 m wide; "
        "the nearest place that it can reach is (13."
    )
    # what is suggested has no finding itself
    place = found.sentence.rpartition("(")[2].rstrip(")")
    assert found_in(tmp_path, f"{{navigate_to_pose: [{place}]}}") == ()


@pytest.mark.parametrize(
    "ports",
    ["{goal: [14.4, 5.0], partial: true}", "{goal: [14.4, 5.0], tolerance: 1 m}"],
)
def test_a_goal_that_need_not_be_reached_exactly_is_no_finding(tmp_path, ports):
    assert found_in(tmp_path, f"{{navigate_to_pose: {ports}}}") == ()


def test_a_goal_with_an_error_has_no_second_finding(tmp_path):
    (found,) = found_in(tmp_path, "{navigate_to_pose: [14.25, 5.0]}")
    assert found.code == "E181"


def test_without_a_map_goals_are_not_in_the_world(tmp_path):
    head = "world: office\nstart: dock\nmap: none\n"
    assert found_in(tmp_path, "{navigate_to_pose: [14.4, 5.0]}", head) == ()


def test_each_goal_of_a_list_is_found_where_it_stands(tmp_path):
    run = "{follow_waypoints: [[2.0, 5.0], [14.4, 5.0], [5.0, 10.4]]}"
    found = found_in(tmp_path, run)
    assert [(item.code, item.mark.column) for item in found] == [("W143", 38), ("W143", 51)]

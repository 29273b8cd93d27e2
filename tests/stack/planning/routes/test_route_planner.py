"""Plans along lanes on an open floor of 12 x 8 m, and their rules."""

import json
from dataclasses import replace
from math import hypot, pi
from pathlib import Path as FilePath

import numpy as np
import pytest

from stack.components import CancelToken, PlanOptions
from stack.drivetrain.ackermann import SteeredWheels
from stack.drivetrain.description import RobotDescription
from stack.drivetrain.differential import Wheels
from stack.drivetrain.limits import Limits
from stack.errors import NavigationError, ParameterError
from stack.planning.routes.parameters import RouteParameters
from stack.planning.routes.planner import Route
from stack.types import LETHAL_COST, CostGrid, FailureCode, Footprint, Pose2D
from tests.stack.planning.routes.test_geojson import collection, edge, node

ROBOT = RobotDescription(
    "round", Footprint.circle(0.22), 0.4, FilePath("none.urdf"), Wheels((), (), 0.05, 0.3),
    limits=Limits(linear_speed=1.0),
)  # fmt: skip
RES = 0.05
A, B, C, D = (1.0, 1.0), (11.0, 1.0), (11.0, 7.0), (1.0, 7.0)
"""Corners of a ring of lanes: a to b is 10 m, b to c 6 m."""


def lane(name, ends, **given):
    places = {"a": A, "b": B, "c": C, "d": D}
    return edge(name, *ends, [places[end] for end in ends], **given)


@pytest.fixture
def planner(tmp_path):
    def make(*, robot=ROBOT, rules=None, **parameters):
        rules = rules or {}
        lanes = [lane(name, name, **rules.get(name, {})) for name in ("ab", "bc", "cd", "da")]
        nodes = [node(name, *place) for name, place in zip("abcd", (A, B, C, D), strict=True)]
        file = tmp_path / "ring.geojson"
        file.write_text(json.dumps(collection(*nodes, *lanes)))
        return Route(RouteParameters(graph=str(file), **parameters), robot)

    return make


def floor(*boxes):
    """Costs of an open floor; boxes (x, y, half a side) are lethal, inscribed 0.22 m around."""
    cells = np.zeros((160, 240), dtype=np.uint8)
    for x, y, half in boxes:
        for reach, cost in ((half + 0.22, 253), (half, LETHAL_COST)):
            rows = slice(max(0, round((y - reach) / RES)), round((y + reach) / RES))
            columns = slice(max(0, round((x - reach) / RES)), round((x + reach) / RES))
            cells[rows, columns] = cost
    return CostGrid(cells, RES)


def passes(path, place, within=0.5):
    return bool((np.hypot(*(path.points[:, :2] - place).T) < within).any())


def off_the_ring(path):
    """(n,) metres from each point to the ring."""
    x, y = path.points[:, 0], path.points[:, 1]
    sides = np.minimum(np.abs(x - 1.0), np.abs(x - 11.0)), np.minimum(abs(y - 1.0), abs(y - 7.0))
    return np.minimum(*sides)


def test_the_path_follows_the_lanes(planner):
    path = planner().plan(floor(), Pose2D(1.0, 1.2), Pose2D(11.0, 6.8, pi))
    # 0.2 m down to a, along, up to 0.2 m below c: 0.2 + 10 + 5.8, less the rounded corner at b
    assert 15.2 < path.length < 16.1
    assert passes(path, B) and not passes(path, (6.0, 4.0), within=2.0)
    assert off_the_ring(path).max() < 0.25  # half the distance from a corner to its parabola
    steps = np.hypot(*np.diff(path.points[:, :2], axis=0).T)
    assert steps.max() < 0.08
    assert (path.points[0, 0], path.points[0, 1]) == (1.0, 1.2)
    assert path.points[-1] == pytest.approx([11.0, 6.8, pi])


def test_entries_and_exits_from_the_middle_of_the_floor_are_short(planner):
    path = planner().plan(floor(), Pose2D(3.0, 3.0), Pose2D(10.0, 5.0))
    assert off_the_ring(path).max() == pytest.approx(2.0, abs=0.1)  # where it begins
    assert passes(path, (8.0, 1.0)) and passes(path, (11.0, 3.0))


def test_close_goals_are_reached_without_lanes(planner):
    path = planner().plan(floor(), Pose2D(5.0, 4.0), Pose2D(6.0, 4.0))
    assert path.length == pytest.approx(1.0, abs=0.05)


def test_one_way_lanes_are_respected(planner):
    back = planner(rules={"ab": {"one_way": True}}).plan(
        floor(), Pose2D(9.0, 1.0), Pose2D(3.0, 1.0)
    )
    # not 6 m against the arrow, but 2 + 6 + 10 + 6 + 2 m round the ring, less rounded corners
    assert 24.0 < back.length < 26.2
    on = planner(rules={"ab": {"one_way": True}}).plan(floor(), Pose2D(3.0, 1.0), Pose2D(9.0, 1.0))
    assert on.length == pytest.approx(6.0, abs=0.05)


def test_closures_are_respected_and_change_in_a_copy(planner):
    open_, ends = planner(), (Pose2D(*A), Pose2D(*B))
    closed = open_.with_edge("ab", closed=True)
    assert open_.plan(floor(), *ends).length == pytest.approx(10.0, abs=0.05)
    assert closed.plan(floor(), *ends).length > 20.0
    again = closed.with_edge("ab", closed=False)
    assert again.plan(floor(), *ends).length == pytest.approx(10.0, abs=0.05)


def test_no_connection_replaces_a_closed_lane(planner):
    ring = planner(rules={"ab": {"closed": True}, "cd": {"closed": True}})
    with pytest.raises(NavigationError) as raised:
        ring.plan(floor(), Pose2D(1.0, 4.0), Pose2D(11.0, 4.0))
    failure = raised.value.failure
    assert failure.code == FailureCode.NO_VALID_PATH
    assert failure.sentence == (
        "no path on the route graph from (1.00, 4.00) to (11.00, 4.00): nearest to the start is "
        "node a, 3.00 m away; nearest to the goal is node b, 3.00 m away; closed: ab, cd"
    )


def test_time_prefers_the_long_way_round_a_slow_lane_and_distance_does_not(planner):
    slow = {"ab": {"speed": 0.2}}  # 50 s for 10 m, against 22 m at 1 m/s
    ends = (Pose2D(*A), Pose2D(*B))
    assert planner(rules=slow, cost="time").plan(floor(), *ends).length > 20.0
    assert planner(rules=slow, cost="distance").plan(floor(), *ends).length < 10.1


def test_a_weight_makes_a_lane_expensive(planner):
    heavy = {"ab": {"weight": 3.0}}  # counts as 30 m, against 22 m
    ends = (Pose2D(*A), Pose2D(*B))
    assert planner(rules=heavy, cost="distance").plan(floor(), *ends).length > 20.0
    light = {"ab": {"weight": 2.0}}  # 20 m
    assert planner(rules=light, cost="distance").plan(floor(), *ends).length < 10.1


def test_speed_limits_apply_on_their_lane(planner):
    slow = {"bc": {"speed": "30 %"}}
    path = planner(rules=slow).plan(floor(), Pose2D(6.0, 1.0), Pose2D(11.0, 4.0))
    limited = np.isfinite(path.speed_limits)
    assert set(path.speed_limits[limited]) == {0.3}  # 30 % of 1 m/s
    assert limited[-1] and not limited[0]  # also where the path leaves it
    assert (path.points[~limited, 1] < 1.3).all()
    assert planner().plan(floor(), Pose2D(6.0, 1.0), Pose2D(11.0, 4.0)).speed_limits is None


def test_a_goal_on_a_closed_lane_is_not_reached_from_the_next_open_lane(planner):
    ring = planner(rules={"bc": {"closed": True}})
    with pytest.raises(NavigationError, match="closed: bc"):
        ring.plan(floor(), Pose2D(6.0, 1.0), Pose2D(11.0, 4.5))  # 2.5 m from c, 3.5 m from b


def test_a_start_on_a_closed_lane_may_leave_it(planner):
    ring = planner(rules={"bc": {"closed": True}})
    path = ring.plan(floor(), Pose2D(11.0, 4.5), Pose2D(2.0, 7.0))
    assert path.length < 12.0


def test_an_obstacle_on_a_lane_is_avoided_by_a_short_detour(planner):
    path = planner().plan(floor((6.0, 1.0, 0.3)), Pose2D(2.0, 1.0), Pose2D(10.0, 1.0))
    assert path.length < 9.5
    away = np.hypot(path.points[:, 0] - 6.0, path.points[:, 1] - 1.0)
    assert away.min() > 0.45  # half a side of the box and half the robot
    beyond = np.abs(path.points[:, 0] - 6.0) > 1.6
    assert off_the_ring(path)[beyond].max() < 0.05  # back on the lane


def test_without_detours_an_obstacle_is_avoided_by_other_lanes(planner):
    path = planner(detour=0.0).plan(floor((6.0, 1.0, 0.3)), Pose2D(2.0, 1.0), Pose2D(10.0, 1.0))
    assert path.length > 20.0
    assert passes(path, (6.0, 7.0))


def test_an_obstacle_on_a_node_is_avoided(planner):
    box = floor((11.0, 1.0, 0.3))
    path = planner().plan(box, Pose2D(6.0, 1.0), Pose2D(11.0, 6.0))
    assert path.length < 12.0
    assert np.hypot(*(path.points[:, :2] - B).T).min() > 0.45


def test_a_wall_across_a_lane_is_avoided_by_other_lanes(planner):
    wall = floor(*[(6.0, y, 0.1) for y in np.arange(0.1, 5.0, 0.1)])
    path = planner().plan(wall, Pose2D(2.0, 1.0), Pose2D(10.0, 1.0))
    assert passes(path, (6.0, 7.0)) and path.length > 20.0


def test_a_robot_on_a_lane_drives_on_along_it(planner):
    """Replanning during the drive must neither turn the robot around nor leave the lane."""
    path = planner().plan(floor(), Pose2D(5.02, 1.06), Pose2D(10.0, 1.0))
    headings = path.points[:-1, 2]
    assert np.abs(headings).max() < 0.35
    assert path.length == pytest.approx(5.0, abs=0.05)


def test_corners_of_cars_have_their_turning_radius(planner):
    wheels = SteeredWheels(("l", "r"), ("a", "b"), 0.1, 0.5, 0.4, 0.5, 1.0)
    car = replace(ROBOT, wheels=wheels)
    path = planner(robot=car).plan(floor(), Pose2D(5.0, 1.0, 0.0), Pose2D(11.0, 5.0, pi / 2))
    near = np.hypot(*(path.points[:, :2] - B).T) < 1.6
    turns = np.abs(np.diff(np.unwrap(path.points[near, 2])))
    steps = np.hypot(*np.diff(path.points[near, :2], axis=0).T)
    radius = 1.0 / np.convolve(turns / steps, np.ones(5) / 5, "valid").max()
    assert car.turning_radius == pytest.approx(0.915, abs=0.001)  # 0.5 / tan 0.5
    assert radius > 0.95 * car.turning_radius


def test_invalid_goals_and_starts_have_their_own_codes(planner):
    box = floor((3.0, 3.0, 0.8))
    for ends, code in (
        ((Pose2D(2.0, 1.0), Pose2D(3.0, 3.0)), FailureCode.GOAL_OCCUPIED),
        ((Pose2D(3.0, 3.0), Pose2D(2.0, 1.0)), FailureCode.START_OCCUPIED),
        ((Pose2D(2.0, 1.0), Pose2D(30.0, 3.0)), FailureCode.GOAL_OUTSIDE_MAP),
    ):
        with pytest.raises(NavigationError) as raised:
            planner().plan(box, *ends)
        assert raised.value.failure.code == code


def test_a_cancelled_plan_stops(planner):
    cancel = CancelToken()
    cancel.request()
    with pytest.raises(NavigationError) as error:
        planner().plan(floor(), Pose2D(2.0, 2.0), Pose2D(10.0, 6.0), PlanOptions(cancel=cancel))
    assert error.value.failure.code == FailureCode.CANCELLED


def test_it_needs_a_graph_and_another_planner(planner):
    with pytest.raises(ParameterError, match="route needs a route graph"):
        Route(RouteParameters(), ROBOT)
    with pytest.raises(ParameterError, match="cannot connect to its own lanes"):
        planner(connect="route")


@pytest.mark.parametrize("seed", range(12))
def test_plans_between_random_places_are_complete_and_collision_free(planner, seed):
    random = np.random.default_rng(seed)
    boxes = [(*random.uniform((2, 2), (10, 6)), 0.4) for _ in range(3)]
    boxes.append((random.uniform(3, 9), 1.0, 0.2))
    costs, route = floor(*boxes), planner()
    done = 0
    while done < 4:
        ends = random.uniform((0.5, 0.5), (11.5, 7.5), size=(2, 2))
        cells = [costs.cells[costs.cell_at(*end)] for end in ends]
        if max(cells) >= 253:
            continue
        done += 1
        path = route.plan(costs, Pose2D(*ends[0]), Pose2D(*ends[1]))
        points = path.points[:, :2]
        assert hypot(*(points[0] - ends[0])) < 1e-9 and hypot(*(points[-1] - ends[1])) < 1e-9
        assert np.hypot(*np.diff(points, axis=0).T).max() < 0.11
        rows, columns = ((points[:, ::-1]) // RES).astype(int).T
        assert (costs.cells[rows, columns] < 253).all()

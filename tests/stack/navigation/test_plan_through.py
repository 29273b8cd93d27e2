"""Plans and drives through many poses, with every planner."""

from math import pi

import numpy as np
import pytest

from stack.components import choose
from stack.costmap.costmap import Costmap
from stack.costmap.parameters import CostmapParameters
from stack.errors import NavigationError
from stack.navigation.plans.planner_worker import PlanRequest, plan_through
from stack.types import LETHAL_COST, CostGrid, Pose2D, TaskStatus, wrap_angle
from tests.stack.navigation.toy_world import ToyWorld, robot, room
from tests.stack.planning.footprint_check import first_blocked, footprint_cost
from tests.stack.planning.office_maps import office
from tests.stack.planning.test_pose_planners import directions_of

ROBOT = robot()
PLANNERS = ("astar", "theta_star", "hybrid_astar", "lattice")
OF_POSES = ("hybrid_astar", "lattice")
VIAS = (Pose2D(3.0, 1.2, 0.0), Pose2D(5.0, 2.0, pi / 4), Pose2D(6.8, 3.8, pi / 2))
END = Pose2D(4.0, 5.0, pi)


def planner(name, **values):
    choice = choose("planner", name, {"tolerance": 0.0, **values})
    return choice.component(choice.parameters, ROBOT)


def at(plan, metres):
    """The pose at a distance along a plan, and the steps into and out of it."""
    points = plan.path.points
    along = np.append(0.0, np.cumsum(np.hypot(*np.diff(points[:, :2], axis=0).T)))
    index = int(np.argmin(np.abs(along - metres)))
    into, out = points[index, :2] - points[index - 1, :2], points[index + 1, :2] - points[index, :2]
    return points[index], into, out


@pytest.mark.parametrize("name", PLANNERS)
def test_a_plan_leads_through_every_pose(name):
    costs = CostGrid(np.zeros((140, 180), dtype=np.uint8), 0.05)
    request = PlanRequest(costs, Pose2D(1.0, 1.0, 0.0), (*VIAS, END))
    plan = plan_through(planner(name), request)
    assert len(plan.leg_ends) == 4 and plan.leg_ends[-1] == pytest.approx(plan.path.length)
    for via, end in zip(VIAS, plan.leg_ends, strict=False):
        pose, into, out = at(plan, end)
        assert pose[:2] == pytest.approx([via.x, via.y], abs=1e-6)
        if name in OF_POSES:
            assert into @ out > 0.0  # no cusp
            assert abs(wrap_angle(pose[2] - via.heading)) < 1e-6
            forward = np.array([np.cos(via.heading), np.sin(via.heading)])
            for step in (into, out):  # smooth: the join lies on one curve
                assert step @ forward / np.hypot(*step) > np.cos(0.15)


@pytest.mark.parametrize("name", PLANNERS)
def test_plans_through_rooms_touch_nothing(name):
    costs = Costmap(CostmapParameters(), ROBOT.footprint, office(200, 3)).grid
    random, planned = np.random.default_rng(3), 0
    roomy = np.argwhere(costs.cells == 0)
    made = planner(name)
    for _ in range(4):
        poses = [
            Pose2D(*costs.centre_of(*roomy[n]), random.uniform(-3.1, 3.1))
            for n in random.integers(0, len(roomy), 4)
        ]
        if any(footprint_cost(costs, ROBOT.footprint, pose) >= LETHAL_COST for pose in poses):
            continue
        try:
            plan = plan_through(made, PlanRequest(costs, poses[0], tuple(poses[1:])))
        except NavigationError as error:
            assert error.failure.code == "NO_VALID_PATH"
            continue
        planned += 1
        for pose, end in zip(poses[1:-1], plan.leg_ends, strict=False):
            assert at(plan, end)[0][:2] == pytest.approx([pose.x, pose.y], abs=1e-6)
        if name in OF_POSES:
            assert first_blocked(costs, plan.path.points, ROBOT.footprint) is None
        else:
            assert max(costs.cells[costs.cell_at(x, y)] for x, y, _ in plan.path.points) < 253
    assert planned >= 2


def test_a_leg_goes_on_in_the_direction_in_which_the_one_before_ends():
    """Round to the left over open floor, as long forward as backward but for the penalty of 5 %."""
    costs = CostGrid(np.zeros((140, 180), dtype=np.uint8), 0.05)
    start, via, end = Pose2D(4.0, 3.0, 0.0), Pose2D(3.0, 3.0, 0.0), Pose2D(3.0, 5.0, pi)
    made = planner("hybrid_astar", reverse_penalty=1.05, change_penalty=3.0)
    alone = made.plan(costs, via, end).points
    assert np.all(directions_of(alone)[0] == 1)
    plan = plan_through(made, PlanRequest(costs, start, (via, end)))
    assert np.all(directions_of(plan.path.points)[0] == -1)  # a metre back, then on backward


@pytest.mark.parametrize("name", PLANNERS)
def test_a_drive_through_poses_never_stops_on_the_way(make, name):
    world = ToyWorld(room(8, 6), ROBOT, Pose2D(1.0, 1.0, 0.0))
    toy = make(world, planner=planner(name))
    task = toy.navigator.base.navigate_through([*VIAS, END])
    nearest, speeds = [np.inf] * len(VIAS), []
    while task.running and world.time < 90.0:
        toy.step()
        nearest = [
            min(away, world.pose.distance_to(via)) for away, via in zip(nearest, VIAS, strict=True)
        ]
        on_the_way = 2.0 < world.time and world.pose.distance_to(END) > 1.0
        speeds += [abs(world.twist.linear)] if on_the_way else []
    assert task.status is TaskStatus.SUCCEEDED, task.failure
    assert max(nearest) < 0.4  # via_radius
    assert min(speeds) > 0.05
    assert world.nearest > 0.0

"""Drives on lanes in the toy world: speed limits, closures on the way, and what is not possible."""

import json

import numpy as np
import pytest

from stack.errors import ParameterError
from stack.navigation.path_speeds import PathSpeeds, slower
from stack.planning.routes.parameters import RouteParameters
from stack.planning.routes.planner import Route
from stack.types import FailureCode, Path, Pose2D, TaskStatus, Twist
from tests.stack.navigation.toy_world import ToyWorld, robot, room
from tests.stack.planning.routes.test_geojson import collection, edge, node

A, B, C, D = (1.0, 1.0), (7.0, 1.0), (7.0, 5.0), (1.0, 5.0)


@pytest.fixture
def drive(make, tmp_path):
    """A toy drive on a ring of lanes in a room of 8 x 6 m."""

    def build(**rules):
        places = {"a": A, "b": B, "c": C, "d": D}
        lanes = [
            edge(name, *name, [places[end] for end in name], **rules.get(name, {}))
            for name in ("ab", "bc", "cd", "da")
        ]
        file = tmp_path / "ring.geojson"
        nodes = [node(name, *place) for name, place in places.items()]
        file.write_text(json.dumps(collection(*nodes, *lanes)))
        world = ToyWorld(room(8, 6), robot(linear_speed=0.6), Pose2D(*A))
        return make(world, planner=Route(RouteParameters(graph=str(file)), world.robot))

    return build


def driven(toy, task, seconds=120.0):
    """Drives to the end; (n, 3) of x, y and speed."""
    rows = []
    while task.status is TaskStatus.RUNNING and len(rows) * toy.world.period < seconds:
        toy.step()
        rows.append((toy.world.pose.x, toy.world.pose.y, toy.world.twist.linear))
    return np.array(rows)


def test_the_speed_limit_of_a_lane_is_kept_from_its_beginning(drive):
    toy = drive(bc={"speed": 0.2}, cd={"closed": True})
    task = toy.navigator.base.navigate_to(Pose2D(7.0, 4.5, 1.57))
    rows = driven(toy, task)
    assert task.status is TaskStatus.SUCCEEDED
    on_it = (rows[:, 1] > 1.5) & (rows[:, 1] < 4.4)
    assert rows[on_it, 2].max() < 0.205
    assert rows[on_it, 2].mean() > 0.19
    assert rows[rows[:, 0] < 5.0, 2].max() > 0.4  # and elsewhere it is fast


def test_the_task_says_that_it_drives_slowly(drive):
    toy = drive(ab={"speed": 0.2}, cd={"closed": True})
    task = toy.navigator.base.navigate_to(Pose2D(6.0, 1.0))
    toy.run(5.0)
    assert task.feedback == f"{task.distance_remaining:.1f} m to go, 0.20 m/s at most"


def test_a_lane_that_is_closed_on_the_way_is_left_at_once(drive):
    toy = drive()
    task = toy.navigator.base.navigate_to(Pose2D(*C))
    toy.run(4.0)
    assert toy.world.pose.x > 1.5 or toy.world.pose.y > 1.5
    toy.navigator.base.set_edge("bc", closed=True)
    rows = driven(toy, task)
    assert task.status is TaskStatus.SUCCEEDED
    assert ("route", "edge bc is now closed", {"edge": "bc"}) in toy.events
    assert any("the routes have changed" in text for kind, text, _ in toy.events)
    assert not ((rows[:, 0] > 6.5) & (rows[:, 1] > 1.5) & (rows[:, 1] < 4.4)).any()
    assert ((rows[:, 0] < 1.5) & (rows[:, 1] > 2.0)).any()  # it went by d


def test_with_every_route_closed_it_stops_with_the_reason(drive):
    toy = drive(cd={"closed": True})
    task = toy.navigator.base.navigate_to(Pose2D(*C))
    toy.run(3.0)
    toy.navigator.base.set_edge("bc", closed=True)
    rows = driven(toy, task)
    assert task.failure is not None and task.failure.code == FailureCode.NO_VALID_PATH
    assert "closed: bc, cd" in task.failure.sentence
    assert rows[-1, 0] < 4.0  # it did not drive on to b, 7 m


def test_a_lane_opened_while_it_waits_is_used(drive):
    toy = drive(cd={"closed": True}, bc={"closed": True})
    task = toy.navigator.base.navigate_to(Pose2D(*C))
    toy.run(1.0)
    assert toy.world.pose.distance_to(Pose2D(*A)) < 0.01
    toy.navigator.base.set_edge("bc", closed=False)
    assert toy.finish(task) is TaskStatus.SUCCEEDED


def test_closing_needs_an_edge_and_a_graph(drive, make):
    with pytest.raises(ParameterError, match="the route graph has no edge 'bd'"):
        drive().navigator.base.set_edge("bd", closed=True)
    with pytest.raises(ParameterError, match="the planner in use has no route graph"):
        make().navigator.base.set_edge("ab", closed=True)


STRAIGHT = np.column_stack([np.arange(0.0, 4.01, 0.05), np.zeros(81), np.zeros(81)])


def test_a_limit_ahead_is_braked_for():
    limits = np.full(81, np.inf)
    limits[40:] = 0.2  # from 2 m on
    speeds = PathSpeeds(Path(STRAIGHT, limits), deceleration=1.0)
    assert speeds.at(2.0) == speeds.at(3.7) == speeds.at(99.0) == 0.2
    # v² = w² + 2 a s with half of the deceleration: 0.04 + 2 · 0.5 · 1.0
    assert speeds.at(1.0) == pytest.approx(1.04**0.5)
    assert (speeds.posted(1.0), speeds.posted(2.5)) == (np.inf, 0.2)
    assert PathSpeeds(Path(STRAIGHT), 1.0).at(1.0) == np.inf


def test_slower_is_the_same_arc():
    assert slower(Twist(0.6, 0.9), 0.2) == Twist(pytest.approx(0.2), pytest.approx(0.3))
    assert slower(Twist(-0.6, 0.0), 0.2).linear == pytest.approx(-0.2)
    assert slower(Twist(0.0, 2.0), 0.2) == Twist(0.0, 2.0)  # turning in place

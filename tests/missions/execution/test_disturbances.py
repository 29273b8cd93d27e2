"""What an operator does to a simulated world while a mission runs."""

from __future__ import annotations

from math import hypot

import pytest

from robots.scripted import ScriptedBody
from stack.telemetry.records import MissionState
from tests.missions.execution.live_run import LiveRun

DRIVE = """
run:
  navigate_to_pose: {goal: [5.0, 3.8, 0]}
"""
OFFICE = "mission: lively\nrobot: scout\nworld: office\n"


@pytest.fixture
def live(tmp_path, live_run):
    def start(text: str = DRIVE, **more) -> LiveRun:
        run = live_run(tmp_path / "m", text, **more)
        run.steps(20)
        return run

    return start


def test_a_box_before_the_robot_is_seen_and_driven_round(live):
    run = live()
    truth = run.runtime.parts.scorer.truth
    assert run.order("drop_box").done
    run.steps(2)
    [event] = [event for event in run.kept.events if event.kind == "box"]
    x, y = event.fields["at"]
    front = run.engine.body.description.footprint.front
    assert hypot(x - truth.x, y - truth.y) == pytest.approx(front + 1.0 + 0.2, abs=0.03)
    run.until("mission_ended", within=1500)
    assert run.runtime.state is MissionState.SUCCESS
    assert run.snapshot.counters["collisions"] == 0


def test_a_dropped_box_stops_the_body(live):
    """A push of 1 m towards a box 0.3 m before the outline ends at the box."""
    run = live("run: {wait: 60 s}\n")
    here = run.runtime.parts.scorer.truth
    radius = run.engine.body.description.footprint.front
    ahead = here.x + radius + 0.5
    assert run.order("drop_box", x=ahead, y=here.y, heading=0.0).done
    assert run.order("push_robot", forward=1.0).done
    run.steps(40)
    moved = run.runtime.parts.scorer.truth.x - here.x
    assert 0.2 < moved < 0.35
    assert any("a dropped box" in text for text in run.texts("contact", "pushed")) or any(
        "stopped by an obstacle" in text for text in run.texts("pushed")
    )


def test_where_a_robot_stands_no_box_is_dropped(live):
    run = live("run: {wait: 60 s}\n")
    here = run.runtime.parts.scorer.truth
    answer = run.order("drop_box", x=here.x + 0.2, y=here.y)
    assert not answer.done and "a robot is there" in answer.reason
    assert "neither" in run.order("drop_box", x=1.0).reason


def test_the_nearest_door_closes_and_opens(live):
    run = live("run: {wait: 60 s}\n", head=OFFICE)
    before = dict(run.engine.body.doors)
    assert run.order("move_door").done
    after = dict(run.engine.body.doors)
    [name] = [name for name in before if before[name] != after[name]]
    assert run.order("move_door", name=name, closed=before[name]).done
    assert dict(run.engine.body.doors) == before
    assert "no door 'gate'" in run.order("move_door", name="gate").reason


def test_a_lifted_robot_is_elsewhere_and_its_odometry_does_not_know(live):
    run = live("run: {wait: 60 s}\n")
    odometry = run.snapshot.odometry
    assert run.order("lift_robot", x=3.0, y=2.0, heading=1.0).done
    run.steps(2)
    truth = run.runtime.parts.scorer.truth
    assert (truth.x, truth.y) == pytest.approx((3.0, 2.0), abs=0.01)
    assert run.snapshot.odometry.distance_to(odometry) < 0.01
    assert "outside the world" in run.order("lift_robot", x=300.0, y=2.0).reason


def test_a_sensor_that_was_taken_away_delivers_nothing_until_it_is_back(live):
    run = live("run: {wait: 60 s}\n")
    assert run.order("silence_sensor", name="lidar").done
    run.steps(40)
    lidar = next(sensor for sensor in run.snapshot.sensors if sensor.name == "lidar")
    assert lidar.age > 1.5 and lidar.is_slow
    assert run.order("silence_sensor", name="lidar", works=True).done
    run.steps(24)  # the figures are taken once a second
    lidar = next(sensor for sensor in run.snapshot.sensors if sensor.name == "lidar")
    assert lidar.age < 1.2
    assert "available: lidar" in run.order("silence_sensor", name="radar").reason


def test_the_battery_is_drained(live):
    run = live("run: {wait: 60 s}\n")
    assert run.order("set_charge", charge=0.1).done
    run.steps(2)
    assert run.snapshot.battery.charge == pytest.approx(0.1, abs=0.001)


def test_the_same_disturbances_in_the_same_steps_give_the_same_log(tmp_path):
    def log(name):
        run = LiveRun(tmp_path / name, DRIVE)
        run.steps(20)
        run.order("drop_box")
        run.steps(30)
        run.order("push_robot", left=0.2)
        run.steps(60)
        run.close()
        return run.telemetry.log_sha256

    assert log("a") == log("b")


@pytest.mark.parametrize("kind", ["drop_box", "move_door", "push_robot"])
def test_a_real_body_refuses(kind, live):
    run = live("run: {wait: 60 s}\n", make_body=lambda setup: ScriptedBody(setup.robot))
    assert "only a simulated world" in run.order(kind).reason

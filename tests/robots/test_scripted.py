"""The scripted body: a perfect drive, measurements by script, whole missions without physics."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

import missions
from robots.bodies import BodySetup, find_body
from robots.scripted import ScriptedBody, scans_of
from stack.body import BodyCommand, SimulatedWorld
from stack.errors import InputError
from stack.types import Battery, Odometry, Pose2D, Scan, Twist
from tests.stack.sim.sim_rover import EQUIPPED, ROVER, square_room


def test_it_moves_exactly_as_commanded_within_the_limits_and_stops_without_commands():
    body = ScriptedBody(ROVER, start=Pose2D(1.0, 2.0, pi / 2))
    limit = ROVER.limits.linear_speed
    for _ in range(20):
        body.command(BodyCommand(Twist(10.0)))
        body.wait(0.05)
    assert (body.pose.x, body.pose.y) == pytest.approx((1.0, 2.0 + limit))
    wheels = body.sense().wheels
    assert wheels == Odometry(1.0, Pose2D(pytest.approx(limit), pytest.approx(0.0), 0.0),
                              Twist(pytest.approx(limit)))  # fmt: skip
    for _ in range(20):
        body.wait(0.05)
    # the last command came at 0.95 s; the body stops 0.3 s and one period later
    assert body.pose.y - 2.0 - limit == pytest.approx(0.3 * limit)
    assert body.sense().wheels.twist == Twist()


def test_scans_of_a_world_are_exact_and_come_at_their_rate():
    room = square_room(4.0)
    measure = scans_of(EQUIPPED, room)
    found = [measure(0.05 * n, Pose2D(0.0, 0.0)) for n in range(40)]
    scans = [seen["lidar"] for seen in found if "lidar" in seen]
    rate = EQUIPPED.lidar.rate
    assert [scan.stamp for scan in scans] == pytest.approx(np.arange(0.0, 2.0, 1.0 / rate))
    points = scans[0].points()
    assert np.abs(np.abs(points).max(axis=1) - 4.0).max() < 1e-5


def test_a_script_reaches_a_real_mission(tmp_path):
    """A behaviour author's test: the battery falls at 6 s."""
    (tmp_path / "m.yaml").write_text(
        "mission: m\nrobot: scout\nworld: small_room\nmap: none\n"
        "run:\n  sequence:\n"
        "    - drive_on_heading: {distance: 1.0}\n"
        "    - wait_until: battery.charge < 0.5\n"
    )
    made = []

    def make(setup: BodySetup) -> ScriptedBody:
        scans = scans_of(setup.robot, setup.world)

        def script(time, pose):
            charge = 0.4 if time >= 6.0 else 1.0
            return {**scans(time, pose), "battery": Battery(charge, stamp=time)}

        made.append(ScriptedBody(setup.robot, script, start=setup.start))
        return made[0]

    report = missions.run(tmp_path / "m.yaml", body=make)
    assert report.status == "success", report.reason
    assert report.simulated_seconds == pytest.approx(6.0, abs=0.25)
    assert report.collisions is None
    body = made[0]
    # the lidar alone tells where the robot is; it drives 1 m ahead of its start
    start = body._start
    assert body.pose.distance_to(start) == pytest.approx(1.0, abs=0.05)
    assert {type(command) for command in body.commands} == {BodyCommand}


def test_a_shipped_mission_runs_on_the_scripted_body_of_the_robot_file(tmp_path):
    report = missions.run("01_drive_to_a_point", body="scripted")
    assert report.status == "success", report.reason
    assert report.final_pose["truth"] is None


def test_bodies_are_found_by_name():
    setup = BodySetup(EQUIPPED, square_room(4.0), Pose2D(0.0, 0.0))
    body = find_body("scripted", {})(setup)
    assert not isinstance(body, SimulatedWorld)
    assert "lidar" in body.sense().of(Scan)
    with pytest.raises(InputError, match="no body 'simulatd'; did you mean 'simulated'"):
        find_body("simulatd", {})

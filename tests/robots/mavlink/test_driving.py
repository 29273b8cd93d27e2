"""The body drives an emulated ArduRover over UDP, in real time."""

from itertools import pairwise
from time import monotonic, sleep  # noqa: TID251 - a real robot's clock

import numpy as np
import pytest

from robots.mavlink.rover_link import Phase
from stack.body import BodyCommand
from stack.errors import BodyError
from stack.types import Twist


def drive(body, twist, seconds):
    """Command a twist in each control period, as the step loop does; return the observations."""
    seen = []
    for _ in range(round(seconds * 20)):
        seen.append(body.sense())
        body.command(BodyCommand(twist))
        body.wait(0.05)
    return seen


def until(condition, longest=5.0):
    end = monotonic() + longest
    while not condition():
        assert monotonic() < end, "it did not happen"
        sleep(0.01)


def test_arms_drives_stops_and_disarms(emulated, bodies):
    rover = emulated(refuses_arming_for=2.5)
    body = bodies()
    assert [check.name for check in body.checks if not check.passed] == []
    assert any("AHRS: not using configured" in line for line in body.told)
    assert rover.armed and rover.mode == 15
    # 1 m/s for 2 s with a lag of 0.15 s: 1.85 m, and one cycle of delay.
    drive(body, Twist(1.0), 2.0)
    assert rover.north == pytest.approx(1.85, abs=0.15) and abs(rover.east) < 0.05
    drive(body, Twist(), 1.0)
    assert abs(rover.speed) < 0.01
    # Backwards, and to the left: yaw is clockwise, so it falls.
    before, yaw = rover.north, rover.yaw
    drive(body, Twist(-0.5, 0.5), 1.0)
    assert rover.north < before - 0.3 and -0.6 < rover.yaw - yaw < -0.3
    drive(body, Twist(), 0.5)
    last = drive(body, Twist(), 0.1)[-1]
    wheels = last.wheels
    # In the odom frame: x is where it faced at first (north), y to the left of it (west).
    assert (wheels.pose.x, wheels.pose.y) == pytest.approx((rover.north, -rover.east), abs=0.05)
    assert wheels.pose.heading == pytest.approx(-rover.yaw, abs=0.02)
    body.close()
    assert not rover.armed


def test_setpoints_are_steady_and_end_with_the_loop(emulated, bodies):
    rover, body = emulated(), bodies()
    drive(body, Twist(0.5), 1.0)
    rover.setpoints.clear()
    drive(body, Twist(0.5), 2.0)
    times = [at for at, _, _ in rover.setpoints]
    assert len(times) >= 30  # 20 Hz wanted, at least 10 needed
    assert max(b - a for a, b in pairwise(times)) < 0.2
    sleep(0.6)  # the loop is stuck
    assert rover.setpoints[-1][1:] == (0.0, 0.0)  # stopped explicitly after 0.3 s
    assert abs(rover.speed) < 0.2


def test_the_pilot_wins(emulated, bodies):
    rover, body = emulated(), bodies()
    drive(body, Twist(0.5), 0.5)
    rover.set_mode("MANUAL")
    drive(body, Twist(0.5), 1.5)  # heartbeats come once a second
    assert "mode was changed from GUIDED to MANUAL" in body.health.problem
    count = len(rover.setpoints)
    drive(body, Twist(0.5), 1.5)
    assert rover.mode == 0 and len(rover.setpoints) == count  # nothing is sent, nothing is asked
    assert body.engage() == ""
    drive(body, Twist(0.5), 2.5)
    assert rover.mode == 15 and body.health.problem == "" and rover.speed > 0.4
    rover.set_mode("MANUAL")
    until(lambda: body.health.problem)
    body.close()
    assert rover.armed and rover.mode == 0  # somebody drives it: it is left alone


def test_a_lost_rover_stands_until_it_is_asked_again(emulated, bodies):
    rover, body = emulated(), bodies()
    rover.silent = True
    drive(body, Twist(0.5), 2.0)
    assert "nothing heard from the rover" in body.health.problem == body.engage()
    rover.silent = False
    until(lambda: body._link.phase is Phase.STANDING_BY)
    drive(body, Twist(0.5), 0.5)
    assert body.health.problem == "" and abs(rover.speed) < 0.01
    assert body.engage() == ""
    drive(body, Twist(0.5), 1.0)
    assert rover.speed > 0.4


def test_a_restarted_rover_is_armed_again(emulated, bodies):
    rover, body = emulated(), bodies()
    drive(body, Twist(0.5), 0.5)
    rover.boot()
    until(lambda: body.health.problem, 4.0)
    body.engage()
    drive(body, Twist(), 0.1)
    until(lambda: body._link.phase is Phase.DRIVING)
    drive(body, Twist(0.5), 1.0)
    assert rover.armed and rover.speed > 0.4
    assert len(drive(body, Twist(), 1.0)[-1].measurements) > 0
    assert body._measurements.stamps.clocks["boot"].restarts == 1


def test_noise_loss_and_delays(emulated, bodies):
    rover = emulated(noise=1.0, loss=0.2, jitter=0.02)
    body = bodies()
    seen = drive(body, Twist(0.5, 0.3), 3.0)
    seen += drive(body, Twist(), 1.3)
    wheels = seen[-1].wheels
    assert wheels.twist.stands
    place = (rover.north, -rover.east, -rover.yaw)
    assert (wheels.pose.x, wheels.pose.y) == pytest.approx(place[:2], abs=0.12)
    assert wheels.pose.heading == pytest.approx(place[2], abs=0.05)
    assert body._link.heard.figures.round_trips


@pytest.mark.parametrize(
    ("settings", "parameters", "problem"),
    [
        (None, {"connect_timeout": 0.3}, "✘ heartbeat: no heartbeat of a rover on udpin"),
        ({"battery": 5}, {"arm_timeout": 1.5}, "✘ battery: 5%, 12.6 V; charge it above 10%"),
        ({"refuses_arming_for": 99}, {"arm_timeout": 3.0},
         "✘ armed: the autopilot refuses; it says: Arm: AHRS: not using configured AHRS type"),
        ({"refuses_mode_for": 99}, {"arm_timeout": 1.5}, "✘ odometry: .*none yet"),
        ({"wheels": False}, {"odometry": "wheels", "arm_timeout": 1.5},
         "✘ odometry: WHEEL_DISTANCE: none yet"),
    ],
)  # fmt: skip
def test_a_rover_that_may_not_drive_is_refused_with_the_name_of_the_check(
    emulated, bodies, settings, parameters, problem
):
    rover = emulated(**settings) if settings is not None else None
    with pytest.raises(BodyError, match=problem):
        bodies(**parameters)
    assert rover is None or not rover.armed


def test_two_rovers_are_not_one(emulated, bodies):
    emulated()
    emulated(system=2)
    with pytest.raises(BodyError, match="several rovers are there: 1, 2; set `system`"):
        bodies()
    assert bodies(system=2)._link.rover.system == 2


def test_sensors(emulated, bodies):
    rover = emulated(wheels=True)
    body = bodies()
    seen = drive(body, Twist(0.0, 0.5), 1.5)
    turning = seen[15:]
    seen += drive(body, Twist(), 0.6)
    assert [check.text for check in body.checks if check.name == "odometry"] == [
        "from WHEEL_DISTANCE"
    ]
    scans = [o.named("lidar", object) for o in seen if "lidar" in o.measurements]
    assert 15 <= len(scans) <= 23
    # In the middle of a room of 8 m: 4 m to each wall, the corners at 5.66 m.
    yaw = -seen[-1].wheels.pose.heading
    scan = scans[-1]
    ahead = scan.ranges[np.argmin(abs(scan.angles))]
    assert ahead == pytest.approx(rover.range_at(0.0), abs=0.03)
    xy = scan.points()
    # The walls stand still in the odom frame.
    c, s = np.cos(-yaw), np.sin(-yaw)
    turned = np.abs(xy @ np.array([[c, s], [-s, c]]))
    assert np.allclose(turned.max(axis=1), 4.0, atol=0.02)
    front = [o.named("front", object) for o in seen if "front" in o.measurements]
    assert front[-1].distance == float("inf")  # beyond its 4 m
    imu = [o.imu for o in turning if o.imu is not None]
    rates = np.concatenate([o.imu.angular_velocity[:, 2] for o in turning if o.imu])
    assert np.median(rates) == pytest.approx(0.5, abs=0.02)
    assert imu[-1].linear_acceleration[0, 2] == pytest.approx(9.81, abs=0.01)
    assert seen[-1].wheels.pose.heading == pytest.approx(-rover.yaw, abs=0.01)

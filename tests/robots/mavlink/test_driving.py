"""The body drives an emulated rover over UDP in real time, from the process of the fast loop."""

import os
import signal
import subprocess
import sys
from time import monotonic, sleep  # noqa: TID251 - a real robot's clock

import pytest

from robots.mavlink.rover_link import Phase
from stack.body import DEAD_MAN, FAST_LOOP, PILOT, BodyCommand
from stack.errors import BodyError, InputError
from stack.types import Imu, Scan, Twist


def drive(body, twist, seconds):
    """Command a twist in each control period, as the step loop does; return the observations."""
    seen = []
    for _ in range(round(seconds * 20)):
        seen.append(body.sense())
        body.command(BodyCommand(twist))
        body.wait(0.05)
    return seen


def until(body, condition, longest=6.0):
    """Command a standstill until something is so."""
    end = monotonic() + longest
    while not condition():
        drive(body, Twist(), 0.05)
        assert monotonic() < end, "it did not happen"


def test_arms_drives_gives_way_and_disarms(emulated, bodies):
    rover = emulated(refuses_arming=1)
    body = bodies()
    assert [check.name for check in body.checks if not check.passed] == []
    assert "autopilot: Arm: AHRS: not using configured AHRS type" in body.told
    assert rover.armed and body.is_real_time
    seen = drive(body, Twist(0.8, 0.4), 1.5)
    scans = [o.named("lidar", Scan) for o in seen if "lidar" in o.measurements]
    imus = [o.named("imu", Imu) for o in seen if "imu" in o.measurements]
    assert len(scans) >= 5 and len(imus) >= 10
    assert all(0.0 < o.named("lidar", Scan).stamp <= o.time for o in seen if "lidar" in
               o.measurements)  # fmt: skip
    assert rover.driven > 0.5 and rover.yaw < -0.2
    until(body, lambda: abs(rover.speed) < 0.001)
    wheels = drive(body, Twist(), 0.3)[-1].wheels
    # In the odom frame: x is where it faced at first (north), y to the left of it (west).
    assert (wheels.pose.x, wheels.pose.y) == pytest.approx((rover.north, -rover.east), abs=0.03)
    assert wheels.pose.heading == pytest.approx(-rover.yaw, abs=0.02)
    rover.set_mode("MANUAL")
    until(body, lambda: body.health.fault == PILOT)
    assert "from GUIDED to MANUAL" in body.health.problem
    assert body.engage() == ""
    until(body, lambda: body._link.phase is Phase.DRIVING)
    assert rover.mode == 15 and body.health.problem == ""
    body.close()
    assert not rover.armed


def test_a_loop_that_is_stuck_stops_the_rover(emulated, bodies):
    rover, body = emulated(refuses_arming=0), bodies()
    drive(body, Twist(0.3), 1.0)
    rover.setpoints.clear()
    began = monotonic()
    sleep(1.2)  # 0.3 m/s are braked with 1 m/s² after DEAD_MAN
    stopped = next(at for at, speed, _ in rover.setpoints if speed == 0.0)
    assert DEAD_MAN - 0.1 < stopped - began < 1.0
    assert rover.setpoints[-1][1] == 0.0 and rover.armed


def test_a_frozen_fast_loop_is_a_fault_and_the_rover_s_own_watchdog_stops_it(emulated, bodies):
    rover, body = emulated(refuses_arming=0, setpoint_timeout=1.0), bodies()
    drive(body, Twist(0.4), 1.0)
    os.kill(body._link._loop.pid, signal.SIGSTOP)
    try:
        until(body, lambda: body.health.fault == FAST_LOOP)
        assert body.health.problem == "the fast loop has not answered for more than 0.3 s"
        until(body, lambda: abs(rover.speed) < 0.01)
    finally:
        os.kill(body._link._loop.pid, signal.SIGCONT)
    until(body, lambda: body.health.fault != FAST_LOOP)
    assert body.engage() == ""
    until(body, lambda: body.health.problem == "" and body._link.phase is Phase.DRIVING)
    drive(body, Twist(0.4), 1.0)
    assert rover.speed > 0.3


BRAIN = """
import sys
from pathlib import Path
from robots.load import read_robot
from robots.mavlink.body import MavlinkBody
from robots.mavlink.parameters import MavlinkParameters
from stack.body import BodyCommand
from stack.types import Twist
body = MavlinkBody(read_robot(Path(sys.argv[1])), MavlinkParameters(sys.argv[2]))
print("drives", flush=True)
while True:
    body.sense()
    body.command(BodyCommand(Twist(0.5)))
    body.wait(0.05)
"""


def test_a_killed_brain_leaves_a_rover_that_stands_and_is_disarmed(emulated, port):
    from tests.robots.mavlink.conftest import ROVER

    rover = emulated(refuses_arming=0)
    brain = subprocess.Popen(
        [sys.executable, "-c", BRAIN, str(ROVER), f"udpin:127.0.0.1:{port}"],
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": os.getcwd()},
    )
    try:
        assert brain.stdout is not None and brain.stdout.readline() == b"drives\n"
        end = monotonic() + 5.0
        while rover.speed < 0.4 and monotonic() < end:
            sleep(0.02)
        assert rover.speed > 0.4
        brain.send_signal(signal.SIGKILL)
        brain.wait()
        end = monotonic() + 4.0
        while rover.armed and monotonic() < end:
            sleep(0.02)
        assert not rover.armed and abs(rover.speed) < 0.1
    finally:
        brain.kill()
        brain.wait()
        brain.stdout.close()


@pytest.mark.parametrize(
    ("settings", "parameters", "problem"),
    [
        (None, {"connect_timeout": 0.3}, "✘ heartbeat: no heartbeat of a rover on udpin"),
        ({"battery": 5}, {"arm_timeout": 1.5}, "✘ battery: 5%, 12.6 V; charge it above 10%"),
        ({"refuses_arming": 99}, {"arm_timeout": 4.0},
         "✘ armed: the autopilot refuses; it says: Arm: AHRS: not using configured AHRS type"),
    ],
)  # fmt: skip
def test_a_rover_that_may_not_drive_is_refused_with_the_name_of_the_check(
    emulated, bodies, settings, parameters, problem
):
    rover = emulated(**settings) if settings is not None else None
    with pytest.raises(BodyError, match=problem):
        bodies(**parameters)
    assert rover is None or not rover.armed


def test_a_robot_that_does_not_fit_is_refused_before_anything_is_opened(bodies):
    from robots.load import find_robot, read_robot

    glide = read_robot(find_robot("glide", find_robot("scout", __import__("pathlib").Path())))
    with pytest.raises(InputError, match="autopilots take no sideways velocity"):
        bodies(glide)
    with pytest.raises(InputError, match="the robot has no sonar 'rear'"):
        bodies(rangefinders=("front", "rear"))

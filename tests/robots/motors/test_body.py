"""The body `wheels`: a mission on emulated wheels in real time, odometry, choice of the driver."""

from math import pi
from pathlib import Path

import pytest

import missions
from robots.bodies import chosen_body
from robots.load import read_robot
from robots.motors.body import WheelsBody
from robots.motors.can_simple import AxisError
from robots.motors.odometry import EncoderOdometry
from robots.motors.parameters import WheelsParameters
from stack.body import MOTOR, BodyCommand
from stack.drivetrain.ackermann import SteeredWheels
from stack.drivetrain.differential import Wheels
from stack.drivetrain.limits import Limits
from stack.errors import InputError
from stack.types import STANDSTILL, Battery, Odometry, Twist
from tests.robots.motors.axes_process import axes_process

pytestmark = pytest.mark.xdist_group("fast_loop")

SCOUT = Path(__file__).parents[3] / "robots" / "scout"


def robot_file(folder, body):
    text = (SCOUT / "robot.yaml").read_text().replace("scout.urdf", str(SCOUT / "scout.urdf"))
    file = folder / "robot.yaml"
    file.write_text(f"{text[: text.index('lidar:')]}\nbody: {body}\n")
    return file


def test_a_mission_drives_emulated_wheels_through_a_fast_loop(tmp_path):
    robot_file(tmp_path, "{use: wheels, rate: 500 Hz, driver: {use: emulated, lag: 10 ms}}")
    file = tmp_path / "ahead.yaml"
    file.write_text(
        "mission: ahead\nformat: 1\nrobot: ./robot.yaml\nworld: small_room\n"
        "localisation: dead_reckoning\nrun: {drive_on_heading: {distance: 0.1 m}}\n"
    )
    made = []

    def make(setup):
        made.append(chosen_body(setup.robot, "")(setup))
        return made[0]

    report = missions.run(file, seed=0, body=make)
    assert (report.status, report.final_pose["truth"]) == ("success", None)
    assert report.distance_m == pytest.approx(0.1, abs=0.03)
    timing = report.fast_loop
    assert timing["rate"] == 500.0
    assert timing["cycles"] + timing["overruns"] >= 500.0 * 0.5 * report.simulated_seconds
    assert 0.0 < timing["late_median"] <= timing["late_worst"]
    # The periods that the body sleeps are no compute time of the stage.
    computed = report.stages["body"]["mean_ms"] * 1e-3 * report.stages["body"]["count"]
    assert computed + made[0].slept <= report.simulated_seconds + 0.1
    assert made[0].slept > 0.0


@pytest.mark.parametrize(
    ("body", "sentence"),
    [
        ("{use: wheels, driver: emulatd}", "no driver 'emulatd'; did you mean 'emulated'"),
        ("{use: wheels, driver: {use: emulated, lagg: 1 ms}}", "lagg"),
        ("{use: wheels, driver: {lag: 1 ms}}", "expected a name, or a mapping with `use`"),
        ("{use: wheels, rate: 5 kHz}", "rate"),
    ],
)
def test_a_wrong_body_is_an_error_in_the_robot_file(tmp_path, body, sentence):
    with pytest.raises(InputError, match=sentence):
        read_robot(robot_file(tmp_path, body))


@pytest.fixture
def can_body(tmp_path):
    """The body on emulated axes in another process, and these."""
    with axes_process() as axes:
        robot = read_robot(robot_file(tmp_path, "{use: wheels}"))
        driver = {"use": "odrive_can", **axes.driver}
        body = WheelsBody(robot, WheelsParameters(driver=driver, rate=250.0))
        yield body, axes
        body.close()


def until(body, condition, twist=STANDSTILL):
    """Drive as the step loop does until something is so; return the observations."""
    seen = []
    for _ in range(200):
        seen.append(body.sense())
        if condition():
            return seen
        body.command(BodyCommand(twist))
        body.wait(0.05)
    raise AssertionError("it did not happen within 10 s")


def test_engaging_clears_the_faults_of_the_drives_and_arms_them_again(can_body):
    body, axes = can_body
    ahead = Twist(0.3)

    def speed():
        return body.sense().of(Odometry)["wheels"].twist.linear

    until(body, lambda: speed() > 0.28, ahead)
    assert body.engage() == ""  # nothing to clear: it drives on
    axes.order(node=1, error=int(AxisError.DRV_FAULT))
    until(body, lambda: body.health.problem != "", ahead)
    assert (body.health.problem, body.health.fault) == ("node 1: DRV_FAULT", MOTOR)
    until(body, lambda: abs(speed()) < 0.01, ahead)
    assert body.health.problem == "node 1: DRV_FAULT"  # it stands, whatever is commanded
    assert body.engage() == ""
    until(body, lambda: body.health.problem == "" and speed() > 0.28, ahead)
    body.loop.close()
    assert body.engage() == "the fast loop ended with code 0"


def test_the_battery_is_the_supply_of_the_drives(can_body):
    """Between 20.0 V, empty, and 25.2 V, full, half of the charge is at 22.6 V."""
    body, axes = can_body
    seen = until(body, lambda: body.time > 1.5)
    full = [o.of(Battery)["battery"] for o in seen if o.of(Battery)]
    assert full[-1].voltage == 24.0
    axes.order(voltage=22.6)
    now = body.time
    seen = until(body, lambda: body.time > now + 1.5)
    half = [o.of(Battery)["battery"] for o in seen if o.of(Battery)]
    assert half[-1].voltage == pytest.approx(22.6)
    assert half[-1].charge == pytest.approx(0.5, abs=1e-6)
    assert now < half[-1].stamp <= body.time


def test_odometry_of_a_half_circle_is_exact_with_any_number_of_readings():
    """Radius 1 m, track 0.4 m, wheels of 0.1 m: the sides roll 0.8 pi and 1.2 pi metres."""
    drive = Wheels(("l",), ("r",), 0.1, 0.4).drivetrain(Limits())
    for readings in (1, 7):
        odometry = EncoderOdometry(drive)
        odometry.update(0.0, [3.0, -2.0], [0.0, 0.0])
        for number in range(1, readings + 1):
            share = number / readings
            angles = [3.0 + 8.0 * pi * share, -2.0 + 12.0 * pi * share]
            odometry.update(share, angles, [8.0, 12.0])
        pose, twist = odometry.reading.pose, odometry.reading.twist
        assert (pose.x, pose.y, abs(pose.heading)) == pytest.approx((0.0, 2.0, pi), abs=1e-9)
        assert (twist.linear, twist.angular) == pytest.approx((1.0, 1.0))


def test_odometry_of_a_car_turns_by_its_measured_steering():
    car = SteeredWheels(("a", "b"), ("c", "d"), 0.1, 0.5, 0.4, pi / 6, 1.0).drivetrain(Limits())
    wheels = car.to_wheels(car.state_at(Twist(1.0, 0.5), car.at_rest))
    odometry = EncoderOdometry(car)
    odometry.update(0.0, [0.0, 0.0], [0.0, 0.0], wheels.steering)
    odometry.update(1.0, list(wheels.speeds), list(wheels.speeds), wheels.steering)
    assert odometry.reading.pose.heading == pytest.approx(0.5)
    assert odometry.reading.twist.angular == pytest.approx(0.5)

import pytest

from stack.description import Limits, Wheels
from stack.sim.drive import DifferentialDrive
from stack.types import Twist

WHEELS = Wheels(("l",), ("r",), radius=0.1, separation=0.4)
LIMITS = Limits(
    linear_speed=0.8, reverse_speed=0.3, angular_speed=1.8, linear_acceleration=1.0,
    linear_deceleration=2.0, angular_acceleration=4.0,
)  # fmt: skip


@pytest.fixture
def drive():
    return DifferentialDrive(LIMITS, WHEELS, 0.002)


def run(drive, twist, steps):
    speeds = []
    for _ in range(steps):
        drive.command(twist)
        drive.advance()
        speeds.append((drive.linear, drive.angular))
    return speeds


def test_ramps_take_speed_over_acceleration(drive):
    speeds = run(drive, Twist(0.5, 1.0), 300)
    assert [v for v, _ in speeds].index(0.5) + 1 == 250  # 0.5 / 1.0 / 0.002
    assert [w for _, w in speeds].index(1.0) + 1 == 125  # 1.0 / 4.0 / 0.002
    run_down = run(drive, Twist(), 300)
    assert [v for v, _ in run_down].index(0.0) + 1 == 125  # 0.5 / 2.0 / 0.002


def test_turning_back_stops_at_the_deceleration_first(drive):
    run(drive, Twist(0.2), 200)
    speeds = [v for v, _ in run(drive, Twist(-0.2), 300)]
    assert speeds[49] == pytest.approx(0.0, abs=1e-12)  # 0.2 / 2.0 / 0.002 = 50 steps
    assert speeds[99] == pytest.approx(-0.1)  # then 50 steps at 1.0
    assert speeds[-1] == -0.2


def test_commands_are_cut_to_the_limits(drive):
    assert run(drive, Twist(9.0, -9.0), 2000)[-1] == (0.8, -1.8)
    assert run(drive, Twist(-9.0), 2000)[-1][0] == -0.3


def test_wheel_speeds_of_a_turn(drive):
    run(drive, Twist(0.5, 1.0), 500)
    # (v -+ w b / 2) / r = (0.5 -+ 0.2) / 0.1
    assert drive.wheel_speeds == pytest.approx((3.0, 7.0))


def test_without_commands_it_stops_after_the_dead_man_time(drive):
    run(drive, Twist(0.5), 500)
    changes = [drive.advance() for _ in range(400)]
    # The last command stands for 150 steps in all, the one it came in included.
    assert changes.index(True) == 149
    assert drive.linear == 0.0
    assert sum(changes) == 125


def test_steady_speed_asks_for_nothing(drive):
    run(drive, Twist(0.5), 500)
    assert not drive.advance()

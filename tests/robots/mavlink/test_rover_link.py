"""The rover link against emulated rovers on a virtual clock."""

from itertools import pairwise

import pytest

from robots.mavlink.rover_link import SILENCE, Order, Phase
from tests.robots.mavlink.emulated_rover import MODES, OFFBOARD, PX4, Settings
from tests.robots.mavlink.virtual import World

HOLD_ON, FORWARD = Order(engagement=1), Order(0.5, 0.0, 1)


def driving(*settings, **options):
    """A world in which the rover is driven."""
    world = World(*settings, **options)
    world.run_until(lambda: world.link.phase is Phase.DRIVING, HOLD_ON)
    return world


def test_it_is_armed_after_refusals_and_says_why():
    world = World(Settings(refuses_arming=3, position_after=5.0))
    took = world.run_until(lambda: world.link.phase is Phase.DRIVING, HOLD_ON)
    texts = world.link.heard.take_texts()
    assert "Mode change to GUIDED failed: requires position" in texts
    assert texts.count("Arm: AHRS: not using configured AHRS type") == 3
    assert 5.0 + 3.0 < took < 5.0 + 3.0 + 4.0  # asked once a second; seen in the next heartbeat


def test_a_rover_that_is_not_armed_in_time_is_a_problem_in_its_own_words():
    world = World(Settings(refuses_arming=99))
    world.run(4.0, HOLD_ON)
    assert world.link.problem == ""
    world.run(4.0, HOLD_ON)
    assert world.link.problem == (
        "the rover still waits to be armed (Arm: AHRS: not using configured AHRS type)"
    )


@pytest.mark.parametrize("autopilot", [3, PX4])
def test_velocities_have_our_signs(autopilot):
    world = driving(Settings(autopilot=autopilot))
    assert world.rover.mode == (OFFBOARD if autopilot == PX4 else MODES["GUIDED"])
    world.run(3.0, Order(1.0, 0.0, 1))
    assert world.rover.north == pytest.approx(3.0 - 0.15, abs=0.06)  # the lag of the drive
    world.run(1.0, HOLD_ON)
    north = world.rover.north
    # Backwards with a yaw rate: without one ArduRover would turn round and drive forward.
    world.run(2.0, Order(-0.5, 0.0, 1))
    assert world.rover.north == pytest.approx(north - 0.5 * 1.85, abs=0.03)
    assert abs(world.rover.yaw) < 0.01
    world.run(2.0, Order(0.0, 0.5, 1))
    assert world.rover.yaw == pytest.approx(-0.5 * 1.85, abs=0.03)  # to the left; yaw to the right


def test_setpoints_and_heartbeats_are_steady():
    world = driving()
    world.rover.setpoints.clear()
    beats = world.rover.received["HEARTBEAT"]
    world.run(10.0, FORWARD)
    times = [at for at, _, _ in world.rover.setpoints]
    assert len(times) == pytest.approx(200, abs=2)
    assert max(b - a for a, b in pairwise(times)) <= 0.07
    assert world.rover.received["HEARTBEAT"] - beats == pytest.approx(10, abs=1)


def test_the_rates_arrive_in_spite_of_loss():
    world = World(Settings(loss=0.3))
    world.run(20.0)
    kinds = dict(world.link.heard.figures.kinds)
    world.run(10.0)
    rate = {
        kind: (count - kinds.get(kind, 0)) / 10.0
        for kind, count in world.link.heard.figures.kinds.items()
    }
    assert rate["ATTITUDE"] == pytest.approx(14.0, abs=2.5)  # 70 % of 20 Hz
    assert rate["RAW_IMU"] == pytest.approx(35.0, abs=5.0)
    assert rate["OBSTACLE_DISTANCE"] == pytest.approx(7.0, abs=2.0)
    assert world.link.heard.values["MAV_GCS_SYSID"] == 255.0
    assert max(world.link.heard.figures.round_trips) < 0.05
    assert {105, 9000} == world.link._requests.refused  # it has no HIGHRES_IMU and no encoders


@pytest.mark.parametrize(
    ("happens", "why"),
    [
        (lambda rover: rover.set_mode("MANUAL"), "mode was changed from GUIDED to MANUAL"),
        (lambda rover: setattr(rover, "armed", False), "the rover was disarmed"),
    ],
)
def test_the_pilot_wins_until_control_is_asked_for_again(happens, why):
    world = driving()
    world.run(1.0, FORWARD)
    happens(world.rover)
    world.run(1.2, FORWARD)  # its heartbeats come once a second
    assert world.link.phase is Phase.TAKEN_OVER and why in world.link.problem
    assert world.link.problem.endswith("`resume` asks for GUIDED again")
    setpoints, commands = len(world.rover.setpoints), world.rover.received["COMMAND_LONG"]
    world.run(10.0, FORWARD)
    assert len(world.rover.setpoints) == setpoints
    assert world.rover.received["COMMAND_LONG"] == commands
    again = Order(0.5, 0.0, 2)
    world.run_until(lambda: world.link.phase is Phase.DRIVING, again)
    world.run(1.0, again)
    assert world.link.problem == "" and world.rover.speed > 0.4


def test_a_rover_that_somebody_else_drives_is_left_alone_at_the_end():
    world = driving()
    world.rover.set_mode("MANUAL")
    world.run(1.2, FORWARD)
    world.run(3.0, Order())
    assert world.rover.armed and world.rover.mode == MODES["MANUAL"]


def test_a_rover_that_is_given_back_is_disarmed_at_the_end():
    world = driving()
    world.rover.set_mode("MANUAL")
    world.run(1.2, FORWARD)
    again = Order(0.0, 0.0, 2)
    world.run_until(lambda: world.link.phase is Phase.DRIVING, again)
    world.run(3.0, Order())
    assert not world.rover.armed


def test_it_stops_before_it_disarms():
    world = driving()
    world.run(2.0, Order(1.0, 0.0, 1))
    speeds = []
    world.run(3.0, Order(), lambda: speeds.append((world.rover.armed, world.rover.speed)))
    assert world.link.phase is Phase.RELEASED and not world.rover.armed
    assert max(speed for armed, speed in speeds if not armed) < 0.06


def test_a_rover_that_was_armed_before_stays_armed():
    world = World(Settings(refuses_arming=0))
    world.run(1.0)
    world.rover.armed = True
    world.rover.set_mode("GUIDED")
    world.run(1.5)
    world.run_until(lambda: world.link.phase is Phase.DRIVING, HOLD_ON)
    world.run(2.0, Order(1.0, 0.0, 1))
    world.run(2.0, Order())
    assert world.rover.armed and abs(world.rover.speed) < 0.01


def test_a_lost_rover_is_told_to_stop_and_waits_to_be_asked():
    world = driving()
    world.run(1.0, FORWARD)
    send, world.rover.send = world.rover.send, lambda message: None  # we do not hear it
    lost = world.run_until(lambda: world.link.phase is Phase.LOST, FORWARD)
    assert lost == pytest.approx(SILENCE, abs=0.1)
    assert "nothing heard from the rover" in world.link.problem
    world.run(1.0, FORWARD)
    assert abs(world.rover.speed) < 0.01  # it still heard us
    world.rover.send = send
    world.run(3.0, FORWARD)
    assert world.link.phase is Phase.STANDING_BY and abs(world.rover.speed) < 0.01
    assert "the rover was lost" in world.link.problem  # also when it was lost for a moment only
    world.run(2.0, Order(0.5, 0.0, 2))
    assert world.link.phase is Phase.DRIVING and world.rover.speed > 0.4


def test_a_broken_connection_is_opened_again():
    world = driving()
    world.broken = True
    world.run(3.0, FORWARD)
    assert world.link.phase is Phase.LOST and "No such file" in world.link.problem
    world.broken = False
    world.run(3.0, FORWARD)
    assert world.link.phase is Phase.STANDING_BY
    assert "the rover was lost" in world.link.problem and "`resume`" in world.link.problem
    assert abs(world.rover.speed) < 0.01
    assert world.link.heard.figures.reopened == 1


def test_a_restarted_rover_is_asked_for_its_rates_and_armed_again():
    world = driving()
    world.run(2.0, FORWARD)
    world.rover.boot()
    world.run(2.0, FORWARD)
    assert world.link.phase is Phase.TAKEN_OVER and "disarmed" in world.link.problem
    again = Order(0.5, 0.0, 2)
    world.run_until(lambda: world.link.phase is Phase.DRIVING, again)
    kinds = dict(world.link.heard.figures.kinds)
    world.run(2.0, again)
    assert world.rover.speed > 0.4 and world.link.heard.figures.restarts == 1
    assert world.link.heard.figures.kinds["ATTITUDE"] - kinds["ATTITUDE"] > 30


def test_the_failsafe_of_the_autopilot_is_a_take_over():
    """FS_GCS_ENABLE with the id of another station: it does not count our heartbeats."""
    world = driving(Settings(parameters={"FS_GCS_ENABLE": 1.0, "MAV_GCS_SYSID": 245.0}))
    world.run(10.0, FORWARD)
    assert world.link.phase is Phase.DRIVING  # our heartbeats keep it driving
    world.rover.settings.parameters["MAV_GCS_SYSID"] = 255.0
    world.run(9.0, FORWARD)
    assert "from GUIDED to HOLD (Radio Failsafe)" in world.link.problem


def test_the_wrong_rover_is_not_driven():
    two = Settings(), Settings(system=2)
    world = World(*two)
    world.run(2.0)
    assert world.link.heard.others == {2}
    world = driving(*two, system=2)
    assert not world.rovers[0].armed and world.rovers[1].armed


def test_the_origin_is_sent_until_it_is_known():
    world = World(Settings(loss=0.5), origin=(48.0, 11.5))
    world.run(20.0)
    assert world.rover.origin == (480000000, 115000000)
    sent = world.rover.received["SET_GPS_GLOBAL_ORIGIN"]
    world.run(10.0)
    assert world.rover.received["SET_GPS_GLOBAL_ORIGIN"] == sent

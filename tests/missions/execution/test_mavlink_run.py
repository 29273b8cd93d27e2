"""A real run that a station commands: what only the engine and the vehicle together show."""

from __future__ import annotations

import pytest
from pymavlink.dialects.v20 import all as mav

from stack.mavlink.origin import GeoOrigin
from stack.telemetry.mavlink.handover import Handover
from stack.telemetry.mavlink.vehicle import Vehicle
from stack.telemetry.records import MissionState
from stack.types import Pose2D
from tests.missions.execution.live_run import PERIOD, LiveRun

WAITS = "run: {assisted_teleop: {time: 1 h, silence: 1 h}}\n"
ORIGIN = GeoOrigin(48.0, 11.0)
MANUAL, HOLD, AUTO, RTL, GUIDED = 0, 4, 10, 11, 15


class Commanded:
    """A run and the vehicle before it, without a thread: the station's messages come at once."""

    def __init__(self, folder, text=WAITS):
        self.run, self.sent, self.now = LiveRun(folder, text), [], 0.0
        self.handover = Handover()
        self.vehicle = Vehicle(self.handover, self, lambda: self.now, origin=ORIGIN)
        self.steps(2)

    def send(self, message):
        message.pack(mav.MAVLink(None, 1, 1))
        self.sent.append(message)

    def steps(self, count):
        kept = self.run.kept
        for _ in range(count):
            known, answered = len(kept.events), len(kept.acks)
            kept.orders += self.handover.take_commands()
            self.run.steps()
            self.handover.snapshot = self.run.snapshot
            self.handover.events.extend(kept.events[known:])
            self.handover.acks.extend(kept.acks[answered:])
            self.now += PERIOD
            self.vehicle.tick()

    def say(self, message, steps=3):
        """Let a station send a message; the result, if it is a command."""
        (heard,) = mav.MAVLink(None).parse_buffer(bytes(message.pack(mav.MAVLink(None, 255, 190))))
        known = len(self.sent)
        self.vehicle.take(heard)
        self.steps(steps)
        return [m.result for m in self.sent[known:] if m.get_type() == "COMMAND_ACK"]

    def change(self, mode):
        return self.say(mav.MAVLink_command_long_message(1, 1, 176, 0, 1, mode, 0, 0, 0, 0, 0))

    @property
    def mode(self):
        return [m for m in self.sent if m.get_type() == "HEARTBEAT"][-1].custom_mode

    def until(self, condition, within=1200):
        for _ in range(within):
            if condition():
                return
            self.steps(1)
        raise AssertionError(self.run.texts())

    @property
    def pose(self):
        return self.run.runtime.parts.scorer.truth


@pytest.fixture
def robot(tmp_path):
    """A robot at (1, 1) in the small room that waits in assisted_teleop."""
    made = Commanded(tmp_path / "m")
    yield made
    made.run.close()


def test_an_uploaded_plan_is_driven_and_survives_an_emergency_stop(robot):
    places = [(2.0, 1.0), (2.0, 2.0)]
    robot.say(mav.MAVLink_mission_count_message(1, 1, 2, 0))
    for number, place in enumerate(places):
        robot.say(mav.MAVLink_mission_item_int_message(
            1, 1, number, 6, 16, 0, 1, 0, 0, 0, 0, *ORIGIN.to_integers(*place), 0, 0
        ))  # fmt: skip
    assert [m.type for m in robot.sent if m.get_type() == "MISSION_ACK"] == [0]
    assert robot.change(AUTO) == [0] and robot.mode == AUTO
    robot.steps(20)
    assert robot.run.speed > 0.1
    assert robot.say(mav.MAVLink_command_long_message(1, 1, 400, 0, *[0] * 7)) == [0]
    robot.steps(30)
    assert robot.run.speed < 0.02 and robot.run.runtime.state is MissionState.EMERGENCY_STOP
    assert robot.say(mav.MAVLink_command_long_message(1, 1, 400, 0, 1, *[0] * 6)) == [0]
    robot.steps(20)
    assert robot.run.speed < 0.02 and robot.mode == HOLD  # arming starts no motion
    assert robot.change(AUTO) == [0]

    def reached():
        return [m.seq for m in robot.sent if m.get_type() == "MISSION_ITEM_REACHED"]

    robot.until(lambda: reached() == [0, 1])
    assert robot.pose.distance_to(Pose2D(2.0, 2.0)) < 0.2
    assert robot.change(RTL) == [0]
    robot.until(lambda: robot.pose.distance_to(Pose2D(1.0, 1.0)) < 0.2)


@pytest.mark.parametrize("place", [(2.0, -3.0), (2.0, 0.05)])
def test_a_plan_through_a_wall_is_refused(robot, place):
    """The south wall of the small room stands at y = 0."""
    robot.say(mav.MAVLink_mission_count_message(1, 1, 1, 0))
    robot.say(mav.MAVLink_mission_item_int_message(
        1, 1, 0, 6, 16, 0, 1, 0, 0, 0, 0, *ORIGIN.to_integers(*place), 0, 0
    ))  # fmt: skip
    assert [m.type for m in robot.sent if m.get_type() == "MISSION_ACK"] == [10]


def test_sticks_drive_in_manual_and_the_mission_waits_on(robot):
    assert robot.change(HOLD) == [0] and robot.mode == HOLD
    assert robot.change(MANUAL) == [0] and robot.mode == MANUAL
    for _ in range(10):
        robot.say(mav.MAVLink_manual_control_message(1, 0, 0, 400, 0, 0))
    assert robot.run.speed > 0.1
    robot.steps(40)  # 2 s without sticks
    assert robot.run.speed < 0.02 and robot.run.runtime.state is MissionState.RUNNING


def test_velocities_drive_in_guided_until_they_stop_coming(robot):
    assert robot.change(GUIDED) == [0] and robot.mode == GUIDED
    forward = mav.MAVLink_set_position_target_local_ned_message(
        0, 1, 1, 8, 0x5C7, 0, 0, 0, 0.3, 0, 0, 0, 0, 0, 0, 0
    )
    for _ in range(15):
        robot.say(forward, steps=2)
    assert robot.run.speed == pytest.approx(0.3, abs=0.05) and robot.mode == GUIDED
    robot.steps(40)
    assert robot.run.speed < 0.02
    assert robot.change(AUTO) == [0]
    assert robot.run.runtime.state is MissionState.RUNNING

"""Commands, modes and arming, against an engine that answers as it is told."""

import pytest
from pymavlink.dialects.v20 import all as mav

from stack.telemetry.records import MissionState
from tests.stack.telemetry.mavlink.conftest import ORIGIN, of, results, text_of

ACCEPTED, REJECTED, DENIED, UNSUPPORTED, IN_PROGRESS = 0, 1, 2, 3, 5
ARM, SET_MODE, REPOSITION = 400, 176, 192
MANUAL, HOLD, AUTO, RTL, GUIDED = 0, 4, 10, 11, 15


def mode_of(rig):
    rig.sent.clear()
    rig.go_on(1.1)
    beat = of(rig.sent, "HEARTBEAT")[-1]
    return beat.custom_mode, bool(beat.base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED)


@pytest.mark.parametrize("target", [(1, 1), (1, 0), (0, 0)])
def test_an_unknown_command_is_acknowledged_to_its_sender(rig, target):
    (ack,) = of(rig.say(mav.MAVLink_command_long_message(*target, 31000, 0, *[0] * 7), (77, 5)),
                "COMMAND_ACK")  # fmt: skip
    assert (ack.command, ack.result) == (31000, UNSUPPORTED)
    assert (ack.target_system, ack.target_component) == (77, 5)


@pytest.mark.parametrize("target", [(2, 1), (1, 100)])
def test_commands_for_others_are_left_alone(rig, target):
    assert rig.long(ARM, 0, target=target) == [] and rig.orders == []


def test_our_own_id_commands_nothing(rig):
    assert rig.long(ARM, 0, sender=(1, 1)) == [] and rig.orders == []


def test_a_resent_command_is_acknowledged_but_not_run_again(rig):
    assert rig.long(ARM, 0) == [ACCEPTED]
    assert rig.long(ARM, 0, confirmation=1) == [ACCEPTED]
    assert [kind for kind, _ in rig.orders] == ["estop"]
    assert rig.long(ARM, 0) == [ACCEPTED]  # a new one, not resent
    assert [kind for kind, _ in rig.orders] == ["estop", "estop"]


def test_a_resend_after_another_command_is_run(rig):
    """COMMAND_INT has no counter: going back to a former goal is no resend."""
    places = [ORIGIN.to_integers(1.0, 2.5), ORIGIN.to_integers(1.5, 3.0)]
    for x, y in (places[0], places[0], places[1], places[0]):
        assert rig.int(REPOSITION, -1, 1, 0, float("nan"), x=x, y=y) == [ACCEPTED]
    goals = [round(given["x"], 1) for kind, given in rig.orders if kind == "set_goal"]
    assert goals == [1.0, 1.5, 1.0]


def test_a_slow_engine_is_in_progress(rig):
    rig.is_slow = True
    assert rig.long(SET_MODE, 1, HOLD) == []
    rig.sent.clear()
    assert results(rig.go_on(1.0)) == [IN_PROGRESS] * 3  # each 0.3 s
    assert rig.long(SET_MODE, 1, HOLD, confirmation=1) == [IN_PROGRESS]
    assert rig.long(SET_MODE, 1, AUTO) == [REJECTED]
    rig.is_slow = False
    rig.sent.clear()
    assert results(rig.go_on()) == [ACCEPTED] and [kind for kind, _ in rig.orders] == ["pause"]


def test_an_engine_without_an_answer_is_given_up(rig):
    rig.is_slow = True
    rig.long(SET_MODE, 1, HOLD)
    rig.sent.clear()
    rig.go_on(30.5)
    assert results(rig.sent)[-1] == DENIED and "no answer for 30 s" in text_of(rig.sent)


def test_disarming_is_the_emergency_stop_and_arming_its_release(rig):
    assert mode_of(rig) == (AUTO, True)
    assert rig.long(ARM, 0) == [ACCEPTED]
    assert rig.orders == [("estop", {"reason": "disarmed by station 255/190"})]
    rig.show(state=MissionState.EMERGENCY_STOP)
    assert mode_of(rig) == (HOLD, False)
    assert rig.long(SET_MODE, 1, AUTO) == [DENIED] and "disarmed" in text_of(rig.sent)
    assert rig.long(SET_MODE, 1, HOLD) == [ACCEPTED]
    assert rig.long(ARM, 1) == [ACCEPTED] and rig.orders[-1][0] == "release"
    rig.show(state=MissionState.PAUSED)
    assert mode_of(rig) == (HOLD, True)  # not on its way: that takes a mode
    assert rig.long(ARM, 1) == [ACCEPTED] and rig.orders[-1][0] == "release"


@pytest.mark.parametrize("state", [MissionState.SUCCESS, MissionState.ABORTED])
def test_a_mission_that_is_over_cannot_be_armed(rig, state):
    rig.show(state=state)
    assert mode_of(rig) == (HOLD, False)
    assert rig.long(ARM, 1) == [DENIED] and str(state) in text_of(rig.sent)


def test_a_heartbeat_comes_at_once_after_a_change(rig):
    assert of(rig.go_on(), "HEARTBEAT") == []
    rig.show(state=MissionState.PAUSED)
    assert len(of(rig.go_on(), "HEARTBEAT")) == 1


def test_modes_are_orders_to_the_engine(rig):
    assert rig.long(SET_MODE, 1, HOLD) == [ACCEPTED]
    rig.show(state=MissionState.PAUSED)
    assert mode_of(rig)[0] == HOLD
    assert rig.long(SET_MODE, 1, GUIDED) == [ACCEPTED] and mode_of(rig)[0] == GUIDED
    assert rig.long(SET_MODE, 1, RTL) == [ACCEPTED]
    rig.show(detour=True)
    assert mode_of(rig)[0] == RTL
    assert rig.long(SET_MODE, 1, AUTO) == [ACCEPTED]  # without a plan: the mission goes on
    rig.show(state=MissionState.RUNNING, detour=False)
    assert mode_of(rig)[0] == AUTO
    home = {"x": 1.0, "y": 2.0, "heading": 0.25, "tag": "mavlink home"}  # the first pose
    assert rig.orders == [
        ("pause", {}), ("pause", {}), ("set_goal", home), ("cancel_goal", {}), ("resume", {}),
    ]  # fmt: skip
    assert rig.long(SET_MODE, 1, 99) == [DENIED] and "no mode 99" in text_of(rig.sent)
    assert rig.long(SET_MODE, 0, HOLD) == [UNSUPPORTED]  # no custom mode


def test_the_older_set_mode_is_acknowledged_by_its_message_number(rig):
    (ack,) = of(rig.say(mav.MAVLink_set_mode_message(1, 1, HOLD)), "COMMAND_ACK")
    assert (ack.command, ack.result) == (11, ACCEPTED) and rig.orders == [("pause", {})]


def test_pause_and_continue(rig):
    assert rig.long(193, 0) == [ACCEPTED]
    rig.show(state=MissionState.PAUSED)
    assert rig.long(193, 1) == [ACCEPTED]
    assert [kind for kind, _ in rig.orders] == ["pause", "resume"]
    assert rig.long(193, 7) == [DENIED]


def test_manual_control_steers_only_where_the_mission_allows_it(rig):
    stick = mav.MAVLink_manual_control_message(1, 0, -500, 1000, 0, 0)
    assert rig.long(SET_MODE, 1, MANUAL) == [ACCEPTED]
    assert rig.orders == [("pause", {})] and "manual control is refused" in text_of(rig.sent)
    rig.show(state=MissionState.PAUSED)
    rig.say(stick)
    assert rig.orders == [("pause", {})] and "manual control is refused" in text_of(rig.sent)
    rig.show(state=MissionState.RUNNING, teleop=True)
    assert mode_of(rig)[0] == MANUAL
    rig.say(stick)  # full throttle is the cruise speed 0.5 m/s; steering left at half
    assert rig.orders[-1] == ("teleop", {"linear": 0.5, "lateral": 0.0, "angular": 0.5})


def test_goals_come_in_the_frames_of_earth(rig):
    x, y = ORIGIN.to_integers(1.5, 3.0)
    for frame in (0, 3, 5, 6):
        assert rig.int(REPOSITION, -1, 1, 0, 0.0, frame=frame, x=x, y=y) == [ACCEPTED]
    assert len([order for order in rig.orders if order[0] == "set_goal"]) == 4
    given = rig.orders[-1][1]  # yaw 0 is north: 90 degrees on the map; 1e-7 degrees are 11 mm
    assert (given["x"], given["y"]) == pytest.approx((1.5, 3.0), abs=0.01)
    assert given["heading"] == pytest.approx(1.5708, abs=1e-4)
    assert rig.int(REPOSITION, -1, 1, frame=1, x=x, y=y) == [9]  # unsupported frame
    assert rig.long(REPOSITION, -1, 1) == [8]  # COMMAND_INT only
    rig.refuse["set_goal"] = "(1.5, 3) is outside the map"
    assert rig.int(REPOSITION, -1, 1, frame=6, x=x, y=y + 1) == [DENIED]
    assert "outside the map" in text_of(rig.sent)


def test_a_goal_outside_guided_needs_the_flag(rig):
    x, y = ORIGIN.to_integers(1.5, 3.0)
    assert rig.int(REPOSITION, -1, 0, x=x, y=y) == [DENIED] and rig.orders == []


def target(mask, frame=1, **values):
    names = ("x", "y", "z", "vx", "vy", "vz", "afx", "afy", "afz", "yaw", "yaw_rate")
    numbers = [values.get(name, 0.0) for name in names]
    return mav.MAVLink_set_position_target_local_ned_message(0, 1, 1, frame, mask, *numbers)


def test_a_repeated_position_target_is_one_goal(paused):
    paused.say(target(0xDF8, x=3.0, y=1.5))
    assert paused.orders == []  # not in GUIDED
    paused.long(SET_MODE, 1, GUIDED)
    for _ in range(5):  # north 3, east 1.5
        paused.say(target(0xDF8, x=3.0, y=1.5))
        paused.go_on(0.3)
    (goal,) = [given for kind, given in paused.orders if kind == "set_goal"]
    assert (goal["x"], goal["y"]) == (1.5, 3.0)
    paused.say(target(0xDF8, frame=9, x=1.0, y=0.0))  # 1 m ahead of (1, 2, 0.25)
    assert paused.orders[-1][1]["x"] == pytest.approx(1.0 + 0.9689, abs=1e-3)
    assert paused.orders[-1][1]["y"] == pytest.approx(2.0 + 0.2474, abs=1e-3)


def test_velocities_drive_by_teleoperation(paused):
    paused.long(SET_MODE, 1, GUIDED)
    velocity = target(0x5C7, frame=8, vx=0.4, yaw_rate=0.2)
    paused.say(velocity)
    assert paused.orders[-1][0] == "behaviour" and paused.orders[-1][1]["name"] == "assisted_teleop"
    paused.show(detour=True, teleop=True)
    paused.say(velocity)
    kind, given = paused.orders[-1]
    assert kind == "teleop" and given["linear"] == pytest.approx(0.4)
    assert given["angular"] == pytest.approx(-0.2)  # yaw rate is to the right
    paused.say(target(0x5C7, vx=float("nan")))
    assert paused.orders[-1] == (kind, given)


def test_speed_home_and_requests(rig):
    assert rig.long(178, 1, 0.7) == [ACCEPTED]
    ((kind, speed),) = rig.orders
    assert (kind, speed["name"]) == ("set_parameter", "controller.cruise_speed")
    assert speed["value"] == pytest.approx(0.7)
    x, y = ORIGIN.to_integers(1.5, 3.0)
    assert rig.int(179, 0, frame=0, x=x, y=y) == [ACCEPTED]
    (home,) = of(rig.sent, "HOME_POSITION")
    assert (home.latitude, home.longitude) == (x, y) and home.x == pytest.approx(3.0, abs=0.01)
    assert rig.long(410) == [ACCEPTED] and len(of(rig.sent, "HOME_POSITION")) == 1
    for command, first in ((512, 148), (520, 1)):
        assert rig.long(command, first) == [ACCEPTED]
        (version,) = of(rig.sent, "AUTOPILOT_VERSION")
        assert version.capabilities & mav.MAV_PROTOCOL_CAPABILITY_MISSION_INT
    assert rig.long(512, 435) == [UNSUPPORTED] and rig.long(512, 397) == [UNSUPPORTED]
    assert rig.long(224, 3) == [DENIED]


def test_every_request_for_a_message_is_answered(rig):
    """QGroundControl asks for modes (435) and metadata (395, 397), and waits for an answer."""
    for number in (*mav.mavlink_map, 435, 395, 397, 99_999):
        assert len(rig.long(512, number)) == 1, number


def test_what_other_operators_do_shows_in_the_mode(rig):
    rig.show(state=MissionState.PAUSED)
    assert rig.long(SET_MODE, 1, GUIDED) == [ACCEPTED] and mode_of(rig)[0] == GUIDED
    rig.show(state=MissionState.RUNNING)  # resumed in the dashboard
    assert mode_of(rig)[0] == AUTO
    rig.show(state=MissionState.PAUSED)
    assert mode_of(rig)[0] == HOLD
    rig.show(detour=True)  # sent to a goal in the dashboard
    assert mode_of(rig)[0] == GUIDED
    rig.show(detour=False, detour_held=True)
    assert mode_of(rig)[0] == HOLD


def test_intervals(rig):
    assert rig.long(511, 30, 100_000) == [ACCEPTED]
    rig.sent.clear()
    assert 9 <= len(of(rig.go_on(1.0), "ATTITUDE")) <= 11
    assert rig.long(511, 30, 1.0) == [ACCEPTED]  # at most 50 Hz
    rig.sent.clear()
    assert 45 <= len(of(rig.go_on(1.0), "ATTITUDE")) <= 51
    assert rig.long(510, 30) == [ACCEPTED]
    assert of(rig.sent, "MESSAGE_INTERVAL")[0].interval_us == 20_000
    assert rig.long(511, 30, -1) == [ACCEPTED]
    rig.sent.clear()
    assert of(rig.go_on(1.0), "ATTITUDE") == []
    assert rig.long(511, 9999, 1000) == [UNSUPPORTED]
    rig.say(mav.MAVLink_request_data_stream_message(1, 1, 0, 4, 1))
    rig.sent.clear()
    rig.go_on(1.0)
    assert 3 <= len(of(rig.sent, "ATTITUDE")) <= 5
    assert 3 <= len(of(rig.sent, "GLOBAL_POSITION_INT")) <= 5

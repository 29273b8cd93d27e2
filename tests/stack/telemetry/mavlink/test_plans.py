"""Upload, download and driving of plans, against an engine that answers as it is told."""

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from stack.telemetry.mavlink.plan import MAX_ITEMS
from stack.telemetry.records import MissionState
from tests.stack.telemetry.mavlink.conftest import ORIGIN, Rig, of, text_of

OK, ERROR, BAD_FRAME, UNSUPPORTED, NO_SPACE, BAD_SPEED = 0, 1, 2, 3, 4, 7
BAD_PLACE, BAD_SEQUENCE, DENIED, CANCELLED = 10, 13, 14, 15
NAN = float("nan")
ANOTHER = (254, 1)
AUTO, HOLD = 10, 4


def item(seq, x=1.5, y=3.0, command=16, frame=6, parameters=(0, 0, 0, NAN), kind=0):
    latitude, longitude = ORIGIN.to_integers(x, y)
    return mav.MAVLink_mission_item_int_message(
        1, 1, seq, frame, command, 0, 1, *parameters, latitude, longitude, 7.5, kind
    )


def count(number, kind=0):
    return mav.MAVLink_mission_count_message(1, 1, number, kind)


def acks(messages):
    return [message.type for message in of(messages, "MISSION_ACK")]


def asked(messages):
    return [message.seq for message in of(messages, "MISSION_REQUEST_INT")]


def upload(rig, *items, sender=(255, 190)):
    """Upload a plan; the result."""
    assert asked(rig.say(count(len(items)), sender)) == [0]
    for number, one in enumerate(items):
        sent = rig.say(one, sender)
        if number + 1 < len(items) and not acks(sent):
            assert asked(sent) == [number + 1]
        elif acks(sent):
            return acks(sent)[0]
    return None


def stored(rig):
    """Number of items that a download would get."""
    (answer,) = of(rig.say(mav.MAVLink_mission_request_list_message(1, 1, 0)), "MISSION_COUNT")
    return answer.count


PLAN = (item(0), item(1, 1.0, 2.6, 19, parameters=(2.0, 0, 0, 0)), item(2, command=178, frame=2,
        parameters=(1, 0.4, NAN, NAN)), item(3, command=20, frame=2))  # fmt: skip


def test_a_plan_comes_back_as_it_was_sent(rig):
    assert upload(rig, *PLAN) == OK and stored(rig) == 4
    requests = [mav.MAVLink_mission_request_int_message(1, 1, seq, 0) for seq in (3, 0, 1, 2)]
    for request in requests:  # several at once, in any order
        (back,) = of(rig.say(request), "MISSION_ITEM_INT")
        sent = PLAN[back.seq]
        for name in ("frame", "command", "param1", "param2", "x", "y", "z", "autocontinue"):
            assert getattr(back, name) == pytest.approx(getattr(sent, name), nan_ok=True)
        assert math.isnan(back.param4) == math.isnan(sent.param4)
    (old,) = of(rig.say(mav.MAVLink_mission_request_message(1, 1, 0, 0)), "MISSION_ITEM")
    assert old.x == pytest.approx(PLAN[0].x / 1e7, abs=1e-5)  # 32-bit floats: 0.4 m
    assert acks(rig.say(mav.MAVLink_mission_request_int_message(1, 1, 4, 0))) == [BAD_SEQUENCE]


def test_the_older_items_in_degrees_are_accepted(rig):
    rig.say(count(1))
    place = ORIGIN.to_geodetic(1.5, 3.0)
    old = mav.MAVLink_mission_item_message(1, 1, 0, 3, 16, 0, 1, 0, 0, 0, 0, *place, 0, 0)
    assert acks(rig.say(old)) == [OK]


def test_lost_messages_are_asked_for_again(rig):
    rig.say(count(2))
    assert asked(rig.go_on(0.6)) == [0, 0, 0]  # the first, and each 0.25 s
    assert asked(rig.say(item(1))) == [0]  # out of order
    assert asked(rig.say(item(0))) == [1]
    assert asked(rig.say(item(0))) == [1]  # repeated
    assert acks(rig.say(item(1))) == [OK]
    assert acks(rig.say(item(1))) == [OK]  # its ack was lost
    rig.go_on(11.0)
    assert acks(rig.say(item(1))) == [BAD_SEQUENCE]


def test_the_old_plan_stays_until_the_last_item(rig):
    assert upload(rig, item(0)) == OK
    rig.say(count(3))
    rig.say(item(0))
    assert stored(rig) == 1
    rig.sent.clear()
    sent = rig.go_on(4.0)  # 12 tries, then it is given up
    assert acks(sent) == [CANCELLED] and len(asked(sent)) == 12 and stored(rig) == 1
    rig.say(count(3))
    assert acks(rig.say(item(0, command=22))) == [UNSUPPORTED] and stored(rig) == 1


def test_one_station_uploads_at_a_time(rig):
    rig.say(count(2))
    assert acks(rig.say(count(1), ANOTHER)) == [DENIED]
    assert acks(rig.say(item(0), ANOTHER)) == [DENIED]
    assert acks(rig.say(mav.MAVLink_mission_clear_all_message(1, 1, 0), ANOTHER)) == [DENIED]
    rig.say(item(0))
    assert acks(rig.say(item(1))) == [OK]
    assert upload(rig, item(0), sender=ANOTHER) == OK


@pytest.mark.parametrize(
    ("one", "result", "text"),
    [
        (item(0, command=22), UNSUPPORTED, "command 22"),
        (item(0, frame=1), BAD_FRAME, "frame 1"),
        (item(0, x=-30.0), BAD_PLACE, "item 0 at (-30.0, 3.0) m is outside the map"),
        (item(0, command=178, parameters=(1, -5.0, 0, 0)), BAD_SPEED, "speed -5"),
        (item(0, parameters=(-1.0, 0, 0, 0)), 6, "wait of -1 s"),
    ],
)
def test_items_that_cannot_be_driven_are_refused(rig, one, result, text):
    free = rig.handover.snapshot.layers["map"].content
    free.cells[:] = 0
    assert upload(rig, one) == result
    assert text in text_of(rig.sent) and stored(rig) == 0


def test_a_waypoint_in_an_obstacle_is_refused(rig):
    grid = rig.handover.snapshot.layers["map"].content
    grid.cells[:] = 0
    row, column = grid.cell_at(1.5, 3.0)
    grid.cells[row - 1 : row + 2, column - 1 : column + 2] = 100
    assert upload(rig, item(0, 1.0, 2.5), item(1)) == BAD_PLACE
    assert "item 1 at (1.5, 3.0) m is in an obstacle" in text_of(rig.sent)


def test_without_an_origin_nothing_on_earth_is_driven_to(clock):
    rig = Rig(clock, origin=None)
    assert upload(rig, item(0)) == ERROR and "--origin" in text_of(rig.sent)
    assert of(rig.go_on(2.0), "GLOBAL_POSITION_INT") == []
    rig.say(mav.MAVLink_set_gps_global_origin_message(1, 480000000, 110000000, 500000))
    assert of(rig.sent, "GPS_GLOBAL_ORIGIN")[0].latitude == 480000000
    assert upload(rig, item(0)) == OK
    rig.say(mav.MAVLink_set_gps_global_origin_message(1, 0, 0, 0))
    assert "does not change" in text_of(rig.sent)


def test_fences_and_rally_points_are_empty(rig):
    for kind in (1, 2):
        (answer,) = of(rig.say(mav.MAVLink_mission_request_list_message(1, 1, kind)),
                       "MISSION_COUNT")  # fmt: skip
        assert (answer.count, answer.mission_type) == (0, kind)
        assert acks(rig.say(count(0, kind))) == [OK]
        assert acks(rig.say(count(2, kind))) == [UNSUPPORTED]
    assert acks(rig.say(mav.MAVLink_mission_clear_all_message(1, 1, 255))) == [OK]
    assert acks(rig.say(count(MAX_ITEMS + 1))) == [NO_SPACE]
    for part in (mav.MAVLink_mission_request_partial_list_message(1, 1, 0, 1, 0),
                 mav.MAVLink_mission_write_partial_list_message(1, 1, 0, 1, 0)):  # fmt: skip
        assert acks(rig.say(part)) == [UNSUPPORTED]


def test_an_empty_upload_and_a_clear_forget_the_plan(rig):
    for clears in (count(0), mav.MAVLink_mission_clear_all_message(1, 1, 0)):
        assert upload(rig, item(0)) == OK and stored(rig) == 1
        assert acks(rig.say(clears)) == [OK] and stored(rig) == 0


@pytest.mark.parametrize(
    ("rule", "frame", "begins"),
    [("auto", 0, 1), ("auto", 3, 0), ("always", 3, 1), ("never", 0, 0)],
)
def test_the_first_item_may_be_home(clock, rule, frame, begins):
    rig = Rig(clock, home_item=rule)
    assert upload(rig, item(0, frame=frame), item(1)) == OK
    assert of(rig.sent, "MISSION_CURRENT")[-1].seq == begins
    assert stored(rig) == 2


def driven(rig):
    """What the engine was told, short."""
    return [given["name"] + " " + given["ports"][0] if kind == "behaviour" else kind
            for kind, given in rig.orders]  # fmt: skip


def reached(rig):
    return [message.seq for message in of(rig.sent, "MISSION_ITEM_REACHED")]


def test_a_plan_is_driven_item_by_item(rig):
    """From (1, 2) to (1.5, 3): the heading is atan2(1, 0.5) = 1.1071 rad."""
    upload(rig, *PLAN)
    assert rig.long(176, 1, AUTO) == [0]
    rig.show(state=MissionState.PAUSED, detour=True)
    assert reached(rig) == []
    for expected in ([0], [], [1, 2], [3]):
        rig.sent.clear()
        rig.detour_ends()
        assert reached(rig) == expected
    assert driven(rig)[0].startswith("navigate_to_pose goal=[1.500, 3.00")
    assert rig.orders[0][1]["ports"][0].endswith(" 1.1080]")  # 1e-7 degrees are up to 6 mm off
    assert driven(rig)[1].startswith("navigate_to_pose goal=[1.0")
    assert driven(rig)[2:4] == ["wait time=2", "set_parameter"]
    assert driven(rig)[4] == "navigate_to_pose goal=[1.000, 2.000, 0.2500]"
    assert "Mission complete" in text_of(rig.sent)
    (*_, now) = of(rig.sent, "MISSION_CURRENT")
    assert (now.seq, now.total, now.mission_state) == (3, 4, mav.MISSION_STATE_COMPLETE)


def start(rig, *items):
    assert upload(rig, *items) == OK
    assert rig.long(176, 1, AUTO) == [0]
    rig.show(state=MissionState.PAUSED, detour=True)


def test_a_pause_keeps_the_item(rig):
    start(rig, item(0), item(1, 1.0, 2.6))
    rig.detour_ends()
    assert rig.long(193, 0) == [0] and rig.orders[-1][0] == "pause"
    rig.show(detour=False, detour_held=True)
    assert of(rig.go_on(1.1), "MISSION_CURRENT")[-1].mission_state == mav.MISSION_STATE_PAUSED
    assert rig.long(176, 1, AUTO) == [0] and rig.orders[-1][0] == "resume"
    rig.show(detour=True, detour_held=False)
    rig.sent.clear()
    rig.detour_ends()
    assert reached(rig) == [1]


def test_a_pause_between_two_items_is_kept(rig):
    """The engine has ended one item when HOLD comes, and the next is not begun yet."""
    start(rig, item(0), item(1, 1.0, 2.6))
    rig.is_slow = True
    rig.say(mav.MAVLink_command_long_message(1, 1, 176, 0, 1, HOLD, 0, 0, 0, 0, 0))
    rig.show(detour=False)
    rig.detour_ends()
    rig.is_slow = False
    rig.go_on()
    assert [kind for kind, _ in rig.orders] == ["behaviour", "pause"]
    assert rig.long(176, 1, AUTO) == [0] and [kind for kind, _ in rig.orders][2:] == ["behaviour"]


def test_an_interrupted_item_is_driven_again(rig):
    start(rig, item(0), item(1, 1.0, 2.6))
    rig.detour_ends()
    rig.detour_ends("cancelled")  # an emergency stop
    rig.show(detour=False)
    assert rig.long(176, 1, AUTO) == [0]
    assert [given["ports"][0][:11] for kind, given in rig.orders if kind == "behaviour"] == [
        "goal=[1.500", "goal=[1.000", "goal=[1.000",
    ]  # fmt: skip


def test_a_failed_item_stops_the_plan(rig):
    start(rig, item(0), item(1, 1.0, 2.6))
    assert "stops at item 0" in text_of(rig.detour_ends("failure"))
    assert len(rig.orders) == 1
    rig.show(detour=False)
    beat = of(rig.go_on(1.1), "HEARTBEAT")[-1]
    assert beat.custom_mode == HOLD


def test_a_plan_that_is_driven_is_not_replaced(rig):
    start(rig, item(0), item(1, 1.0, 2.6))
    assert acks(rig.say(count(1))) == [DENIED] and "HOLD or GUIDED" in text_of(rig.sent)
    assert acks(rig.say(mav.MAVLink_mission_clear_all_message(1, 1, 0))) == [DENIED]
    assert rig.long(176, 1, 15) == [0]  # GUIDED
    rig.show(detour=False)
    assert upload(rig, item(0)) == OK


def test_the_current_item_can_be_chosen(rig):
    assert upload(rig, item(0), item(1, 1.0, 2.6)) == OK
    sent = rig.say(mav.MAVLink_mission_set_current_message(1, 1, 1))
    assert of(sent, "MISSION_CURRENT")[-1].seq == 1
    rig.say(mav.MAVLink_mission_set_current_message(1, 1, 9))
    assert "no item 9" in text_of(rig.sent)
    assert rig.long(300, 0, 0) == [0] and driven(rig)[0].startswith("navigate_to_pose goal=[1.000")
    rig.show(state=MissionState.PAUSED, detour=True)
    assert rig.long(224, 0) == [0] and driven(rig)[1].startswith("navigate_to_pose goal=[1.500")
    rig.sent.clear()
    rig.detour_ends()
    assert reached(rig) == [0]


def test_a_long_plan_without_motion_needs_no_deep_stack(rig):
    speeds = [item(n, command=178, frame=2, parameters=(1, -1, 0, 0)) for n in range(MAX_ITEMS)]
    assert upload(rig, *speeds) == OK
    rig.long(176, 1, AUTO)
    rig.sent.clear()
    rig.go_on(6.0)
    assert reached(rig)[-1] == MAX_ITEMS - 1

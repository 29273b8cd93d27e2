"""Parameters by their short names."""

import re
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import all as mav

from missions.execution.component_choices import SETTINGS
from stack.components import BUILT_IN, component
from stack.parameters import declarations
from stack.telemetry.mavlink.parameter_names import LENGTH, short_name, short_names
from tests.stack.telemetry.mavlink.conftest import of, text_of

PAGE = Path(__file__).parents[4] / "docs" / "rovers.md"
COSTMAPS = ("local_costmap", "global_costmap")
FIXED = ("planner", "costmap_layer", "loop", "recording", "speed_limits", "tracker")
"""Whose parameters do not change during a run."""


def set_(name, value, kind=9):
    return mav.MAVLink_param_set_message(1, 1, name.encode(), value, kind)


def values(messages):
    return {m.param_id: (m.param_value, m.param_type) for m in of(messages, "PARAM_VALUE")}


def test_the_list_has_the_public_numbers(rig):
    rig.say(mav.MAVLink_param_request_list_message(1, 1))
    found = values(rig.go_on(0.2))
    assert found == {
        "CTL_CRUISE_SPEED": (0.5, mav.MAV_PARAM_TYPE_REAL32),
        "LOC_BEAMS": (60.0, mav.MAV_PARAM_TYPE_INT32),
        "DEP_OBSTACLES": (0.0, mav.MAV_PARAM_TYPE_UINT8),
    }
    every = of(rig.sent, "PARAM_VALUE")
    assert [(m.param_index, m.param_count) for m in every] == [(0, 3), (1, 3), (2, 3)]


def test_one_is_read_by_name_or_index(rig):
    for name, index in (("LOC_BEAMS", -1), ("", 1)):
        asked = mav.MAVLink_param_request_read_message(1, 1, name.encode(), index)
        assert values(rig.say(asked)) == {"LOC_BEAMS": (60.0, mav.MAV_PARAM_TYPE_INT32)}
    for name, index in (("NONE", -1), ("", 3)):
        rig.say(mav.MAVLink_param_request_read_message(1, 1, name.encode(), index))
        assert "there is no parameter" in text_of(rig.sent)


@pytest.mark.parametrize(
    ("name", "given", "order"),
    [
        ("CTL_CRUISE_SPEED", 0.7, 0.7),  # not 0.699999988079071, its 32-bit float
        ("LOC_BEAMS", 30.0, 30),
        ("DEP_OBSTACLES", 1.0, True),
    ],
)
def test_a_change_is_an_order_and_its_value_comes_back(rig, name, given, order):
    sent = rig.say(set_(name, given))
    ((kind, arguments),) = rig.orders
    assert kind == "set_parameter" and arguments["value"] == order
    assert type(arguments["value"]) is type(order)
    assert values(sent)[name][0] == pytest.approx(given)


def test_a_refused_change_is_answered_with_the_old_value(rig):
    rig.refuse["set_parameter"] = "cruise_speed: 50 m/s must be at most 5 m/s"
    assert values(rig.say(set_("CTL_CRUISE_SPEED", 50.0)))["CTL_CRUISE_SPEED"][0] == 0.5
    assert "at most 5 m/s" in text_of(rig.sent)
    assert values(rig.say(set_("CTL_CRUISE_SPEED", float("nan"))))["CTL_CRUISE_SPEED"][0] == 0.5
    assert len(rig.orders) == 1


def public_names():
    """Full names of all public parameters of the shipped components."""
    kinds = {kind: [component(kind, name).Parameters for name in names]
             for kind, names in BUILT_IN.items()}  # fmt: skip
    kinds |= {kind: [parameters] for kind, parameters in SETTINGS.items() if kind != "costmap"}
    kinds |= {kind: [SETTINGS["costmap"]] for kind in COSTMAPS}
    kinds = {kind: classes for kind, classes in kinds.items() if kind not in FIXED}
    return sorted(
        {
            f"{kind}.{name}"
            for kind, classes in kinds.items()
            for parameters in classes
            for name, declared in declarations(parameters).items()
            if declared.public and declared.type in (float, int, bool)
        }
    )


def test_short_names_are_unique_and_readable():
    names = public_names()
    found = short_names(names)
    assert len(found) == len(names) > 50
    assert {short_name(name) for name in names} == set(found)  # none needs a checksum
    assert all(re.fullmatch(r"[A-Z0-9_]{4,16}", short) for short in found)
    assert found["LOC_INIT_POS_DEV"] == "localisation.initial_position_deviation"


def test_two_that_would_be_the_same_end_in_a_checksum():
    full = ["plugin.aaaaaaaaaaaaaaaaaa", "plugin.aaaaaaaaaaaaaaaaab"]
    found = short_names(full)
    assert list(found.values()) == full and all(len(short) <= LENGTH for short in found)


def test_the_page_lists_them():
    rows = re.findall(r"^\| `([A-Z0-9_]+)` \| `([a-z_.0-9]+)` \|", PAGE.read_text("utf-8"), re.M)
    assert {full: short for short, full in rows} == {
        name: short_name(name) for name in public_names()
    }

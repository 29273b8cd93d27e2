"""Schemas of commands: what is accepted, and what refusals say."""

import json
from math import inf, nan

import msgpack
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stack.errors import InputError
from stack.runtime.command_schema import MAX_TEXT, SCHEMAS, SpeedArguments, loggable, read_arguments
from stack.telemetry.event_log import event_line
from stack.telemetry.records import Event

POSE = {"x": 1.0, "y": -2, "heading": 0.5}
VALID = [
    ("pause", {}),
    ("resume", {}),
    ("estop", {"reason": "a hand"}),
    ("release", {}),
    ("abort", {"reason": "late"}),
    ("abort", {}),
    ("speed", {"factor": 0}),
    ("speed", {"factor": 0.01}),
    ("speed", {"factor": 1000}),
    ("set_pose", POSE),
    ("set_goal", POSE | {"tag": "a"}),
    ("cancel_goal", {}),
    ("behaviour", {"name": "wait", "ports": ["time=1 s"], "tag": "a"}),
    ("drop_box", {"x": 1.0, "y": 2.0, "height": 0.3}),
    ("move_door", {"name": "lab", "closed": True}),
    ("push_robot", {"forward": 0.3, "turn": 0.5}),
    ("lift_robot", {"x": 1.0, "y": 2.0}),
    ("silence_sensor", {"name": "lidar"}),
    ("set_charge", {"charge": 0.1}),
    ("set_parameter", {"name": "controller.cruise_speed", "value": 0.4}),
    ("set_parameter", {"name": "a.b", "value": ["x", True, None, 3]}),
    ("teleop", {"linear": 0.2, "angular": -0.4, "lateral": 0.0}),
    ("teleop", {}),
    ("teleop_done", {}),
    ("break", {"node": "12", "generation": 0}),
    ("unbreak", {}),
    ("force", {"node": "drive", "status": "failure", "code": "NO_VALID_PATH"}),
    ("step", {"ticks": 5}),
    ("continue", {}),
]
HOSTILE = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text() | st.binary()
    | st.just(10**400) | st.just(msgpack.ExtType(4, b"x")) | st.just(msgpack.Timestamp(1))
    | st.just("x" * 100_000) | st.just("\x1b[2J") | st.just("\ud800"),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner),
    max_leaves=6,
)  # fmt: skip
NAMES = st.sampled_from(
    ["x", "y", "heading", "factor", "reason", "name", "value", "node", "status", "ticks", "linear"]
)


@pytest.mark.parametrize(("kind", "arguments"), VALID)
def test_valid_commands_are_accepted_and_logged_unchanged(kind, arguments):
    assert isinstance(read_arguments(kind, arguments), SCHEMAS[kind])
    assert loggable(arguments) == arguments


def test_every_kind_has_a_valid_example():
    assert {kind for kind, _ in VALID} == SCHEMAS.keys()


@pytest.mark.parametrize(
    ("kind", "arguments", "reason"),
    [
        ("speed", {"factor": 1e-300}, "speed: factor: expected 0 (as fast as possible) or 0.01 to"),
        ("speed", {"factor": -1}, "got -1"),
        ("speed", {"factor": 1001.0}, "got 1001"),
        ("speed", {"factor": nan}, "speed: factor: expected a finite number"),
        ("speed", {"factor": True}, "speed: factor: expected a number, got true"),
        ("speed", {"factor": "4"}, "speed: factor: expected a number, got the text '4'"),
        ("speed", {}, "speed: needs the argument 'factor': simulated seconds"),
        ("speed", {"factor": 1, "fcator": 2}, "no argument 'fcator'; did you mean 'factor'?"),
        ("set_pose", POSE | {"x": 1e300}, "set_pose: x: expected a finite number up to 1e15"),
        ("set_pose", POSE | {"x": 1.1e6}, "set_pose: x: 1.1e+06 m must be at most 1e+06 m"),
        ("set_pose", POSE | {"y": inf}, "set_pose: y: expected a finite number"),
        ("set_pose", POSE | {"y": 10**400}, "set_pose: y: expected a finite number"),
        ("set_goal", POSE | {"heading": 90.0}, "heading: 90 rad must be at most 6.28319 rad"),
        ("set_goal", POSE | {"x": [1.0]}, "set_goal: x: expected a length, got [1.0]"),
        ("teleop", {"linear": None}, "teleop: linear: expected a number in m/s, got nothing"),
        ("teleop", {"linear": b"1"}, "teleop: linear: unexpected bytes"),
        ("teleop", {"linear": msgpack.ExtType(4, b"x")}, "teleop: linear: unexpected ExtType"),
        ("pause", {"now": True}, "pause: there is no argument 'now'; it has no arguments"),
        ("abort", {"reason": "x" * 301}, "abort: reason: 301 characters; at most 300"),
        ("abort", {"reason": "a\x1b[2J"}, r"one line without control characters, got 'a\x1b[2J'"),
        ("abort", {"reason": "a\nb"}, r"one line without control characters, got 'a\nb'"),
        ("set_parameter", {"name": "a.b", "value": [[1]]}, "value: unexpected list"),
        ("set_parameter", {"name": "a.b", "value": {"a": 1}}, "value: unexpected dict"),
        ("set_parameter", {"name": "a.b", "value": [1] * 33}, "a list of 33; at most 32"),
        ("set_parameter", {"name": 3, "value": 1}, "name: expected text, got 3"),
        ("break", {"node": 12}, "break: node: expected text, got 12"),
        ("break", {"node": "12", "generation": "0"}, "generation: expected a whole number"),
        ("step", {"ticks": 2.0}, "step: ticks: expected a whole number, got 2.0"),
        ("step", {"ticks": 10**7}, "step: ticks: 1e+07 must be at most 1e+06"),
        ("PAUSE", {}, "there is no command 'PAUSE'; available: pause, resume"),
        ("\x1b[2J" * 100, {}, r"there is no command '\x1b[2J"),
    ],
)  # fmt: skip
def test_malformed_commands_are_refused_with_the_reason(kind, arguments, reason):
    with pytest.raises(InputError) as refused:
        read_arguments(kind, arguments)
    text = str(refused.value)
    assert reason in text
    assert len(text) < 400
    assert text.isprintable()


def test_an_emergency_stop_is_accepted_with_any_arguments():
    for arguments in ({"reason": b"now"}, {"reason": "x" * 1000}, {"quick": 1}, {"reason": None}):
        assert read_arguments("estop", arguments).reason == "operator"


@given(st.sampled_from([*SCHEMAS, "", "x"]), st.dictionaries(NAMES | st.text(), HOSTILE))
def test_any_command_is_read_or_refused_and_can_be_logged(kind, arguments):
    """Bound: 11 names of 300 characters, each with 32 texts of 300 characters of 6 bytes."""
    try:
        read_arguments(kind, arguments)
    except InputError as error:
        assert len(str(error)) < 1000
    logged = {"arguments": loggable(arguments), "command": loggable(kind)}
    line = event_line(Event(0, 0, 0.0, "info", "command", "command", "", logged))
    assert len(line) < 11 * 33 * 300 * 6
    assert json.loads(line)["fields"].keys() == logged.keys()


def test_the_log_of_a_hostile_command_is_short():
    hostile = {"a\x1b" * 500: ["x" * 10**6] * 1000, "b": {"c": {"d": {"e": 1}}}, "f": b"x" * 10**6}
    logged = loggable(hostile)
    names = list(logged)
    assert names[0] == r"a\x1b" * 150 + "…"
    assert logged[names[0]] == ["x" * MAX_TEXT + "…"] * 32 + ["… 1000 in all"]
    assert logged["b"] == {"c": "<dict>"}
    assert logged["f"] == "<bytes>"


def test_the_speeds_of_the_command_line_are_those_of_the_command():
    from missions.execution.supervision.engine import speed_factor as of_option

    assert of_option("max") == SpeedArguments(0.0).factor
    for limit in ("0.01", "1000"):
        assert of_option(limit) == SpeedArguments(float(limit)).factor
    for beyond in ("0.009", "1000.1", "1e-300", "nan", "inf", "-1", "0", "1e400"):
        with pytest.raises(InputError, match=r"max, or a number from 0\.01 to 1000"):
            of_option(beyond)

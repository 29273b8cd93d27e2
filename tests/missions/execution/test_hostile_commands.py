"""Malformed commands to a running mission: refused, logged, without effect."""

from __future__ import annotations

import dataclasses
import random
from contextlib import suppress
from math import inf, nan

import msgpack
import pytest

from stack.errors import TelemetryError
from stack.runtime.command_schema import SCHEMAS
from stack.telemetry.codec import decode, encode
from stack.telemetry.records import Command, MissionState
from tests.missions.execution.live_run import LiveRun
from tests.stack.runtime.test_command_schema import VALID

MISSION = """
run:
  sequence:
    - wait: {time: 100 s}
      name: drive
"""
UNMAPPED = "mission: lively\nrobot: scout\nworld: small_room\nmap: none\n"
BAD_NUMBERS = (nan, inf, -inf, 1e300, 10**400, -(10**30), True, "1", "x", None, b"1", [1.0], {})
BAD_TEXTS = (
    1, 1.0, True, None, b"x", [], {}, "x" * 301, "a\x1b[31mb", "a\nb", "\u202eb",
    "\ud800", "no such", msgpack.ExtType(4, b"x"), msgpack.Timestamp(1),
)  # fmt: skip
BAD_VALUES = (b"x", {}, [[1]], [{}], [1] * 33, nan, 1e300, msgpack.ExtType(4, b"x"))
HOSTILE = (
    {"factor": msgpack.ExtType(7, b"\0" * 100)},
    {"factor": msgpack.Timestamp(2**40)},
    {"factor": b"\xff" * 1000},
    {"factor": [[[[[[1]]]]]]},
    {"factor": 1e-300},
    {"f" * 10_000: 1},
    {str(n): n for n in range(10_000)},
)
FREE_TEXTS = {("abort", "reason"), ("estop", "reason"), ("set_goal", "tag"), ("behaviour", "tag")}


def mutated(chance: random.Random) -> Command:
    """A valid command with one mutation that makes it invalid."""
    kind, valid = chance.choice(VALID)
    arguments = dict(valid)
    choice = chance.randrange(4) if arguments else chance.randrange(2)
    if choice == 0:
        place = chance.randrange(len(kind) + 1)
        kind = kind[:place] + chance.choice("xz_ \0\x1b\u202e") + kind[place:]
    elif choice == 1:
        arguments[chance.choice(("z", "", "\x1b", "x" * 10_000, "é"))] = chance.choice(BAD_TEXTS)
    else:
        name = chance.choice(list(arguments))
        wrong = BAD_TEXTS if isinstance(arguments[name], str) else BAD_NUMBERS
        wrong = BAD_VALUES if name == "value" else wrong
        if (kind, name) in FREE_TEXTS:
            wrong = tuple(text for text in BAD_TEXTS if text != "no such")
        arguments[name] = chance.choice(
            [item for item in wrong if not (name == "generation" and item is None)]
        )
    return Command("1", kind, arguments)


def condition(run: LiveRun) -> tuple:
    """All that a command could change."""
    runtime = run.runtime
    parts = runtime.parts
    return (
        runtime.state, runtime.reason, runtime.mission.emergency_stop, parts.body.pace,
        parts.live_parameters.current(), parts.robot.localisation.pose, parts.debugger.view(),
        runtime.command, parts.navigator.base.teleoperation, parts.tree.outcome,
        len(run.kept.events),
    )  # fmt: skip


def assert_refused(run: LiveRun, command: Command) -> None:
    before = condition(run)
    ack = run.runtime.apply(command)
    assert not ack.done, command
    assert ack.reason
    assert ack.reason.isprintable()
    assert condition(run) == (*before[:-1], before[-1] + 1)  # the event of the refusal
    event = run.kept.events[-1]
    assert (event.kind, event.level, event.fields["refused"]) == ("command", "warning", ack.reason)


def obey_mutations(run: LiveRun, count: int, seed: int) -> int:
    """Send mutated commands; return how many were emergency stops."""
    chance, stops = random.Random(seed), 0
    for number in range(count):
        command = mutated(chance)
        if command.kind == "estop":
            assert run.runtime.apply(command).done
            assert run.runtime.state is MissionState.EMERGENCY_STOP
            for kind in ("release", "resume"):
                assert run.runtime.apply(Command("1", kind)).done
            stops += 1
        else:
            assert_refused(run, command)
        if number % 100 == 0:
            run.steps()
    return stops


@pytest.fixture
def run(tmp_path, live_run):
    made = live_run(tmp_path / "m", MISSION)
    made.steps(4)
    return made


def test_a_thousand_mutated_commands_change_nothing(run):
    stops = obey_mutations(run, 1000, seed=1)
    assert 10 < stops < 100  # 3 of 4 mutations of one in 21 commands: 36 expected
    assert run.runtime.state is MissionState.RUNNING
    steps = run.runtime.steps
    run.steps(4)
    assert run.runtime.steps == steps + 4


def test_what_msgpack_can_encode_is_refused(run):
    place = [field.name for field in dataclasses.fields(Command)].index("arguments")
    for kind in ("speed", "set_pose", "set_parameter", "pause", "break"):
        for hostile in HOSTILE:
            message = msgpack.unpackb(encode(Command("1", kind, {})))
            message[2][place] = hostile
            with suppress(TelemetryError):  # some are refused on arrival
                assert_refused(run, decode(msgpack.packb(message), Command))


def test_poses_outside_the_map_are_refused(run):
    for kind in ("set_pose", "set_goal"):
        assert_refused(run, Command("1", kind, {"x": 300.0, "y": 1.0, "heading": 0.0}))
    assert "is outside the map, which covers x " in run.kept.events[-1].text


def test_without_a_map_a_far_pose_does_not_end_the_mission(tmp_path, live_run):
    run = live_run(tmp_path / "m", MISSION, UNMAPPED)
    run.steps(4)
    far = {"x": 1e6, "y": -1e6, "heading": 3.0}
    assert run.order("set_pose", **far).done
    run.steps(10)
    assert run.order("set_goal", **far | {"x": -1e6}).done
    run.steps(10)
    assert run.runtime.state is MissionState.PAUSED


def test_a_stop_with_a_malformed_reason_stops(run):
    assert run.order("estop", reason=b"\xff" * 1000).done
    assert run.runtime.mission.emergency_stop == "operator"


def test_the_commands_have_schemas(run):
    handler = run.runtime._commands
    assert {*handler._actions, *handler.debugging.actions} == SCHEMAS.keys()


def test_a_reaction_time_of_days_is_refused(run):
    """The safety stage computes a time step for every part of it: at 1e6 s a step took minutes."""
    assert_refused(
        run, Command("1", "set_parameter", {"name": "safety.reaction_time", "value": 1e6})
    )

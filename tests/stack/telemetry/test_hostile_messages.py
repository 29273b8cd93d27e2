"""Damaged messages: nothing that is not valid is obeyed, and honest clients are still answered.

`TREEPILOT_MESSAGES=10000 python -m pytest tests/stack/telemetry/test_hostile_messages.py` sends as
many of each kind instead of the 1000 of the suite.
"""

from __future__ import annotations

import os
import random

import msgpack
import pytest
import zmq

from stack.telemetry import codec
from stack.telemetry.client import TelemetryClient
from stack.telemetry.hub import Telemetry
from stack.telemetry.messages import Goodbye, Inquiry, Request
from stack.telemetry.records import Ack, Command
from stack.telemetry.server import TelemetryServer

COUNT = int(os.environ.get("TREEPILOT_MESSAGES", "1000"))
BATCH = 20
"""Messages between two looks at the server."""


def commands(identity):
    arguments = {
        "pause": {}, "estop": {"reason": "hand"}, "release": {}, "speed": {"factor": 4.0},
        "set_goal": {"x": 1.0, "y": 2.0, "heading": 0.5}, "teleop": {"linear": 0.2},
        "set_parameter": {"name": "controller.cruise_speed", "value": [0.4, {"a": None}]},
        "force": {"node": "go", "status": "failure", "code": "NO_VALID_PATH"},
    }  # fmt: skip
    return [Command(f"c{n}", kind, a, identity) for n, (kind, a) in enumerate(arguments.items())]


def nested(depth, make):
    value = 1
    for _ in range(depth):
        value = make(value)
    return value


def hostile_values():
    """Values that no message has in any place, packed by msgpack."""
    return [
        2**64 - 1, -(2**63), float("nan"), float("inf"), b"\x00bytes", "\x1b[2J\x00", "x" * 40_000,
        msgpack.ExtType(5, b"abc"), msgpack.Timestamp(1, 2), None, True, [], {}, {1: 2}, {b"k": 1},
        nested(40, lambda v: [v]), nested(400, lambda v: {"k": v}), nested(900, lambda v: [v]),
        list(range(3000)), {str(n): n for n in range(3000)},
    ]  # fmt: skip


def replaced(value, generator, hostile):
    """A copy in which one part, somewhere inside, is a hostile value."""
    inner = list(value) if isinstance(value, dict) else range(len(value)) if is_list(value) else ()
    if not inner or generator.random() < 0.2:
        return hostile
    copy, place = value.copy(), generator.choice(list(inner))
    copy[place] = replaced(copy[place], generator, hostile)
    return copy


def is_list(value):
    return isinstance(value, list)


def mutated(encoded, generator):
    """The message with one to three faults."""
    for _ in range(generator.randint(1, 3)):
        match generator.randrange(5):
            case 0:
                flipped = bytearray(encoded or b"\x00")
                for _ in range(generator.randint(1, 8)):
                    flipped[generator.randrange(len(flipped))] ^= 1 << generator.randrange(8)
                encoded = bytes(flipped)
            case 1:
                encoded = encoded[: generator.randrange(len(encoded) + 1)]
            case 2:
                encoded += generator.randbytes(generator.randint(1, 20))
            case _:
                encoded = with_hostile_value(encoded, generator)
    return encoded


def with_hostile_value(encoded, generator):
    try:
        value = msgpack.unpackb(encoded, strict_map_key=False)
        changed = replaced(value, generator, generator.choice(hostile_values()))
        return msgpack.packb(changed)
    except Exception:
        return encoded + b"\xc1"  # it was damaged before: a byte that msgpack never uses


def is_plain(value, depth=codec.MAX_DEPTH):
    """Whether a value is a number, text, list or mapping, nested at most that deep."""
    if value is None or type(value) in (bool, int, float, str):
        return True
    if depth == 0 or not isinstance(value, list | dict):
        return False
    if is_list(value):
        return all(is_plain(item, depth - 1) for item in value)
    return all(isinstance(key, str) and is_plain(value[key], depth - 1) for key in value)


def valid_command(encoded, identity):
    """The command in a message as this test reads the format, as text; None if it is damaged."""
    try:
        stamp, name, (own_id, kind, arguments, run) = msgpack.unpackb(encoded)
    except Exception:
        return None
    if (stamp, name, run) != (codec.stamp(), "Command", identity):
        return None
    texts = isinstance(own_id, str) and isinstance(kind, str) and isinstance(arguments, dict)
    plain = texts and all(
        isinstance(key, str) and is_plain(item) for key, item in arguments.items()
    )
    return repr((kind, arguments)) if plain else None


class Target:
    """A server under attack, its raw client, and the valid commands sent to it so far."""

    def __init__(self, info, clock, make_snapshot):
        self.server, self.clock, self.make_snapshot = (
            TelemetryServer(clock=clock),
            clock,
            make_snapshot,
        )
        self.telemetry = Telemetry(info, [self.server], self.fail)
        self.context = zmq.Context()
        self.socket = self.context.socket(zmq.DEALER)
        self.socket.connect(self.server.handle.address)
        self.valid, self.obeyed = set(), 0

    def fail(self, line):
        raise AssertionError(line)

    def send(self, *frames):
        self.valid.add(valid_command(frames[0], self.telemetry.info.identity))
        self.socket.send_multipart(frames)

    def step(self):
        """Let the server read, apply what it accepts as the engine does, and publish."""
        self.clock.now += 1.0
        for command in self.telemetry.commands():
            assert repr((command.kind, dict(command.arguments))) in self.valid
            self.obeyed += 1
            self.telemetry.acknowledge(Ack(command.id, True))
            self.telemetry.emit(
                "command", command.kind, source="command", arguments=dict(command.arguments)
            )
        self.telemetry.publish(self.make_snapshot)
        while self.socket.poll(0):
            self.socket.recv_multipart()

    def close(self):
        self.socket.close(linger=0)
        self.context.term()
        self.telemetry.close(None)


@pytest.fixture
def target(runtime_directory, info, clock, snapshot_at):
    target = Target(info, clock, snapshot_at)
    yield target
    target.close()


def answers_honestly(target):
    """Whether a new client gets a snapshot, and its emergency stop an answer."""
    client = TelemetryClient(target.server.handle, clock=target.clock)
    client.send(Command("honest", "estop"))
    target.valid.add(repr(("estop", {})))
    seen, acked = False, False
    for _ in range(2000):
        target.step()
        seen = client.poll() is not None or seen
        acked = acked or any(ack == Ack("honest", True) for ack in client.acks())
        if seen and acked:
            break
    client.close()
    return seen and acked


def attack(target, messages, make_frames):
    generator = random.Random(1)
    for number in range(COUNT):
        target.send(*make_frames(codec.encode(generator.choice(messages)), generator))
        if number % BATCH == BATCH - 1:
            target.socket.poll(20)  # some are answered
            target.step()
    for _ in range(100):
        target.step()
    assert answers_honestly(target)


def test_damaged_commands_are_not_obeyed(target):
    """Faults in ids, kinds and arguments can leave a command valid; all others are dropped."""
    sent = commands(target.telemetry.info.identity)
    attack(target, sent, lambda encoded, generator: [mutated(encoded, generator)])
    assert 0 < target.obeyed < COUNT / 2


def test_damaged_frames_do_no_harm(target):
    messages = [Request(), Request(True, 5, 3, {"map": 2}), Inquiry(), Goodbye()]

    def frames(encoded, generator):
        count = generator.choice([1, 1, 1, 2, 3])
        return [mutated(encoded, generator) for _ in range(count)]

    attack(target, messages, frames)
    assert target.obeyed == 1  # the emergency stop of the honest client

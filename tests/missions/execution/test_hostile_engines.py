"""Engines that send nonsense, or nothing: a connection says so and ends."""

from __future__ import annotations

import os

import msgpack
import pytest
import zmq

import treepilot
from missions.execution.client import Connection
from stack.telemetry.codec import encode, stamp
from stack.telemetry.messages import EventBatch, Over, Served
from stack.telemetry.rendezvous import RunHandle


@pytest.fixture
def engine(tmp_path):
    """A socket that tests answer from, and a connection that waits for its first answer."""
    address = f"ipc://{tmp_path}/s"
    handle = RunHandle("0123abcd", "run", "scout", "m", "", os.getpid(), address, "", 0)
    context = zmq.Context()
    socket = context.socket(zmq.ROUTER)
    socket.bind(address)
    connection = Connection(handle, 0.5)
    identity, _ = socket.recv_multipart()
    yield (
        lambda *messages: [socket.send_multipart([identity, item]) for item in messages],
        (connection),
    )
    connection.close()
    socket.close(0)
    context.term()


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (b"", "not a treepilot message"),
        (b"\xc1garbage", "not a treepilot message|damaged|unpack"),
        (msgpack.packb(["another version", "Served", [1]]), "same treepilot version"),
        (msgpack.packb([stamp(), "os.system", ["true"]]), "got 'os.system'"),
        (msgpack.packb([stamp(), "RunInfo", [1, 2, 3]]), "malformed RunInfo"),
        (msgpack.packb([stamp(), "Snapshot", []]), "got 'Snapshot'"),
        (encode(EventBatch(0, (b"x",))), "not a treepilot message|malformed"),
        (encode(Over(None)), "has ended"),
    ],
)
def test_nonsense_is_one_clear_error(engine, answer, message):
    send, connection = engine
    send(answer)
    with pytest.raises(treepilot.TelemetryError, match=message), connection:
        pass


def test_an_engine_that_only_says_that_it_lives_describes_nothing(engine):
    send, connection = engine
    send(*[encode(Served(0))] * 5)
    with pytest.raises(treepilot.TelemetryError, match=r"within 0\.5 s|for 0\.5 s"), connection:
        pass


def test_a_silent_engine_is_given_up(engine):
    _, connection = engine
    with pytest.raises(treepilot.TelemetryError, match=r"not answered for 0\.5 s"), connection:
        pass

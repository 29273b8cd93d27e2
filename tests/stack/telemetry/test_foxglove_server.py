"""Foxglove watches a run live, as a client of its WebSocket protocol sees it."""

import json
import socket
import struct
from base64 import b64decode
from contextlib import contextmanager, suppress

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from stack.errors import InputError
from stack.telemetry.foxglove import drawing as drawing_module
from stack.telemetry.foxglove.server import BACKLOG, HOST, FoxgloveServer
from stack.telemetry.hub import Telemetry
from stack.telemetry.records import Layer, MissionState
from stack.types import OccupancyGrid, Pose2D
from tests.stack.telemetry.foxglove_reader import chain, message_class

MESSAGE = struct.Struct("<BIQ")
"""Head of a message to a client: kind (1: data), subscription, time in nanoseconds."""

NOT_DUE = -1.0
"""A robot time before that of the first snapshot."""


@pytest.fixture
def port():
    with socket.create_server((HOST, 0)) as free:
        return free.getsockname()[1]


@pytest.fixture
def sink(port):
    return FoxgloveServer(port)


@pytest.fixture
def telemetry(sink, info):
    """The hub of a run that is served."""
    made = Telemetry(info, [sink])
    yield made
    made.close(None)


class Client:
    """A client of the protocol that Foxglove documents as `foxglove.sdk.v1`."""

    def __init__(self, socket):
        self._socket = socket
        self.server = json.loads(socket.recv(timeout=10))
        self.channels = {}

    def advertised(self, *topics):
        """Read until these topics are advertised."""
        while not {*topics} <= {channel["topic"] for channel in self.channels.values()}:
            message = json.loads(self._socket.recv(timeout=10))
            self.channels |= {item["id"]: item for item in message["channels"]}

    def subscribe(self, sink, *topics):
        """Subscribe; returns when the sink has noted it: it wants a snapshot when none is due."""
        self.advertised(*topics)
        chosen = [number for number, item in self.channels.items() if item["topic"] in topics]
        wanted = [{"id": number, "channelId": number} for number in chosen]
        self._socket.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
        for _ in range(1000):
            assert self._socket.ping().wait(10)
            if sink.wants_snapshot(NOT_DUE):
                return
        raise AssertionError("the subscription is not noted")

    def receive(self):
        """The next message: topic, time in seconds, content."""
        data = self._socket.recv(timeout=10)
        while isinstance(data, str):
            data = self._socket.recv(timeout=10)
        kind, number, time = MESSAGE.unpack_from(data)
        channel, content = self.channels[number], data[MESSAGE.size :]
        assert kind == 1
        if channel["encoding"] == "json":
            return channel["topic"], time / 1e9, json.loads(content)
        made = message_class(channel["schemaName"], b64decode(channel["schema"]))
        return channel["topic"], time / 1e9, made.FromString(content)

    def receive_last(self, topic):
        """The last message of a topic before the server closes the connection."""
        found = None
        with suppress(ConnectionClosed):
            while True:
                name, time, content = self.receive()
                found = (time, content) if name == topic else found
        return found


@contextmanager
def watching(port, most_unread=None):
    """A client; it stops reading from its socket with so many messages that nobody has received."""
    address, protocols = f"ws://{HOST}:{port}", ["foxglove.sdk.v1"]
    with connect(
        address, subprotocols=protocols, max_size=None, max_queue=most_unread, close_timeout=0.1
    ) as opened:
        yield Client(opened)


def publish(telemetry, snapshot):
    telemetry.advance(snapshot.step, snapshot.time)
    telemetry.publish(lambda: snapshot)


def test_a_newcomer_gets_the_whole_state_although_nothing_changes(
    port, sink, telemetry, snapshot_at
):
    """Also while the mission is paused: its time stands."""
    shot = snapshot_at(2.0, map_version=3)
    publish(telemetry, shot)
    with watching(port) as client:
        client.subscribe(sink, "/tf", "/map", "/tree", "/scan", "/status")
        publish(telemetry, shot)
        received = {topic: (time, content) for topic, time, content in (
            client.receive() for _ in range(5)
        )}  # fmt: skip
    assert {time for time, _ in received.values()} == {2.0}
    base, names = chain([received["/tf"][1]], "base")
    assert names == ["base", "odom", "map"]
    assert base[:2, 3] == pytest.approx([shot.pose.x, shot.pose.y])
    assert received["/map"][1].column_count == 80 and received["/status"][1]["state"] == "running"
    assert received["/tree"][1]["nodes"][1]["name"] == "to the dock"
    assert list(received["/scan"][1].ranges)[:2] == [1.0, float("inf")]


def test_only_what_changes_is_sent_again(port, sink, telemetry, snapshot_at):
    with watching(port) as client:
        publish(telemetry, snapshot_at(0.0, map_version=1))
        client.subscribe(sink, "/map", "/pose")
        for number in range(1, 6):
            publish(telemetry, snapshot_at(float(number), map_version=1 if number < 4 else 2))
        received = [client.receive()[:2] for _ in range(7)]
    assert [time for topic, time in received if topic == "/map"] == [1.0, 4.0]
    assert [time for topic, time in received if topic == "/pose"] == [1.0, 2.0, 3.0, 4.0, 5.0]


def test_events_and_the_end_reach_the_client(port, sink, telemetry, snapshot_at):
    with watching(port) as client:
        publish(telemetry, snapshot_at(0.0))
        telemetry.emit("say", "hello", source="mission")
        client.subscribe(sink, "/log", "/status")
        telemetry.advance(20, 1.0)
        telemetry.emit("say", "good bye", source="mission")
        telemetry.close({}, lambda: snapshot_at(1.0, state=MissionState.SUCCESS))
        topic, time, line = client.receive()
        assert (topic, time, line.message) == ("/log", 1.0, "good bye")
        assert client.receive_last("/status")[1]["state"] == "success"


def test_a_client_that_does_not_read_holds_nobody(port, sink, telemetry, snapshot_at):
    """200 maps of 2 MB fit into no buffer: the lazy one loses them, the other gets the newest."""
    maps = [OccupancyGrid(np.full((640, 640), value, np.int8), 0.05) for value in (0, 100)]
    publish(telemetry, snapshot_at(0.0))
    with watching(port, most_unread=2) as lazy, watching(port) as reader:
        lazy.subscribe(sink, "/map")
        publish(telemetry, snapshot_at(0.2))
        reader.subscribe(sink, "/pose")
        for number in range(1, 201):
            layers = {"map": Layer(number, maps[number % 2])}
            shot = snapshot_at(float(number), layers=layers, pose=Pose2D(float(number), 0.0))
            publish(telemetry, shot)
            _, time, found = reader.receive()
            assert (time, found.pose.position.x) == (float(number), float(number))
        received = [lazy.receive()[1]]
        while received[-1] < 200.0:
            received.append(lazy.receive()[1])
    assert BACKLOG <= len(received) < 200


def test_nothing_is_made_for_topics_that_nobody_reads(
    port, sink, telemetry, snapshot_at, monkeypatch
):
    made = []
    monkeypatch.setattr(drawing_module, "moving", lambda *_: made.append("moving"))
    publish(telemetry, snapshot_at(0.0))
    with watching(port) as client:
        client.subscribe(sink, "/pose")
        publish(telemetry, snapshot_at(1.0))
        assert client.receive()[0] == "/pose" and made == []


def test_it_listens_on_this_machine_only_and_takes_no_commands(port, telemetry):
    """A server on all addresses would hold the port on every other one, too."""
    with pytest.raises(OSError):
        socket.create_server((HOST, port))
    socket.create_server(("127.0.0.2", port)).close()
    with watching(port) as client:
        assert client.server["capabilities"] == []


def test_a_port_in_use_is_refused_before_the_run_begins(port):
    with socket.create_server((HOST, port)):
        with pytest.raises(InputError, match=f"cannot listen on port {port} .*another port"):
            FoxgloveServer(port)


def test_a_port_that_is_taken_meanwhile_is_a_lost_link(port, info):
    """The mission does not end because nobody can watch it."""
    sink, events = FoxgloveServer(port), []
    with socket.create_server((HOST, port)):
        telemetry = Telemetry(info, [sink])
        telemetry.emit("say", "hello", source="mission")
        events = [event.kind for event in telemetry.recent(9)]
        telemetry.close(None)
    assert events == ["say", "link_lost"]

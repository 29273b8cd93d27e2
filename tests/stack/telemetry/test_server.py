import os
import shutil
import signal
import subprocess
import sys
from dataclasses import replace
from math import inf
from pathlib import Path
from time import perf_counter

import msgpack
import numpy as np
import pytest
import zmq

from stack.errors import TelemetryError
from stack.telemetry import client as client_module
from stack.telemetry import codec, server
from stack.telemetry.client import TelemetryClient
from stack.telemetry.hub import Telemetry
from stack.telemetry.messages import EventBatch, Served
from stack.telemetry.records import Ack, Command, Layer
from stack.telemetry.rendezvous import RunHandle, live_runs
from stack.telemetry.server import TelemetryServer
from stack.types import CameraModel, CostGrid, Image

PATIENCE = 30.0
"""Real seconds that the background threads of ZeroMQ get to deliver something."""


def patience():
    """Go on as long as it lasts."""
    deadline = perf_counter() + PATIENCE
    while perf_counter() < deadline:
        yield


class Run:
    """An engine and its dashboards in one thread, on a wall clock turned by hand."""

    def __init__(self, info, clock):
        self.clock, self.clients, self.snapshots_built = clock, [], 0
        self.server = TelemetryServer(clock=clock)
        self.telemetry = Telemetry(info, [self.server], self.fail)
        self.make = None

    def fail(self, sentence):
        raise AssertionError(sentence)

    def connect(self):
        client = TelemetryClient(self.server.handle, clock=self.clock)
        self.clients.append(client)
        return client

    def publish(self):
        def build():
            self.snapshots_built += 1
            return self.make()

        self.telemetry.publish(build)

    def until(self, arrived, step=None):
        """Let the engine step until something has arrived; a twentieth of a second each."""
        for _ in patience():
            found = arrived()
            if found:
                return found
            (step or self.publish)()
            self.clock.now += 0.05
        raise AssertionError("it never arrived")

    def wait_for_request(self, client):
        """Until the server holds an open request of its only client."""

        def exchange():
            client.events()
            self.server._receive()

        (known,) = self.server._clients.values()
        self.until(lambda: known.pending, exchange)
        return known

    def close(self):
        for client in self.clients:
            client.close()
        self.telemetry.close(None)


@pytest.fixture
def run(runtime_directory, info, clock, snapshot_at):
    run = Run(info, clock)
    run.make = snapshot_at
    yield run
    run.close()


def test_a_run_whose_runtime_folder_was_deleted_is_found_again(run, runtime_directory):
    client = run.connect()
    run.until(client.poll)
    shutil.rmtree(run.server.handle.socket.parent)
    assert live_runs() == []
    run.clock.now += server.ANNOUNCE_PERIOD
    run.publish()
    (found,) = live_runs()
    assert found == run.server.handle
    newcomer = TelemetryClient(found, clock=run.clock)
    run.clients.append(newcomer)
    newcomer.send(Command("1", "pause"))
    assert [command.kind for command in run.until(run.telemetry.commands)] == ["pause"]
    assert run.until(client.poll) is not None  # and the old one is still connected


def test_without_a_runtime_directory_a_run_moves_to_the_one_that_clients_look_in(
    run, runtime_directory, tmp_path, monkeypatch
):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "none"))
    monkeypatch.setattr("tempfile.gettempdir", lambda: runtime_directory)
    shutil.rmtree(run.server.handle.socket.parent)
    run.clock.now += server.ANNOUNCE_PERIOD
    run.publish()
    (found,) = live_runs()
    assert found.socket.parent.name == f"treepilot-{os.getuid()}" and found.socket.exists()


def test_a_client_learns_what_is_fixed_and_sees_the_newest_moment(run, info, snapshot_at):
    client = run.connect()
    snapshot = run.until(client.poll)
    assert client.info.run_id == info.run_id and client.info.places == info.places
    expected = snapshot_at()
    assert snapshot.tree == expected.tree and snapshot.pose == expected.pose
    assert np.array_equal(
        snapshot.layers["map"].content.cells, expected.layers["map"].content.cells
    )
    assert snapshot.layers["scene"] == expected.layers["scene"]
    assert (snapshot.image, snapshot.mask, snapshot.depth_image) == (None, None, None)
    assert client.poll() is None


def test_without_clients_no_snapshot_is_built(run):
    for _ in range(10):
        run.publish()
        run.clock.now += 0.05
    assert run.snapshots_built == 0


def test_at_most_twenty_snapshots_a_wall_second(run):
    client = run.connect()
    run.until(client.poll)
    built = run.snapshots_built
    for _ in range(2000):  # steps of half a wall millisecond
        run.publish()
        client.poll()
        run.clock.now += 0.0005
    assert 1 <= run.snapshots_built - built <= 21


def test_a_stalled_client_costs_nothing_and_sees_the_newest_when_it_wakes(
    run, snapshot_at, monkeypatch
):
    monkeypatch.setattr(client_module, "REQUEST_TIMEOUT", 1e9)  # a slow machine is not a lost one
    client = run.connect()
    run.until(client.poll)
    run.wait_for_request(client)
    built = run.snapshots_built
    for n in range(200):
        run.make = lambda n=n: snapshot_at(time=10.0 + n)
        run.publish()
        run.clock.now += 0.05
    # One request was open when it stalled; nothing else was sent or built for it.
    assert run.snapshots_built - built == 1
    first = run.until(client.poll)
    last = run.until(client.poll)
    assert first.time <= last.time == 209.0


def test_a_layer_travels_once_for_each_version(run, snapshot_at, monkeypatch):
    came = []
    real = client_module.decode_one_of

    def noting(encoded, kinds):
        message = real(encoded, kinds)
        came.append(getattr(message, "name", None))
        return message

    monkeypatch.setattr(client_module, "decode_one_of", noting)
    monkeypatch.setattr(client_module, "REQUEST_TIMEOUT", 1e9)  # a slow machine is not a lost one
    client = run.connect()
    for _ in range(5):
        run.until(client.poll)
    assert came.count("map") == 1
    grid = CostGrid(np.full((20, 20), 9, np.uint8), 0.05)
    changed = snapshot_at().layers | {"local_costmap": Layer(5, grid)}
    run.make = lambda: snapshot_at(layers=changed)
    snapshot = run.until(
        lambda: (new := client.poll()) and new.layers["local_costmap"].version == 5 and new
    )
    assert snapshot.layers["local_costmap"].content.cells[0, 0] == 9
    assert came.count("map") == 1 and came.count("local_costmap") == 2
    del changed["local_costmap"]
    while "local_costmap" in snapshot.layers:
        snapshot = run.until(client.poll)
    assert snapshot.layers.keys() == {"map", "scene"}


def test_pictures_are_small_and_sent_only_while_a_viewer_asks(run, snapshot_at):
    """At most two a wall second to a client."""
    camera = CameraModel(640, 480, 500.0, (0.0, 0.0, 0.3))
    pixels = np.zeros((480, 640, 3), dtype=np.uint8)
    client, stamps = run.connect(), []

    def step():
        image = Image(run.clock.now, pixels, camera)
        run.make = lambda: replace(snapshot_at(run.clock.now), image=image)
        run.publish()
        run.clock.now += 0.05
        snapshot = client.poll()
        if snapshot is not None and snapshot.image is not None:
            stamps.append(snapshot.image.stamp)
            assert snapshot.image.pixels.shape == (120, 160, 3)
        return snapshot

    run.until(step)
    for _ in range(60):
        step()
    assert stamps == []
    client.pictures = True
    run.until(lambda: stamps, step)
    del stamps[:]
    begin = run.clock.now
    for _ in range(60):
        step()
    assert len(set(stamps)) <= 2 * (run.clock.now - begin) + 1


def emit(run, count):
    for _ in range(count):
        run.telemetry.emit("say", "x", source="mission", n=run.telemetry.count)


def collect(run, client, count):
    events = []
    run.until(lambda: events.extend(client.events()) or len(events) >= count)
    return events


def test_events_come_from_the_first_on_without_gaps(run, monkeypatch):
    monkeypatch.setattr(server, "BATCH", 100)
    emit(run, 350)
    client = run.connect()
    early = collect(run, client, 350)
    emit(run, 30)
    late = collect(run, client, 30)
    assert [event.number for event in early + late] == list(range(380))
    assert late[-1].fields == {"n": 379} and client.missed_events == 0


def test_an_event_received_twice_is_returned_once(run):
    emit(run, 5)
    client = run.connect()
    collect(run, client, 5)
    again = tuple(run.server._events)[3:]
    client._take(EventBatch(3, again))
    assert client.events() == []
    emit(run, 1)
    assert [event.number for event in collect(run, client, 1)] == [5]


def test_discarded_events_are_counted(runtime_directory, info, clock, monkeypatch, snapshot_at):
    monkeypatch.setattr(server, "KEPT_EVENTS", 50)
    run = Run(info, clock)
    run.make = snapshot_at
    emit(run, 120)
    client = run.connect()
    events = collect(run, client, 50)
    assert events[0].number == 70 and client.missed_events == 70
    run.close()


def test_commands_are_acknowledged_to_their_sender(run):
    one, other = run.connect(), run.connect()
    one.send(Command("1", "pause"))
    other.send(Command("1", "set_goal", {"x": 1.0}))
    commands = []
    run.until(lambda: commands.extend(run.telemetry.commands()) or len(commands) == 2)
    assert {command.kind for command in commands} == {"pause", "set_goal"}
    for command in commands:
        run.telemetry.acknowledge(Ack(command.id, command.kind == "pause", "no map"))
    assert run.until(one.acks) == [Ack("1", True, "no map")]
    assert run.until(other.acks) == [Ack("1", False, "no map")]


def taken(run, count):
    """The next commands that the run gets."""
    commands = []
    run.until(lambda: commands.extend(run.telemetry.commands()) or len(commands) >= count)
    return commands


def apply_all(run):
    """Take and acknowledge what has come; what was taken."""
    commands = run.telemetry.commands()
    for command in commands:
        run.telemetry.acknowledge(Ack(command.id, True))
    return commands


def test_a_command_for_another_run_is_refused(run):
    """Two engines may have runs of the same name; a stop must not reach the wrong one."""
    stranger = replace(run.server.handle, identity="0" * 32)
    client = TelemetryClient(stranger, clock=run.clock)
    run.clients.append(client)
    client.send(Command("1", "estop"))
    (ack,) = run.until(client.acks)
    assert not ack.done
    assert ack.reason.startswith("the command is for run '00000000', this is 'test_run-1' (")
    assert run.telemetry.commands() == []


def test_a_command_for_no_run_is_refused(run):
    client = run.connect()
    client._socket.send(codec.encode(Command("1", "estop")))
    (ack,) = run.until(client.acks)
    assert (ack.done, ack.reason[:27]) == (False, "the command is for no run, ")
    assert run.telemetry.commands() == []


def test_an_emergency_stop_overtakes_other_commands_and_cancels_what_moves_the_robot(run):
    one, other = run.connect(), run.connect()
    for n, kind in enumerate(["release", "resume", "pause"]):
        one.send(Command(str(n), kind))
    run.until(lambda: run.server._receive() or len(run.server._inbox._others) == 3)
    other.send(Command("s", "estop"))
    run.until(lambda: run.server._receive() or run.server._inbox._stops)
    assert [command.kind for command in apply_all(run)] == ["estop", "pause"]
    acks = []
    run.until(lambda: acks.extend(one.acks()) or len(acks) == 3)
    assert {ack.id: ack.done for ack in acks} == {"0": False, "1": False, "2": True}
    assert run.until(other.acks) == [Ack("s", True)]


def test_a_flood_of_commands_is_cut_off_and_does_not_delay_a_stop(run):
    """A client sends 800 commands at once, another one an emergency stop."""
    flooding, calm = run.connect(), run.connect()
    for n in range(800):
        flooding.send(Command(str(n), "pause"))
        if n == 500:
            calm.send(Command("s", "estop"))
    acks, kinds = [], []

    def exchange():
        acks.extend(flooding.acks())
        kinds.extend(command.kind for command in apply_all(run))
        return len(acks) == 800

    run.until(exchange, lambda: None)
    # The clock advances 0.05 s a round: 5 more commands are allowed in each.
    applied = kinds.count("pause")
    refused = [ack for ack in acks if not ack.done]
    assert len(refused) == 800 - applied and applied < 500
    assert refused[0].reason == "too many commands: at most 100 in a second are accepted"
    assert kinds.index("estop") <= server.MAX_RECEIVED
    assert run.until(calm.acks)[0].done


def test_one_client_cannot_pile_up_emergency_stops(run):
    client = run.connect()
    for n in range(60):
        client.send(Command(str(n), "estop"))
    acks = []
    run.until(lambda: (acks.extend(client.acks()), run.server._receive(), len(acks) == 56)[2])
    assert {ack.reason for ack in acks} == {"an emergency stop is already being applied"}
    assert [command.kind for command in apply_all(run)] == ["estop"] * 4


def test_the_last_of_many_stops_still_cancels_a_resume(run):
    """The stop after the fourth used to be refused, and the resume before it applied."""
    client = run.connect()
    kinds = [*["estop"] * 4, "release", "resume", "estop"]
    for n, kind in enumerate(kinds):
        client.send(Command(str(n), kind))
    acks = []
    run.until(lambda: (acks.extend(client.acks()), run.server._receive(), len(acks) == 3)[2])
    assert {ack.id: ack.done for ack in acks} == {"4": False, "5": False, "6": True}
    assert [command.kind for command in apply_all(run)] == ["estop"] * 4


def test_a_paused_engine_still_answers(run):
    client = run.connect()
    run.until(lambda: client.poll() or client.info, run.telemetry.service)
    assert client.poll() is None and run.snapshots_built == 0
    run.clock.now += 30.0
    assert client.silent_for > 29.0
    run.until(lambda: client.poll() or client.silent_for < 1.0, run.telemetry.service)
    emit(run, 3)
    events = []
    run.until(lambda: events.extend(client.events()) or len(events) == 3, run.telemetry.service)


def test_at_the_end_every_client_receives_what_it_lacks(run, monkeypatch, snapshot_at):
    monkeypatch.setattr(server, "BATCH", 10)
    client = run.connect()
    run.until(client.poll)
    emit(run, 55)
    run.telemetry.close(
        {"result": "success", "seconds": np.float64(2.5)}, lambda: snapshot_at(time=7.0)
    )
    snapshots, events = [], []
    for _ in patience():
        new = client.poll()
        snapshots.extend([new] if new else [])
        events.extend(client.events())
        if client.is_over:
            break
    assert client.report == {"result": "success", "seconds": 2.5}
    assert snapshots[-1].time == 7.0
    assert [event.number for event in events] == list(range(55))
    assert live_runs() == [] and not run.server.handle.socket.exists()
    with pytest.raises(TelemetryError, match="cannot pause: the run is over"):
        client.send(Command("9", "pause"))


def test_a_client_that_left_is_forgotten(run):
    client = run.connect()
    run.until(client.poll)
    run.wait_for_request(client)
    client.close()
    client.close()
    run.clock.now += 1.0
    run.until(lambda: run.server.watchers == 0 or run.publish())


def test_a_goodbye_frees_the_place_at_once(run, monkeypatch):
    """33 `treepilot tell` in a row; 32 of them used to block the rest for a minute."""
    for _ in range(server.MAX_CLIENTS + 1):
        client = run.connect()
        run.until(client.poll)
        client.close()
    run.until(lambda: run.server._receive() or run.server.watchers == 0)


def test_a_silent_client_gives_its_place_to_a_new_one(run, monkeypatch):
    monkeypatch.setattr(server, "MAX_CLIENTS", 2)
    first, second = run.connect(), run.connect()
    run.until(lambda: run.server.watchers == 2)
    run.until(first.poll)
    run.until(second.poll)
    for _ in range(10):  # both are answered and send nothing more
        run.publish()
        run.clock.now += 0.1
    third = run.connect()
    for _ in range(5):
        run.publish()
    assert third.poll() is None and third.info is None
    run.clock.now += server.SILENT_AFTER + 0.1
    run.until(third.poll)
    assert run.server.watchers == 2


def test_without_a_place_only_the_emergency_stop_is_obeyed(run, monkeypatch):
    monkeypatch.setattr(server, "MAX_CLIENTS", 1)
    monkeypatch.setattr(server, "SILENT_AFTER", inf)  # the clock is faster than messages
    first = run.connect()
    run.until(first.poll)
    second = run.connect()
    second.send(Command("p", "pause"))
    second.send(Command("s", "estop"))
    commands = []

    def step():
        commands.extend(apply_all(run))
        run.publish()

    acks = []
    run.until(lambda: acks.extend(second.acks()) or len(acks) == 2, step)
    by_id = {ack.id: ack for ack in acks}  # the emergency stop may overtake
    assert by_id["p"] == Ack("p", False, "1 clients are connected already; close one of them")
    assert by_id["s"].done and [command.kind for command in commands] == ["estop"]


def test_a_request_that_got_lost_is_repeated(run):
    client = run.connect()
    run.until(client.poll)
    run.wait_for_request(client).pending = None  # as if it had never come
    requested = client._requested
    run.clock.now += client_module.REQUEST_TIMEOUT + 0.1
    run.until(client.poll)
    assert client._requested > requested


def test_another_version_is_answered_with_this_one(run):
    context = zmq.Context()
    stranger = context.socket(zmq.DEALER)
    stranger.connect(run.server.handle.address)
    stranger.send(msgpack.packb(["0.other", "Request", []]))
    run.until(lambda: stranger.poll(0), run.telemetry.service)
    assert codec.decode(stranger.recv(), Served) == Served(0)
    stranger.close()
    context.term()


def test_random_bytes_of_a_client_do_no_harm(run):
    client = run.connect()
    run.until(client.poll)
    client._socket.send(b"\xff noise")
    client._socket.send_multipart([b"a", b"b", b"c"])
    assert run.until(client.poll)


def at(address):
    """The handle of a run at an address."""
    return RunHandle("1" * 32, "r", "rover", "m", "", os.getpid(), address, "")


def test_only_local_addresses(clock):
    with pytest.raises(TelemetryError, match="expected ipc://"):
        TelemetryClient(at("tcp://127.0.0.1:1"))


def test_a_client_of_a_dead_address_waits_quietly(runtime_directory, clock):
    client = TelemetryClient(at(f"ipc://{runtime_directory}/nobody.sock"), clock=clock)
    clock.now += 5.0
    assert client.poll() is None and client.info is None and client.silent_for == 5.0
    client.send(Command("1", "pause"))
    client.close()


def test_a_client_survives_the_death_of_its_engine(runtime_directory):
    program = """
from stack.telemetry.records import RunInfo
from stack.telemetry.server import TelemetryServer
from stack.types import Footprint
server = TelemetryServer()
server.open(RunInfo("r", "m", "", "", "", 0, Footprint.circle(0.3)))
print("ready", flush=True)
while True:
    server.service()
"""
    engine = subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, cwd=Path(__file__).parents[3]
    )
    assert engine.stdout.readline() == b"ready\n"
    (handle,) = live_runs()
    assert handle.pid == engine.pid
    client = TelemetryClient(handle)
    while client.info is None:
        client.poll()
    os.kill(engine.pid, signal.SIGKILL)
    engine.communicate()
    assert client.poll() is None and client.report is None and not client.is_over
    client.close()
    assert live_runs() == []

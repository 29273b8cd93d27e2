"""Links over real sockets of this machine and a pseudo-terminal."""

import os
import pty
import random
import socket
from time import monotonic  # noqa: TID251 - sockets live in wall time

import pytest

from stack.errors import InputError
from stack.mavlink.address import MavlinkAddress, read_address
from stack.mavlink.link import Link, opening_problem
from stack.mavlink.transports import BACKLOG, BLOCK, MAX_BYTES, MAX_PEERS, PEER_TIMEOUT


def free_port(kind=socket.SOCK_DGRAM):
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Clock:
    now = 100.0

    def __call__(self):
        return self.now


@pytest.fixture
def opened():
    links = []

    def open_link(address, system=1, **options):
        options = {"component": 1, **options}
        links.append(Link(read_address(address), system=system, **options))
        return links[-1]

    yield open_link
    for link in links:
        link.close()


def beat(link, mode=0):
    return link.dialect.MAVLink_heartbeat_message(10, 3, 0, mode, 4, 3)


def modes(link, count, timeout=1.0):
    """Custom modes of the next heartbeats; a call may return with a part of one."""
    found, end = [], monotonic() + timeout
    while len(found) < count and (left := end - monotonic()) > 0.0:
        found += [item.message.custom_mode for item in link.receive(left)]
    return found


def pair(opened, kind):
    if kind == "udp":
        port = free_port()
        return opened(f"udp:127.0.0.1:{port}"), opened(f"udpout:127.0.0.1:{port}", 245)
    port = free_port(socket.SOCK_STREAM)
    return opened(f"tcpin:127.0.0.1:{port}"), opened(f"tcp:127.0.0.1:{port}", 245)


@pytest.mark.parametrize("kind", ["udp", "tcp"])
def test_both_directions(opened, kind):
    server, client = pair(opened, kind)
    assert not server.send(beat(server))  # nobody is there yet
    assert client.send(beat(client, 7))
    received = server.receive(1.0)
    if not received:  # TCP: the first call accepted the connection
        received = server.receive(1.0)
    (item,) = received
    assert (item.kind, item.system, item.component) == ("HEARTBEAT", 245, 1)
    assert item.message.custom_mode == 7 and item.message.get_msgbuf()[0] == 0xFD  # version 2
    assert server.send(beat(server, 8), item.peer)
    assert modes(client, 1) == [8]
    assert client.counters.received == server.counters.received == 1


def test_a_serial_line(opened):
    near, far = pty.openpty()
    try:
        link = opened(f"serial:{os.ttyname(far)}:57600")
        assert link.receive(0.0) == []
        link.send(beat(link, 5))
        frame = os.read(near, 1000)
        for byte in frame:  # a slow line: byte by byte
            os.write(near, bytes([byte]))
        assert modes(link, 1, timeout=10.0) == [5]
        os.close(near)
        with pytest.raises(OSError):
            link.receive(0.5)
    finally:
        os.close(far)


def test_gaps_and_damaged_frames_are_counted(opened):
    server, client = pair(opened, "udp")
    client.send(beat(client, 1))
    client._packing.seq += 3  # three frames lost on the way
    client.send(beat(client, 2))
    frame = bytearray(beat(client, 3).pack(client._packing))
    frame[12] ^= 1
    client._transport.send(bytes(frame))
    client.send(beat(client, 4))
    assert modes(server, 3) == [1, 2, 4]
    assert (server.counters.missed, server.counters.refused) == (3, 1)


def test_half_a_datagram_does_not_swallow_the_next(opened):
    server, client = pair(opened, "udp")
    client._transport.send(bytes(beat(client).pack(client._packing))[:11])
    client.send(beat(client, 9))
    assert modes(server, 1) == [9]


@pytest.mark.parametrize("kind", ["udp", "tcp"])
def test_random_and_mutated_bytes_are_harmless(opened, kind):
    server, client = pair(opened, kind)
    random_source = random.Random(5)
    for n in range(300):
        frame = bytearray(beat(client, n).pack(client._packing))
        for _ in range(random_source.randrange(1, 4)):
            frame[random_source.randrange(len(frame))] = random_source.randrange(256)
        client._transport.send(random_source.choice([bytes(frame), random_source.randbytes(40)]))
        server.receive(0.0)
    client._transport.send(bytes(300))  # ends the longest frame that was announced
    client.send(beat(client, 1000))
    assert modes(server, 10_000, timeout=0.2)[-1:] == [1000]


def test_peers_are_few_and_forgotten(opened):
    clock, port = Clock(), free_port()
    server = opened(f"udp:127.0.0.1:{port}", clock=clock)
    clients = [opened(f"udpout:127.0.0.1:{port}", n + 2) for n in range(MAX_PEERS + 1)]
    for client in clients:
        client.send(beat(client))
        server.receive(1.0)
    assert server.counters.received == MAX_PEERS  # the last one had no place
    clock.now += PEER_TIMEOUT + 1.0
    assert not server.send(beat(server))  # all are silent
    clients[-1].send(beat(clients[-1], 3))
    assert modes(server, 1) == [3]


def test_a_peer_that_does_not_read_is_disconnected(opened):
    server, client = pair(opened, "tcp")
    client.send(beat(client))
    server.receive(1.0)
    server.receive(1.0)
    text = server.dialect.MAVLink_statustext_message(6, b"x" * 50)
    for _ in range(200 * BACKLOG // 60):
        if not server.send(text):
            break
    else:
        pytest.fail("the backlog has no limit")
    server.receive(1.0)
    assert not server.send(text)  # nobody is there any more


def test_the_other_side_is_gone(opened):
    server, client = pair(opened, "tcp")
    server.receive(1.0)
    server.close()
    with pytest.raises(OSError):
        client.receive(1.0)


@pytest.mark.parametrize("kind", ["udpin", "tcpin", "tcp"])
def test_opening_problems_say_what_to_do(kind):
    stream = socket.SOCK_STREAM if kind.startswith("tcp") else socket.SOCK_DGRAM
    with socket.socket(socket.AF_INET, stream) as other:
        other.bind(("127.0.0.1", 0))
        address = MavlinkAddress(kind, "127.0.0.1", other.getsockname()[1])
        with pytest.raises(OSError) as caught:
            Link(address, system=1, component=1)
    text = opening_problem(address, caught.value)
    assert str(address) in text and ("another program" in text or "nothing listens" in text)


def test_a_file_is_no_serial_device(tmp_path):
    file = tmp_path / "log"
    file.write_bytes(b"")
    with pytest.raises((OSError, InputError), match="not a serial device"):
        Link(MavlinkAddress("serial", str(file), 57600), system=1, component=1)


def test_a_flood_is_read_in_small_parts(opened):
    """2 MB wait in the socket; noise that does not begin like a frame is not even parsed."""
    port = free_port()
    link = opened(f"udpin:127.0.0.1:{port}")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as flood:
        for _ in range(1000):
            flood.sendto(b"\xfd" + bytes(1999), ("127.0.0.1", port))
        assert sum(len(data) for _, data in link._transport.receive(1.0)) <= MAX_BYTES + BLOCK
        while link._transport.receive(0.0):
            pass
        refused = link.counters.refused
        flood.sendto(bytes(2000), ("127.0.0.1", port))
        assert link.receive(1.0) == [] and link.counters.refused == refused + 1

import pytest

from stack.errors import InputError
from stack.mavlink.address import BAUD, MavlinkAddress, read_address


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("udp:127.0.0.1:14550", ("udpin", "127.0.0.1", 14550)),
        ("udpin:localhost:14550", ("udpin", "localhost", 14550)),
        ("udpout:rover.local:14551", ("udpout", "rover.local", 14551)),
        ("tcp:192.168.1.5:5760", ("tcp", "192.168.1.5", 5760)),
        ("tcpin:127.0.0.1:5760", ("tcpin", "127.0.0.1", 5760)),
        ("serial:/dev/ttyACM0", ("serial", "/dev/ttyACM0", BAUD)),
        ("serial:/dev/ttyS1:921600", ("serial", "/dev/ttyS1", 921600)),
    ],
)
def test_addresses(text, expected):
    assert read_address(text) == MavlinkAddress(*expected)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("127.0.0.1:14550", "expected udpin:HOST:PORT"),
        ("udp:14550", "expected udpin:HOST:PORT"),
        ("udpout::14550", "expected udpin:HOST:PORT"),
        ("udpout:a b:14550", "expected udpin:HOST:PORT"),
        ("udpout:host:70000", "port '70000' is not in 1..65535"),
        ("serial:ttyACM0", "expected udpin:HOST:PORT"),
        ("serial:/dev/ttyACM0:0", "expected udpin:HOST:PORT"),
        ("udp:0.0.0.0:14550", "would listen on 0.0.0.0, where anyone can connect"),
        ("tcpin:192.168.1.2:5760", "call the other side with tcp:192.168.1.2:5760"),
    ],
)
def test_wrong_addresses_say_what_is_expected(text, problem):
    with pytest.raises(InputError) as caught:
        read_address(text)
    assert problem in str(caught.value)


def test_only_a_signed_link_may_listen_to_other_machines():
    assert read_address("udp:0.0.0.0:14550", signed=True).listens

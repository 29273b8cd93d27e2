import socket
import threading
from pathlib import Path

import pytest

from robots.load import read_robot
from robots.mavlink.body import MavlinkBody
from robots.mavlink.parameters import MavlinkParameters
from tests.robots.mavlink.emulated_rover import EmulatedRover, Settings

ROVER = Path(__file__).parent / "rover.yaml"


@pytest.fixture
def port():
    """A free port."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture
def emulated(port):
    """Starts emulated rovers, each in a thread of its own."""
    rovers = []

    def start(**settings):
        rover = EmulatedRover(Settings(**settings))
        thread = threading.Thread(target=rover.run, args=(port,), daemon=True)
        thread.start()
        rovers.append((rover, thread))
        return rover

    yield start
    for rover, thread in rovers:
        rover.ended.set()
        thread.join(2.0)


@pytest.fixture(scope="module")
def description():
    return read_robot(ROVER)


@pytest.fixture
def bodies(port, description, monkeypatch):
    """Makes bodies that listen on the port, and closes them."""
    monkeypatch.setattr("robots.mavlink.body.SETTLE", 0.1)
    made = []

    def make(robot=None, **parameters):
        told = []
        settings = MavlinkParameters(f"udpin:127.0.0.1:{port}", **parameters)
        body = MavlinkBody(robot or description, settings, tell=told.append)
        body.told = told
        made.append(body)
        return body

    yield make
    for body in made:
        body.close()

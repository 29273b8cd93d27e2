import dataclasses

import pytest
from pymavlink.dialects.v20 import all as mav

from stack.mavlink.origin import GeoOrigin
from stack.telemetry.mavlink.handover import Handover
from stack.telemetry.mavlink.vehicle import Vehicle
from stack.telemetry.records import Ack, Event, Layer, MissionState
from stack.types import ParameterInfo, ParameterTable
from tests.stack.telemetry.conftest import make_snapshot

ORIGIN = GeoOrigin(48.0, 11.0)
TABLE = ParameterTable(
    (
        ParameterInfo("controller.cruise_speed", "number", "m/s", start=0.5),
        ParameterInfo("localisation.beams", "whole number", start=60),
        ParameterInfo("depth.obstacles", "true or false", start=False),
        ParameterInfo("planner.kind", "text", start="a_star"),
        ParameterInfo("controller.gain", "number", public=False, start=1.0),
    )
)
VALUES = {
    "controller.cruise_speed": 0.5, "localisation.beams": 60, "depth.obstacles": False,
    "planner.kind": "a_star", "controller.gain": 1.0,
}  # fmt: skip


class Rig:
    """A vehicle, a station that talks to it, and an engine that does as it is told.

    Attributes:
        sent: messages of the vehicle, oldest first.
        orders: commands that the engine has got: (kind, arguments).
        refuse: reason with which the engine refuses a kind of command.
        is_slow: the engine does not answer: its orders stay in `waiting`.
    """

    def __init__(self, clock, **options):
        self.clock, self.sent, self.orders, self.refuse = clock, [], [], {}
        self.is_slow, self.waiting, self._events = False, [], 0
        self.handover = Handover()
        self.vehicle = Vehicle(
            self.handover, self, clock, **({"origin": ORIGIN, "identity": "00ff"} | options)
        )
        self.show()
        self.vehicle.tick()
        self.sent.clear()

    def send(self, message):
        message.pack(self._codec)
        self.sent.append(message)

    _codec = mav.MAVLink(None, 1, 1)

    def show(self, **changes):
        """Set the state of the run; fields that are not named stay."""
        now = self.handover.snapshot or make_snapshot(parameters=VALUES)
        layers = {**now.layers, "parameters": Layer(1, TABLE)}
        self.handover.snapshot = dataclasses.replace(now, layers=layers, **changes)

    def say(self, message, sender=(255, 190)):
        """Let a station send a message; the vehicle's answers to it."""
        codec = mav.MAVLink(None, *sender)
        (heard,) = mav.MAVLink(None).parse_buffer(bytes(message.pack(codec)))
        self.sent.clear()
        self.vehicle.take(heard)
        self.go_on()
        return self.sent

    def go_on(self, seconds=0.0):
        """Let wall time pass in steps of 10 ms; the engine answers in between."""
        for _ in range(max(2, round(seconds * 100))):
            self.clock.now += 0.01 if seconds else 0.0
            self.waiting += self.handover.take_commands()
            while self.waiting and not self.is_slow:
                command = self.waiting.pop(0)
                self.orders.append((command.kind, dict(command.arguments)))
                why = self.refuse.get(command.kind, "")
                self.handover.acks.append(Ack(command.id, not why, why))
            self.vehicle.tick()
        return self.sent

    def detour_ends(self, status="success", **fields):
        """The newest detour has ended."""
        (*_, tag) = [order[1]["tag"] for order in self.orders if "tag" in order[1]]
        self._events += 1
        self.handover.events.append(
            Event(
                self._events,
                0,
                0.0,
                "info",
                "command",
                "detour",
                "detour",
                {
                    "tag": tag,
                    "status": status,
                    **fields,
                },
            )
        )
        return self.go_on(0.1)

    def long(self, command, *parameters, confirmation=0, sender=(255, 190), target=(1, 1)):
        """Results of a COMMAND_LONG."""
        seven = [*parameters, 0, 0, 0, 0, 0, 0, 0][:7]
        sent = self.say(
            mav.MAVLink_command_long_message(*target, command, confirmation, *seven), sender
        )
        return results(sent)

    def int(self, command, *four, frame=0, x=0, y=0, sender=(255, 190)):
        """Results of a COMMAND_INT."""
        given = [*four, 0, 0, 0, 0][:4]
        message = mav.MAVLink_command_int_message(1, 1, frame, command, 0, 0, *given, x, y, 0)
        return results(self.say(message, sender))


def results(messages):
    return [m.result for m in messages if m.get_type() == "COMMAND_ACK"]


def of(messages, kind):
    return [message for message in messages if message.get_type() == kind]


def text_of(messages):
    return "".join(message.text for message in of(messages, "STATUSTEXT"))


@pytest.fixture
def rig(clock):
    return Rig(clock)


@pytest.fixture
def paused(rig):
    rig.show(state=MissionState.PAUSED)
    return rig

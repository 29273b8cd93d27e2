"""Hostile MAVLink frames against the vehicle: `python -m tests.benchmarks.mavlink_fuzz -n 1000000`.

Three kinds in turn: noise, damaged frames, and well-formed messages of every type with values that
no station would send. They go through the codec of the link into the vehicle, whose engine is slow
and refuses every other order. The test of the suite does the same with fewer frames.
"""

from __future__ import annotations

import argparse
import random
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from pymavlink.dialects.v20 import all as mav

from stack.mavlink.origin import GeoOrigin
from stack.mavlink.signing import Signing, signed_codecs
from stack.telemetry.mavlink.handover import Handover
from stack.telemetry.mavlink.vehicle import Vehicle
from stack.telemetry.records import Ack, Snapshot

KINDS = ("noise", "damaged", "odd")

HEARD = (
    "COMMAND_LONG", "COMMAND_INT", "SET_MODE", "MISSION_COUNT", "MISSION_ITEM_INT", "MISSION_ITEM",
    "MISSION_REQUEST_INT", "MISSION_REQUEST", "MISSION_REQUEST_LIST", "MISSION_CLEAR_ALL",
    "MISSION_SET_CURRENT", "MISSION_ACK", "PARAM_SET", "PARAM_REQUEST_READ", "PARAM_REQUEST_LIST",
    "SET_POSITION_TARGET_LOCAL_NED", "SET_POSITION_TARGET_GLOBAL_INT", "MANUAL_CONTROL",
    "REQUEST_DATA_STREAM", "SET_GPS_GLOBAL_ORIGIN", "SETUP_SIGNING", "FILE_TRANSFER_PROTOCOL",
    "TIMESYNC", "PING", "HEARTBEAT",
)  # fmt: skip
"""Types that the vehicle answers, as often as all others together."""

COMMANDS = (16, 20, 176, 178, 179, 192, 193, 224, 246, 300, 400, 410, 510, 511, 512, 520)
NUMBERS = {
    "char": (0, 255), "uint8_t": (0, 2**8 - 1), "int8_t": (-(2**7), 2**7 - 1),
    "uint16_t": (0, 2**16 - 1), "int16_t": (-(2**15), 2**15 - 1), "uint32_t": (0, 2**32 - 1),
    "int32_t": (-(2**31), 2**31 - 1), "uint64_t": (0, 2**64 - 1), "int64_t": (-(2**63), 2**63 - 1),
}  # fmt: skip
ODD = (0.0, -0.0, 1.0, -1.0, 2.0, 4.0, 10.0, 1e-45, 3e38, -3e38, float("nan"), float("inf"))


class Hostile:
    """A source of frames.

    Args:
        seed: of the random numbers.
    """

    def __init__(self, seed: int = 0) -> None:
        self._chance = random.Random(seed)
        self._types = list(mav.mavlink_map.values())
        self._heard = [kind for kind in self._types if kind.msgname in HEARD]

    def frames(self, count: int, kinds: Sequence[str]) -> Iterator[bytes]:
        """So many frames of these kinds in turn: noise, damaged, odd."""
        for number in range(count):
            kind = kinds[number % len(kinds)]
            if kind == "noise":
                yield self._chance.randbytes(self._chance.randrange(1, 300))
            elif kind == "damaged":
                yield self._damaged(bytearray(self.odd_frame()))
            else:
                yield self.odd_frame()

    def odd_frame(self) -> bytes:
        """A well-formed frame with any values, mostly for our vehicle."""
        chance = self._chance
        kind = chance.choice(self._heard if chance.random() < 0.5 else self._types)
        values = [self._value(kind, n, name) for n, name in enumerate(kind.ordered_fieldnames)]
        in_order = dict(zip(kind.ordered_fieldnames, values, strict=True))
        message = kind(*(in_order[name] for name in kind.fieldnames))
        sender = mav.MAVLink(None, chance.randrange(256), chance.randrange(256))
        return bytes(message.pack(sender))

    def _value(self, kind: Any, number: int, name: str) -> Any:
        length = kind.array_lengths[number]
        declared = kind.fieldtypes[kind.fieldnames.index(name)]
        if declared == "char":
            return self._chance.randbytes(length or 1)
        if length:
            return [self._number(declared, name) for _ in range(length)]
        return self._number(declared, name)

    def _number(self, declared: str, name: str) -> Any:
        chance = self._chance
        if name.startswith("target") and chance.random() < 0.9:
            return 1
        if name == "command" and chance.random() < 0.9:
            return chance.choice(COMMANDS)
        if declared in ("float", "double"):
            return chance.choice(ODD) if chance.random() < 0.8 else chance.uniform(-1e3, 1e3)
        low, high = NUMBERS[declared]
        if chance.random() < 0.5:
            return chance.randrange(low, high + 1)
        return min(max(chance.randrange(20), low), high)

    def _damaged(self, frame: bytearray) -> bytes:
        """A frame with a wrong byte, without its end, or doubled."""
        chance = self._chance
        way = chance.randrange(3)
        if way == 0:
            frame[chance.randrange(len(frame))] ^= 1 << chance.randrange(8)
        elif way == 1:
            del frame[chance.randrange(1, len(frame)) :]
        else:
            frame[chance.randrange(len(frame)) :] = frame[: chance.randrange(len(frame))]
        return bytes(frame)


class Nowhere:
    """A link that packs every message as a real one does, and counts."""

    def __init__(self) -> None:
        self.sent: Counter[str] = Counter()
        self._codec = mav.MAVLink(None, 1, 1)

    def send(self, message: Any) -> bool:
        """Pack a message: values out of range would raise."""
        message.pack(self._codec)
        self.sent[message.get_type()] += 1
        return True


@dataclass
class Outcome:
    """What hostile frames have done.

    Attributes:
        understood: number of messages that the codec has found.
        orders: commands for the engine by kind.
        waiting: most commands that waited for the engine at once.
        sent: messages of the vehicle by type.
    """

    understood: int = 0
    orders: Counter[str] = field(default_factory=Counter)
    waiting: int = 0
    sent: Counter[str] = field(default_factory=Counter)


def fuzz(
    count: int, snapshot: Snapshot, codec: Any, kinds: Sequence[str] = KINDS, seed: int = 0
) -> Outcome:
    """Let the vehicle hear hostile frames.

    Args:
        count: number of frames.
        snapshot: state of the run.
        codec: of the link, which parses.
        kinds: of the frames, in turn.
        seed: of the frames.
    """
    handover, link, now, outcome = Handover(), Nowhere(), [0.0], Outcome()
    handover.snapshot = snapshot
    vehicle = Vehicle(handover, link, lambda: now[0], origin=GeoOrigin(48.0, 11.0))
    codec.robust_parsing = True
    for number, frame in enumerate(Hostile(seed).frames(count, kinds)):
        for message in codec.parse_buffer(frame) or ():
            kind = message.get_type()
            if kind != "BAD_DATA" and not kind.startswith("UNKNOWN_"):
                outcome.understood += 1
                vehicle.take(message)
        codec.buf, codec.buf_index = bytearray(), 0  # as the link does after each datagram
        now[0] += 0.002
        vehicle.tick()
        outcome.waiting = max(outcome.waiting, handover.waiting)
        if number % 50 == 0:
            for command in handover.take_commands():
                outcome.orders[command.kind] += 1
                handover.acks.append(Ack(command.id, number % 100 == 0, "refused"))
    outcome.sent = link.sent
    return outcome


def main() -> None:
    """Print the result of a long run."""
    from tests.stack.telemetry.conftest import make_snapshot

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-n", type=int, default=1_000_000, metavar="FRAMES")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    signed = signed_codecs(Signing(bytes(32)))(1, 1)
    for name, kinds, codec in (
        ("noise and damaged frames", KINDS[:2], mav.MAVLink(None)),
        ("odd messages", KINDS[2:], mav.MAVLink(None)),
        ("all, to a signed link", KINDS, signed),
    ):
        found = fuzz(given.n // 3, make_snapshot(), codec, kinds, given.seed)
        print(f"{name}: {given.n // 3} frames, {found.understood} understood", end=", ")
        print(f"orders {dict(found.orders)}, at most {found.waiting} waited")


if __name__ == "__main__":
    main()

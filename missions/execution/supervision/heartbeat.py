"""Memory that engine and supervisor share.

The engine writes its phase, a beat for each step and the node that is being ticked; the supervisor
reads them, also while the engine hangs in a call that never returns, and after it has died. The
supervisor writes one number: what it asks of the engine.
"""

from __future__ import annotations

import json
import mmap
import os
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from time import monotonic  # noqa: TID251 - the beat is compared by another process

SIZE = 1 << 19
ROBOTS = 16
"""Trees whose ticked node is shown; further ones are not."""

_BEAT, _NODES, _NAMES = 8, 64, 64 + 4 * ROBOTS
_BEATS, _COUNT = struct.Struct("=dddq"), struct.Struct("=i")
"""Wall time (monotonic), robot time and distance; step. Length of the names.

Packed outside the shared memory: `pack_into` would clear it first, and the other process would find
zeros in between.
"""

_PHASE, _REQUEST = 0, 1
"""Indices of the numbers before the beat."""

READS = 100
"""Attempts to read the same beat twice: one that is being written changes between two reads."""

NO_NODE = -1


class Phase(IntEnum):
    """What the engine is doing."""

    STARTING = 0
    COMPILING = 1
    RUNNING = 2
    CLOSING = 3


class Request(IntEnum):
    """What the supervisor asks of the engine."""

    NOTHING = 0
    CONTINUE_ALONE = 1
    HUNG_UP = 2


@dataclass(frozen=True, slots=True)
class Beat:
    """Progress of the engine.

    Attributes:
        phase: of the engine.
        wall: monotonic time of the last step, seconds, comparable between processes; 0 before it.
        time: of the robot, seconds.
        distance: driven, metres.
        step: number of the last step.
        nodes: number of the node that each tree ticks; NO_NODE between two ticks.
    """

    phase: Phase
    wall: float
    time: float
    distance: float
    step: int
    nodes: tuple[int, ...]


class Heartbeat:
    """The shared memory. The supervisor creates it and passes its descriptor to the engine."""

    def __init__(self, descriptor: int) -> None:
        """Map the memory of a descriptor, which may be closed afterwards."""
        self._memory = mmap.mmap(descriptor, SIZE)
        self._numbers = memoryview(self._memory)[:_BEAT].cast("i")
        self._beat = memoryview(self._memory)[_BEAT : _BEAT + _BEATS.size]
        self._nodes = memoryview(self._memory)[_NODES:_NAMES].cast("i")
        self._names: list[list[str]] = []
        self._closed = 0

    @staticmethod
    def create() -> tuple[Heartbeat, int]:
        """Return new shared memory and its descriptor, which the caller closes."""
        descriptor = os.memfd_create("heartbeat")
        os.truncate(descriptor, SIZE)
        heartbeat = Heartbeat(descriptor)
        for number in range(ROBOTS):
            heartbeat._nodes[number] = NO_NODE
        return heartbeat, descriptor

    def beat(self, step: int, time: float, distance: float) -> None:
        """Write that the engine has taken a step."""
        self._beat[:] = _BEATS.pack(monotonic(), time, distance, step)

    @property
    def phase(self) -> Phase:
        """What the engine is doing."""
        return Phase(self._numbers[_PHASE])

    @phase.setter
    def phase(self, phase: Phase) -> None:
        self._numbers[_PHASE] = phase

    @property
    def request(self) -> Request:
        """What the supervisor asks of the engine."""
        return Request(self._numbers[_REQUEST])

    @request.setter
    def request(self, request: Request) -> None:
        self._numbers[_REQUEST] = request

    def close_run(self) -> None:
        """Tell that the records of a run are being closed; the last one ends the work."""
        self._closed += 1
        if self._closed >= len(self._names):
            self.phase = Phase.CLOSING

    def add_tree(self) -> tuple[int, memoryview[int] | list[int]]:
        """Return the number of a new tree, and the cell for the node that it ticks."""
        number = len(self._names)
        self._names.append([])
        if number >= ROBOTS:
            return number, [NO_NODE]
        return number, self._nodes[number : number + 1]

    def set_names(self, tree: int, names: Sequence[str]) -> None:
        """Write the names of the nodes of a tree, in the order of their numbers."""
        self._names[tree] = list(names)
        text = json.dumps(self._names).encode()
        if len(text) <= SIZE - _NAMES - _COUNT.size:
            self._memory[_NAMES + _COUNT.size : _NAMES + _COUNT.size + len(text)] = text
            self._memory[_NAMES : _NAMES + _COUNT.size] = _COUNT.pack(len(text))

    def read(self) -> Beat:
        """Return the progress of the engine."""
        found = self._beat.tobytes()
        for _ in range(READS):
            before, found = found, self._beat.tobytes()
            if found == before:
                break
        wall, time, distance, step = _BEATS.unpack(found)
        return Beat(self.phase, wall, time, distance, step, tuple(self._nodes))

    def node_name(self) -> str:
        """Return the name of the node that is being ticked; empty between two ticks."""
        size = _COUNT.unpack_from(self._memory, _NAMES)[0]
        begin = _NAMES + _COUNT.size
        text = self._memory[begin : begin + max(0, min(size, SIZE - begin))]
        try:
            names = json.loads(text)
        except ValueError:  # there are none yet, or they are just being written
            return ""
        for tree, node in zip(names, self._nodes, strict=False):
            if 0 <= node < len(tree):
                return str(tree[node])
        return ""

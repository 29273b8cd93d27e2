"""Mailbox: the latest command and the latest feedback in shared memory, each with one writer.

A record is a sequence number, a signature and the content. The number is odd while the writer is at
work (a seqlock), so neither side ever waits for the other. The signature is a keyed BLAKE2b of
number and content with a key that only this brain and its loop know: a write that was torn, that is
from another brain or that is older than the last one is refused.

The memory has no name: the loop inherits its file descriptor. It stays readable whichever process
dies, and a new brain makes a new one.
"""

from __future__ import annotations

import mmap
import os
import struct
from dataclasses import dataclass
from hashlib import blake2b
from hmac import compare_digest

from stack.drivetrain.wheel_loop import PER_WHEEL
from stack.errors import BodyError

SIGNATURE = 16
_NUMBER = struct.Struct("=Q")
HEADER = _NUMBER.size + SIGNATURE

_COMMAND = struct.Struct("=dddQQQQ")
_FEEDBACK = struct.Struct("=QQdQQ")
PROBLEM = 240
"""Bytes of a problem."""
STATISTICS = 64
"""Numbers of the statistics: int64, as in stack/fast_loop/kernels.py."""


class Record:
    """One record in a mailbox.

    Args:
        memory: of the record, HEADER + content bytes.
        key: of the signature.

    Attributes:
        refused: number of contents that did not fit their signature.
    """

    def __init__(self, memory: memoryview, key: bytes) -> None:
        self._memory, self._key = memory, key
        self._content = memory[HEADER:]
        self._signature = memory[_NUMBER.size : HEADER]
        self._last = _NUMBER.unpack_from(memory)[0]
        self.refused = 0

    @property
    def number(self) -> int:
        """Of the last content written or read; it rises."""
        return int(self._last)

    def write(self, content: bytes | memoryview) -> None:
        """Replace the content; the sizes are equal."""
        number = self._last + 2
        _NUMBER.pack_into(self._memory, 0, number - 1)
        self._content[:] = content
        self._signature[:] = self._sign(number, self._content)
        _NUMBER.pack_into(self._memory, 0, number)
        self._last = number

    def read(self) -> bytes | None:
        """Return the content if it is newer than the last one; None also while it is written."""
        (number,) = _NUMBER.unpack_from(self._memory)
        if number == self._last or number % 2:
            return None
        signature, content = bytes(self._signature), bytes(self._content)
        if _NUMBER.unpack_from(self._memory)[0] != number:
            return None
        if number < self._last or not compare_digest(signature, self._sign(number, content)):
            self.refused += 1
            return None
        self._last = number
        return content

    def _sign(self, number: int, content: bytes | memoryview) -> bytes:
        digest = blake2b(_NUMBER.pack(number), digest_size=SIGNATURE, key=self._key)
        digest.update(content)
        return digest.digest()


@dataclass(frozen=True, slots=True)
class LoopCommand:
    """What the brain wants. Emergency stops are counted, so that none is lost between two reads.

    Attributes:
        twist: linear, angular and lateral velocity, base frame.
        stops: emergency stops so far.
        released: number of the last emergency stop that was released; `stops` if none stands.
        off: whether the wheels get no torque (1) or do (0).
        end: whether the loop stops the robot and ends (1) or not (0).
    """

    twist: tuple[float, float, float] = (0.0, 0.0, 0.0)
    stops: int = 0
    released: int = 0
    off: int = 0
    end: int = 0

    def packed(self) -> bytes:
        """Return the content of a record."""
        return _COMMAND.pack(*self.twist, self.stops, self.released, self.off, self.end)

    @classmethod
    def unpacked(cls, content: bytes) -> LoopCommand:
        """Return the command in a record."""
        linear, angular, lateral, stops, released, off, end = _COMMAND.unpack(content)
        return cls((linear, angular, lateral), stops, released, off, end)


@dataclass(frozen=True, slots=True)
class LoopFeedback:
    """What the loop did in its last cycle.

    Attributes:
        cycle: number of cycles so far.
        seen: number of the record of the last command that was obeyed.
        now: seconds on the loop's monotonic clock, which is the machine's.
        refused: commands with a wrong signature so far.
        stops: emergency stops seen; more than were released: one stands.
        state: of the wheel loop, float64 (stack/drivetrain/wheel_loop.py).
    """

    cycle: int
    seen: int
    now: float
    refused: int
    stops: int
    state: bytes

    def packed(self) -> bytes:
        """Return the content of a record."""
        head = _FEEDBACK.pack(self.cycle, self.seen, self.now, self.refused, self.stops)
        return head + self.state

    @classmethod
    def unpacked(cls, content: bytes) -> LoopFeedback:
        """Return the feedback in a record."""
        cycle, seen, now, refused, stops = _FEEDBACK.unpack_from(content)
        return cls(cycle, seen, now, refused, stops, content[_FEEDBACK.size :])


class Mailbox:
    """Three records in a file in memory.

    Args:
        descriptor: of the file; made by `new_file`. It is closed with the mailbox.
        wheels: number of driven wheels.
        key: of the signatures.

    Attributes:
        command: written by the brain: a `LoopCommand`.
        feedback: written by the loop in each cycle: a `LoopFeedback`.
        statistics: written by the loop ten times a second: int64 numbers, then the problem.
    """

    def __init__(self, descriptor: int, wheels: int, key: bytes) -> None:
        sizes = _record_sizes(wheels)
        self.descriptor = descriptor
        self._map = mmap.mmap(descriptor, sum(sizes))
        whole, records = memoryview(self._map), []
        for size in sizes:
            records.append(Record(whole[:size], key))
            whole = whole[size:]
        self.command, self.feedback, self.statistics = records

    @staticmethod
    def new_file(wheels: int) -> int:
        """Return the descriptor of a new file, of a size that nobody can change.

        Raises:
            BodyError: the system has no files in memory.
        """
        import fcntl

        if not hasattr(os, "memfd_create"):
            raise BodyError("the fast loop needs Linux: this system has no memfd_create")
        descriptor = os.memfd_create("treepilot", os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
        os.ftruncate(descriptor, sum(_record_sizes(wheels)))
        fcntl.fcntl(descriptor, fcntl.F_ADD_SEALS, fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_GROW)
        return descriptor

    def close(self) -> None:
        """Close the descriptor. The memory goes with the last process that has it."""
        os.close(self.descriptor)


def _record_sizes(wheels: int) -> tuple[int, int, int]:
    """Bytes of the records, multiples of 8, so that each begins aligned."""
    feedback = _FEEDBACK.size + 8 * (PER_WHEEL + 7 * wheels)
    contents = (_COMMAND.size, feedback, 8 * STATISTICS + PROBLEM)
    return tuple(HEADER + size for size in contents)  # type: ignore[return-value]

"""What the engine's thread and the thread of the link hand to each other; bounded, never blocking.

Every operation is one append, pop or assignment, which Python makes atomic.
"""

from __future__ import annotations

from collections import deque

from stack.telemetry.records import Ack, Command, Event, Snapshot

MAX_EVENTS, MAX_COMMANDS = 500, 50
"""Beyond it the oldest event is dropped, and a command is refused."""


class Handover:
    """Queues between the two threads.

    Attributes:
        snapshot: newest state of the run; None before the first.
        events: for the link, oldest first.
        acks: of the link's commands. An ack comes after the snapshot with its effect.
        heard: wall seconds of the newest heartbeat of a ground station; None before the first.
    """

    def __init__(self) -> None:
        self.snapshot: Snapshot | None = None
        self.events: deque[Event] = deque(maxlen=MAX_EVENTS)
        self.acks: deque[Ack] = deque()
        self.heard: float | None = None
        self._commands: deque[Command] = deque()

    def order(self, command: Command, *, urgent: bool = False) -> bool:
        """Queue a command for the engine; return whether there was room.

        Args:
            command: to queue.
            urgent: an emergency stop: always accepted, before all others.
        """
        if urgent:
            self._commands.appendleft(command)
            return True
        if len(self._commands) >= MAX_COMMANDS:
            return False
        self._commands.append(command)
        return True

    @property
    def waiting(self) -> int:
        """Number of commands that the engine has not taken yet."""
        return len(self._commands)

    def take_commands(self) -> list[Command]:
        """The commands since the last call, in order."""
        return [self._commands.popleft() for _ in range(len(self._commands))]

    def take_events(self) -> list[Event]:
        """The events since the last call, in order."""
        return [self.events.popleft() for _ in range(len(self.events))]

    def take_acks(self) -> list[Ack]:
        """The acknowledgements since the last call, in order."""
        return [self.acks.popleft() for _ in range(len(self.acks))]

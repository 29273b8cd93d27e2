"""Counts contacts, those of a moving robot apart from those made with a standing one."""

from __future__ import annotations

from dataclasses import dataclass

from stack.types import Twist

EPISODE_GAP = 0.5
"""Seconds without contact after which a touch is a new contact."""

MOVING = 0.02
"""Above this, m/s and rad/s, the robot moves."""


@dataclass(frozen=True, slots=True)
class ContactTally:
    """How often the robot touched something while moving, or was touched while standing."""

    by_robot: int = 0
    against_standing: int = 0


class ContactCounter:
    """Turns touches into episodes.

    Who moved is judged by the speed just before the touch, since a push moves a standing robot.
    """

    def __init__(self) -> None:
        self.tally = ContactTally()
        self._before = Twist()
        self._last = -EPISODE_GAP

    def update(self, time: float, touching: bool, speed: Twist) -> bool:
        """Note whether anything is touched now; whether that begins an episode."""
        before, self._before = self._before, speed
        if not touching:
            return False
        # The sum of many periods may miss the gap by a rounding error.
        begins = time - self._last >= EPISODE_GAP - 1e-9
        self._last = time
        if begins:
            self._count(before)
        return begins

    def _count(self, before: Twist) -> None:
        tally = self.tally
        if max(abs(before.linear), abs(before.angular), abs(before.lateral)) > MOVING:
            self.tally = ContactTally(tally.by_robot + 1, tally.against_standing)
        else:
            self.tally = ContactTally(tally.by_robot, tally.against_standing + 1)

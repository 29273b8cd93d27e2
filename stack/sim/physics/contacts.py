"""Contact counter; separates contacts of a moving robot from contacts with a standing one."""

from __future__ import annotations

from collections.abc import Iterable

from stack.body import ContactTally
from stack.sim.physics.engine import Touch
from stack.types import Twist

EPISODE_GAP = 0.5
"""Seconds without touch after which a touch counts as a new contact."""

MOVING_SPEED = 0.02
"""Speed, m/s and rad/s, above which the robot counts as moving."""

TILTED = 0.05
"""Radians above which something lifts the robot, or tips it over."""

SQUEEZED = 0.05
"""Metres by which what squeezes a robot overlaps it at least."""


def is_driving(twist: Twist) -> bool:
    """Whether a velocity of the base counts as a motion."""
    return max(abs(twist.linear), abs(twist.angular), abs(twist.lateral)) > MOVING_SPEED


def depths(touches: Iterable[Touch], tilt: float) -> dict[str, float]:
    """Return, by name, the largest depth by which the robot and what it touches overlap, metres.

    Between two things, or tilted, the robot cannot give way: it counts as squeezed by both of them.

    Args:
        touches: of the robot.
        tilt: of the robot, radians.
    """
    found: dict[str, float] = {}
    for touch in touches:
        found[touch.name] = max(touch.depth, found.get(touch.name, 0.0))
    if len(found) < 2 and tilt <= TILTED:
        return found
    return {name: max(depth, SQUEEZED) for name, depth in found.items()}


class ContactCounter:
    """Groups touches into contacts.

    Whether the robot moved is decided by its speed just before the touch, because a push moves a
    standing robot.
    """

    def __init__(self) -> None:
        self.tally = ContactTally()
        self._moved = False
        self._last = -EPISODE_GAP

    def update(self, time: float, touching: bool, moves: bool) -> bool:
        """Record whether the robot touches something now; return whether a contact begins.

        Args:
            time: seconds.
            touching: whether it touches something.
            moves: whether base or arm move by themselves now.
        """
        moved, self._moved = self._moved, moves
        if not touching:
            return False
        # Tolerance for the rounding error of a sum of many periods.
        begins = time - self._last >= EPISODE_GAP - 1e-9
        self._last = time
        if begins:
            self._count(moved)
        return begins

    def _count(self, moved: bool) -> None:
        tally = self.tally
        if moved:
            self.tally = ContactTally(tally.by_robot + 1, tally.against_standing)
        else:
            self.tally = ContactTally(tally.by_robot, tally.against_standing + 1)

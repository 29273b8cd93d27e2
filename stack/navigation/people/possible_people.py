"""People who stood when they were seen first: no track shows them, but they may wait for the robot.

A scan cannot tell them from things. Who is polite waits in a doorway until the robot has left it,
so the robot first treats what holds it up as a person: it makes room. What stays for as long as
that can take is a thing.
"""

from __future__ import annotations

from dataclasses import replace

from stack.lifecycle import Timer, Timers
from stack.navigation.drive_tools import DriveTools
from stack.navigation.people.standoff import PERSON_DISTANCE, nearest
from stack.types import Perceived

LARGEST_PERSON = 0.4
"""Radius in metres above which what stands is no person."""

GAP = 1.0
"""Seconds after which a robot that tries to get past is not held up any more."""


class PossiblePeople:
    """Adds standing objects that may be people to the tracks while they hold a drive up.

    Args:
        tools: of the drive.
        timers: of the drive: pauses do not count.
    """

    def __init__(self, tools: DriveTools, timers: Timers) -> None:
        self._tools, self._timers, self._held = tools, timers, timers.new()
        self._seen: dict[int, Timer] = {}

    def added(self, perceived: Perceived, *, held: bool) -> Perceived:
        """Return what is perceived, with those who may be people among the tracks.

        Args:
            perceived: in this step.
            held: whether the robot stands before an obstacle, finds no path or gives way.
        """
        p, now = self._tools.parameters, perceived.time
        if held and p.give_way_attempts:
            self._held.start(now)
        if not self._held.running or self._held.elapsed(now) > GAP or not perceived.world.standing:
            return perceived
        near = [
            thing for thing in perceived.world.standing
            if thing.radius <= LARGEST_PERSON
            and nearest([thing], perceived.estimate.pose, PERSON_DISTANCE) is not None
            and self._may_be_person(thing.id, now)
        ]  # fmt: skip
        if not near:
            return perceived
        tracks = (*perceived.world.tracks, *near)
        return replace(perceived, world=replace(perceived.world, tracks=tracks, standing=()))

    def _may_be_person(self, number: int, now: float) -> bool:
        timer = self._seen.setdefault(number, self._timers.new())
        timer.start_once(now)
        p = self._tools.parameters
        return timer.elapsed(now) < p.give_way_after + p.give_way_time

"""Exploration of an unknown place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot

from py_trees.common import Status

from behaviours._motion.driving import SteppedBehaviour, Steps
from behaviours._motion.odometry_trail import OdometryTrail
from behaviours.base import DRIVE_FAILURES, output, port
from stack.types import Frontier, Pose2D

LOOK_PERIOD = 1.0
"""Seconds between two looks at the frontiers during a drive."""
SETTLING_TIME = 1.0
"""Seconds without a frontier after which the exploration is over: the newest scans may lag."""
LOOK_ANGLE = 0.4
"""Radians; SLAM keeps a scan of a place from which the robot has turned this far."""
GAIN_EXPONENT = 0.25
"""Of the unknown area in view, which is divided by the way. With 1 the robot left small areas in a
room and came back for them at the end: mission 25 took 273 s instead of 167 s with seed 1."""
SAME_PLACE = 0.75
"""Metres within which two frontiers are the same one."""
FUTILE_DRIVES = 3
"""Drives to views of one place that fail or show nothing new before it is forgotten."""
MOST_DRIVES = 4
"""Drives to one place before it is forgotten, also those that ended early."""


@dataclass
class _Tried:
    """A place to which drives have failed, or from which the frontier did not vanish."""

    x: float
    y: float
    attempts: int = 0
    drives: int = 0

    @property
    def is_forgotten(self) -> bool:
        """Whether no more drives are made to this place."""
        return self.attempts >= FUTILE_DRIVES or self.drives >= MOST_DRIVES


class Explore(SteppedBehaviour):
    """Drive to frontiers until nothing reachable is unknown, and return to the start.

    A frontier is where known free space meets unknown space. The next one is a near one with much
    unknown area in view. Drives end early when the frontier has been seen from the way. Of a place
    that cannot be reached or seen, three views are tried. Needs a mission without a map, or one
    that draws its map: `localisation: slam`.
    """

    sensor_range: float = port(
        "distance at which walls are seen well", unit="m", default=6.0, above=0.0
    )
    least_size: float = port("shorter frontiers are ignored", unit="m", default=0.4, above=0.0)
    least_gain: float = port(
        "views that show less unknown area, m², are ignored", default=0.25, at_least=0.0
    )
    detour: float = port(
        "distance added to every way: larger values prefer large views to near ones",
        unit="m", default=2.0, above=0.0,
    )  # fmt: skip
    return_home: bool = port("drive back to the start at the end", default=True)
    known_area: float = output("free and occupied area of the map, m²")
    path_length: float = output("distance driven", unit="m")
    time_taken: float = output("duration", unit="s")
    unreachable: int = output("number of places that could not be reached or seen")

    needs = ("lidar",)
    claims = ("base",)
    takes_time = True
    fails_with = DRIVE_FAILURES

    def initialise(self) -> None:
        self._home = self.robot.localisation.pose
        self._timer, self._trail = self.start_timer(), OdometryTrail()
        self._tried: list[_Tried] = []
        self._avoided: list[Pose2D] = []
        self._steps = self._explore()

    def update(self) -> Status:
        self._trail.record(self.robot.time, self.robot.base.odometry)
        status = self.advance(self._steps)
        if status is not Status.RUNNING:
            self.known_area = self.robot.map.known_area
            self.path_length, self.time_taken = self._trail.distance, self._timer.elapsed
            self.unreachable = sum(item.is_forgotten for item in self._tried)
        return status

    def _explore(self) -> Steps:
        while True:
            yield from self._visit_all()
            if not self.return_home:
                return True
            looked = self.start_timer()
            task = self.robot.base.navigate_to(self._home)
            while (status := self.follow(task)) is Status.RUNNING:
                self.feedback_message = "everything reachable is known; returning"
                yield
                if not looked.is_over(LOOK_PERIOD):
                    continue
                looked.restart()
                # newly drawn scans or a closed loop may show another
                if self._best(self._frontiers()) is not None:
                    break
            else:
                return status is Status.SUCCESS

    def _visit_all(self) -> Steps:
        """Visit frontiers until none has been left for SETTLING_TIME."""
        settling = self.start_timer()
        while not settling.is_over(SETTLING_TIME):
            best = self._best(self._frontiers())
            if best is None:
                self.feedback_message = "no frontier left"
                yield
                continue
            yield from self._visit(best)
            settling.restart()
        return True

    def _visit(self, frontier: Frontier) -> Steps:
        """Drive to the view of a frontier until it has vanished; note places that fail."""
        place = self._place(frontier)
        place.drives += 1
        looked = self.start_timer()
        task = self.robot.base.navigate_to(frontier.pose)
        while (status := self.follow(task)) is Status.RUNNING:
            x, y = frontier.middle
            self.feedback_message = (
                f"to the frontier at ({x:.1f}, {y:.1f}), {frontier.gain:.1f} m² to see; "
                f"{self.robot.map.known_area:.0f} m² known"
            )
            yield
            if not looked.is_over(LOOK_PERIOD):
                continue
            looked.restart()
            frontiers = self._frontiers()
            if self._best(frontiers) is None or not _is_among(frontier, frontiers):
                return True
        self.failure = None
        if status is Status.FAILURE:
            place.attempts += 1
            self._avoided.append(frontier.pose)
        elif _is_among(frontier, self._frontiers()):
            yield from self._look_around()
            if _is_among(frontier, self._frontiers()):  # there is nothing more to see from here
                place.attempts += 1
                self._avoided.append(frontier.pose)
        yield
        return True

    def _look_around(self) -> Steps:
        """Turn a little, so that the map gets a scan from here, and wait until it is drawn."""
        yield from self.done(self.robot.base.spin(LOOK_ANGLE))
        self.failure = None
        settling = self.start_timer()
        while not settling.is_over(SETTLING_TIME):
            yield
        return True

    def _best(self, frontiers: Sequence[Frontier]) -> Frontier | None:
        """Return the frontier to drive to next; None without one."""
        known = [item for item in frontiers if not self._is_forgotten(item)]
        return max(known, key=self._worth, default=None)

    def _worth(self, frontier: Frontier) -> float:
        return float(frontier.gain**GAIN_EXPONENT / (frontier.distance + self.detour))

    def _frontiers(self) -> list[Frontier]:
        return self.robot.map.frontiers(
            sensor_range=self.sensor_range, least_size=self.least_size, least_gain=self.least_gain,
            avoided=self._avoided,
        )  # fmt: skip

    def _is_forgotten(self, frontier: Frontier) -> bool:
        return any(
            item.is_forgotten and _distance(frontier, item.x, item.y) < SAME_PLACE
            for item in self._tried
        )

    def _place(self, frontier: Frontier) -> _Tried:
        """Return the record of drives to a place, a new one for a new place."""
        for item in self._tried:
            if _distance(frontier, item.x, item.y) < SAME_PLACE:
                return item
        self._tried.append(_Tried(*frontier.middle))
        return self._tried[-1]


def _is_among(frontier: Frontier, frontiers: Sequence[Frontier]) -> bool:
    return any(_distance(item, *frontier.middle) < SAME_PLACE for item in frontiers)


def _distance(frontier: Frontier, x: float, y: float) -> float:
    return hypot(frontier.middle[0] - x, frontier.middle[1] - y)

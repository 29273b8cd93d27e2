"""Giving way: the robot leaves the way of a person whom it faces, and waits until they passed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import hypot, inf

import numpy as np

from stack.lifecycle import Lifecycle, Timers
from stack.navigation.drive_tools import DriveTools
from stack.navigation.following import Drive
from stack.navigation.people.backing_out import can_turn
from stack.navigation.people.narrow_meeting import Meeting, find_narrow_meeting
from stack.navigation.people.passing_place import REACH, find_passing_place, way_of
from stack.navigation.people.standoff import STANDING_SPEED, Standoff, nearest
from stack.navigation.tasks import MotionExecutor
from stack.planning.smoothing import resampled
from stack.types import STANDSTILL, FloatArray, Limitation, Perceived, Pose2D, TrackedObject, Twist
from stack.types.limitations import PERSON, STOPPED

TRAIL_STEP, TRAIL_LENGTH = 0.15, 8.0
"""Metres between the positions of a trail, and its length."""

ARRIVED_WITHIN = 0.15
"""Metres to the passing place at which the robot is there."""

BACKED_UP_AT_MOST = 0.5
"""Metres that a robot without room to turn backs up at most."""

WAITING_PERSON_TIME = 2.0
"""Seconds for which a person in the way has stood who waits for the robot to go first."""

PATIENCE = 2.0
"""Factor on the time before the robot gives way to a person who still moves: they may get past."""

STUCK, MOVES = 3.0, 0.1
"""Seconds in which a robot that gets less than these metres nearer does not reach its place."""

UNHELPFUL_AFTER = 4.0
"""Seconds for which the person stands before a robot that has made room: they need more of it."""

LOOK_AGAIN = 0.5
"""Seconds between two searches for a passing place."""

DRIVING_SPEED, STARTING_TIME = 0.5, 1.5
"""Speed in m/s on the way to a passing place, and seconds until the robot is under way."""

NEAR_WAY = 0.7
"""Metres to the way between the robot and whom it faced, within which a person has not passed."""

WALKS, ONWARD = 0.3, 2.0
"""m/s from which the velocity of a person shows where they want to go, and metres for which people
who stand are expected to go on straight."""

WAY_SPACING = 0.1
"""Metres between the points of the way that a person is expected to take."""

PASSED_AFTER = 0.5
"""Seconds without a person in front after which they have passed."""


class Trail:
    """Positions of the robot in the last metres, map frame."""

    def __init__(self) -> None:
        self._points: list[tuple[float, float]] = []

    @property
    def points(self) -> FloatArray:
        """(n, 2) oldest first."""
        found: FloatArray = np.array(self._points, dtype=np.float64).reshape(-1, 2)
        return found

    def add(self, pose: Pose2D) -> None:
        """Add the current position."""
        if self._points:
            x, y = self._points[-1]
            if hypot(pose.x - x, pose.y - y) < TRAIL_STEP:
                return
        self._points.append((pose.x, pose.y))
        del self._points[: -round(TRAIL_LENGTH / TRAIL_STEP)]


class WalkingDirections:
    """Remembers the direction of everybody in sight, also after they have stopped."""

    def __init__(self) -> None:
        self._known: dict[int, tuple[float, float]] = {}

    def update(self, people: Sequence[TrackedObject]) -> None:
        """Note how people walk now, map frame."""
        known = {person.id: self._known[person.id] for person in people if person.id in self._known}
        for person in people:
            if person.speed >= WALKS:
                x, y = person.velocity
                known[person.id] = (x / person.speed, y / person.speed)
        self._known = known

    def way_of(self, person: TrackedObject) -> FloatArray | None:
        """Return (2, 2) the way of a person straight ahead, map frame; None if it is not known."""
        direction = self._known.get(person.id)
        if direction is None:
            return None
        here = np.array(person.position)
        return np.array([here, here + ONWARD * np.array(direction)])


class GiveWay(Lifecycle):
    """Decides when a drive leaves a person's way, drives to a passing place and waits there.

    Args:
        tools: of the drive.
        make_drive: returns the drive to a passing place, map frame.
        timers: of the drive: pauses do not count.
    """

    def __init__(
        self, tools: DriveTools, make_drive: Callable[[Pose2D], Drive], timers: Timers
    ) -> None:
        self._tools, self._make_drive = tools, make_drive
        self._waits, self._clear, self._idle = (timers.new() for _ in range(3))
        self._trail, self._looked_at, self._looked_ahead_at = Trail(), -inf, -inf
        self._directions = WalkingDirections()
        self._tried: list[Pose2D] = []
        self._nearest = inf
        self._given = self._waited_before = 0
        self._front: FloatArray = np.empty((0, 2))
        self._person, self._expected = -1, -inf
        self._place = Pose2D(0.0, 0.0)
        self._drive: Drive | None = None
        self._back: MotionExecutor | None = None
        self._arrived = False

    @property
    def leaves_way(self) -> bool:
        """Whether the robot is on its way to a passing place, or waits there."""
        return self._drive is not None

    @property
    def limitation(self) -> Limitation | None:
        """That the robot stands at its passing place until a person has passed; else None."""
        if self._drive is None or not self._arrived:
            return None
        return Limitation(STOPPED, PERSON, "waiting for a person to pass")

    def step(self, perceived: Perceived, standoff: Standoff, ahead: FloatArray) -> Twist | None:
        """Return the velocity for this step; None while the robot does not give way.

        Args:
            perceived: in this step.
            standoff: who is in the way of the drive, and for how long.
            ahead: (n, 2) path of the drive from the robot on, map frame.
        """
        self._directions.update(perceived.world.tracks)
        if self._drive is None:
            self._trail.add(perceived.estimate.pose)
            self._begin(perceived, standoff)
        if self._drive is None:
            self._wait_before(perceived, ahead)
        if self._drive is None:
            return None
        twist = self._aside(self._drive, perceived)
        if twist is None:
            self.stop(perceived.time)
            standoff.end()
            self._tried.clear()
        return twist

    def pause(self, now: float) -> None:
        for motion in filter(None, (self._drive, self._back)):
            motion.pause(now)

    def resume(self, now: float) -> None:
        for motion in filter(None, (self._drive, self._back)):
            motion.resume(now)

    def stop(self, now: float) -> None:
        if self._drive is not None:
            self._drive.task.cancel("the way is free")
            self._drive.stop(now)
            self._drive = None
        self._end_back(now)

    def _end_back(self, now: float) -> None:
        if self._back is not None:
            self._back.task.cancel("the robot has room")
            self._back.stop(now)
            self._back = None

    def _begin(self, perceived: Perceived, standoff: Standoff) -> None:
        """Leave the way of a person whom the robot has faced for long enough."""
        p, person, now = self._tools.parameters, standoff.person, perceived.time
        waits = standoff.stood(now) >= WAITING_PERSON_TIME
        if person is None or standoff.lasts(now) < p.give_way_after * (1.0 if waits else PATIENCE):
            return
        if self._given >= p.give_way_attempts or now < self._looked_at + p.give_way_after:
            return
        self._looked_at = now
        here = perceived.estimate.pose
        front = np.array([person.position, (here.x, here.y)])
        place = self._place_beside(perceived, person, front)
        if place is not None:
            self._given += 1
            self._leave(perceived, place, Meeting(person, front, 0.0), "giving way to a person")

    def _wait_before(self, perceived: Perceived, ahead: FloatArray) -> None:
        """Leave the way of a person whom the robot would meet where two cannot pass."""
        p, now = self._tools.parameters, perceived.time
        if not perceived.world.tracks or self._waited_before >= p.give_way_attempts:
            return
        if now < self._looked_ahead_at + LOOK_AGAIN:
            return
        speed = perceived.motion.twist.linear
        costs = self._tools.global_costmap.view
        outline = self._tools.robot.footprint
        meeting = find_narrow_meeting(costs, ahead, perceived.world.tracks, speed, outline)
        if meeting is None:
            return
        self._looked_ahead_at = now
        place = self._place_beside(perceived, meeting.person, meeting.way)
        if place is None:
            return
        way = perceived.estimate.pose.distance_to(place)
        if STARTING_TIME + way / DRIVING_SPEED < meeting.seconds:
            self._waited_before += 1
            self._leave(perceived, place, meeting, "letting a person out of a narrow corridor")

    def _place_beside(
        self, perceived: Perceived, person: TrackedObject, front: FloatArray
    ) -> Pose2D | None:
        """Return a place beside the way of a person; `front`: from them to the robot."""
        pose = perceived.estimate.pose
        ways = [np.concatenate([front[:-1], way_of(person, pose, self._trail.points)[1:]])]
        ahead = self._directions.way_of(person)
        if ahead is not None:
            ways.append(ahead)
        near = [
            track for track in perceived.world.tracks if nearest([track], pose, REACH) is not None
        ]
        costs = self._tools.global_costmap.view
        return find_passing_place(
            costs, pose, ways, self._tools.robot.footprint, people=near, tried=self._tried
        )

    def _leave(self, perceived: Perceived, place: Pose2D, meeting: Meeting, why: str) -> None:
        """Begin the drive to a passing place."""
        now = perceived.time
        self._place, self._arrived = place, False
        self._front = resampled(meeting.way, WAY_SPACING)
        self._person, self._expected = meeting.person.id, now + meeting.seconds
        self._waits.start(now)
        self._clear.reset()
        self._idle.start(now)
        self._nearest = inf
        self._tools.emit("give_way", f"{why}: waiting at ({place.x:.1f}, {place.y:.1f})")
        self._drive = self._make_drive(place)
        self._drive.start(now)
        if not self._can_turn(perceived):
            self._back = self._tools.motions.back_up(BACKED_UP_AT_MOST, self._tools.parameters)
            if self._back is not None:
                self._back.start(now)

    def _aside(self, drive: Drive, perceived: Perceived) -> Twist | None:
        """Drive to the passing place and wait there; None when it is over."""
        now = perceived.time
        if self._waits.elapsed(now) >= self._tools.parameters.give_way_time:
            return None
        if self._back is not None:
            if self._back.task.running and not self._can_turn(perceived):
                return self._back.step(perceived)
            self._end_back(now)
        if self._does_not_help(perceived):
            self._go_elsewhere(perceived)
        if self._may_still_come(perceived):
            self._clear.start(now)
        else:
            self._clear.start_once(now)
        if self._clear.elapsed(now) >= PASSED_AFTER:
            return None
        drive = self._drive or drive
        if not self._arrived:
            self._arrived = perceived.estimate.pose.distance_to(self._place) <= ARRIVED_WITHIN
            if not self._arrived:
                return drive.step(perceived) if drive.task.running else None
            drive.stop(now)
            self._idle.start(now)
        return STANDSTILL

    def _does_not_help(self, perceived: Perceived) -> bool:
        """Whether the robot does not get to its place, or the person does not use the room."""
        now = perceived.time
        if self._arrived:
            in_front = [
                track for track in perceived.world.tracks if self._is_in_front(track.position)
            ]
            if not in_front or max(track.speed for track in in_front) >= STANDING_SPEED:
                self._idle.start(now)
            return self._idle.elapsed(now) >= UNHELPFUL_AFTER
        away = perceived.estimate.pose.distance_to(self._place)
        if away < self._nearest - MOVES:
            self._nearest = away
            self._idle.start(now)
        return self._idle.elapsed(now) >= STUCK

    def _go_elsewhere(self, perceived: Perceived) -> None:
        """Leave for another place; if there is none, try longer."""
        self._idle.start(perceived.time)
        person = next((t for t in perceived.world.tracks if t.id == self._person), None)
        if person is None or self._given >= self._tools.parameters.give_way_attempts:
            return
        here = perceived.estimate.pose
        front = np.array([person.position, (here.x, here.y)])
        self._tried.append(self._place)
        place = self._place_beside(perceived, person, front)
        if place is None:
            return
        self._given += 1
        self.stop(perceived.time)
        meeting = Meeting(person, self._front, self._expected - perceived.time)
        self._leave(perceived, place, meeting, "making more room for a person")

    def _may_still_come(self, perceived: Perceived) -> bool:
        """Whether a person is in front, or who was expected cannot be seen and is not due yet."""
        if any(self._is_in_front(track.position) for track in perceived.world.tracks):
            return True
        is_seen = any(track.id == self._person for track in perceived.world.tracks)
        return not is_seen and perceived.time < self._expected

    def _can_turn(self, perceived: Perceived) -> bool:
        """Whether nothing is within the circle in which the robot turns."""
        return can_turn(perceived.obstacles.points, self._tools.robot.footprint)

    def _is_in_front(self, at: tuple[float, float]) -> bool:
        """Whether a person is on the part of the way that leads to where the robot left it."""
        away = np.hypot(*(self._front - at).T)
        nearest_one = int(np.argmin(away))
        return bool(away[nearest_one] <= NEAR_WAY) and nearest_one < len(self._front) - 1

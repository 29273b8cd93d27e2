"""Following a person."""

from __future__ import annotations

from functools import partial
from math import atan2, cos, hypot, pi, sin

import numpy as np
from py_trees.common import Status

from behaviours._motion.driving import TIME_TO_LIVE, Steps
from behaviours._motion.following import STUCK_TIME, FollowingBehaviour
from behaviours._motion.odometry_trail import OdometryTrail
from behaviours._motion.paths import shortened
from behaviours._people.followed_person import COASTING_TIME, SURE_WITHIN, FollowedPerson, deviation
from behaviours.base import DRIVE_FAILURES, output, port
from stack.robot import Task
from stack.types import (
    STANDSTILL,
    Failure,
    FailureCode,
    Pose2D,
    TaskStatus,
    TrackedObject,
    Twist,
    wrap_angle,
)

AHEAD_ANGLE = 0.5 * pi
"""Radians to each side within which a person is ahead."""

DISTANCE_TO_STANDING = 0.2
"""Metres between the robot and a standing person at the end of a plan, which is then shortened:
the costmap shows people who stand as obstacles."""

AT_PLACE, LARGEST_PERSON = 0.5, 0.4
"""Metres from `near` within which an object that stands may be the person, and its radius."""

PLAN_PERIOD, PLAN_TIME = 0.5, 8.0
"""Seconds between two plans, and seconds of failing plans after which the last failure is that of
the behaviour."""

PATH_LEAD = 0.5
"""Seconds by which a path leads beyond the person, who walks on until the next one."""

SLACK, SET_OFF = 0.1, 0.3
"""Metres beyond the distance that the robot leaves at the end of a path, and at which it sets off
again."""

TURN_GAIN, FASTEST_TURN, POINTED = 1.5, 0.8, 0.1
"""1/s, rad/s and radians: the robot faces a person who stands."""

NO_TURN_WITHIN = 0.35
"""Metres to the person within which the robot does not turn to face them."""

SEARCH_LEAD = 2.0
"""Seconds of the person's walk beyond the place where they were last seen, to a second place of the
search."""

SEARCH_TOLERANCE = 0.3

OWN_POINTS, LANE_ROOM = 0.25, 0.1
"""Metres round the outline of the person within which returns are theirs, and beside the robot in
the lane to them."""

WALKED_AWAY = 0.5
"""Metres from where the person was seen first, after which standing still counts."""

FATAL_CODES = (FailureCode.LOST, FailureCode.AMBIGUOUS)


class FollowPerson(FollowingBehaviour):
    """Follow a walking person at a distance, also after a loss of sight.

    The person is the nearest walking one ahead, or nearest to a place. The robot plans to where the
    person walks and stops at the distance, facing them; it leaves their way when they come towards
    it (`evasion`). Out of sight, it goes to the place where they were last seen and beyond, and
    looks round; it finds them also if they stand. Succeeds at the first `until_…` that is reached.
    Fails with PERSON_LOST if the person is not seen for `patience`, and with NO_PROGRESS if it
    cannot follow.
    """

    also_known_as = ("FollowObject",)

    near: Pose2D | None = port(
        "follow who is nearest to this place, map frame; default: the nearest one ahead",
        default=None,
    )
    distance: float = port(
        "from the robot's front to the person", unit="m", default=1.0, at_least=0.5, at_most=5.0
    )
    speed: float | None = port(
        "top speed; default: the robot's", unit="m/s", default=None, above=0.0, at_most=3.0
    )
    patience: float = port(
        "time without sight of the person, or without motion of the object taken for them, after "
        "which it fails",
        unit="s", default=20.0, above=0.0,
    )  # fmt: skip
    until_stands: float | None = port(
        "end when the person, after a walk, has stood for this time and the robot is there",
        unit="s", default=None, above=0.0,
    )  # fmt: skip
    place_radius: float = port("radius around `until_place`", unit="m", default=1.0, above=0.0)
    person: Pose2D = output("where the person was last seen, map frame; heading of their walk")
    gap: float = output("distance between the robot's front and the person", unit="m")
    travelled: float = output("distance driven", unit="m")
    times_lost: int = output("how often the person went out of sight")

    needs = ("lidar",)
    claims = ("base",)
    takes_time = True
    fails_with = (*DRIVE_FAILURES, FailureCode.PERSON_LOST)
    ends_by = ("until_stands", "until_travelled", "until_time", "until_place")

    def initialise(self) -> None:
        super().initialise()
        self._front = self.robot.base.footprint.front
        self._unseen, self._stood, self._since_plan = (self.start_timer() for _ in range(3))
        self._supposed = self.start_timer()
        self._unplanned = self.start_timer()
        self._followed_person: FollowedPerson | None = None
        self._query: Task | None = None
        self._drive: Task | None = None
        self._search: Steps | None = None
        self._why: Failure | None = None
        self._walked, self._first = False, self.robot.localisation.pose
        self._beside = 0.0
        self.times_lost, self.travelled = 0, 0.0

    def update(self) -> Status:
        self.record_way()
        self.travelled = self._trail.distance
        person = self._person()
        if person is None:
            return self._wait_for_person()
        self._report(person)
        if self._is_over(person):
            return Status.SUCCESS
        lost = self._why_lost()
        if lost is not None:
            return self.fail(FailureCode.PERSON_LOST, lost)
        if self._unseen.elapsed <= COASTING_TIME:
            self._search = None
            self._follow_person(person)
        else:
            self._look_for(person)
        if self._why is not None:
            return self.fail(self._why.code, self._why.sentence)
        return Status.RUNNING

    def terminate(self, new_status: Status) -> None:
        self._end_query()
        super().terminate(new_status)

    def _person(self) -> FollowedPerson | None:
        """Return the person as they are now; None before a person was chosen."""
        now, tracks = self.robot.time, self.robot.perception.tracks
        person = self._followed_person
        if person is None:
            track = self._choice(tracks)
            if track is None:
                return None
            person = self._followed_person = FollowedPerson(track, now)
            self._trail, self._first = OdometryTrail(), Pose2D(*track.position)
            self.begin_here()
            for timer in (self._unseen, self._supposed, self._stood, self._unplanned):
                timer.restart()
        else:
            person.update(tracks, now, self.robot.perception.standing_objects)
        if person.visible:
            self._unseen.restart()
        if not person.is_supposed:
            self._supposed.restart()
        x, y = person.seen.position
        self._walked |= hypot(x - self._first.x, y - self._first.y) >= WALKED_AWAY
        if not (self._walked and person.stands and person.visible):
            self._stood.restart()
        return person

    def _choice(self, tracks: tuple[TrackedObject, ...]) -> TrackedObject | None:
        """Return whom to follow; None while nobody fits."""
        pose, near = self.robot.localisation.pose, self.near
        seen = [track for track in tracks if deviation(track) <= SURE_WITHIN]
        if near is None:
            near = pose
            seen = [track for track in seen if abs(_bearing(pose, track.position)) <= AHEAD_ANGLE]
        else:
            seen += [
                item for item in self.robot.perception.standing_objects
                if _distance(near, item) <= AT_PLACE and item.radius <= LARGEST_PERSON
            ]  # fmt: skip
        return min(seen, key=partial(_distance, near), default=None)

    def _wait_for_person(self) -> Status:
        if self._unseen.is_over(self.patience):
            where = "ahead" if self.near is None else f"near ({self.near.x:g}, {self.near.y:g})"
            return self.fail(
                FailureCode.PERSON_LOST, f"no walking person {where} within {self.patience:g} s"
            )
        self.stand(gives_way=True)
        self.feedback_message = "waiting for a person who walks"
        return Status.RUNNING

    def _report(self, person: FollowedPerson) -> None:
        (x, y), (u, v) = person.seen.position, person.seen.velocity
        self.person = Pose2D(x, y, atan2(v, u))
        self.gap = self._gap(person)
        self.times_lost = person.times_lost

    def _gap(self, person: FollowedPerson) -> float:
        x, y = person.expected(self.robot.time)
        pose = self.robot.localisation.pose
        return hypot(x - pose.x, y - pose.y) - self._front - person.radius

    def _why_lost(self) -> str | None:
        """Return why the person counts as lost, as a sentence; None while they do not."""
        where = f"({self.person.x:.1f}, {self.person.y:.1f})"
        if self._unseen.is_over(self.patience):
            return (
                f"the person, last seen at {where}, has been out of sight for {self.patience:g} s"
            )
        if self._supposed.is_over(self.patience):
            return (
                f"what stands at {where}, where the person may be, has not moved for "
                f"{self.patience:g} s"
            )
        return None

    def _is_over(self, person: FollowedPerson) -> bool:
        if self.is_limit_reached:
            return True
        stands = self.until_stands
        there = self._gap(person) <= self.distance + SET_OFF + SLACK
        return stands is not None and there and self._stood.is_over(stands)

    def _follow_person(self, person: FollowedPerson) -> None:
        """Drive towards the person, stand facing them, or back off."""
        gap = self._gap(person)
        drives = self._drive is not None and self._drive.status is TaskStatus.RUNNING
        near = gap <= self.distance + (SLACK if drives else SET_OFF)
        if near and (person.stands or self._is_in_line(person)):
            self._stand(person, gap)
            return
        self.feedback_message = f"following, {gap:.1f} m to the person"
        if self.is_stuck:
            self._why = Failure(
                FailureCode.NO_PROGRESS,
                f"the person walks on, but no progress for {STUCK_TIME:g} s",
            )
            return
        self._take_plan(person)
        if self._query is None and (not drives or self._since_plan.is_over(PLAN_PERIOD)):
            self._since_plan.restart()
            self._query = self.robot.base.plan(self._goal(person))
        if self._drive is None:
            self._face(person)
        elif self.follow(self._drive) is not Status.RUNNING:
            self._end_drive()
            self.feedback_message = f"following, {gap:.1f} m to the person"

    def _is_in_line(self, person: FollowedPerson) -> bool:
        """Whether the straight lane to the person is free; else a wall may soon hide them."""
        if self.robot.perception.scan is None:
            return True
        x, y = person.expected(self.robot.time)
        here = Pose2D(x, y).relative_to(self.robot.localisation.pose)
        length = hypot(here.x, here.y)
        points = self.robot.perception.scan.points()
        along = (points[:, 0] * here.x + points[:, 1] * here.y) / max(length, 1e-6)
        aside = np.abs(points[:, 1] * here.x - points[:, 0] * here.y) / max(length, 1e-6)
        between = (along > self._front) & (along < length - person.radius - OWN_POINTS)
        return not bool((between & (aside < self._front + LANE_ROOM)).any())

    def _goal(self, person: FollowedPerson) -> Pose2D:
        """Return where the person is soon, map frame."""
        (x, y), (u, v) = person.expected(self.robot.time), person.seen.velocity
        pose, lead = self.robot.localisation.pose, 0.0 if person.stands else PATH_LEAD
        bearing = atan2(y - pose.y, x - pose.x)
        self._beside = 0.0
        if person.stands and person.visible:
            self._beside = self._front + person.radius + DISTANCE_TO_STANDING
            x, y = x - self._beside * cos(bearing), y - self._beside * sin(bearing)
        return Pose2D(x + lead * u, y + lead * v, bearing)

    def _take_plan(self, person: FollowedPerson) -> None:
        """Drive along a plan that is ready."""
        query = self._query
        if query is None or query.status is TaskStatus.RUNNING:
            return
        self._query = None
        if query.status is not TaskStatus.SUCCEEDED or query.path is None:
            why = query.failure
            if why is not None and (why.code in FATAL_CODES or self._unplanned.is_over(PLAN_TIME)):
                self._why = why
            return
        self._unplanned.restart()
        keep = self.distance + self._front + person.radius - self._beside
        path = shortened(query.path, keep, self.speed)
        if path is not None and path.length > SLACK and len(path.points) > 1:
            self._drive = self.robot.base.follow_path(path)

    def _end_drive(self) -> None:
        """Forget a drive that is over; another plan replaces it."""
        if self.failure is not None and self.failure.code in FATAL_CODES:
            self._why = self.failure
        self.failure = None
        self._drive = None

    def _end_query(self) -> None:
        if self._query is not None:
            self._query.cancel()
            self._query = None

    def _stand(self, person: FollowedPerson, gap: float) -> None:
        """Stand facing the person."""
        self._end_query()
        self._drive, self._followed = None, None  # `drive_for` cancels it
        self._unplanned.restart()
        self.expect_motion()
        self.feedback_message = f"standing, {gap:.1f} m to the person"
        self._face(person)

    def _face(self, person: FollowedPerson) -> None:
        """Turn to the person; leave their way if they come towards the robot."""
        bearing = _bearing(self.robot.localisation.pose, person.expected(self.robot.time))
        turn = min(max(TURN_GAIN * bearing, -FASTEST_TURN), FASTEST_TURN)
        still = abs(bearing) <= POINTED or self._gap(person) < NO_TURN_WITHIN
        twist = STANDSTILL if still else Twist(angular=turn)
        self.robot.base.drive_for(twist, TIME_TO_LIVE, gives_way=True)

    def _look_for(self, person: FollowedPerson) -> None:
        """Go on with the search for a person out of sight."""
        if self._search is None:
            self._end_query()
            self._drive = None
            self._search = self._steps(person)
        try:
            next(self._search)
        except StopIteration:
            self._search = self._waiting()
        left = self._unseen.left(self.patience)
        self.feedback_message = f"looking for the person, {left:.0f} s left"

    def _steps(self, person: FollowedPerson) -> Steps:
        """Go to the place where the person was last seen and beyond, and look round."""
        (x, y), (u, v) = person.seen.position, person.seen.velocity
        for seconds in (0.0,) if person.stands else (0.0, SEARCH_LEAD):
            goal = Pose2D(x + seconds * u, y + seconds * v, atan2(v, u))
            yield from self._do(
                self.robot.base.navigate_to(goal, tolerance=SEARCH_TOLERANCE, partial=True)
            )
        yield from self._do(self.robot.base.spin(2.0 * pi))
        return (yield from self._waiting())

    def _do(self, task: Task) -> Steps:
        yield from self.done(task)
        self._end_drive()
        return True

    def _waiting(self) -> Steps:
        while True:
            self.stand(gives_way=True)
            yield


def _distance(place: Pose2D, item: TrackedObject) -> float:
    return hypot(item.position[0] - place.x, item.position[1] - place.y)


def _bearing(pose: Pose2D, at: tuple[float, float]) -> float:
    """Return the direction of a point, map frame, in the frame of a pose, radians."""
    dx, dy = at[0] - pose.x, at[1] - pose.y
    c, s = cos(pose.heading), sin(pose.heading)
    return wrap_angle(atan2(c * dy - s * dx, c * dx + s * dy))

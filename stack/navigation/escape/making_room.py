"""Making room: a drive that stands too close to something to turn onto its path first leaves it."""

from __future__ import annotations

from math import atan2, inf

from stack.lifecycle import Lifecycle, Timers
from stack.navigation.drive_tools import DriveTools
from stack.navigation.following import Follower
from stack.navigation.people.backing_out import can_turn
from stack.navigation.people.standoff import PERSON_DISTANCE, nearest
from stack.navigation.tasks import MotionExecutor
from stack.types import Perceived, Pose2D, Twist

PATIENCE_SHARE = 0.4
"""Share of `collision_patience` after which a robot that cannot turn where it is makes room."""

AHEAD, LEAST_TURN = 0.5, 0.3
"""Metres ahead on the path, and radians to there from which on the robot turns onto its path."""

ELSEWHERE = 0.3
"""Metres from the last place where the robot made room at which it may do so again."""


class MakingRoom(Lifecycle):
    """Drives a robot away from what keeps it from turning, by its range sensors.

    The plans of a grid begin in any direction, but a box beside a wall cannot turn: it leaves the
    wall along a gentle arc. A round robot can always turn. It stands still where a person is near.

    Args:
        tools: of the drive.
        timers: of the drive.
    """

    def __init__(self, tools: DriveTools, timers: Timers) -> None:
        self._tools, self._held = tools, timers.new()
        self._motion: MotionExecutor | None = None
        self._made_at: Pose2D | None = None

    @property
    def is_driving(self) -> bool:
        """Whether it drives the robot."""
        return self._motion is not None

    def step(self, perceived: Perceived, follower: Follower) -> Twist | None:
        """Return the velocity of a robot that makes room; None when it does not.

        Args:
            perceived: in this step.
            follower: of the drive.
        """
        if self._motion is None and self._should_begin(perceived, follower):
            self._begin(perceived)
        if self._motion is None:
            return None
        twist = self._motion.step(perceived)
        if self._motion.task.running:
            return twist
        self.stop(perceived.time)
        return None

    def pause(self, now: float) -> None:
        if self._motion is not None:
            self._motion.pause(now)

    def resume(self, now: float) -> None:
        if self._motion is not None:
            self._motion.resume(now)

    def stop(self, now: float) -> None:
        if self._motion is not None:
            self._motion.stop(now)
            self._motion = None

    def _begin(self, perceived: Perceived) -> None:
        self._held.reset()
        self._made_at = perceived.motion.pose
        self._motion = self._tools.motions.make_room(perceived, self._tools.parameters)
        self._motion.start(perceived.time)
        self._tools.emit("recovery", "no room to turn onto the path: making room")

    def _should_begin(self, perceived: Perceived, follower: Follower) -> bool:
        p, tools = self._tools.parameters, self._tools
        held = follower.waiting and follower.standoff.person is None
        if not held or tools.robot.footprint.is_round or not perceived.motion.twist.stands:
            self._held.reset()
            return False
        self._held.start_once(perceived.time)
        if self._held.elapsed(perceived.time) < PATIENCE_SHARE * p.collision_patience:
            return False
        before = self._made_at
        away = inf if before is None else before.distance_to(perceived.motion.pose)
        near = nearest(perceived.world.tracks, perceived.estimate.pose, 2.0 * PERSON_DISTANCE)
        if away < ELSEWHERE or near is not None or not _turns(follower, perceived.estimate.pose):
            return False
        return not can_turn(perceived.obstacles.points, tools.robot.footprint)


def _turns(follower: Follower, pose: Pose2D) -> bool:
    """Whether the robot must turn onto its path: what holds it may also stand ahead on it."""
    if follower.progress is None:
        return False
    points = follower.progress.ahead(AHEAD)
    if not len(points):
        return False
    there = pose.inverse().transform(points[-1:, :2])[0]
    return abs(atan2(there[1], there[0])) > LEAST_TURN

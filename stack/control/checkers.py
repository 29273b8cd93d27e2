"""Goal checker, progress checker and localisation checker."""

from __future__ import annotations

from stack.lifecycle import Timers
from stack.types import Pose2D, wrap_angle


class GoalChecker:
    """Goal checker: position and heading within their tolerances.

    A controller that still moves inside the tolerances may finish: the goal is reached when the
    robot stands, or after `settle` seconds inside. While the robot turns to the final heading, the
    position tolerance is doubled.
    """

    def __init__(
        self, goal: Pose2D, position: float = 0.15, heading: float = 0.15, settle: float = 2.0
    ) -> None:
        self.goal, self.position, self.heading, self.settle = goal, position, heading, settle
        self.at_position = False
        self.timers = Timers()
        self._settling = self.timers.new()

    def reached(self, time: float, pose: Pose2D, *, standing: bool) -> bool:
        """Whether the goal is reached at this time (s) and pose (map frame)."""
        distance = pose.distance_to(self.goal)
        self.at_position = distance <= self.position * (2.0 if self.at_position else 1.0)
        turned = abs(wrap_angle(self.goal.heading - pose.heading)) <= self.heading
        if not (self.at_position and turned):
            self._settling.reset()
            return False
        self._settling.start_once(time)
        return standing or self._settling.elapsed(time) >= self.settle


class ProgressChecker:
    """Reports no progress when position (m) and heading (rad) change too little for some time."""

    def __init__(self, distance: float = 0.3, angle: float = 0.4, seconds: float = 8.0) -> None:
        self.distance, self.angle, self.seconds = distance, angle, seconds
        self.timers = Timers()
        self._still = self.timers.new()
        self._place: Pose2D | None = None

    def stuck(self, time: float, pose: Pose2D) -> bool:
        """Whether the robot has stayed near one pose for too long."""
        place = self._place
        if place is not None:
            moved = place.distance_to(pose) >= self.distance
            turned = abs(wrap_angle(pose.heading - place.heading)) >= self.angle
            if not (moved or turned):
                return self._still.elapsed(time) >= self.seconds
        self._place = pose
        self._still.start(time)
        return False


class LostChecker:
    """Reports lost localisation when its health stays below a threshold for some time."""

    def __init__(self, health: float = 0.3, seconds: float = 1.5) -> None:
        self.health, self.seconds = health, seconds
        self.timers = Timers()
        self._low = self.timers.new()

    @property
    def doubted(self) -> bool:
        """Whether the health was below the threshold at the last check."""
        return self._low.running

    def lost(self, time: float, health: float) -> bool:
        """Whether the health has been below the threshold for `seconds`."""
        if health >= self.health:
            self._low.reset()
            return False
        self._low.start_once(time)
        return self._low.elapsed(time) >= self.seconds

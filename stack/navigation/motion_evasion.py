"""Applies evasion to motions: which of them it may change, its event, and the plan after it."""

from __future__ import annotations

from math import inf

import numpy as np

from stack.control.evasion.evasion import Evasion, Situation
from stack.control.path_follower import PathFollower
from stack.navigation.disambiguation import Disambiguation
from stack.navigation.following import Drive
from stack.navigation.path_speeds import slower
from stack.navigation.recoveries import DriveForMotion
from stack.navigation.tasks import Emit, MotionExecutor
from stack.types import STANDSTILL, FloatArray, Perceived, Twist

PATH_FORESEEN = 8.0
"""Metres of path along which evasion expects the robot."""

NO_POINTS: FloatArray = np.empty((0, 2))

NEW_EVASION = 3.0
"""Seconds without evasion after which the next one is an event of its own."""


class MotionEvasion:
    """Lets evasion change the velocity of a motion.

    Args:
        evasion: leaves the way of people who walk towards the robot.
        path_follower: knows the way ahead.
        emit: as of the navigator.

    Attributes:
        evasion: as given.
    """

    def __init__(self, evasion: Evasion, path_follower: PathFollower, emit: Emit) -> None:
        self.evasion, self._path_follower, self._emit = evasion, path_follower, emit
        self._evaded_at, self._evades = -inf, False

    def step(
        self, wanted: Twist, perceived: Perceived, motion: MotionExecutor | None, *,
        along_path: bool, limit: float,
    ) -> Twist:  # fmt: skip
        """Return the wanted velocity, or one that leaves the way of a person.

        A motion that is held because the robot is lost stands.

        Args:
            wanted: velocity of the motion, base frame.
            perceived: in this step.
            motion: that is under way; None: none.
            along_path: whether the motion follows a path.
            limit: of the speed, while the pose is in doubt, m/s.
        """
        when = self.evasion.parameters.when
        is_held = motion is not None and motion.held_for is not None
        if when == "never" or is_held or (when == "driving" and not _gives_way(motion)):
            if self._evades and isinstance(motion, Drive):
                motion.note_evasion()
            self._rest()
            return wanted
        if wanted != STANDSTILL and along_path and self._path_follower.keeps_clear(perceived.time):
            self._rest()
            return wanted
        way = NO_POINTS
        if along_path:
            way = self._path_follower.way_ahead(PATH_FORESEEN, backward=wanted.linear < 0.0)
        makes_way = isinstance(motion, Drive) and motion.makes_way and wanted != STANDSTILL
        situation = Situation(
            perceived.time, perceived.estimate.pose, perceived.motion.twist, perceived.world.tracks,
            perceived.obstacles, way, makes_way,
        )  # fmt: skip
        twist, evades = self.evasion.step(wanted, situation)
        if self._evades and not evades and isinstance(motion, Drive):
            motion.note_evasion()
        self._evades = evades
        if evades:
            if perceived.time >= self._evaded_at + NEW_EVASION:
                self._emit("evasion", "keeping clear of a person")
            self._evaded_at = perceived.time
        return twist if motion is None or motion.while_lost else slower(twist, limit)

    def _rest(self) -> None:
        self.evasion.rest()
        self._evades = False


def _gives_way(motion: MotionExecutor | None) -> bool:
    return isinstance(motion, Drive | Disambiguation) or (
        isinstance(motion, DriveForMotion) and motion.order.gives_way
    )

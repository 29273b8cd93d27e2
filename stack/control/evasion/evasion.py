"""Evasion: keeps the robot clear of people, and leaves the way of those who walk towards it.

A decision of the dynamic window kind (D. Fox, W. Burgard and S. Thrun, IEEE RAM 4(1), 1997) with
moving obstacles: constant velocities predict people well for a few seconds (C. Schöller et al.,
"What the constant velocity model can teach us about pedestrian motion prediction", RA-L 2020).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import hypot, inf
from typing import NamedTuple

import numpy as np

from stack.compilation import KernelTypes
from stack.control.evasion.lanes import LANE_LOOKAHEAD, Lanes
from stack.control.evasion.motions import motions_of
from stack.control.evasion.parameters import EvasionParameters
from stack.control.evasion.pushing import PushingPeople
from stack.drivetrain.description import RobotDescription
from stack.drivetrain.kinematics import scaled
from stack.safety.monitor import moving_discs
from stack.types import TRACK_PADDING, FloatArray, ObstaclePoints, Pose2D, TrackedObject, Twist

CLOSENESS_COSTS_BELOW = 0.35
"""Distance below which being close costs, m."""
WEIGHT_DECAY = 1.0
"""Time ahead after which a meeting weighs 1/e of one now, s."""

PREDICTION_STEP = 0.1
"""Step of the prediction, seconds."""

FARTHEST_POINT = 3.0
"""Points farther away than this are ignored, metres."""

MOST_POINTS = 160
"""Number of obstacle points that are used; more are thinned out."""

OVERLAP = 0.08
"""Metres by which the disc of a person may overlap a wall: bodies are not round."""

STATIC_PADDING = 0.04
"""Distance kept to obstacle points, metres."""

OFF_WALLS = 0.1
"""Distance that motions off the path keep to obstacle points, metres."""

METRES_PER_RADIAN = 0.15
"""Metres of deviation that equal one radian."""

KEPT, KEPT_SHARE = 0.25, 0.2
"""Cost, and share of it, by which another motion must be better than the one under way."""

KEPT_TIME = 2.0
"""Seconds after which a motion under way is no longer preferred."""

EVADING_MARGIN = 0.05
"""Distance, metres, that is kept to people in addition while an evasion is under way."""

UNLIMITED_TIME = 10.0
"""Seconds of a motion that goes on for longer than the horizon."""

RETREAT_SHARE = 0.5
"""Share of `retreat_time` by which a robot that retreats must be clear in addition."""

NO_TIME = 1e-9
"""Seconds, for rounding."""

NO_MOTIONS: FloatArray = np.empty((0, 7))
STANDING: FloatArray = np.array([[0.0, 0.0, 0.0, UNLIMITED_TIME, 0.0, 0.0, 0.0]])


@dataclass(frozen=True, slots=True)
class Situation:
    """Input of a decision.

    Attributes:
        time: seconds on the robot's clock.
        pose: map frame.
        twist: measured velocity.
        tracks: moving objects at `time`, map frame.
        obstacles: points of all range sensors, base frame.
        path: (k, 2) next points of the path that the velocity follows, map frame; none: it is no
            drive along a path.
        makes_way: whether the velocity makes way for a person already: it is only replaced if a
            standing robot would be met later.
    """

    time: float
    pose: Pose2D
    twist: Twist
    tracks: Sequence[TrackedObject]
    obstacles: ObstaclePoints
    path: FloatArray = field(default_factory=lambda: np.empty((0, 2)))
    makes_way: bool = False


@dataclass(frozen=True, slots=True)
class KeptMotion:
    """The lane or motion under way.

    Attributes:
        is_lane: whether it is a lane.
        number: of the lane, or of the motion.
        began: seconds.
    """

    is_lane: bool
    number: int
    began: float


Judge = Callable[[FloatArray, FloatArray, FloatArray], tuple[FloatArray, FloatArray]]
"""Lanes, motions and settings of the kernel `motion_costs` to their costs and times."""


class Evaded(NamedTuple):
    """A velocity, base frame, and whether it is an evasive one."""

    twist: Twist
    is_evasive: bool = False


class Evasion:
    """Replaces a velocity that leads to a meeting with a person by the best evasive motion.

    Costmaps and controllers do not see people who walk or have just stopped: this is the only part
    that plans round them.

    Args:
        robot: outline, limits and kind of drive.
        parameters: `configure` replaces them.
    """

    @staticmethod
    def kernels() -> KernelTypes:
        """Return the kernels of evasion."""
        from stack.control.evasion import kernels

        return kernels.EVASION

    def __init__(self, robot: RobotDescription, parameters: EvasionParameters) -> None:
        from stack.control.evasion import kernels

        self._kernels, self._robot = kernels, robot
        self._corners = np.ascontiguousarray(robot.footprint.points, dtype=np.float64)
        self._radius = robot.footprint.circumscribed_radius
        self._motions, self._lanes = motions_of(robot), Lanes(robot)
        limits = robot.limits
        self._limits = np.array([
            limits.linear_acceleration, limits.linear_deceleration, limits.angular_acceleration,
        ])  # fmt: skip
        self.configure(parameters)
        self._pushing = PushingPeople()
        self._kept: KeptMotion | None = None
        self._until = -inf

    def configure(self, parameters: EvasionParameters) -> None:
        """Apply new parameters."""
        self.parameters = parameters
        self._narrow, self._wide = _settings(parameters, 0.0), _settings(parameters, EVADING_MARGIN)

    def step(self, wanted: Twist, situation: Situation) -> Evaded:
        """Return the wanted velocity or an evasive one, slowly where it passes people.

        Args:
            wanted: base frame.
            situation: of this step.
        """
        discs = self._discs(situation)
        if not len(discs):
            self.rest()
            return Evaded(wanted)
        resting = situation.time < self._until
        chosen = self._decide(wanted, situation, discs, resting=resting)
        if chosen is None:
            self._kept = None
            return Evaded(self._slowed(wanted, discs))
        self._until = situation.time + self.parameters.rest
        return Evaded(self._slowed(chosen, discs), is_evasive=True)

    def rest(self) -> None:
        """Leave the wanted velocity alone: nobody is near, or its plan keeps clear of them."""
        self._kept = None

    def _slowed(self, twist: Twist, discs: FloatArray) -> Twist:
        """Return the twist on the same arc, limited by the distance to people not yet passed."""
        p, speed = self.parameters, hypot(twist.linear, twist.lateral)
        if not p.passing_time or speed <= p.passing_speed:
            return twist
        gap = self._kernels.least_gap_ahead(
            discs, self._corners, twist.linear / speed, twist.lateral / speed
        )
        share = (p.passing_speed + max(gap, 0.0) / p.passing_time) / speed
        return twist if share >= 1.0 else scaled(twist, share)

    def _discs(self, situation: Situation) -> FloatArray:
        """(k, 6) people whom the robot may meet within the horizon, base frame."""
        p = self.parameters
        discs = moving_discs(situation.tracks, situation.pose)
        if not len(discs):
            self._pushing.clear()
            return np.empty((0, 6))
        discs = self._pushing.expected(situation.time, situation.tracks, situation.pose, discs)
        coming: FloatArray = self._kernels.discs_in_reach(
            discs, p.horizon, self._robot.limits.linear_speed, self._radius
        )
        return coming

    def _decide(
        self, wanted: Twist, situation: Situation, discs: FloatArray, *, resting: bool
    ) -> Twist | None:
        """Return the evasive motion's first velocity; None if the wanted one is as good."""
        p = self.parameters
        points = self._points(situation.obstacles.points, discs)
        walking = self._kernels.times_to_obstacles(discs, points, p.horizon, OVERLAP, TRACK_PADDING)
        reach = p.horizon * abs(wanted.linear) + 2.0 * LANE_LOOKAHEAD
        way = self._lanes.way(situation.path, situation.pose, wanted, reach)
        lanes = self._lanes.beside(way, wanted)
        straight = np.array([
            (wanted.linear, wanted.lateral, wanted.angular, UNLIMITED_TIME, 0.0, 0.0, 0.0)
        ])  # fmt: skip
        own = NO_MOTIONS if len(lanes) else straight
        judged = self._judge(situation.twist, way, discs, walking, points)
        _, times = judged(lanes[:1], own, self._wide if resting else self._narrow)
        if times[0] == inf or (times[0] > p.time_to_meeting + NO_TIME and not resting):
            return None
        if len(lanes) or situation.makes_way:
            candidates = np.concatenate([own, STANDING])
            costs, times = judged(lanes, candidates, self._narrow)
            if situation.makes_way and times[0] >= times[-1]:
                self._kept = None
                return self._hurried(wanted, situation.obstacles)
            if len(lanes) and not self._must_retreat(times[-1]):
                return self._lane(way, lanes, costs[:-1], times[:-1])
        motions = np.concatenate([own, self._possible(situation.obstacles)])
        under_way = self._rest_of_motion(motions[len(own) :], situation.time)
        costs, _ = judged(lanes, np.concatenate([motions, under_way]), self._narrow)
        self._prefer_kept(costs, lanes, len(under_way))
        best = int(np.argmin(costs))
        if best == 0:
            return None
        if best < len(lanes):
            return self._follow(way, lanes, best)
        number = best - len(lanes)
        if number == len(motions):
            return _first_twist(under_way[0])
        self._kept = KeptMotion(is_lane=False, number=number - len(own), began=situation.time)
        return _first_twist(motions[number])

    def _hurried(self, wanted: Twist, obstacles: ObstaclePoints) -> Twist | None:
        """Return a reverse on the same arc at full speed; None: drive as wanted."""
        limits = self._robot.limits
        if wanted.linear >= 0.0 or obstacles.is_blind(np.pi):
            return None
        share = limits.reverse_speed / -wanted.linear
        if wanted.angular:
            share = min(share, limits.angular_speed / abs(wanted.angular))
        return scaled(wanted, max(share, 1.0))

    def _must_retreat(self, time: float) -> bool:
        """Whether the robot may leave its lanes, as it would be met in `time` if it stood."""
        retreats = self._kept is not None and not self._kept.is_lane
        return time <= self.parameters.retreat_time * (1.0 + RETREAT_SHARE * retreats) + NO_TIME

    def _lane(
        self, way: FloatArray, lanes: FloatArray, costs: FloatArray, times: FloatArray
    ) -> Twist | None:
        """Return the velocity onto the best lane; None for the wanted one, also if all meet people.

        Most people who walk towards a robot that keeps its lane make way; safety slows it.
        """
        self._prefer_kept(costs, lanes, 0)
        best = int(np.argmin(costs))
        return None if best == 0 or times[best] < inf else self._follow(way, lanes, best)

    def _follow(self, way: FloatArray, lanes: FloatArray, number: int) -> Twist:
        self._kept = KeptMotion(is_lane=True, number=number, began=0.0)
        return self._lanes.twist(way, *lanes[number].tolist())

    def _prefer_kept(self, costs: FloatArray, lanes: FloatArray, under_way: int) -> None:
        """Lower the cost of the lane or motion that is under way; a motion is the last one."""
        kept = self._kept
        if under_way:
            costs[-1] -= KEPT + KEPT_SHARE * costs[-1]
        elif kept is not None and kept.is_lane and len(lanes):
            costs[kept.number] -= KEPT + KEPT_SHARE * costs[kept.number]

    def _rest_of_motion(self, possible: FloatArray, time: float) -> FloatArray:
        """Return (1, 7) what is left of the motion under way; (0, 7): none is."""
        kept = self._kept
        if kept is None or kept.is_lane or time - kept.began > KEPT_TIME:
            return NO_MOTIONS
        motion = possible[kept.number : kept.number + 1].copy()
        motion[0, 3] -= time - kept.began
        if motion[0, 3] < 0.5 * PREDICTION_STEP:
            motion[0, :3], motion[0, 3] = motion[0, 4:], UNLIMITED_TIME
        return motion

    def _possible(self, obstacles: ObstaclePoints) -> FloatArray:
        """Return the motions, slow where no sensor sees."""
        if not obstacles.is_blind(np.pi):
            return self._motions
        slow = self._motions.copy()
        for column in (0, 4):
            slow[:, column] = np.maximum(slow[:, column], -0.15)
        return slow

    def _judge(
        self, twist: Twist, way: FloatArray, discs: FloatArray, walking: FloatArray,
        points: FloatArray,
    ) -> Judge:  # fmt: skip
        """Return what tells costs and times of the first meeting of lanes and motions."""
        now = np.array([twist.linear, twist.lateral, twist.angular])

        def judged(
            lanes: FloatArray, motions: FloatArray, settings: FloatArray
        ) -> tuple[FloatArray, FloatArray]:
            costs, times = self._kernels.motion_costs(
                lanes, way, self._lanes.steering, motions, now, self._limits, discs, walking,
                points, self._corners, self._radius, settings,
            )  # fmt: skip
            return costs, times

        return judged

    def _points(self, points: FloatArray, discs: FloatArray) -> FloatArray:
        """Return the near points that belong to no disc, thinned out."""
        near: FloatArray = self._kernels.points_outside_discs(
            np.ascontiguousarray(points), discs, FARTHEST_POINT + self._radius, TRACK_PADDING
        )
        every = -(-len(near) // MOST_POINTS) or 1
        return np.ascontiguousarray(near[::every])


def _settings(parameters: EvasionParameters, wider: float) -> FloatArray:
    """Return the parameters as `motion_costs` takes them, with padding that is wider by metres."""
    p = parameters
    return np.array([
        p.horizon, PREDICTION_STEP, p.padding + wider, p.growth, p.headway,
        CLOSENESS_COSTS_BELOW, STATIC_PADDING, WEIGHT_DECAY,
        p.meeting_weight, p.closeness_weight, 1.0, METRES_PER_RADIAN, OFF_WALLS,
    ])  # fmt: skip


def _first_twist(motion: FloatArray) -> Twist:
    linear, lateral, angular = motion[:3].tolist()
    return Twist(linear, angular, lateral)

"""MPPI controller: averages thousands of simulated motions, weighted by their cost."""

from __future__ import annotations

from functools import cache, partial
from math import ceil, hypot, inf
from typing import ClassVar

import numpy as np

from stack.compilation import KernelTypes
from stack.components import ControlState
from stack.control.mppi.critics.critics import PATH_FOLLOW_AHEAD
from stack.control.mppi.optimiser import Optimiser
from stack.control.mppi.parameters import MppiParameters
from stack.control.mppi.scene import BodyArrays, LocalPath, Obstacles, clearance_to
from stack.control.path_controller import PathController
from stack.drivetrain.description import RobotDescription
from stack.geometry.path_segment import PathSegment
from stack.types import FloatArray, Twist

PATH_SPACING = 0.05
"""Spacing of the path points used by critics, m."""

SLOWER_PLANS = (1.0, 0.5, 0.25)
"""Factors on the plan's speeds, tried in turn while its motion is not clear."""

STALLED, STALLED_TURN = 0.04, 0.1
"""Motion in metres and radians below which the plan of a standing robot counts as stalled."""

AT_REST = 0.2
"""Speed in m/s below which a tracked object counts as standing; it may wait for the robot."""

CLEARANCE_TO_MOVING = 0.1
"""Metres of clearance to predicted positions of a plan that keeps clear."""

NEAR_PERSON = 3.0
"""Distance in metres to a moving object within which the robot does not stop to turn in place."""


class Mppi(PathController[MppiParameters]):
    """MPPI controller: samples control sequences and averages the best."""

    Parameters = MppiParameters
    needs_tracks: ClassVar[bool] = True

    @staticmethod
    def kernels(parameters: MppiParameters, robot: RobotDescription) -> KernelTypes:
        from stack.control.mppi.critics.kernels import CRITICS
        from stack.control.mppi.kernels import ROLLOUTS

        return (*PathController.kernels(parameters, robot), *ROLLOUTS, *CRITICS)

    def __init__(self, parameters: MppiParameters, robot: RobotDescription, period: float) -> None:
        self._outline = cache(partial(BodyArrays.of, robot.footprint))
        self._obstacles: Obstacles | None = None
        self._keeps_clear = False
        super().__init__(parameters, robot, period)

    def configure(self, parameters: MppiParameters) -> None:
        """Apply new parameters and reset the plan."""
        self._optimiser = Optimiser(parameters, self._robot, self._period)
        super().configure(parameters)

    def _commanded(self, twist: Twist) -> None:
        self._optimiser.remember(twist)
        super()._commanded(twist)

    @property
    def keeps_clear(self) -> bool:
        return bool(self.parameters.moving_weight) and self._keeps_clear

    def _stand(self) -> None:
        self._keeps_clear = False
        self._optimiser.reset()
        super()._stand()

    def _may_stand_and_turn(self, state: ControlState) -> bool:
        """Not near a moving object: the plan leads past it."""
        x, y = state.pose.x, state.pose.y
        return not self.parameters.moving_weight or all(
            track.speed < AT_REST
            or hypot(track.position[0] - x, track.position[1] - y) > NEAR_PERSON
            for track in state.tracks
        )

    def _follow(self, segment: PathSegment, state: ControlState) -> Twist | None:
        """The first step of the improved plan, slower if needed to be safe; None if unsafe."""
        optimiser, p, costs = self._optimiser, self.parameters, state.costs
        reach = optimiser.top_speed * p.steps * p.time_step + PATH_FOLLOW_AHEAD
        path = LocalPath.of(segment, state.pose, costs, reach, PATH_SPACING)
        body = self._swept.body(costs.resolution)
        tracks = state.tracks if p.moving_weight else ()
        around = Obstacles.of(costs, state.pose, body, tracks, self._obstacles)
        self._obstacles = around
        outline = self._outline(costs.resolution)
        optimiser.limit_reverse(p.blind_speed if state.blind_behind else inf)
        optimiser.shift()
        optimiser.improve(state.pose.heading, self._alignment.last, path, around, outline)
        chosen = self._choice(state)
        if chosen is None:
            self._stand()
            return None
        return None if self._stalled(segment, state) else self._alignment.ramped(chosen)

    def _choice(self, state: ControlState) -> Twist | None:
        """The first step of the plan or of the best rollout, slower if needed to be safe.

        One that keeps clear of everybody to its end comes before others.
        """
        chosen: Twist | None = None
        self._keeps_clear = False
        for share in SLOWER_PLANS:
            for controls in (self._optimiser.plan, self._optimiser.best()):
                poses, first = self._optimiser.trajectory(
                    share * controls, state.pose, self._alignment.last
                )
                rooms = self._rooms(poses, state)
                if not self._is_safe(poses[: self._soon], rooms[:, : self._soon], state):
                    continue
                self._keeps_clear = bool((rooms >= CLEARANCE_TO_MOVING).all())
                if chosen is None or self._keeps_clear:
                    chosen, self._local_plan = first, poses
                if self._keeps_clear:
                    return chosen
        return chosen

    def _is_safe(self, poses: FloatArray, rooms: FloatArray, state: ControlState) -> bool:
        """Whether poses one time step apart are free, and nobody comes into contact.

        Args:
            poses: (k, 3) map frame.
            rooms: (m, k) clearances to moving objects; below 0 from the start: no way to avoid it.
            state: of this step.
        """
        if self._swept.clear_poses(state.costs, state.pose, poses[None])[0] < len(poses):
            return False
        return not ((rooms[:, 0] >= 0.0) & (rooms.min(axis=1) < 0.0)).any()

    def _rooms(self, poses: FloatArray, state: ControlState) -> FloatArray:
        """(m, k) clearances at (k, 3) poses one time step apart to objects that keep on moving."""
        p, outline = self.parameters, self._outline(state.costs.resolution)
        times = p.time_step * np.arange(1.0, len(poses) + 1.0)
        tracks = state.tracks if p.moving_weight else ()
        rooms = [clearance_to(outline, poses, times, track) for track in tracks]
        return np.array(rooms).reshape(len(rooms), len(poses))

    @property
    def _soon(self) -> int:
        """Number of steps of a plan that must be clear."""
        return ceil(self.parameters.time_to_collision / self.parameters.time_step)

    def _stalled(self, segment: PathSegment, state: ControlState) -> bool:
        """Whether the robot stands and its plan does not move it within `time_to_collision`.

        Later motion does not count: the robot could postpone it for ever. Near the end of a segment
        half of the rest is enough, for a slow robot half of what it can do.
        """
        if self._local_plan is None or hypot(state.twist.linear, state.twist.lateral) > STALLED:
            return False
        x, y, heading = self._local_plan[: self._soon][-1]
        half = 0.5 * self.parameters.time_to_collision
        least = min(STALLED, 0.5 * segment.remaining, half * self._optimiser.top_speed)
        moves = hypot(x - state.pose.x, y - state.pose.y) > least
        least_turn = min(STALLED_TURN, half * self._robot.limits.angular_speed)
        return not moves and abs(heading - state.pose.heading) < least_turn

"""Model-predictive path integral control: thousands of short futures, weighted by their cost."""

from __future__ import annotations

from math import ceil, hypot
from typing import ClassVar

import numpy as np

from stack.components import ControlState
from stack.control.mppi.optimiser import Optimiser
from stack.control.mppi.parameters import MppiParameters
from stack.control.mppi.scene import Array32, LocalPath, Obstacles, Outline, room_beside
from stack.control.path_controller import PathController
from stack.control.path_progress import PathProgress
from stack.drivetrain.description import RobotDescription
from stack.types import FloatArray, Twist

SLOWER = (1.0, 0.5, 0.25)
"""Shares of the plan's speeds tried in turn while what it leads to is not clear."""

STALLED, STALLED_TURN = 0.04, 0.1
"""A plan that moves less than this (metres, radians) while the robot stands leads nowhere."""

AT_REST = 0.2
"""m/s below which somebody is not on the way to anywhere, and may be waiting for the robot."""

NEAR_SOMEBODY = 3.0
"""Metres to a moving thing within which the robot does not stand to turn towards its path."""


class Mppi(PathController[MppiParameters]):
    """Follows a path by sampling controls and averaging the best (MPPI)."""

    Parameters = MppiParameters
    needs_tracks: ClassVar[bool] = True

    def __init__(self, parameters: MppiParameters, robot: RobotDescription, period: float) -> None:
        self._outline: tuple[float, Outline] | None = None
        super().__init__(parameters, robot, period)

    def configure(self, parameters: MppiParameters) -> None:
        """Put other parameters in force; the plan begins anew."""
        self._optimiser = Optimiser(parameters, self._robot, self._period)
        super().configure(parameters)

    def command(self, state: ControlState) -> Twist:
        """The velocity to drive now.

        Raises:
            NavigationError: COLLISION_AHEAD when nothing safe could be commanded for `patience`.
        """
        twist = super().command(state)
        self._optimiser.remember(twist)
        return twist

    def _stand(self) -> None:
        self._optimiser.reset()
        super()._stand()

    def _may_stand_and_turn(self, state: ControlState) -> bool:
        """Not in the way of somebody, whom the plan leads past."""
        x, y = state.pose.x, state.pose.y
        return not self.parameters.moving_weight or all(
            track.speed < AT_REST
            or hypot(track.position[0] - x, track.position[1] - y) > NEAR_SOMEBODY
            for track in state.tracks
        )

    def _along(self, track: PathProgress, state: ControlState) -> Twist | None:
        """The first step of the improved plan, or of what of it is safe; None: nothing is."""
        optimiser, p, costs = self._optimiser, self.parameters, state.costs
        reach = optimiser.top_speed * p.steps * p.time_step + p.path_follow_ahead
        path = LocalPath.of(track, state.pose, costs, reach, p.path_spacing)
        body = self._swept.body(costs.resolution)
        around = Obstacles.of(costs, state.pose, body, state.tracks if p.moving_weight else ())
        outline = self._outline_for(costs.resolution)
        optimiser.shift()
        optimiser.improve(state.pose.heading, self._ends.last, path, around, outline)
        for share in SLOWER:
            for controls in (optimiser.plan, optimiser.best()):
                twist = self._if_safe(share * controls, state)
                if twist is not None:
                    return None if self._stalled(state) else self._ends.ramped(twist)
        self._stand()
        return None

    def _if_safe(self, controls: Array32, state: ControlState) -> Twist | None:
        """The first step of controls, if what they lead to soon is clear."""
        poses, first = self._optimiser.trajectory(controls, state.pose, self._ends.last)
        soon = poses[: self._soon]
        if self._swept.clear_poses(state.costs, state.pose, soon[None])[0] < len(soon):
            return None
        if state.tracks and self._meets_somebody(soon, state):
            return None
        self._local_plan = poses
        return first

    def _meets_somebody(self, poses: FloatArray, state: ControlState) -> bool:
        """Whether poses one time step apart run into anybody who keeps his velocity."""
        p, outline = self.parameters, self._outline_for(state.costs.resolution)
        times = p.time_step * np.arange(1.0, len(poses) + 1.0)
        rooms = [room_beside(outline, poses, times, track) for track in state.tracks]
        return bool(p.moving_weight) and any(room[0] >= 0.0 > room.min() for room in rooms)

    @property
    def _soon(self) -> int:
        """Steps of a plan that have to be clear."""
        return ceil(self.parameters.time_to_collision / self.parameters.time_step)

    def _stalled(self, state: ControlState) -> bool:
        """Whether the robot stands and its plan leads nowhere soon: something holds it up.

        What it means to do later does not count: it would put that off for ever.
        """
        if self._local_plan is None or hypot(state.twist.linear, state.twist.lateral) > STALLED:
            return False
        x, y, heading = self._local_plan[: self._soon][-1]
        moves = hypot(x - state.pose.x, y - state.pose.y) > STALLED
        return not moves and abs(heading - state.pose.heading) < STALLED_TURN

    def _outline_for(self, resolution: float) -> Outline:
        if self._outline is None or self._outline[0] != resolution:
            self._outline = (resolution, Outline.of(self._robot.footprint, resolution))
        return self._outline[1]

"""Model-predictive path integral control: thousands of short futures, weighted by their cost."""

from __future__ import annotations

from math import ceil, hypot

from stack.components import ControlState
from stack.control.arrival import Arrival
from stack.control.mppi.optimiser import Optimiser
from stack.control.mppi.parameters import MppiParameters
from stack.control.mppi.scene import Array32, LocalPath, Obstacles, Outline
from stack.control.patience import Patience
from stack.control.ramps import Ramp
from stack.control.rotation_shim import RotationShim
from stack.control.swept import SweptFootprint
from stack.control.track import Track
from stack.control.turning import TurnInPlace, TurnStyle
from stack.description import RobotDescription
from stack.types import STANDSTILL, FloatArray, Path, Twist, wrap_angle

SLOWER = (1.0, 0.5, 0.25)
"""Shares of the plan's speeds tried in turn while what it leads to is not clear."""

CAR_HEADING = 0.1
"""Heading error, in radians, with which a car that cannot turn in place is content."""

STALLED, STALLED_TURN = 0.05, 0.15
"""A plan that moves less than this (metres, radians) while the robot stands leads nowhere."""


class Mppi:
    """Follows a path by sampling controls and averaging the best (MPPI)."""

    Parameters = MppiParameters

    def __init__(self, parameters: MppiParameters, robot: RobotDescription, period: float) -> None:
        self._robot, self._period = robot, period
        self._swept, self._patience = SweptFootprint(robot.footprint), Patience()
        self._track: Track | None = None
        self._last = STANDSTILL
        self._local_plan: FloatArray | None = None
        self._outline: tuple[float, Outline] | None = None
        self._arrival, self._shim = Arrival(), RotationShim()
        self.configure(parameters)

    def configure(self, parameters: MppiParameters) -> None:
        """Put other parameters in force; the plan begins anew."""
        self.parameters = parameters
        self._optimiser = Optimiser(parameters, self._robot.limits, self._period)
        self._ramp = Ramp(self._robot.limits, self._period, parameters.response_time)
        style = TurnStyle(parameters.rotate_speed, parameters.brake_share, parameters.goal_heading)
        self._turn = TurnInPlace(self._swept, self._ramp, style)

    def set_path(self, path: Path) -> None:
        """A new path to follow, map frame."""
        self._track = Track(path)
        self._arrival.set_path(path)

    def command(self, state: ControlState) -> Twist:
        """The velocity to drive now.

        Raises:
            NavigationError: COLLISION_AHEAD when nothing safe could be commanded for `patience`.
        """
        track = self._track
        if track is None:
            return STANDSTILL
        track.advance(state.pose)
        last = self._ramp.rebased(self._last, state.twist)
        if self._there(track, state):
            chosen = self._finish(track, state, last)
        else:
            chosen = self._turned(track, state, last) or self._planned(track, state, last)
        self._last = STANDSTILL
        self._last = self._patience.bear(chosen, state.time, self.parameters.patience)
        self._optimiser.remember(self._last)
        return self._last

    @property
    def local_plan(self) -> Path | None:
        """Where the plan leads, map frame."""
        return None if self._local_plan is None else Path(self._local_plan)

    @property
    def _turns_in_place(self) -> bool:
        return self.parameters.motion_model != "ackermann"

    def _there(self, track: Track, state: ControlState) -> bool:
        """Whether the goal's position is reached; for a car its heading as well."""
        reached = self._arrival.reached(state.pose, self.parameters.goal_position)
        error = wrap_angle(track.path.goal.heading - state.pose.heading)
        return reached and (self._turns_in_place or abs(error) <= CAR_HEADING)

    def _finish(self, track: Track, state: ControlState, last: Twist) -> Twist | None:
        """Stop, and turn to the goal's heading."""
        self._stand()
        if not self._turns_in_place:
            return self._ramp.stopped(last)
        angle = wrap_angle(track.path.goal.heading - state.pose.heading)
        return self._turn.twist(state, last, angle)

    def _turned(self, track: Track, state: ControlState, last: Twist) -> Twist | None:
        """A turn towards a path that lies far off; None when it need not or cannot be made."""
        p = self.parameters
        if not (p.rotate_to_heading and self._turns_in_place):
            return None
        angle = self._shim.angle(track, state, p.rotate_angle, p.goal_position)
        twist = None if angle is None else self._turn.twist(state, last, angle)
        if twist is not None:
            self._stand()
        return twist

    def _stand(self) -> None:
        self._optimiser.reset()
        self._local_plan = None

    def _planned(self, track: Track, state: ControlState, last: Twist) -> Twist | None:
        """The first step of the improved plan, or of what of it is safe; None: nothing is."""
        optimiser, p, costs = self._optimiser, self.parameters, state.costs
        reach = optimiser.top_speed * p.steps * p.time_step + p.path_follow_ahead
        path = LocalPath.of(track, state.pose, costs, reach, p.path_spacing)
        around = Obstacles.of(costs, state.pose, self._swept.body(costs.resolution))
        optimiser.shift()
        optimiser.improve(
            state.pose.heading, last, path, around, self._outline_for(costs.resolution)
        )
        for share in SLOWER:
            for controls in (optimiser.plan, optimiser.best()):
                twist = self._if_safe(share * controls, state, last)
                if twist is not None:
                    return None if self._stalled(state) else self._ramped(last, twist)
        self._stand()
        return None

    def _if_safe(self, controls: Array32, state: ControlState, last: Twist) -> Twist | None:
        """The first step of controls, if what they lead to soon is clear."""
        p = self.parameters
        poses, first = self._optimiser.trajectory(controls, state.pose, last)
        soon = ceil(p.time_to_collision / p.time_step)
        clear = self._swept.clear_poses(state.costs, state.pose, poses[None, :soon])
        if clear[0] < len(poses[:soon]):
            return None
        self._local_plan = poses
        return first

    def _stalled(self, state: ControlState) -> bool:
        """Whether the robot stands and its plan leads nowhere: something holds it up."""
        assert self._local_plan is not None
        if hypot(state.twist.linear, state.twist.lateral) > STALLED or self._track is None:
            return False
        x, y, heading = self._local_plan[-1]
        moves = hypot(x - state.pose.x, y - state.pose.y) > STALLED
        return not moves and abs(heading - state.pose.heading) < STALLED_TURN

    def _ramped(self, last: Twist, twist: Twist) -> Twist:
        """The twist as far as it can be reached in one control period, which a step may exceed."""
        return Twist(
            self._ramp.forward(last.linear, twist.linear),
            self._ramp.turn(last.angular, twist.angular),
            self._ramp.forward(last.lateral, twist.lateral),
        )

    def _outline_for(self, resolution: float) -> Outline:
        if self._outline is None or self._outline[0] != resolution:
            self._outline = (resolution, Outline.of(self._robot.footprint, resolution))
        return self._outline[1]

"""The activity that drives the robot out of a tight spot."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf

from stack.navigation.escape.primitives import EscapeSegment
from stack.navigation.escape.search import EscapeCriteria, Motion, Search, Way
from stack.navigation.escape.surroundings import Surroundings
from stack.navigation.following import standing
from stack.navigation.recoveries import DONE, MotionProfile, RecoveryTools, StraightWay
from stack.navigation.tasks import MotionTask, NavigationState
from stack.types import STANDSTILL, FailureCode, Pose2D, Scan, Twist

LOOK_AGAIN = 0.5
"""Seconds between two searches while there is no way."""

GIVES_UP_MOTION, STIR = 1.0, 0.005
"""Seconds in which it moves less than so many metres, after which another motion is tried."""

MOVED_ON = 0.05
"""Metres of way after which motions that did not go may be tried again."""

GAIN = 0.02
"""Metres of clearance that make a motion worth while: more than the noise of a lidar."""


@dataclass(frozen=True, slots=True)
class EscapeGoal:
    """What an escape is asked for.

    Attributes:
        clearance: wanted between the outline and anything, metres.
        distance: metres to drive for it, at most.
        speed: m/s.
    """

    clearance: float
    distance: float
    speed: float


class Escape:
    """Drives towards more room, by the motion that promises most, looking again at each step.

    It ends with enough room, or after its longest way with more room than before. It fails when
    everything around is in the way (COLLISION_AHEAD), when nothing within reach is roomier or the
    wheels turn for nothing (NO_PROGRESS), and after a deadline (TIMED_OUT).
    """

    def __init__(
        self,
        task: MotionTask,
        escape_goal: EscapeGoal,
        surroundings: Surroundings,
        tools: RecoveryTools,
    ) -> None:
        self.task = task
        self._freedom, self._tools, self._surroundings = escape_goal, tools, surroundings
        self._search = Search(tools.robot, surroundings)
        self._radius = tools.robot.footprint.circumscribed_radius
        self._way: Way | None = None
        self._legs: tuple[EscapeSegment, ...] = ()
        self._rate, self._driven, self._stirred = 0.0, 0.0, 0.0
        self._banned: list[Motion] = []
        self._last: Pose2D | None = None
        self._scan: Scan | None = None
        self._began = self._moved_at = self._looked_at = self._stirred_at = -inf
        self._moved_to, self._stirred_to, self._banned_at = 0.0, 0.0, 0.0
        self._waits_since: float | None = None
        self._first = self._room = 0.0

    @property
    def deadline(self) -> float:
        """Seconds: three times those of its longest way and two full turns."""
        spin = min(self._tools.parameters.spin_speed, self._tools.limits.angular_speed)
        return 3.0 * (self._freedom.distance / self._freedom.speed + 12.6 / spin) + 5.0

    def advance(self, state: NavigationState) -> Twist:
        """The velocity for this step."""
        pose = state.odometry.pose
        if self._began == -inf:
            self._began = self._moved_at = state.time
        self._follow_up(state)
        if self._out_of_time(state) or not self._sees(state):
            return STANDSTILL
        if state.scan is not self._scan:
            self._measure(state.scan, pose)
        self.task.report(f"{self._room:.2f} m free all round", self._remaining)
        if self._is_over():
            return self._finish(state)
        if self._way is not None and self._goes_on(state, self._way):
            return self._drive()
        self._look_for_a_way(state)
        return STANDSTILL

    @property
    def _remaining(self) -> float:
        return max(0.0, self._freedom.distance - self._driven)

    def _measure(self, scan: Scan | None, pose: Pose2D) -> None:
        """Clearance by a new scan."""
        first = self._scan is None
        self._scan = scan
        self._room = self._search.clearance(pose, self._freedom.clearance)
        if first:
            self._first = self._room

    def _sees(self, state: NavigationState) -> bool:
        """Whether there is a scan; fails without one after as long as is patient."""
        if self._surroundings.newest is not None:
            return True
        self._wait(state, FailureCode.FAILED, "no lidar scan came: an escape goes by nothing else")
        return False

    def _wait(self, state: NavigationState, code: FailureCode, sentence: str) -> None:
        """Stand and hope for a change; fail once patience is over."""
        if self._waits_since is None:
            self._waits_since = state.time
        if state.time - self._waits_since >= self._tools.parameters.recovery_patience:
            self.task.fail(code, sentence)

    def _follow_up(self, state: NavigationState) -> None:
        """What the last step has made of the leg under way."""
        pose = state.odometry.pose
        if self._last is not None:
            step = pose.relative_to(self._last)
            self._driven += pose.distance_to(self._last)
            if self._legs:
                leg = self._legs[0]
                come = leg.come(step)
                self._stirred += come * (self._radius if leg.turns else 1.0)
                self._legs = (replace(leg, amount=leg.amount - come), *self._legs[1:])
        self._last = pose
        if self._stirred > self._moved_to + DONE:
            self._moved_to, self._moved_at = self._stirred, state.time
        if self._stirred > self._stirred_to + STIR:
            self._stirred_to, self._stirred_at = self._stirred, state.time
        if self._stirred > self._banned_at + MOVED_ON:
            self._banned = []

    def _out_of_time(self, state: NavigationState) -> bool:
        p = self._tools.parameters
        came = f"came {self._driven:.2f} m, {self._room:.2f} m free all round"
        if state.time - self._began >= self.deadline:
            self.task.fail(FailureCode.TIMED_OUT, f"not free after {self.deadline:.0f} s; {came}")
        elif self._waits_since is None and state.time - self._moved_at >= p.stall_time:
            self.task.fail(FailureCode.NO_PROGRESS, f"did not move for {p.stall_time:g} s; {came}")
        return not self.task.running

    def _is_over(self) -> bool:
        return self._room >= self._freedom.clearance or self._remaining <= DONE

    def _finish(self, state: NavigationState) -> Twist:
        self._rate, self._legs, self._way = 0.0, (), None
        if not standing(state.odometry.twist):
            return STANDSTILL
        wanted = self._freedom.clearance
        came = f"{self._room:.2f} m free all round after {self._driven:.2f} m"
        if self._room >= wanted or self._room >= self._first + GAIN:
            self.task.succeed(came)
        else:
            self.task.fail(
                FailureCode.NO_PROGRESS, f"{came}, as much as before; wanted {wanted:.2f} m"
            )
        return STANDSTILL

    def _goes_on(self, state: NavigationState, way: Way) -> bool:
        """Whether the way is to be driven on; what is over or in vain is dropped."""
        while self._legs and self._legs[0].amount <= DONE:
            self._legs, self._rate = self._legs[1:], 0.0
        if state.time - self._stirred_at >= GIVES_UP_MOTION:
            self._banned.append(way.motion)
            self._banned_at = self._stirred
            self._way = None
        elif not self._legs or not self._search.clear(state.odometry.pose, way, self._legs):
            self._way = None
        return self._way is not None

    def _drive(self) -> Twist:
        leg = self._legs[0]
        self._rate = self._stroke(leg).next_rate(self._rate, leg.amount, self._tools.period)
        return Twist(
            self._rate * leg.twist.linear,
            self._rate * leg.twist.angular,
            self._rate * leg.twist.lateral,
        )

    def _stroke(self, leg: EscapeSegment) -> MotionProfile:
        limits, p = self._tools.limits, self._tools.parameters
        if leg.turns:
            top = min(p.spin_speed, limits.angular_speed)
            return MotionProfile(leg.amount, top, 0.5 * limits.angular_acceleration, 0.0, "rad")
        way = StraightWay.along(leg.twist, self._freedom.speed)
        top = way.top_speed(limits)
        if leg.twist.angular:
            top = min(top, limits.angular_speed / abs(leg.twist.angular))
        return MotionProfile(leg.amount, top, 0.5 * limits.linear_acceleration, 0.0, "m")

    def _look_for_a_way(self, state: NavigationState) -> None:
        """Search from where it stands; wait and fail when there is nothing to find."""
        self._rate, self._legs = 0.0, ()
        if not standing(state.odometry.twist):
            return
        if self._waits_since is not None and state.time - self._looked_at < LOOK_AGAIN - 1e-9:
            return
        self._looked_at = state.time
        pose = state.odometry.pose
        padding = self._tools.parameters.escape_padding
        criteria = EscapeCriteria(self._freedom.clearance + GAIN, padding, GAIN, self._remaining)
        self._way = self._search.best(pose, criteria, self._banned)
        if self._way is not None:
            if self._waits_since is not None:
                self._waits_since, self._moved_at = None, state.time
            self._legs, self._stirred_at = self._way.legs, state.time
        elif self._banned:  # what does not go may go now; the stall is timed elsewhere
            self._banned = []
        else:
            self._despair(state, pose)

    def _despair(self, state: NavigationState, pose: Pose2D) -> None:
        """There is no way to more room: wait for one, then fail with what is the matter."""
        padding = self._tools.parameters.escape_padding
        wanted = self._freedom.clearance
        if self._search.can_leave(pose, padding):
            self._wait(
                state, FailureCode.NO_PROGRESS,
                f"nowhere within {self._remaining:.1f} m is there more room than the "
                f"{self._room:.2f} m here; wanted {wanted:.2f} m",
            )  # fmt: skip
        else:
            self._wait(
                state, FailureCode.COLLISION_AHEAD,
                f"something is in the way on every side that the lidar has seen, {self._room:.2f} "
                f"m from the outline; came {self._driven:.2f} m",
            )  # fmt: skip

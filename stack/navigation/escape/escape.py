"""Executor that drives the robot out of a tight spot."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf

from stack.navigation.escape.primitives import EscapeSegment
from stack.navigation.escape.search import (
    LEAST_GAIN,
    NO_FENCE,
    ChosenMotion,
    EscapeSearch,
    MotionId,
)
from stack.navigation.escape.surroundings import Surroundings
from stack.navigation.recoveries import (
    DONE,
    RECOVERY_PATIENCE,
    STALL_TIME,
    MotionProfile,
    RecoveryTools,
    StraightLine,
)
from stack.navigation.tasks import MotionExecutor, MotionTask
from stack.types import STANDSTILL, FailureCode, FloatArray, Perceived, Pose2D, Twist

LOOK_AGAIN = 0.5
"""Seconds between two searches while no motion is found."""

GIVES_UP_MOTION, STIR = 1.0, 0.005
"""Seconds and metres: a motion with less progress in this time is replaced by another one."""

MOVED_ON = 0.05
"""Metres driven after which stalled motions may be tried again."""


@dataclass(frozen=True, slots=True)
class EscapeGoal:
    """Goal of an escape.

    Attributes:
        clearance: desired distance between outline and obstacles, metres.
        distance: maximum distance to drive, metres.
        speed: m/s.
        turning_speed: rad/s.
    """

    clearance: float
    distance: float
    speed: float
    turning_speed: float


class Escape(MotionExecutor):
    """Drives towards more clearance by the best motion, and checks the motion in each step.

    It succeeds with enough clearance, or after its maximum distance with more clearance than
    before. It fails when obstacles block every motion (COLLISION_AHEAD), when no pose within reach
    has more clearance or the robot does not move (NO_PROGRESS), and after a deadline (TIMED_OUT).
    """

    def __init__(
        self,
        task: MotionTask,
        escape_goal: EscapeGoal,
        surroundings: Surroundings,
        tools: RecoveryTools,
        fence: FloatArray = NO_FENCE,
    ) -> None:
        super().__init__(task)
        self._goal, self._tools, self._surroundings = escape_goal, tools, surroundings
        self._search = EscapeSearch(tools.robot, surroundings, fence)
        self._radius = tools.robot.footprint.circumscribed_radius
        self._chosen: ChosenMotion | None = None
        self._segments: tuple[EscapeSegment, ...] = ()
        self._rate, self._driven, self._travelled = 0.0, 0.0, 0.0
        self._banned: list[MotionId] = []
        self._last: Pose2D | None = None
        self._measured_at = 0
        self._total, self._rest, self._stall, self._wait_time, self._look_time = (
            self.timers.new() for _ in range(5)
        )
        self._moved_to, self._stall_from, self._banned_at = 0.0, 0.0, 0.0
        self._first = self._clearance = 0.0

    @property
    def deadline(self) -> float:
        """Time limit: three times the time for the maximum distance and two turns, plus 5 s."""
        spin = min(self._goal.turning_speed, self._tools.robot.limits.angular_speed)
        return 3.0 * (self._goal.distance / self._goal.speed + 12.6 / spin) + 5.0

    def start(self, now: float) -> None:
        self._total.start(now)
        self._rest.start(now)

    def resume(self, now: float) -> None:
        """Continue from standstill with a new search: the robot may be elsewhere."""
        super().resume(now)
        self._rate, self._chosen, self._segments, self._last = 0.0, None, (), None

    def step(self, perceived: Perceived) -> Twist:
        pose = perceived.motion.pose
        self._follow_up(perceived)
        if self._out_of_time(perceived) or not self._sees(perceived):
            return STANDSTILL
        if self._surroundings.updates != self._measured_at:
            self._measure(pose)
        self.task.report(f"clearance {self._clearance:.2f} m", self._remaining)
        if self._is_over():
            return self._finish(perceived)
        if self._chosen is not None and self._goes_on(perceived, self._chosen):
            return self._drive()
        self._search_motion(perceived)
        return STANDSTILL

    @property
    def _remaining(self) -> float:
        return max(0.0, self._goal.distance - self._driven)

    def _measure(self, pose: Pose2D) -> None:
        """Update the clearance with new views."""
        first = self._measured_at == 0
        self._measured_at = self._surroundings.updates
        self._clearance = self._search.clearance(pose, self._goal.clearance)
        if first:
            self._first = self._clearance

    def _sees(self, perceived: Perceived) -> bool:
        """Whether every range sensor has measured; the task fails when patience is over."""
        missing = [name for name, age in perceived.obstacles.ages.items() if age == inf]
        if self._surroundings.updates and not missing:
            return True
        which = f" from {', '.join(missing)}" if missing else ""
        self._wait(
            perceived, FailureCode.FAILED,
            f"no measurement received{which}: an escape needs a lidar or a sonar",
        )  # fmt: skip
        return False

    def _wait(self, perceived: Perceived, code: FailureCode, sentence: str) -> None:
        """Stand and wait for a change; fail when patience is over."""
        self._wait_time.start_once(perceived.time)
        if self._wait_time.elapsed(perceived.time) >= RECOVERY_PATIENCE:
            self.task.fail(code, sentence)

    def _follow_up(self, perceived: Perceived) -> None:
        """Update the current segment with the motion of the last step."""
        pose = perceived.motion.pose
        if self._last is not None:
            step = pose.relative_to(self._last)
            self._driven += pose.distance_to(self._last)
            if self._segments:
                segment = self._segments[0]
                driven = segment.driven(step)
                self._travelled += driven * (self._radius if segment.turns else 1.0)
                self._segments = (
                    replace(segment, amount=segment.amount - driven),
                    *self._segments[1:],
                )
        self._last = pose
        if self._travelled > self._moved_to + DONE:
            self._moved_to = self._travelled
            self._rest.start(perceived.time)
        if self._travelled > self._stall_from + STIR:
            self._stall_from = self._travelled
            self._stall.start(perceived.time)
        if self._travelled > self._banned_at + MOVED_ON:
            self._banned = []

    def _out_of_time(self, perceived: Perceived) -> bool:
        result = f"drove {self._driven:.2f} m, clearance {self._clearance:.2f} m"
        if self._total.elapsed(perceived.time) >= self.deadline:
            self.task.fail(
                FailureCode.TIMED_OUT, f"not enough clearance after {self.deadline:.0f} s; {result}"
            )
        elif not self._wait_time.running and self._rest.elapsed(perceived.time) >= STALL_TIME:
            self.task.fail(FailureCode.NO_PROGRESS, f"did not move for {STALL_TIME:g} s; {result}")
        return not self.task.running

    def _is_over(self) -> bool:
        return self._clearance >= self._goal.clearance or self._remaining <= DONE

    def _finish(self, perceived: Perceived) -> Twist:
        self._rate, self._segments, self._chosen = 0.0, (), None
        if not perceived.motion.twist.stands:
            return STANDSTILL
        wanted = self._goal.clearance
        result = f"clearance {self._clearance:.2f} m after {self._driven:.2f} m"
        if self._clearance >= wanted or self._clearance >= self._first + LEAST_GAIN:
            self.task.succeed(result)
        else:
            self.task.fail(
                FailureCode.NO_PROGRESS, f"{result}, not more than before; wanted {wanted:.2f} m"
            )
        return STANDSTILL

    def _goes_on(self, perceived: Perceived, chosen: ChosenMotion) -> bool:
        """Whether to continue the chosen motion; drops finished segments and stalled motions."""
        while self._segments and self._segments[0].amount <= DONE:
            self._segments, self._rate = self._segments[1:], 0.0
        if self._stall.elapsed(perceived.time) >= GIVES_UP_MOTION:
            self._banned.append(chosen.motion)
            self._banned_at = self._travelled
            self._chosen = None
        elif not self._segments or not self._search.clear(
            perceived.motion.pose, chosen, self._segments
        ):
            self._chosen = None
        return self._chosen is not None

    def _drive(self) -> Twist:
        segment = self._segments[0]
        self._rate = self._profile(segment).next_rate(
            self._rate, segment.amount, self._tools.period
        )
        return Twist(
            self._rate * segment.twist.linear,
            self._rate * segment.twist.angular,
            self._rate * segment.twist.lateral,
        )

    def _profile(self, segment: EscapeSegment) -> MotionProfile:
        limits = self._tools.robot.limits
        if segment.turns:
            top = min(self._goal.turning_speed, limits.angular_speed)
            return MotionProfile(segment.amount, top, 0.5 * limits.angular_acceleration, 0.0, "rad")
        line = StraightLine.along(segment.twist, self._goal.speed)
        top = line.top_speed(limits)
        if segment.twist.angular:
            top = min(top, limits.angular_speed / abs(segment.twist.angular))
        return MotionProfile(segment.amount, top, 0.5 * limits.linear_acceleration, 0.0, "m")

    def _search_motion(self, perceived: Perceived) -> None:
        """Search a motion from the current pose; wait and fail when there is none."""
        self._rate, self._segments = 0.0, ()
        if not perceived.motion.twist.stands:
            return
        looked = (
            self._look_time.running and self._look_time.elapsed(perceived.time) < LOOK_AGAIN - 1e-9
        )
        if self._wait_time.running and looked:
            return
        self._look_time.start(perceived.time)
        pose = perceived.motion.pose
        wanted = self._goal.clearance
        self._chosen = self._search.best(pose, wanted, self._remaining, self._banned)
        if self._chosen is not None:
            if self._wait_time.running:
                self._wait_time.reset()
                self._rest.start(perceived.time)
            self._segments = self._chosen.segments
            self._stall.start(perceived.time)
        elif self._banned:  # stalled motions may work now; the stall has its own time limit
            self._banned = []
        else:
            self._wait_without_motion(perceived, pose)

    def _wait_without_motion(self, perceived: Perceived, pose: Pose2D) -> None:
        """No motion leads to more clearance: wait for a change, then fail with the reason."""
        wanted = self._goal.clearance
        if self._search.can_leave(pose):
            self._wait(
                perceived, FailureCode.NO_PROGRESS,
                f"no pose within {self._remaining:.1f} m has more clearance than the "
                f"{self._clearance:.2f} m here; wanted {wanted:.2f} m",
            )  # fmt: skip
        else:
            self._wait(
                perceived, FailureCode.COLLISION_AHEAD,
                "obstacles block every motion on known ground; the nearest is "
                f"{self._clearance:.2f} m from the outline; drove {self._driven:.2f} m",
            )  # fmt: skip

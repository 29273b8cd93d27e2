"""Driving to goals: plan, follow the path, and replan when the costmap changes."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from math import copysign, inf

import numpy as np

from stack.errors import NavigationError
from stack.geometry.path_progress import PathProgress
from stack.navigation.drive_tools import DriveTools
from stack.navigation.escape.making_room import MakingRoom
from stack.navigation.following import Drive, drive_feedback
from stack.navigation.people.backing_out import backed_out, should_turn
from stack.navigation.people.give_way import GiveWay
from stack.navigation.people.narrow_meeting import LOOKAHEAD
from stack.navigation.people.possible_people import PossiblePeople
from stack.navigation.people.standoff import PERSON_DISTANCE, nearest
from stack.navigation.plans.choice import PlanChoice
from stack.navigation.plans.closed_passages import explained
from stack.navigation.plans.goal_sequence import GoalSequence
from stack.navigation.plans.path_check import PartialEnd, PathCheck, near_partial_end
from stack.navigation.plans.plan_patience import PlanPatience
from stack.navigation.plans.planner_worker import Plan, PlanRequest
from stack.navigation.plans.turning_place import TURNING_DISTANCE, turning_place
from stack.navigation.tasks import MotionTask
from stack.types import (
    STANDSTILL,
    Failure,
    FailureCode,
    Limitation,
    Path,
    Perceived,
    Pose2D,
    Twist,
)

VIA_RADIUS = 0.4
"""Distance within which a via pose is passed, m."""
REPLAN_INTERVAL = 0.5
"""Minimum time between two plan requests, s: a plan takes about as long at most."""
OFF_PATH = 0.5
"""Distance to the path above which the robot replans, m."""

PERMANENT_FAILURES = frozenset({FailureCode.GOAL_OUTSIDE_MAP, FailureCode.START_OUTSIDE_MAP})
"""Failures that waiting cannot fix."""

MOST_CORRECTIONS = 3
"""Maximum number of new plans to correct the heading of a car at the goal."""

REPLANS_BESIDE = 0.15
"""Distance to the path, metres, above which a robot that has evaded a person replans from its pose.
Otherwise it would turn back to the old path, or turn to the goal's heading beside the goal.
"""

HELD_FAILURES = frozenset({FailureCode.COLLISION_AHEAD, FailureCode.NO_PROGRESS})
"""Failures of a robot that stands in front of an obstacle."""

OTHER_ROUTES = "the routes have changed"
"""Replanning reason: the planner was replaced because an edge was closed or opened."""

ROUTINE_REPLAN = ""
"""Replanning reason: a periodic search for a better path."""


class GoalDrive(Drive):
    """Drives through goals in turn to the last one.

    Args:
        task: handle.
        tools: shared by all drives.
        goals: poses in turn, map frame.
        tolerance: metres; None: that of the goal checker.
        aside: whether it leads to a passing place: it gives way to nobody, and may back out.

    Attributes:
        path: current path; None before the first plan.
        goal: the last goal.
        partial: the nearest reachable pose counts as success. Otherwise the end of a partial path
            is the failure NO_VALID_PATH.
    """

    def __init__(  # noqa: PLR0913 - what a drive may do, by keyword
        self, task: MotionTask, tools: DriveTools, goals: Sequence[Pose2D],
        tolerance: float | None, *, aside: bool = False, partial: bool = False,
        while_ambiguous: bool = False,
    ) -> None:  # fmt: skip
        super().__init__(task, tools, tolerance)
        self.partial, self.while_ambiguous = partial, while_ambiguous
        self.goal = goals[-1]
        self.path: Path | None = None
        self._tools, self._goals = tools, GoalSequence(goals)
        self._choice = PlanChoice(tools, self.goal, tolerance)
        self._reason = "first plan"
        self._requested_at = -inf
        self._patience = PlanPatience(tools, self.goal, self.timers)
        self._path_check, self._partial_end = PathCheck(tools), PartialEnd()
        self._planner = self._requested_from = tools.planner_worker.planner
        self._corrections, self._turns_elsewhere = 0, False
        self._has_evaded, self._may_back_out, self._backs_out = False, aside, False
        self._making_room = MakingRoom(tools, self.timers)
        self._possible_people = PossiblePeople(tools, self.timers)
        self._give_way = None if aside else GiveWay(tools, self._drive_aside, self.timers)
        self._parts += [part for part in (self._making_room, self._give_way) if part is not None]

    def step(self, perceived: Perceived) -> Twist:
        perceived = self._possible_people.added(perceived, held=self._is_held_up)
        self._follower.limitation = None
        aside = self._twist_aside(perceived)
        if aside is not None:
            self._making_room.stop(perceived.time)  # its motion begins where the robot was
            return aside
        leaving = self._twist_making_room(perceived)
        if leaving is not None:
            return leaving
        try:
            self._use_plan(perceived)
            self._pass_goals(perceived.estimate.pose)
            if self._goals.only_last_left and self._follower.reached(perceived):
                self._arrive(perceived.estimate.pose)
                return STANDSTILL
            if self._partial_end.reached(self.path, self._follower, perceived.estimate.pose):
                self._arrive(perceived.estimate.pose)
                return STANDSTILL
            self._request_plan_if_needed(perceived)
            self._report()
            if self.path is None:
                self._follower.pause(perceived.time)
                standoff = self._follower.standoff
                self._follower.limitation = standoff.limitation(perceived.estimate.pose)
                return STANDSTILL
            return self._follower.step(perceived)
        except NavigationError as error:
            if near_partial_end(self.path, self._follower) and error.failure.code in HELD_FAILURES:
                self._arrive(perceived.estimate.pose)
            self.task.fail(error.failure.code, error.failure.sentence)
            return STANDSTILL

    def resume(self, now: float) -> None:
        super().resume(now)
        if self.task.future is not None:
            self._drop_request()

    @property
    def makes_way(self) -> bool:
        return self._give_way is not None and self._give_way.leaves_way

    @property
    def limitation(self) -> Limitation | None:
        aside = None if self._give_way is None else self._give_way.limitation
        return aside or self._follower.limitation

    @property
    def _is_held_up(self) -> bool:
        """Whether the robot stands before an obstacle, finds no path, or gives way."""
        return self._follower.waiting or self._patience.failing or self.makes_way

    def note_evasion(self) -> None:
        self._has_evaded = True

    def _twist_aside(self, perceived: Perceived) -> Twist | None:
        """Return the velocity of a robot that leaves a person's way; None when it does not."""
        if self._give_way is None:
            return None
        left_way = self._give_way.leaves_way
        progress, alone = self._follower.progress, not perceived.world.tracks
        ahead = np.empty((0, 2)) if progress is None or alone else progress.ahead(LOOKAHEAD)
        twist = self._give_way.step(perceived, self._follower.standoff, ahead)
        if twist is not None:
            self.task.report("giving way to a person", 0.0)
        elif left_way:
            self._start_again(perceived.time)
        return twist

    def _twist_making_room(self, perceived: Perceived) -> Twist | None:
        """Return the velocity of a robot that makes room to turn; None when it does not."""
        was_driving = self._making_room.is_driving
        twist = self._making_room.step(perceived, self._follower)
        if twist is not None:
            self.task.report("making room to turn", 0.0)
        elif was_driving:
            self._follower.forget_obstacle()
            self._tools.progress_checker.start(perceived.time)
            self._start_again(perceived.time)
        return twist

    def _start_again(self, now: float) -> None:
        """Plan from where the robot is after a detour, and follow the old path until then."""
        self._drop_request()
        self._path_check.forget_blockage()
        if self.path is not None:
            self._follower.set_path(self.path, now)

    def _drop_request(self) -> None:
        """Drop the pending plan, which begins where the robot was, and request another at once."""
        if self.task.future is not None:
            self.task.future.drop()
            self.task.future = None
        self._requested_at = -inf

    def _drive_aside(self, place: Pose2D) -> GoalDrive:
        """Return the drive to a passing place, which gives way to nobody."""
        task = MotionTask(f"drive to ({place.x:.1f}, {place.y:.1f})", lambda _: None)
        return GoalDrive(task, self._tools, [place], None, aside=True)

    def _report(self) -> None:
        progress = self._follower.progress
        remaining = 0.0 if progress is None else progress.remaining
        self.task.report(drive_feedback(self._follower), remaining)

    def _arrive(self, pose: Pose2D) -> None:
        """End the task at the end of the path: the goal, or the nearest reachable pose."""
        distance = f"{pose.distance_to(self.goal):.2f} m"
        away = f"{distance} from the goal"
        if self.path is None or not self.path.partial:
            self.task.succeed(f"reached the goal, {distance} off")
        elif self.partial:
            reached = f"reached the nearest reachable pose, {away}"
            self._tools.emit("partial", reached)
            self.task.succeed(reached)
        else:
            self.task.fail(
                FailureCode.NO_VALID_PATH,
                "there is no path to the goal; reached the nearest reachable pose "
                f"{self._tools.landmarks.name(pose)}, {away}",
            )

    def way_left(self, pose: Pose2D) -> float:
        """Return the straight distance to the next goal."""
        return pose.distance_to(self._goals.next)

    def _pass_goals(self, pose: Pose2D) -> None:
        """Remove the via goals that have been passed."""
        progress, radius = self._follower.progress, VIA_RADIUS
        if progress is None:
            return
        self._follower.update(pose)
        self._goals.pass_by(pose, progress.travelled, radius, waiting=self._follower.waiting)

    def _request_plan_if_needed(self, perceived: Perceived) -> None:
        """Request a plan when there is a reason, at most once per replan_interval."""
        p = self._tools.parameters
        self._path_check.update(self._follower.progress, perceived.estimate.pose)
        is_due = perceived.time >= self._requested_at + self._interval - 1e-9
        if self.task.future is not None or not is_due:
            return
        reason = self._replan_reason(perceived)
        if reason is None:
            return
        twist = perceived.motion.twist
        direction = 0 if twist.stands else int(copysign(1, twist.linear))
        pose = perceived.estimate.pose
        copy = self._tools.global_costmap.copied()
        progress = self._follower.progress
        current = progress.rest if progress is not None and reason == ROUTINE_REPLAN else None
        request = PlanRequest(copy.grid, pose, self._goals.left, self.partial, direction, current)
        due = p.plan_due(perceived.time)
        self.task.future = self._tools.planner_worker.ask(request, due, over=copy.release)
        self._reason, self._requested_at = reason, perceived.time
        self._has_evaded = False
        self._requested_from = self._tools.planner_worker.planner

    @property
    def _interval(self) -> float:
        """Seconds between two plans: before a person in the way a new one rarely differs."""
        p, person = self._tools.parameters, self._follower.standoff.person
        return REPLAN_INTERVAL if person is None else p.replan_period

    def _replan_reason(self, perceived: Perceived) -> str | None:
        """Reason to plan now; ROUTINE_REPLAN to search for a better path, None for no plan."""
        follower, progress = self._follower, self._follower.progress
        if self.path is None or progress is None:
            return "first plan"
        if self._tools.planner_worker.planner is not self._planner:
            return OTHER_ROUTES
        if near_partial_end(self.path, self._follower):
            return self._routine(perceived.time)
        if follower.waiting:
            return self._other_turning_place(perceived) or "an obstacle is in the way"
        if self._path_check.blocked_at is not None:
            return "the path ahead is blocked"
        if beside := self._beside_path(progress, perceived):
            return beside
        if follower.at_position:
            return self._correction(perceived)
        if follower.idles(perceived.time):
            return "stopped short of the goal"
        return self._routine(perceived.time)

    def _beside_path(self, progress: PathProgress, perceived: Perceived) -> str | None:
        """Reason for a plan from where the robot is and as it faces; None if it needs none."""
        if progress.offset > OFF_PATH:
            return f"{progress.offset:.1f} m off the path"
        if self._has_evaded and progress.offset > REPLANS_BESIDE:
            return f"{progress.offset:.1f} m beside the path after an evasion"
        if self._backs_out and should_turn(progress.remaining, perceived, self._tools):
            return "there is room to turn"
        return None

    def _routine(self, time: float) -> str | None:
        due = time >= self._requested_at + self._tools.parameters.replan_period - 1e-9
        return ROUTINE_REPLAN if due else None

    def _correction(self, perceived: Perceived) -> str | None:
        """Reason for another plan of a car at the goal's position; None if it needs none."""
        off = self._follower.off_heading(perceived)
        if not off:
            return None
        if self._corrections >= MOST_CORRECTIONS:
            raise NavigationError(
                FailureCode.NO_PROGRESS,
                f"{off}; {MOST_CORRECTIONS} more plans did not correct it. Leave more room around "
                "the goal, or use the planner hybrid_astar or lattice with the robot's turning "
                "radius",
            )
        self._corrections += 1
        return "at the goal's position, but not at its heading"

    def _other_turning_place(self, perceived: Perceived) -> str | None:
        """Choose another end of the path if there is no room to turn at the goal; say so."""
        tools, pose = self._tools, perceived.estimate.pose
        follower = self._follower
        only_turns = follower.at_position and follower.can_turn and self._goals.only_last_left
        if self._turns_elsewhere or not only_turns:
            return None
        reach = self._choice.tolerance
        place = turning_place(
            self.goal, pose, tools.global_costmap.view, perceived.obstacles.points,
            tools.robot.footprint, TURNING_DISTANCE if reach is None else reach,
        )  # fmt: skip
        if place is None:
            return None
        self._goals.replace_last(place)
        self._turns_elsewhere = True
        return "no room to turn at the goal"

    def _use_plan(self, perceived: Perceived) -> None:
        """Use the requested plan when it is due."""
        future = self.task.future
        answer = None if future is None else future.result(perceived.time)
        if future is None or answer is None:
            return
        self.task.future = None
        if isinstance(answer, Plan):
            answer = self._choice.within_tolerance(answer)
        if isinstance(answer, Failure):
            self._planner = self._requested_from
            self._plan_failed(answer, future.request, perceived)
            return
        self._patience.reset()
        if future.request.goals != self._goals.left:
            self._requested_at = -inf  # a goal was passed meanwhile: the plan leads back to it
            return
        self._planner = self._requested_from
        if self._reason != ROUTINE_REPLAN or self._choice.is_clearly_better(
            answer, self.path, self._follower.progress, perceived.time
        ):
            self._adopt(answer, perceived)

    def _plan_failed(self, failure: Failure, request: PlanRequest, perceived: Perceived) -> None:
        """Handle a failed plan: continue on the current path, or retry until patience ends."""
        if failure.code in PERMANENT_FAILURES:
            raise NavigationError(FailureCode(failure.code), failure.sentence)
        if self._reason == ROUTINE_REPLAN:
            return
        progress = self._follower.progress
        left = progress is not None and progress.offset > OFF_PATH
        if self._reason == OTHER_ROUTES or left:
            self.path = None  # it may lead along a closed edge, or elsewhere
            self._follower.drop_path(perceived.time)
        if self.path is None:
            close = nearest(perceived.world.tracks, perceived.estimate.pose, PERSON_DISTANCE)
            self._follower.standoff.face(close, perceived.time)
        explain = partial(
            explained, tools=self._tools, pose=request.start, goals=request.goals
        )  # fmt: skip
        self._patience.failed(failure, perceived, explain, follows_path=self.path is not None)

    def _adopt(self, plan: Plan, perceived: Perceived) -> None:
        first = self.path is None
        if self._path_check.blocked_at is not None:
            self._choice.note_blocked(self._path_check.blocked_at, perceived.time)
        path = backed_out(plan.path, perceived, self._tools) if self._may_back_out else plan.path
        self._backs_out = path is not plan.path
        self.path = self.task.path = path
        self._goals.follow(plan.leg_ends)
        self._follower.set_path(path, perceived.time)
        self._path_check.start()
        length = round(plan.path.length, 3)
        if first:
            self._tools.emit("plan", f"plan found, {length:.1f} m", length=length)
            return
        reason = self._reason or "a better path"
        self._tools.note_replan()
        self._tools.emit(
            "replan", f"new plan, {length:.1f} m: {reason}", length=length, reason=reason
        )

"""Navigator: accepts motion tasks and computes the velocity of the newest one in each step."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from stack.compilation import KernelTypes
from stack.components import Estimator
from stack.control.evasion.evasion import Evasion
from stack.navigation.activities import Activities
from stack.navigation.capabilities.base import StackBase
from stack.navigation.disambiguation import Disambiguation
from stack.navigation.doubt import LocalisationMonitor
from stack.navigation.drive_to_goal import GoalDrive
from stack.navigation.drive_tools import DriveTools
from stack.navigation.following import Drive, PathDrive
from stack.navigation.motion_evasion import MotionEvasion
from stack.navigation.motion_stage import DriveInterlock, MotionStage, WantedTwist
from stack.navigation.plans.queries import PlanQueries
from stack.navigation.recoveries import DriveForMotion
from stack.navigation.tasks import MotionExecutor, MotionTask
from stack.navigation.teleoperation import Teleoperation
from stack.types import STANDSTILL, CurrentStep, Limitation, Path, Perceived, Pose2D


class Navigator(MotionStage):
    """Plans, follows paths and recovers; one motion task at a time, a newer one cancels the older.

    Called once per control step. Between `pause` and `resume` the mission's motion is held: no
    time limit counts, and a motion that is begun meanwhile is a detour of the operator.

    Args:
        tools: what its drives share.
        evasion: leaves the way of people who walk towards the robot.
        estimator: knows rival poses.
        now: what the step has perceived.
        cover: without a map, grows the costmaps to contain some poses.
        log: receives the tracebacks of controllers.
        interlock: holds the base while another part of the robot is in the way.

    Attributes:
        localisation_monitor: decides what moves while the robot is lost.
        activities: the motions under way.
        base: begins motions, for behaviours.
    """

    @staticmethod
    def kernels() -> KernelTypes:
        """Return the kernels of the navigator's own parts."""
        from stack.geometry.kernels import PATHS
        from stack.geometry.travel.kernels import TRAVEL
        from stack.navigation.escape.kernels import ESCAPE

        return (*PATHS, *ESCAPE, *TRAVEL)

    def __init__(  # noqa: PLR0913 - the parts that it connects
        self, tools: DriveTools, evasion: Evasion, estimator: Estimator, now: CurrentStep,
        cover: Callable[[Iterable[Pose2D]], None], log: Callable[[str], None],
        interlock: DriveInterlock,
    ) -> None:  # fmt: skip
        self.tools, self._now, self._interlock = tools, now, interlock
        self._hindrance: Limitation | None = None
        self._evasion = MotionEvasion(evasion, tools.path_follower, tools.emit)
        self.localisation_monitor = LocalisationMonitor(tools.emit, tools.period)
        self.activities = Activities(tools.emit, self.localisation_monitor, log)
        self._queries = PlanQueries(tools)
        self.base = StackBase(tools, self.activities, self._queries, estimator, now, cover)

    @property
    def evasion(self) -> Evasion:
        """Leaves the way of people who walk towards the robot."""
        return self._evasion.evasion

    @property
    def evades(self) -> bool:
        """Whether only evasion keeps the robot clear of who walks.

        Otherwise they are obstacles: evasion is off, or the controller plans with tracks itself.
        """
        on = self.evasion.parameters.when != "never"
        return on and not self.tools.path_follower.plans_with_tracks

    @property
    def replans(self) -> int:
        """Number of plans so far besides the first one of each drive."""
        return self.tools.replans

    @property
    def is_busy(self) -> bool:
        """Whether a motion is under way."""
        return self.activities.current is not None

    @property
    def doubt(self) -> Limitation | None:
        """How doubt about the pose limits the motion."""
        return self.localisation_monitor.limitation

    @property
    def lost_seconds(self) -> float:
        """Time of standing because the robot was lost, in the whole run."""
        return self.localisation_monitor.lost_seconds

    @property
    def obscured_metres(self) -> float:
        """Metres driven with the map hidden, in the whole run."""
        return self.localisation_monitor.obscured_distance

    @property
    def teleoperation(self) -> Teleoperation | None:
        """The running teleoperation."""
        return self.base.teleoperation

    def navigate_to(self, goal: Pose2D) -> MotionTask:
        """Begin a drive to a pose."""
        return self.base.navigate_to(goal)

    @property
    def limitation(self) -> Limitation | None:
        """Why the motion stands in this step although it wants to drive; None if it does not."""
        motion = self._motion
        if motion is not None and self._hindrance is not None:
            return self._hindrance
        return motion.limitation if isinstance(motion, Drive) else None

    @property
    def goal(self) -> Pose2D | None:
        """Goal of the current drive, map frame; None without one."""
        drive = self._drive
        return None if drive is None else drive.goal

    @property
    def path(self) -> Path | None:
        """Current path, map frame."""
        drive = self._drive
        return None if drive is None else drive.path

    @property
    def local_plan(self) -> Path | None:
        """Planned motion of the controller, map frame."""
        follows = _follows_path(self._motion)
        return self.tools.path_follower.local_plan if follows else None

    @property
    def _motion(self) -> MotionExecutor | None:
        """The motion under way: a drive also if one pose had to be found first."""
        current = self.activities.current
        return current.drive or current if isinstance(current, Disambiguation) else current

    def step(self, perceived: Perceived) -> WantedTwist:
        """Compute the velocity for this step; STANDSTILL without a running task."""
        self.tools.motions.surroundings.look(perceived)
        self._queries.step(perceived)
        self.localisation_monitor.update(perceived, self.tools.parameters)
        waits = self._waits(perceived)
        wanted = self.activities.step(perceived, self.tools.parameters, waits=waits)
        motion = self._motion
        limit = self.localisation_monitor.speed_limit
        twist = self._evasion.step(
            wanted, perceived, motion, along_path=_follows_path(motion), limit=limit
        )
        current = self.activities.current
        return WantedTwist(
            STANDSTILL if waits else twist,
            current.order.contact if isinstance(current, DriveForMotion) else None,
        )

    def _waits(self, perceived: Perceived) -> bool:
        """Whether the base must stand in this step; a motion under way asks for a free way."""
        self._hindrance, motion = self._interlock.hindrance(perceived), self.activities.current
        if self._hindrance is not None and motion is not None:
            failure = self._interlock.remove_hindrance(perceived, motion.task)
            if failure is not None:
                motion.task.fail(failure.code, failure.sentence)
        return self._hindrance is not None

    def await_plans(self, now: float, longest: float) -> bool:
        """Wait at most `longest` wall seconds for the plans that the step at a time needs.

        Returns:
            Whether they are there: `step` does not wait.
        """
        return self.tools.planner_worker.await_results(now, longest)

    def pause(self, now: float) -> None:
        """Hold the mission's motion at a time in seconds; does nothing while it is held."""
        self.activities.pause(now)

    def resume(self, now: float) -> None:
        """Continue the mission's motion, and cancel a detour; does nothing unless held."""
        self.activities.resume(now)

    def hold_detour(self, now: float, *, held: bool) -> None:
        """Hold the operator's detour with its goal, or continue it; without one, no effect."""
        self.activities.hold_detour(now, held=held)

    def cancel_all(self, why: str = "cancelled") -> None:
        """Cancel every task; the robot stops from the next step on."""
        self._queries.cancel(why)
        self.activities.cancel(why)

    def stop_ended(self, now: float) -> None:
        """Stop the motions whose task has ended, as the next step would.

        Args:
            now: seconds.
        """
        self.activities.stop_ended(now)

    def close(self, now: float | None = None) -> None:
        """Cancel all tasks, stop their motions and the planner's thread.

        Args:
            now: seconds; None: the time of the last step.
        """
        self.cancel_all("the run is over")
        self.stop_ended(self._now.perceived.time if now is None else now)
        self.tools.planner_worker.close()

    @property
    def _drive(self) -> GoalDrive | PathDrive | None:
        shown = self.activities.shown
        if isinstance(shown, Disambiguation):
            shown = shown.drive
        return shown if isinstance(shown, GoalDrive | PathDrive) else None


def _follows_path(motion: MotionExecutor | None) -> bool:
    return isinstance(motion, GoalDrive | PathDrive) and motion.path is not None

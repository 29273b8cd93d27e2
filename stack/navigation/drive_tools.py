"""The components that all drives share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from stack.components import GoalChecker, ProgressChecker
from stack.control.path_follower import PathFollower
from stack.costmap.costmap import Costmap
from stack.drivetrain.description import RobotDescription
from stack.lifecycle import Lifecycle
from stack.navigation.landmarks import Landmarks
from stack.navigation.parameters import NavigationParameters
from stack.navigation.plans.planner_worker import PlannerWorker
from stack.navigation.reactive_motions import ReactiveMotions
from stack.navigation.tasks import Emit


def _not_held(since: float, now: float) -> str:
    return ""


@dataclass
class DriveTools:
    """Components used by drives; the parameters may be replaced between steps.

    Attributes:
        period: seconds between control steps.
        motions: by range sensors, as parts of drives.
        held: returns what held the robot most from a time until now, seconds; empty if nothing did.
        landmarks: names of places and doors, for sentences.
        replans: number of plans so far that have replaced another one of the same drive.
    """

    robot: RobotDescription
    path_follower: PathFollower
    goal_checker: GoalChecker
    progress_checker: ProgressChecker
    planner_worker: PlannerWorker
    parameters: NavigationParameters
    local_costmap: Costmap
    global_costmap: Costmap
    emit: Emit
    period: float
    motions: ReactiveMotions = field(init=False)
    held: Callable[[float, float], str] = _not_held
    landmarks: Landmarks = field(default_factory=Landmarks)
    replans: int = 0
    _steered_by: object = None

    def __post_init__(self) -> None:
        self.motions = ReactiveMotions(self.robot, self.global_costmap, self.period)

    @property
    def shared(self) -> tuple[Lifecycle, ...]:
        """The parts with a lifecycle, which all drives share."""
        return self.path_follower, self.goal_checker, self.progress_checker

    def configure(self, parameters: NavigationParameters) -> None:
        """Apply new parameters, from the next step on."""
        self.parameters = parameters

    def steers(self, drive: object) -> bool:
        """Whether the path of a drive is followed."""
        return self._steered_by is drive

    def steer(self, drive: object, now: float) -> None:
        """Give the shared parts to a drive; does nothing if it has them."""
        if self._steered_by is drive:
            return
        for part in self.shared:
            if self._steered_by is not None:
                part.stop(now)
            part.start(now)
        self._steered_by = drive

    def release(self, drive: object, now: float) -> None:
        """Stop the shared parts if a drive has them."""
        if self._steered_by is drive:
            for part in self.shared:
                part.stop(now)
            self._steered_by = None

    def note_replan(self) -> None:
        """Count a plan that replaces another one."""
        self.replans += 1

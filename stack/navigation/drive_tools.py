"""The components that all drives share."""

from __future__ import annotations

from dataclasses import dataclass, field

from stack.components import GoalChecker, ProgressChecker
from stack.control.path_follower import PathFollower
from stack.lifecycle import Lifecycle
from stack.navigation.parameters import NavigationParameters
from stack.navigation.people.passing_place import Bodies
from stack.navigation.plans.planner_worker import PlannerWorker
from stack.navigation.reactive_motions import ReactiveMotions
from stack.navigation.tasks import CostmapLike, Emit


@dataclass
class DriveTools:
    """Components used by drives; the parameters may be replaced between steps.

    Attributes:
        clear_of: radius around the robot, metres, in which a blocked path is ignored.
        deceleration: of the robot, m/s², for braking before a path's speed limit.
        turns_in_place: whether the robot can turn in place; a car cannot.
        bodies: radii of the robot.
        motions: by range sensors, as parts of drives.
        is_round: whether the robot touches nothing by turning in place.
        counters: plans, replans, recoveries and distance, for the snapshot.
        steered_by: the drive whose path is followed.
    """

    path_follower: PathFollower
    goal_checker: GoalChecker
    progress_checker: ProgressChecker
    planner_worker: PlannerWorker
    parameters: NavigationParameters
    local_costmap: CostmapLike
    global_costmap: CostmapLike
    emit: Emit
    clear_of: float
    bodies: Bodies
    motions: ReactiveMotions
    is_round: bool = True
    deceleration: float = 1.0
    turns_in_place: bool = True
    counters: dict[str, float] = field(default_factory=dict)
    steered_by: object = None

    @property
    def shared(self) -> tuple[Lifecycle, ...]:
        """The parts with a lifecycle, which all drives share."""
        return self.path_follower, self.goal_checker, self.progress_checker

    def count(self, what: str) -> None:
        """Increment a counter."""
        self.counters[what] = self.counters.get(what, 0.0) + 1.0

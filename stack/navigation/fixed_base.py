"""The stages of a robot that cannot drive: nothing is planned, followed, limited or mapped."""

from __future__ import annotations

from collections.abc import Mapping

from stack.costmap.costmap import Costmap
from stack.errors import InputError
from stack.frames.buffer import TransformBuffer
from stack.navigation.motion_stage import MotionStage, WantedTwist
from stack.navigation.tasks import MotionTask
from stack.navigation.teleoperation import Teleoperation
from stack.navigation.world_model import WorldStage
from stack.robot import Localisation
from stack.safety.stage import LimitedTwist, SafetyStage
from stack.types import (
    NO_DEPTH,
    NO_OBJECTS,
    STANDSTILL,
    ContactZone,
    CurrentStep,
    DepthPoints,
    Observation,
    OccupancyGrid,
    Path,
    Perceived,
    Pose2D,
    PoseEstimate,
    SeenObjects,
    Twist,
    WorldView,
)

UNMOVED = "the robot has no wheels"


class Standing(MotionStage):
    """Wants no velocity, ever."""

    replans = 0
    evades = is_busy = False
    limitation = doubt = None
    lost_seconds = obscured_metres = 0.0
    teleoperation: Teleoperation | None = None
    goal: Pose2D | None = None
    path: Path | None = None
    local_plan: Path | None = None

    def step(self, perceived: Perceived) -> WantedTwist:
        """Return a standstill."""
        return WantedTwist(STANDSTILL)

    def navigate_to(self, goal: Pose2D) -> MotionTask:
        """Refuse to drive."""
        raise InputError(UNMOVED)

    def await_plans(self, now: float, longest: float) -> bool:
        """Nothing is planned."""
        return True

    def pause(self, now: float) -> None:
        """Nothing moves."""

    def resume(self, now: float) -> None:
        """Nothing moves."""

    def hold_detour(self, now: float, *, held: bool) -> None:
        """Nothing moves."""

    def stop_ended(self, now: float) -> None:
        """Nothing moves."""

    def close(self, now: float | None = None) -> None:
        """Nothing to close."""


class StandingSafety(SafetyStage):
    """Commands a standstill."""

    def limit(
        self, twist: Twist, perceived: Perceived, *, emergency_stop: str = "",
        contact: ContactZone | None = None,
    ) -> LimitedTwist:  # fmt: skip
        """Return a standstill without a reason: none was wanted."""
        return LimitedTwist(STANDSTILL)


class NoWorldModel(WorldStage):
    """Keeps no costmaps and follows nothing that moves."""

    @property
    def costmaps(self) -> Mapping[str, Costmap]:
        """None."""
        return {}

    def update(  # noqa: PLR0913 - what a step knows
        self, observation: Observation, frames: TransformBuffer, depth: DepthPoints = NO_DEPTH,
        objects: SeenObjects = NO_OBJECTS, twist: Twist = STANDSTILL, *, evades: bool,
    ) -> WorldView:  # fmt: skip
        """Return a view without anything in it."""
        return WorldView()

    def show(self, drawn: OccupancyGrid) -> None:
        """Nothing shows it."""

    def forget(self) -> None:
        """Nothing is kept."""


class KnownPlace(Localisation):
    """Answers where a robot stands that never moves: where the mission begins.

    Args:
        now: what the step has perceived.
    """

    def __init__(self, now: CurrentStep) -> None:
        self._now = now

    @property
    def estimate(self) -> PoseEstimate:
        return self._now.perceived.estimate

    @property
    def pose(self) -> Pose2D:
        return self.estimate.pose

    @property
    def health(self) -> float:
        return self.estimate.health

    def fit_at(self, pose: Pose2D) -> float:
        return 0.0

    def set_pose(
        self, pose: Pose2D, *, position_deviation: float, heading_deviation: float, source: str
    ) -> None:
        raise InputError(f"{UNMOVED}; its pose is that of the mission")

    def relocalise(self) -> MotionTask:
        raise InputError(f"{UNMOVED}; its pose is that of the mission")

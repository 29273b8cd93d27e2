"""The stages of a robot that cannot drive: nothing is planned, followed, limited or mapped."""

from __future__ import annotations

from stack.errors import InputError
from stack.frames.buffer import TransformBuffer
from stack.navigation.motion_stage import MotionStage, WantedTwist
from stack.navigation.tasks import MotionTask
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

    def step(self, perceived: Perceived) -> WantedTwist:
        """Return a standstill."""
        return WantedTwist(STANDSTILL)

    def navigate_to(self, goal: Pose2D) -> MotionTask:
        """Refuse to drive."""
        raise InputError(UNMOVED)


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

    def update(  # noqa: PLR0913 - what a step knows
        self, observation: Observation, frames: TransformBuffer, depth: DepthPoints = NO_DEPTH,
        objects: SeenObjects = NO_OBJECTS, twist: Twist = STANDSTILL, *, evades: bool,
    ) -> WorldView:  # fmt: skip
        """Return a view without anything in it."""
        return WorldView()


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

    def fit_at(self, pose: Pose2D) -> float:
        return 0.0

    def set_pose(
        self, pose: Pose2D, *, position_deviation: float, heading_deviation: float, source: str
    ) -> None:
        raise InputError(f"{UNMOVED}; its pose is that of the mission")

    def relocalise(self) -> MotionTask:
        raise InputError(f"{UNMOVED}; its pose is that of the mission")

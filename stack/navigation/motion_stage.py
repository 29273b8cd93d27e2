"""Interfaces of what computes velocities, navigator or fixed base, and of what holds the base."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import NamedTuple

from stack.navigation.tasks import MotionTask
from stack.navigation.teleoperation import Teleoperation
from stack.types import ContactZone, Failure, Limitation, Path, Perceived, Pose2D, Twist


class WantedTwist(NamedTuple):
    """What navigation wants: a velocity, base frame, and where the robot may touch something."""

    twist: Twist
    contact: ContactZone | None = None


class MotionStage(ABC):
    """Computes the velocity of the base in each step, and tells what it does.

    Unless a stage says otherwise, nothing moves.
    """

    @abstractmethod
    def step(self, perceived: Perceived) -> WantedTwist:
        """Compute the velocity for this step; STANDSTILL without a running task."""

    @abstractmethod
    def navigate_to(self, goal: Pose2D) -> MotionTask:
        """Begin a drive to a pose in the map frame, for an operator.

        Raises:
            InputError: the robot cannot drive.
        """

    @property
    def replans(self) -> int:
        """Number of plans so far besides the first one of each drive."""
        return 0

    @property
    def evades(self) -> bool:
        """Whether only evasion keeps the robot clear of who walks."""
        return False

    @property
    def is_busy(self) -> bool:
        """Whether a motion is under way."""
        return False

    @property
    def limitation(self) -> Limitation | None:
        """Why the motion stands in this step although it wants to drive; None if it does not."""
        return None

    @property
    def doubt(self) -> Limitation | None:
        """How doubt about the pose limits the motion; None if it does not."""
        return None

    @property
    def lost_seconds(self) -> float:
        """Time of standing because the robot was lost, in the whole run."""
        return 0.0

    @property
    def obscured_metres(self) -> float:
        """Metres driven with the map hidden, in the whole run."""
        return 0.0

    @property
    def teleoperation(self) -> Teleoperation | None:
        """The running teleoperation; None without one."""
        return None

    @property
    def goal(self) -> Pose2D | None:
        """Goal of the current drive, map frame; None without one."""
        return None

    @property
    def path(self) -> Path | None:
        """Current path, map frame."""
        return None

    @property
    def local_plan(self) -> Path | None:
        """Planned motion of the controller, map frame."""
        return None

    def await_plans(self, now: float, longest: float) -> bool:
        """Wait at most `longest` wall seconds for the plans that the step at a time needs.

        Returns:
            Whether they are there: `step` does not wait.
        """
        return True

    def pause(self, now: float) -> None:  # noqa: B027 - nothing moves
        """Hold the mission's motion at a time in seconds; does nothing while it is held."""

    def resume(self, now: float) -> None:  # noqa: B027 - nothing moves
        """Continue the mission's motion, and cancel a detour; does nothing unless held."""

    def hold_detour(self, now: float, *, held: bool) -> None:  # noqa: B027 - nothing moves
        """Hold the operator's detour with its goal, or continue it; without one, no effect."""

    def stop_ended(self, now: float) -> None:  # noqa: B027 - nothing moves
        """Stop the motions whose task has ended, as the next step would.

        Args:
            now: seconds.
        """

    def close(self, now: float | None = None) -> None:  # noqa: B027 - nothing moves
        """Cancel all tasks, stop their motions and the planner's thread.

        Args:
            now: seconds; None: the time of the last step.
        """


class DriveInterlock(ABC):
    """Holds the base while another part of the robot must not be moved with it."""

    @abstractmethod
    def hindrance(self, perceived: Perceived) -> Limitation | None:
        """Return why the base must stand in this step; None if it may drive."""

    @abstractmethod
    def remove_hindrance(self, perceived: Perceived, task: MotionTask) -> Failure | None:
        """Bring the robot towards a state in which the base may drive; called in each step.

        Args:
            perceived: in this step.
            task: motion of the base that waits.

        Returns:
            Why that is not possible; the motion of the base then fails.
        """

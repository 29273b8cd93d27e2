"""Body: the common interface of simulated, scripted, replayed and real robots.

Time is `body.time`; only `wait` advances it. A body stops by itself when it receives no commands
(DEAD_MAN), by its own time. What only some bodies know or can do is in interfaces of its
own, asked for by type: `SimulatedWorld`, `Replay`, `Engageable`, `AcceptsEstimate` and
`FastLoopBody`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, NamedTuple

from stack.drivetrain.description import RobotDescription
from stack.types import (
    STANDSTILL,
    Disturbance,
    FloatArray,
    GripperCommand,
    JointTrajectory,
    LoopStatistics,
    Observation,
    Odometry,
    Pose2D,
    PoseEstimate,
    Twist,
)

DEAD_MAN = 0.3
"""Seconds without a command after which a body stands.

It begins to stop as late as `Limits.stop` allows, but not before half of that time: a robot that is
too fast for the rest, 0.45 m/s at 3 m/s², stands later.
"""


@dataclass(frozen=True, slots=True)
class BodyCommand:
    """Command of one control period.

    Attributes:
        twist: velocity of the base, base frame.
        capture: whether the camera takes pictures; they are rendered or transferred only then.
        depth: whether the depth cameras take pictures.
        emergency_stop: whether an emergency stop stands. A body with a fast loop latches it there.
            It ends the motion of the arm.
        trajectory: a new motion of the arm; None: it goes on with the one that it has.
        gripper: a new command for the gripper; None: it goes on.
        hold_arm: whether the arm stands on its way, and goes on once this is over.
        stop_arm: whether the arm stops and forgets its trajectory.
    """

    twist: Twist = STANDSTILL
    capture: bool = False
    depth: bool = False
    emergency_stop: bool = False
    trajectory: JointTrajectory | None = None
    gripper: GripperCommand | None = None
    hold_arm: bool = False
    stop_arm: bool = False


STOP = BodyCommand(stop_arm=True)
"""Stand still, with the arm too."""

LINK, MOTOR, PILOT, CLOCK, FAST_LOOP, HARDWARE = (
    "link", "motor", "pilot", "clock", "fast_loop", "hardware",
)  # fmt: skip
"""Kinds of problems of a body: it does not answer, a motor reports an error, a pilot has taken
over, its clock has jumped, the process that drives it does not answer, anything else."""


@dataclass(frozen=True, slots=True)
class BodyHealth:
    """State of the robot's hardware.

    Attributes:
        problem: what does not work; empty if the robot can drive.
        fault: link | motor | pilot | clock | fast_loop | hardware: the kind of the problem, for
            which the parameter of the same name of `failsafe` says what the robot does.
    """

    problem: str = ""
    fault: str = HARDWARE


HEALTHY = BodyHealth()


class Body(ABC):
    """A robot: sensors and drive."""

    @property
    @abstractmethod
    def description(self) -> RobotDescription:
        """Description of the robot."""

    @property
    @abstractmethod
    def time(self) -> float:
        """Seconds on the body's clock; 0 when the run began."""

    @abstractmethod
    def sense(self) -> Observation:
        """Return the measurements since the last call.

        Raises:
            BodyError: the robot does not respond.
        """

    @abstractmethod
    def command(self, command: BodyCommand) -> None:
        """Command the next period; the body applies acceleration limits and the dead-man stop."""

    @abstractmethod
    def wait(self, period: float) -> None:
        """Advance time by `period` seconds: step the physics, or sleep on hardware."""

    @property
    def health(self) -> BodyHealth:
        """State of the hardware; healthy unless a body knows better."""
        return HEALTHY

    @property
    def is_real_time(self) -> bool:
        """Whether time passes by itself, as on hardware; then no late result is waited for.

        The only switch of that kind: plans, optimised maps and detections are then used when they
        come, and otherwise exactly at their latency.
        """
        return False

    @property
    def slept(self) -> float:
        """Wall seconds that `wait` has slept so far; they are no compute time."""
        return 0.0

    @abstractmethod
    def close(self) -> None:
        """Stop the robot and disconnect from it. Safe to call twice."""


class Engageable(ABC):
    """A body that somebody else may take over: a person with a transmitter, a failsafe.

    Its health then has a problem, and it obeys no command until it is asked to.
    """

    @abstractmethod
    def engage(self) -> str:
        """Ask for control again, without waiting, because an operator wants the robot to move.

        Returns:
            Why that is not possible; empty if it is, or if the body is under control.
        """


class AcceptsEstimate(ABC):
    """A body that wants to know where it is."""

    @abstractmethod
    def accept_estimate(self, estimate: PoseEstimate, motion: Odometry) -> None:
        """Take the estimate of a step and the odometry that belongs to it."""


@dataclass(frozen=True, slots=True)
class GroundTruth:
    """Exact state of the base of a simulated robot, world frame."""

    pose: Pose2D
    twist: Twist


@dataclass(frozen=True, slots=True)
class ContactTally:
    """Contacts of a simulated robot with obstacles so far.

    Attributes:
        by_robot: contacts while the robot drove.
        against_standing: contacts while the robot stood still, or was pushed by an event of the
            world.
    """

    by_robot: int = 0
    against_standing: int = 0


SLOWEST_PACE, FASTEST_PACE = 0.01, 1000.0
"""Simulated seconds per wall second that can be chosen, besides 0: as fast as possible."""


def pace_problem(factor: float) -> str:
    """Why a simulation cannot run at this pace; empty if it can."""
    if factor == 0.0 or SLOWEST_PACE <= factor <= FASTEST_PACE:
        return ""
    return (
        f"expected 0 (as fast as possible) or {SLOWEST_PACE:g} to {FASTEST_PACE:g}, got {factor:g}"
    )


class SimulationEvent(NamedTuple):
    """What happened in a simulated world.

    Attributes:
        kind: `contact`, `door`, `box`, `sensor_silenced`, `pushed`, `lifted`, `battery`, `fault`
            or `fault_end`.
        text: for people.
        fields: for programs. Of a contact: `touched`, the name of what the robot touched;
            `is_person`, whether that is a person of the world; `at`, x and y, metres.
    """

    kind: str
    text: str
    fields: Mapping[str, Any] = MappingProxyType({})


class BlockPose(NamedTuple):
    """Pose of a block: position, metres, and quaternion x, y, z, w, world frame."""

    position: tuple[float, float, float]
    orientation: tuple[float, float, float, float]


class FastLoopBody(ABC):
    """What only a body knows whose hardware is held by a fast loop (stack/fast_loop)."""

    @property
    @abstractmethod
    def loop_statistics(self) -> LoopStatistics:
        """Timing of the fast loop so far."""


class LinkedBody(ABC):
    """What only a body knows that talks with its robot over a link."""

    @property
    @abstractmethod
    def link_figures(self) -> Mapping[str, Any]:
        """Measured figures of the link so far, by name, for the report."""


class Replay(ABC):
    """What only a body that plays a recording knows."""

    @property
    @abstractmethod
    def recording_over(self) -> bool:
        """Whether all measurements of the recording have been played."""

    @property
    @abstractmethod
    def has_ended(self) -> bool:
        """Whether there is nothing more to sense."""


class DisturbedWorld(ABC):
    """A simulated world in which an operator may do something while the mission runs."""

    @abstractmethod
    def disturb(self, disturbance: Disturbance) -> None:
        """Do it now, between two steps; `take_events` tells it.

        Raises:
            InputError: there is no such door or sensor, or no room for it.
        """

    @abstractmethod
    def take_settings(self) -> Mapping[str, float | None]:
        """Return live parameters that faults have changed since the last call, by full name.

        None: the value that it had at the begin. They are for what a simulation cannot slow down
        itself: results are used at fixed times, however busy the computer is.
        """


class SimulatedWorld(ABC):
    """What only a simulation can do: truth, scoring, events of the world, pace and freezing time.

    The runtime freezes a simulated world while the robot is held and stands; then `time` does not
    advance. A body without this interface has a clock that cannot be stopped. Several robots may be
    in one world and share its clock.
    """

    @abstractmethod
    def freeze(self, wanted: bool) -> bool:
        """Ask for time to stand, or to go on.

        Returns:
            Whether time stands: only while every robot in the world asks for it.
        """

    @abstractmethod
    def rest(self, longest: float) -> bool:
        """Sleep at most `longest` wall seconds until the next step can be made.

        A step needs that the wall clock has caught up with the pace, and that a picture which is
        due has been rendered. Without `rest` the next `wait` or `sense` sleeps as long as it takes.

        Returns:
            Whether the next step can be made now.
        """

    @property
    @abstractmethod
    def is_due(self) -> bool:
        """Whether the last `wait` is over; time goes on once all robots in the world wait."""

    @property
    @abstractmethod
    def truth(self) -> GroundTruth:
        """Exact pose and velocity of the base frame."""

    @property
    @abstractmethod
    def tally(self) -> ContactTally:
        """Contacts so far."""

    @property
    @abstractmethod
    def clearance(self) -> float:
        """Smallest distance so far between the robot and an obstacle, metres; at most 1 m."""

    @property
    @abstractmethod
    def people(self) -> FloatArray:
        """(n, 3) x, y, radius of the people who are there, world frame, metres."""

    @property
    @abstractmethod
    def all_people(self) -> FloatArray:
        """(n, 3) as `people`, of everyone in the order of the world; nan: not there."""

    @property
    @abstractmethod
    def doors(self) -> dict[str, bool]:
        """Doors: name -> closed."""

    @property
    def blocks(self) -> Sequence[BlockPose]:
        """Where the blocks of the world are, in its order; empty without any."""
        return ()

    @property
    @abstractmethod
    def scene_changes(self) -> int:
        """Number of visible movements of doors and blocks so far."""

    @abstractmethod
    def take_events(self) -> list[SimulationEvent]:
        """Return the events of the world since the last call."""

    @property
    @abstractmethod
    def pace(self) -> float:
        """Simulated seconds per wall second; 0: as fast as possible."""

    @pace.setter
    @abstractmethod
    def pace(self, factor: float) -> None: ...

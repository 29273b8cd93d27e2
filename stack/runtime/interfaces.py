"""Parts of the step loop, and the interfaces of those that other packages implement."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

from stack.body import Body, SimulationEvent
from stack.navigation.capabilities.limbs import ArmStage
from stack.navigation.capabilities.robot import StackRobot
from stack.navigation.live_parameters import LiveParameters
from stack.navigation.motion_stage import MotionStage
from stack.runtime.failsafes import Failsafes
from stack.runtime.holdups import Holdups
from stack.runtime.perceiver import Perceiver
from stack.safety.stage import SafetyStage
from stack.telemetry.hub import Telemetry
from stack.telemetry.records import Debugging, Layer, TreeRow
from stack.types import CurrentStep, Failure, FloatArray, Observation, Pose2D, PoseEstimate


class MissionTree(Protocol):
    """Interface of the compiled mission to the step loop."""

    def tick(self) -> None:
        """Tick the tree once."""

    def pause(self, now: float) -> None:
        """Begin a pause: all time limits and delays of the tree stand still until `resume`."""

    def resume(self, now: float) -> None:
        """End a pause; no effect while not paused."""

    def halt(self) -> None:
        """Halt all running nodes, so that the robot stops."""

    @property
    def outcome(self) -> str:
        """running | success | failure."""

    @property
    def reason(self) -> str:
        """Names from the root to the node that failed first, and why it failed."""

    @property
    def recoveries(self) -> int:
        """Number of recoveries started so far."""

    @property
    def claims(self) -> Sequence[tuple[str, ...]]:
        """What each behaviour that is running claims of the robot."""

    def rows(self) -> tuple[TreeRow, ...]:
        """Every node with its status, in drawing order."""

    def blackboard(self) -> dict[str, str]:
        """Keys and values as text."""


@runtime_checkable
class DetourTree(Protocol):
    """One behaviour that an operator lets the robot carry out while the mission is paused."""

    def tick(self) -> None:
        """Tick the behaviour once."""

    def halt(self) -> None:
        """Halt it, so that the robot stops."""

    def pause(self, now: float) -> None:
        """Let its time limits stand still from a time on, seconds."""

    def resume(self, now: float) -> None:
        """Let them go on."""

    @property
    def outcome(self) -> str:
        """running | success | failure."""

    @property
    def failure(self) -> Failure | None:
        """Why it failed; None otherwise."""


MakeDetour = Callable[[str, Mapping[str, Any]], DetourTree]
"""(name of a behaviour, its ports as a mission file writes them) -> the behaviour, ready to tick;
raises InputError or ParameterError where it cannot be."""


class Debugger(Protocol):
    """Debugger of the running tree; nodes are given by name, number or file position."""

    def set_breakpoint(self, node: str) -> str:
        """Set a breakpoint before a node; return a description of the node.

        Raises:
            InputError: there is no such node; also raised by the methods below.
        """

    def clear_breakpoint(self, node: str = "") -> str:
        """Remove the breakpoint of a node, or all breakpoints; return a description."""

    def force(self, node: str, outcome: str, code: str = "") -> str:
        """Force a node to success or failure until `off`, or trigger an event once with `due`."""

    def pop_breakpoint_hits(self) -> tuple[str, ...]:
        """Descriptions of the nodes at which ticks stopped since the last call."""

    def view(self) -> Debugging:
        """State of the debugger for snapshots."""


class GroundTruthScorer(Protocol):
    """Compares estimates with the ground truth; in simulation only, for reports and displays."""

    @property
    def truth(self) -> Pose2D:
        """The true pose of the base, map frame."""

    @property
    def people(self) -> FloatArray:
        """(n, 3) x, y, radius of the people, map frame, metres."""

    def score(self, estimate: PoseEstimate) -> None:
        """Compare the estimate with the truth; called once per step."""

    def take_events(self) -> list[SimulationEvent]:
        """Events of the world since the last call."""

    def counters(self) -> dict[str, float]:
        """Collisions, clearance, localisation error…"""

    def layers(self) -> dict[str, Layer]:
        """The scene to draw."""


class ObservationLog(Protocol):
    """Records every observation."""

    def write(self, observation: Observation) -> None:
        """Append an observation."""


@dataclass
class LoopParts:
    """The parts of the step loop, in the order in which it calls them."""

    body: Body
    perceiver: Perceiver
    now: CurrentStep
    tree: MissionTree
    robot: StackRobot
    navigator: MotionStage
    safety: SafetyStage
    limbs: ArmStage
    live_parameters: LiveParameters
    telemetry: Telemetry
    holdups: Holdups
    failsafes: Failsafes
    scorer: GroundTruthScorer | None = None
    debugger: Debugger | None = None
    sensor_log: ObservationLog | None = None
    make_detour: MakeDetour | None = None

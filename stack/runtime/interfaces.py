"""What the step loop is made of, and how often each part runs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from stack.body import Body
from stack.costmap.costmap import Costmap
from stack.errors import InputError
from stack.localisation.dead_reckoning import DeadReckoning
from stack.localisation.localiser import Localiser
from stack.localisation.odometry import OdometryFusion
from stack.navigation.navigator import Navigator
from stack.navigation.robot_facade import RobotFacade
from stack.parameters import parameter
from stack.perception.tracker import Tracker
from stack.safety.safety import Safety
from stack.telemetry.hub import Telemetry
from stack.telemetry.records import Debugging, Layer, TreeRow
from stack.types import FloatArray, Pose2D, PoseEstimate


class MissionTree(Protocol):
    """The compiled mission as the loop sees it."""

    def tick(self) -> None:
        """One tick of the tree."""
        ...

    def leave_out(self, seconds: float) -> None:
        """Time that passed while the mission was paused: no limit or delay counts it."""
        ...

    def halt(self) -> None:
        """Halt whatever runs, so that the robot is left standing."""
        ...

    @property
    def outcome(self) -> str:
        """running | success | failure."""
        ...

    @property
    def reason(self) -> str:
        """Path of names from the root to the first cause of the failure, and the cause."""
        ...

    @property
    def recoveries(self) -> int:
        """Recoveries begun so far."""
        ...

    def rows(self) -> tuple[TreeRow, ...]:
        """Every node with its status, in drawing order."""
        ...

    def blackboard(self) -> dict[str, str]:
        """Keys and values as text."""
        ...


class Debugger(Protocol):
    """What operators may do to the tree while it runs; nodes are named as people name them."""

    def set_breakpoint(self, node: str) -> str:
        """Stop before a node starts; what was understood, in words.

        Raises:
            InputError: there is no such node; so for the others.
        """
        ...

    def clear_breakpoint(self, node: str = "") -> str:
        """Take breakpoints away; without a node all of them."""
        ...

    def force(self, node: str, outcome: str, code: str = "") -> str:
        """Force success or failure on a node until `off`; let an event be `due` once."""
        ...

    def take_stops(self) -> tuple[str, ...]:
        """The nodes, in words, that a tick was stopped before since the last call."""
        ...

    def view(self) -> Debugging:
        """For the screen."""
        ...


class GroundTruthScorer(Protocol):
    """Who knows the truth: in simulation only, for scoring and for the screen."""

    @property
    def truth(self) -> Pose2D:
        """The true pose of the base, map frame."""
        ...

    @property
    def people(self) -> FloatArray:
        """(n, 3) x, y, radius of the people."""
        ...

    def look(self, estimate: PoseEstimate) -> None:
        """Score the estimate against the truth; called once a step."""
        ...

    def news(self) -> list[tuple[str, str]]:
        """What happened in the world since the last call, as (kind, text)."""
        ...

    def counters(self) -> dict[str, float]:
        """Collisions, clearance, localisation error…"""
        ...

    def layers(self) -> dict[str, Layer]:
        """The scene to draw."""
        ...


@dataclass(frozen=True)
class Rates:
    """How often each stage runs. Slower rates must divide the control rate."""

    control: float = parameter(20.0, "Hz", above=0.0, help="sense, navigate, limit and drive")
    tree: float = parameter(10.0, "Hz", above=0.0, help="ticks of the behaviour tree")

    def every(self, rate: float, name: str) -> int:
        """How many control steps lie between two runs of a stage.

        Raises:
            InputError: the rate does not divide the control rate.
        """
        steps = self.control / rate
        if steps < 1 or abs(steps - round(steps)) > 1e-9:
            raise InputError(
                f"the {name} rate {rate:g} Hz does not divide the control rate {self.control:g} Hz;"
                " choose one that does, such as 20, 10 or 5 Hz"
            )
        return round(steps)


@dataclass
class Parts:
    """What the loop is made of."""

    body: Body
    fusion: OdometryFusion
    localiser: Localiser | DeadReckoning
    local_costmap: Costmap
    global_costmap: Costmap
    navigator: Navigator
    facade: RobotFacade
    safety: Safety
    tree: MissionTree
    telemetry: Telemetry
    map_layer: Layer
    scorer: GroundTruthScorer | None = None
    tracker: Tracker | None = None
    debugger: Debugger | None = None
    keep_camera_on: bool = False

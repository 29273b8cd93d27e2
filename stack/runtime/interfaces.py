"""Parts of the step loop, and the interfaces of those that other packages implement."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from stack.body import Body
from stack.components import Estimator, OdometryFusion
from stack.frames.buffer import TransformBuffer
from stack.navigation.facade.robot_facade import RobotFacade
from stack.navigation.navigator import Navigator
from stack.navigation.world_model import WorldModel
from stack.perception.camera_lease import CameraLease
from stack.perception.cameras.watch import CameraWatch
from stack.perception.depth.obstacles import DepthObstacles
from stack.perception.depth.scan import DepthScans
from stack.perception.markers.stage import MarkerStage
from stack.perception.objects.detection import ObjectDetection
from stack.perception.obstacle_memory import ObstacleMemory
from stack.perception.places.memory import PlaceMemory
from stack.safety.safety import Safety
from stack.telemetry.hub import Telemetry
from stack.telemetry.records import Debugging, Layer, TreeRow
from stack.types import FloatArray, Observation, Pose2D, PoseEstimate


class MissionTree(Protocol):
    """Interface of the compiled mission to the step loop."""

    def tick(self) -> None:
        """Tick the tree once."""
        ...

    def pause(self, now: float) -> None:
        """Begin a pause: all time limits and delays of the tree stand still until `resume`."""
        ...

    def resume(self, now: float) -> None:
        """End a pause; no effect while not paused."""
        ...

    def halt(self) -> None:
        """Halt all running nodes, so that the robot stops."""
        ...

    @property
    def outcome(self) -> str:
        """running | success | failure."""
        ...

    @property
    def reason(self) -> str:
        """Names from the root to the node that failed first, and why it failed."""
        ...

    @property
    def recoveries(self) -> int:
        """Number of recoveries started so far."""
        ...

    def rows(self) -> tuple[TreeRow, ...]:
        """Every node with its status, in drawing order."""
        ...

    def blackboard(self) -> dict[str, str]:
        """Keys and values as text."""
        ...


class Debugger(Protocol):
    """Debugger of the running tree; nodes are given by name, number or file position."""

    def set_breakpoint(self, node: str) -> str:
        """Set a breakpoint before a node; return a description of the node.

        Raises:
            InputError: there is no such node; also raised by the methods below.
        """
        ...

    def clear_breakpoint(self, node: str = "") -> str:
        """Remove the breakpoint of a node, or all breakpoints; return a description."""
        ...

    def force(self, node: str, outcome: str, code: str = "") -> str:
        """Force a node to success or failure until `off`, or trigger an event once with `due`."""
        ...

    def pop_breakpoint_hits(self) -> tuple[str, ...]:
        """Descriptions of the nodes at which ticks stopped since the last call."""
        ...

    def view(self) -> Debugging:
        """State of the debugger for snapshots."""
        ...


class GroundTruthScorer(Protocol):
    """Compares estimates with the ground truth; in simulation only, for reports and displays."""

    @property
    def truth(self) -> Pose2D:
        """The true pose of the base, map frame."""
        ...

    @property
    def people(self) -> FloatArray:
        """(n, 3) x, y, radius of the people, map frame, metres."""
        ...

    def score(self, estimate: PoseEstimate) -> None:
        """Compare the estimate with the truth; called once per step."""
        ...

    def take_events(self) -> list[tuple[str, str]]:
        """Events of the world since the last call, each (kind, text)."""
        ...

    def counters(self) -> dict[str, float]:
        """Collisions, clearance, localisation error…"""
        ...

    def layers(self) -> dict[str, Layer]:
        """The scene to draw."""
        ...


class ObservationLog(Protocol):
    """Records every observation."""

    def write(self, observation: Observation) -> None:
        """Append an observation."""
        ...


@dataclass
class Parts:
    """The parts of the step loop, in the order in which it calls them."""

    body: Body
    odometry: OdometryFusion
    frames: TransformBuffer
    estimator: Estimator
    cameras: CameraWatch
    depth_scans: DepthScans
    markers: MarkerStage
    places: PlaceMemory
    depth: DepthObstacles
    obstacle_memory: ObstacleMemory
    objects: ObjectDetection
    world_model: WorldModel
    tree: MissionTree
    facade: RobotFacade
    navigator: Navigator
    safety: Safety
    camera: CameraLease
    depth_camera: CameraLease
    telemetry: Telemetry
    map_layer: Layer
    is_mapped: bool = True
    scorer: GroundTruthScorer | None = None
    debugger: Debugger | None = None
    sensor_log: ObservationLog | None = None

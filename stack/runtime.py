"""The step loop: one thread owns the robot, everybody else gets copies.

`Runtime.step` reads like the abstract of the paper. Each named stage is timed; in simulation a
stage that would have overrun the control period on hardware is counted.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from time import perf_counter
from typing import Protocol

from stack.body import Body
from stack.costmap.costmap import Costmap
from stack.errors import InputError, ParameterError
from stack.localisation.dead_reckoning import DeadReckoning
from stack.localisation.localiser import Localiser
from stack.localisation.odometry import OdometryFusion
from stack.navigation.navigation import Navigation
from stack.navigation.pilot import Pilot
from stack.parameters import parameter
from stack.safety.safety import Safety
from stack.snapshots import compose_snapshot
from stack.telemetry.hub import Telemetry
from stack.telemetry.records import Ack, Command, Layer, MissionState, StageTiming, TreeRow
from stack.types import (
    STANDSTILL,
    FloatArray,
    Image,
    Observation,
    Odometry,
    Pose2D,
    PoseEstimate,
    Twist,
)

STANDING_SPEED = 0.02
"""Below this speed (m/s and rad/s) the robot counts as standing."""


class MissionTree(Protocol):
    """The compiled mission as the loop sees it."""

    def tick(self) -> None:
        """One tick of the tree."""
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


class Witness(Protocol):
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
    navigation: Navigation
    pilot: Pilot
    safety: Safety
    tree: MissionTree
    telemetry: Telemetry
    map_layer: Layer
    witness: Witness | None = None


@dataclass
class _Stage:
    total: float = 0.0
    worst: float = 0.0
    count: int = 0
    overruns: int = 0


@dataclass
class Stages:
    """Compute time by stage, wall seconds: for profiling, never for decisions."""

    budget: float
    stages: dict[str, _Stage] = field(default_factory=dict)

    @contextmanager
    def measure(self, name: str, asleep: Callable[[], float] = lambda: 0.0) -> Iterator[None]:
        """Add the time that the block takes to a stage, less what it sleeps."""
        began = perf_counter() - asleep()
        try:
            yield
        finally:
            taken = perf_counter() - asleep() - began
            stage = self.stages.setdefault(name, _Stage())
            stage.total += taken
            stage.count += 1
            stage.worst = max(stage.worst, taken)
            stage.overruns += taken > self.budget

    def timings(self) -> dict[str, StageTiming]:
        """Mean, worst, count and overruns of every stage."""
        return {
            name: StageTiming(stage.total / stage.count, stage.worst, stage.count, stage.overruns)
            for name, stage in self.stages.items()
        }


class Runtime:
    """Runs a mission step by step. Nothing here reads a clock but the body's."""

    def __init__(self, parts: Parts, rates: Rates, idle: Callable[[], None] = lambda: None) -> None:
        """Ready to step.

        Args:
            parts: what to run.
            rates: how often.
            idle: called instead of a step while the robot is held and stands.
        """
        self.parts, self._idle = parts, idle
        self.period = 1.0 / rates.control
        self.steps = 0
        self.state = MissionState.STARTING
        self.reason = ""
        self.stages = Stages(self.period)
        self.odometry = Odometry(0.0, Pose2D(0.0, 0.0), STANDSTILL)
        self.commanded = STANDSTILL
        self.distance = 0.0
        self._began = perf_counter()
        self._image: Image | None = None
        self._ticks_every = rates.every(rates.tree, "tree")
        self._resume_to = MissionState.RUNNING

    def step(self) -> None:
        """One control period, or nothing but service to the operator while the robot is held."""
        if self._held_and_standing():
            self._idle()
            self._apply_commands()
            self.parts.telemetry.publish(lambda: compose_snapshot(self))
            return
        measure = self.stages.measure
        self.parts.telemetry.advance(self.steps, self.parts.body.time)
        with measure("commands"):
            self._apply_commands()
        with measure("sense"):
            observation = self.parts.body.sense()
            self._image = observation.image or self._image
        with measure("estimate"):
            self._estimate(observation)
        with measure("costmap"):
            self._update_costmaps(observation)
        if self.steps % self._ticks_every == 0 and self._ticking():
            with measure("tree"):
                self.parts.tree.tick()
            self._conclude()
        with measure("navigate"):
            wanted = self.parts.pilot.advance() if self._ticking() else STANDSTILL
        with measure("safety"):
            self.commanded = self._limit(wanted)
        self.parts.body.drive(self.commanded)
        self._note_trajectory()
        with measure("publish"):
            self.parts.telemetry.publish(lambda: compose_snapshot(self))
        with measure("body", self._asleep):
            if self.parts.pilot.camera_wanted:
                self.parts.body.ask_for_image()
            self.parts.body.wait(self.period)
        self.steps += 1

    def end(self, state: MissionState, reason: str) -> None:
        """Bring the mission to an end from outside: aborted, interrupted, error."""
        if self.state.is_over:
            return
        self.state, self.reason = state, reason
        self.parts.tree.halt()
        self.parts.telemetry.emit(
            "mission_ended", f"{state}: {reason}" if reason else str(state), source="mission",
            level="info" if state is MissionState.SUCCESS else "warning",
            state=str(state), reason=reason,
        )  # fmt: skip

    def stand_still(self, patience: float = 3.0) -> None:
        """Keep stepping with a zero command until the robot stands; at most `patience` seconds."""
        for _ in range(round(patience / self.period)):
            if self._standing():
                return
            self.step()

    @property
    def real_time_factor(self) -> float:
        """Simulated seconds per wall second since the run began; for the screen only."""
        return self.parts.body.time / max(1e-6, perf_counter() - self._began)

    def fresh_image(self) -> Image | None:
        """The newest picture that no snapshot has shown yet."""
        image, self._image = self._image, None
        return image

    def counters(self) -> dict[str, float]:
        """Figures for the screen and the report."""
        own = {
            "distance": self.distance,
            "recoveries": float(self.parts.tree.recoveries),
            "replans": self.parts.navigation.counters["replans"],
        }
        return own if self.parts.witness is None else {**own, **self.parts.witness.counters()}

    def layers(self) -> dict[str, Layer]:
        """The large things by name: map, costmaps, scene."""
        parts = self.parts
        return {
            "map": parts.map_layer,
            "global_costmap": Layer(parts.global_costmap.version, parts.global_costmap.grid),
            "local_costmap": Layer(parts.local_costmap.version, parts.local_costmap.grid),
            **(parts.witness.layers() if parts.witness is not None else {}),
        }

    def _asleep(self) -> float:
        """Wall seconds that the body has slept to keep its pace: not compute time."""
        return float(getattr(self.parts.body, "slept", 0.0))

    def _ticking(self) -> bool:
        return self.state in (MissionState.STARTING, MissionState.RUNNING)

    def _held_and_standing(self) -> bool:
        held = self.state in (MissionState.PAUSED, MissionState.EMERGENCY_STOP)
        return held and self._standing()

    def _standing(self) -> bool:
        twist = self.odometry.twist
        return abs(twist.linear) < STANDING_SPEED and abs(twist.angular) < STANDING_SPEED

    def _estimate(self, observation: Observation) -> None:
        before = self.odometry.pose
        self.odometry = self.parts.fusion.update(observation)
        self.distance += before.distance_to(self.odometry.pose)
        self.parts.localiser.update(self.odometry.pose, observation.scan)
        self.parts.pilot.update(observation, self.odometry)
        if self.parts.witness is not None:
            self.parts.witness.look(self.parts.localiser.estimate)
            for kind, text in self.parts.witness.news():
                self.parts.telemetry.emit(kind, text, source="simulation")

    def _update_costmaps(self, observation: Observation) -> None:
        if observation.scan is None:
            return
        pose = self.parts.localiser.estimate.pose
        self.parts.local_costmap.update(pose, observation.scan, observation.time)
        self.parts.global_costmap.update(pose, observation.scan, observation.time)

    def _limit(self, wanted: Twist) -> Twist:
        return self.parts.safety.limit(
            wanted, scan=self.parts.pilot.scan, time=self.parts.body.time,
            measured=self.odometry.twist,
        )  # fmt: skip

    def _note_trajectory(self) -> None:
        """Once a simulated second the exact pose goes into the hashed log."""
        if self.steps % round(1.0 / self.period) == 0:
            pose = self.parts.localiser.estimate.pose
            self.parts.telemetry.emit(
                "pose", f"at ({pose.x:.2f}, {pose.y:.2f})", source="localisation",
                x=pose.x, y=pose.y, heading=pose.heading,
                quality=self.parts.localiser.estimate.quality,
                charge=self.parts.pilot.battery.charge,
            )  # fmt: skip

    def _conclude(self) -> None:
        if self.state is MissionState.STARTING:
            self.state = MissionState.RUNNING
        if self.parts.tree.outcome == "success":
            self.end(MissionState.SUCCESS, "")
        elif self.parts.tree.outcome == "failure":
            self.end(MissionState.FAILURE, self.parts.tree.reason)

    def _apply_commands(self) -> None:
        for command in self.parts.telemetry.commands():
            try:
                refusal = self._apply(command)
            except (InputError, ParameterError, KeyError, TypeError, ValueError) as error:
                refusal = f"{type(error).__name__}: {error}"
            self.parts.telemetry.acknowledge(Ack(command.id, not refusal, refusal))
            self.parts.telemetry.emit(
                "command", f"{command.kind}: {refusal or 'done'}", source="command",
                level="warning" if refusal else "info",
                command=command.kind, arguments=dict(command.arguments), step=self.steps,
                refused=refusal,
            )  # fmt: skip

    def _apply(self, command: Command) -> str:
        """Carry out one command; the reason when it is refused, else an empty text."""
        action = getattr(self, f"_command_{command.kind}", None)
        if action is None:
            return f"there is no command {command.kind!r}"
        if self.state.is_over:
            return f"the mission is over ({self.state})"
        return str(action(dict(command.arguments)) or "")

    def _command_pause(self, _: dict[str, object]) -> str:
        if self.state is MissionState.EMERGENCY_STOP:
            return "the emergency stop is engaged; release it first"
        self.state = MissionState.PAUSED
        return ""

    def _command_resume(self, _: dict[str, object]) -> str:
        if self.state is not MissionState.PAUSED:
            return f"nothing to resume: the mission is {self.state}"
        self.state = MissionState.RUNNING
        return ""

    def _command_estop(self, arguments: dict[str, object]) -> None:
        if self.state is not MissionState.EMERGENCY_STOP:
            self._resume_to = self.state
        self.parts.safety.engage(str(arguments.get("reason", "operator")))
        self.state = MissionState.EMERGENCY_STOP

    def _command_release(self, _: dict[str, object]) -> str:
        if self.state is not MissionState.EMERGENCY_STOP:
            return "the emergency stop is not engaged"
        self.parts.safety.release()
        self.state = self._resume_to
        return ""

    def _command_abort(self, arguments: dict[str, object]) -> None:
        self.end(MissionState.ABORTED, str(arguments.get("reason", "by the operator")))

    def _command_speed(self, arguments: dict[str, object]) -> str:
        if not hasattr(self.parts.body, "pace"):
            return "this robot runs in real time"
        factor = float(str(arguments["factor"]))
        if not 0.0 <= factor <= 1000.0:
            return f"a speed of {factor:g} is not between 0 (as fast as possible) and 1000"
        self.parts.body.pace = factor
        return ""

    def _command_set_pose(self, arguments: dict[str, object]) -> None:
        self.parts.pilot.set_pose(
            _pose(arguments), position_deviation=0.3, heading_deviation=0.3, source="operator"
        )

    def _command_set_parameter(self, arguments: dict[str, object]) -> None:
        self.parts.pilot.set_parameter(str(arguments["name"]), arguments["value"])


def _pose(arguments: dict[str, object]) -> Pose2D:
    x, y, heading = (float(str(arguments[key])) for key in ("x", "y", "heading"))
    return Pose2D(x, y, heading)

"""The step loop. One thread owns the robot; everything else receives copies.

Each stage of `Runtime.step` is timed. A stage that takes longer than the control period is
counted as an overrun, also in simulation.
"""

from __future__ import annotations

from collections.abc import Callable
from math import hypot
from time import perf_counter

from stack.costmap.layer import LayerUpdate, PosedScan
from stack.runtime.commands import CommandHandler
from stack.runtime.interfaces import MissionTree, Parts, Rates
from stack.runtime.snapshots import compose_snapshot
from stack.runtime.stage_times import Stages
from stack.telemetry.records import Ack, Command, Layer, MissionState
from stack.types import STANDSTILL, Image, Observation, Odometry, Pose2D, RangeReading, Twist

STANDING_SPEED = 0.02
"""Speed, m/s and rad/s, below which the robot counts as standing."""


class Runtime:
    """Runs a mission step by step. Its only clock is the body's."""

    def __init__(self, parts: Parts, rates: Rates, idle: Callable[[], None] = lambda: None) -> None:
        """Prepare the first step.

        Args:
            parts: of the loop.
            rates: of the stages.
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
        self._next_tree: Callable[[], MissionTree] | None = None
        self._waiting_readings: tuple[RangeReading, ...] = ()
        self._ticks_every = rates.every(rates.tree, "tree")
        self._commands = CommandHandler(parts, self)

    def step(self) -> None:
        """Run one control period; while the robot is held and stands, only serve the operator."""
        self.parts.telemetry.advance(self.steps, self.parts.body.time)
        if self._held_and_standing():
            self._idle()
            self._install_next_tree()
            self._commands.apply_commands(held=True)
            self.parts.telemetry.publish(lambda: compose_snapshot(self))
            return
        measure = self.stages.measure
        with measure("commands"):
            self._commands.apply_commands()
        with measure("sense"):
            observation = self.parts.body.sense()
            self._image = observation.image or self._image
        with measure("estimate"):
            self._estimate(observation)
        with measure("costmap"):
            self._update_costmaps(observation)
        if self.steps % self._ticks_every == 0 and self._may_tick():
            with measure("tree"):
                self.parts.tree.tick()
            self._conclude()
            self._commands.debugging.after_tick()
        with measure("navigate"):
            moving = self._ticking() or self._commands.drives_to_operator_goal
            wanted = self.parts.facade.advance() if moving else STANDSTILL
        with measure("safety"):
            self.commanded = self._limit(wanted)
        self.parts.body.drive(self.commanded)
        self._note_trajectory()
        with measure("publish"):
            self.parts.telemetry.publish(lambda: compose_snapshot(self))
        with measure("body", self._asleep):
            if self.parts.facade.camera_wanted or self.parts.keep_camera_on:
                self.parts.body.ask_for_image()
            self.parts.body.wait(self.period)
        if not self._ticking():
            self.parts.tree.leave_out(self.period)
        self.steps += 1

    def apply(self, command: Command) -> Ack:
        """Apply a command now, between two steps, as if an operator had sent it."""
        return self._commands.apply(command)

    def replace_tree(self, make_tree: Callable[[], MissionTree]) -> None:
        """Halt the tree now, and continue with another one from its root once the robot stands.

        Args:
            make_tree: called when the robot stands; returns the new tree. A later call of
                `replace_tree` replaces it.
        """
        if self.parts.tree.outcome == "running":
            self.parts.tree.halt()
        self._next_tree = make_tree

    def end(self, state: MissionState, reason: str) -> None:
        """End the mission with a final state; does nothing if it is over."""
        if self.state.is_over:
            return
        self.state, self.reason = state, reason
        if self.parts.tree.outcome == "running":  # a tree that has ended keeps its statuses
            self.parts.tree.halt()
        self.parts.telemetry.emit(
            "mission_ended", f"{state}: {reason}" if reason else str(state), source="mission",
            level="info" if state is MissionState.SUCCESS else "warning",
            state=str(state), reason=reason,
        )  # fmt: skip

    def stand_still(self, patience: float = 3.0) -> None:
        """Step with a zero command until the robot stands, at most `patience` seconds."""
        for _ in range(round(patience / self.period)):
            if self._standing():
                return
            self.step()

    @property
    def real_time_factor(self) -> float:
        """Simulated seconds per wall second since the run began; for displays only."""
        return self.parts.body.time / max(1e-6, perf_counter() - self._began)

    def fresh_image(self) -> Image | None:
        """The newest picture if no snapshot has contained it yet."""
        image, self._image = self._image, None
        return image

    def counters(self) -> dict[str, float]:
        """Counters by name, for displays and the report."""
        own = {
            "distance": self.distance,
            "recoveries": float(self.parts.tree.recoveries),
            "replans": self.parts.navigator.counters["replans"],
        }
        return own if self.parts.scorer is None else {**own, **self.parts.scorer.counters()}

    def layers(self) -> dict[str, Layer]:
        """Map, costmaps and scene by name."""
        parts = self.parts
        return {
            "map": parts.map_layer,
            "global_costmap": Layer(parts.global_costmap.version, parts.global_costmap.grid),
            "local_costmap": Layer(parts.local_costmap.version, parts.local_costmap.grid),
            **(parts.scorer.layers() if parts.scorer is not None else {}),
        }

    def _asleep(self) -> float:
        """Wall seconds that the body has slept to keep its pace; these are not compute time."""
        return float(getattr(self.parts.body, "slept", 0.0))

    def _may_tick(self) -> bool:
        """Whether the tree is ticked in this step; installs the next tree if the robot stands.

        A halted tree is not ticked again: the robot stops first, then the next tree starts.
        """
        self._install_next_tree()
        if self._next_tree is not None or not self._ticking():
            return False
        return self._commands.debugging.may_tick()

    def _install_next_tree(self) -> None:
        if self._next_tree is not None and self._standing() and not self.state.is_over:
            self.parts.tree, self._next_tree = self._next_tree(), None

    def _ticking(self) -> bool:
        return self.state in (MissionState.STARTING, MissionState.RUNNING)

    def _held_and_standing(self) -> bool:
        held = self.state in (MissionState.PAUSED, MissionState.EMERGENCY_STOP)
        return held and self._standing() and not self._commands.drives_to_operator_goal

    def _standing(self) -> bool:
        twist = self.odometry.twist
        speed = hypot(twist.linear, twist.lateral)
        return speed < STANDING_SPEED and abs(twist.angular) < STANDING_SPEED

    def _estimate(self, observation: Observation) -> None:
        before = self.odometry.pose
        self.odometry = self.parts.fusion.update(observation)
        self.distance += before.distance_to(self.odometry.pose)
        self.parts.localiser.update(self.odometry.pose, observation.scan)
        self.parts.facade.update(observation, self.odometry)
        if self.parts.scorer is not None:
            self.parts.scorer.look(self.parts.localiser.estimate)
            for kind, text in self.parts.scorer.news():
                self.parts.telemetry.emit(kind, text, source="simulation")

    def _update_costmaps(self, observation: Observation) -> None:
        pose = self.parts.localiser.estimate.pose
        for name, more in observation.scans.items():
            update = LayerUpdate(pose, observation.time, {name: PosedScan(more, pose)})
            self.parts.local_costmap.update(update)
            self.parts.global_costmap.update(update)
        self._waiting_readings += observation.readings
        if observation.scan is None:
            return
        readings, self._waiting_readings = self._waiting_readings, ()
        scan, time, tracker = observation.scan, observation.time, self.parts.tracker
        tracks = None if tracker is None else tracker.update(pose, scan, time)
        self.parts.facade.tracks = tracks or ()
        update = LayerUpdate(pose, time, {"lidar": PosedScan(scan, pose)}, readings, tracks)
        self.parts.local_costmap.update(update)
        self.parts.global_costmap.update(update)

    def _limit(self, wanted: Twist) -> Twist:
        parts, pose = self.parts, self.parts.localiser.estimate.pose
        deceleration = parts.body.description.limits.linear_deceleration
        return parts.safety.limit(
            wanted, scan=parts.facade.scan, time=parts.body.time, measured=self.odometry.twist,
            more=parts.facade.scans,
            speed_limit=parts.speed_limits.at_pose(pose, deceleration),
        )  # fmt: skip

    def _note_trajectory(self) -> None:
        """Log the exact pose once per second of robot time; the log is hashed."""
        if self.steps % round(1.0 / self.period) == 0:
            pose = self.parts.localiser.estimate.pose
            self.parts.telemetry.emit(
                "pose", f"at ({pose.x:.2f}, {pose.y:.2f})", source="localisation",
                x=pose.x, y=pose.y, heading=pose.heading,
                health=self.parts.localiser.estimate.health,
                charge=self.parts.facade.battery.charge,
            )  # fmt: skip

    def _conclude(self) -> None:
        if self.state is MissionState.STARTING:
            self.state = MissionState.RUNNING
        if self.parts.tree.outcome == "success":
            self.end(MissionState.SUCCESS, "")
        elif self.parts.tree.outcome == "failure":
            self.end(MissionState.FAILURE, self.parts.tree.reason)

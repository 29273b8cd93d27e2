"""The step loop. One thread owns the robot; everything else receives copies.

Each stage of `Runtime.step` takes its input as arguments and returns its result. The stages are
timed; a stage or a step that takes longer than the control period is counted as an overrun, also
in simulation.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from stack.body import AcceptsEstimate, BodyCommand, DisturbedWorld, Replay, SimulatedWorld
from stack.costmap.costmap import Costmap
from stack.navigation.motion_stage import WantedTwist
from stack.runtime.arm_display import ArmDisplay
from stack.runtime.commands import CommandHandler
from stack.runtime.failsafes import FailsafeInput
from stack.runtime.figures import SlowFigures
from stack.runtime.interfaces import LoopParts, MissionTree
from stack.runtime.mission_state import HELD, MissionEvent, MissionStateMachine
from stack.runtime.pace_meter import PaceMeter
from stack.runtime.parameters import LoopParameters
from stack.runtime.sensing import Sensing
from stack.runtime.stage_times import Stages
from stack.safety.stage import LimitedTwist
from stack.schedule import Schedule
from stack.telemetry.records import Ack, Command, Debugging, Layer, MissionState, Snapshot
from stack.types import (
    STANDSTILL,
    DepthPoints,
    FloatArray,
    Limitation,
    Odometry,
    Perceived,
    PoseEstimate,
)
from stack.types.limitations import LOST

SHOWN_PARTICLES, SHOWN_DEPTH_POINTS, SHOWN_EVENTS = 300, 1500, 40
"""In a snapshot."""

WATCHED_TIME = 2.0
"""Time over which steps of a real robot are counted that exceed their period, s."""

LOCAL = "local_costmap"

LONGEST_NAP = 0.01
"""Wall seconds between two looks for commands while the next step cannot be made yet."""


class Runtime:
    """Runs a mission step by step. Its only clock is the body's."""

    def __init__(
        self, parts: LoopParts, parameters: LoopParameters, idle: Callable[[], None] = lambda: None
    ) -> None:
        """Prepare the first step.

        Args:
            parts: of the loop.
            parameters: of the loop.
            idle: called instead of a step while a simulation is frozen.
        """
        self.parts, self._idle = parts, idle
        self.period = parameters.period
        self.steps, self.is_frozen = 0, False
        self.mission = MissionStateMachine(self._state_changed)
        self.stages = Stages(self.period)
        self.distance, self.command = 0.0, LimitedTwist(STANDSTILL)
        self.sensing = Sensing(parts)
        self.pace = PaceMeter()
        self._next_tree: Callable[[], MissionTree] | None = None
        self._world = parts.body if isinstance(parts.body, SimulatedWorld) else None
        self._ticks_every = parameters.steps_per_tick
        self._watched_steps = round(WATCHED_TIME * parameters.control_rate)
        self._poses = Schedule(parameters.control_rate)  # in steps: one per second
        self._figures = SlowFigures(self.stages, self.sensing, parts.body)
        self._commands = CommandHandler(parts, self.mission, self.end)
        self._arm = ArmDisplay(parts.limbs)
        self._parameters = Layer(1, parts.live_parameters.table)

    def is_ready(self) -> bool:
        """Wait up to LONGEST_NAP for what the next step needs; return whether it can be made.

        It needs the simulation's pace, and a picture, an optimised map, detections and a plan that
        are due. While they are not there, call `serve`: `step` would wait, and no operator could
        stop the robot.
        """
        p = self.parts
        if self._world is not None and not self._world.rest(LONGEST_NAP):
            return False
        if not p.perceiver.await_input(p.body.time, LONGEST_NAP):
            return False
        if not self._navigates:
            return True
        drives = p.navigator.await_plans(p.body.time, LONGEST_NAP)
        return drives and p.limbs.await_plans(p.body.time, LONGEST_NAP)

    def serve(self) -> None:
        """Apply commands and publish between two steps, as the next step would."""
        self.parts.telemetry.advance(self.steps, self.parts.body.time)
        self._commands.apply_all()
        self.parts.telemetry.publish(self.snapshot)

    def step(self) -> None:
        """Run one control period; while a simulation is frozen, only serve the operator."""
        p, last, measure = self.parts, self.perceived, self.stages.measure
        p.telemetry.advance(self.steps, p.body.time)
        self.pace.advance(p.body.time, self.mission.is_held)
        self.is_frozen = self._freeze()
        if self.is_frozen:
            self._serve_operator()
            return
        self.stages.begin_step()
        with measure("commands"):
            self._commands.apply_all()
        with measure("sense"):
            observation = self.sensing.sense(last.motion.pose)
        if isinstance(p.body, DisturbedWorld):
            p.live_parameters.follow(p.body.take_settings())
        with measure("estimate"):
            motion = p.perceiver.move(observation)
            observation = self.sensing.deskewed(observation)
            estimate = p.perceiver.estimate(observation)
        perceived = p.perceiver.perceive(
            observation, motion, estimate, last, measure, evades=p.navigator.evades
        )
        if isinstance(p.body, AcceptsEstimate):
            p.body.accept_estimate(estimate, motion)
        self._score(last.motion, motion, estimate)
        p.now.see(perceived)
        self._guard(perceived)
        if self.steps % self._ticks_every == 0:
            with measure("tree"):
                self._tick_tree()
        with measure("navigate"):
            perceived = p.perceiver.at(perceived, p.perceiver.estimator.estimate)
            p.now.see(perceived)
            wanted = self._navigate(perceived)
        with measure("safety"):
            self.command = p.safety.limit(
                wanted.twist, perceived, emergency_stop=self.mission.emergency_stop,
                contact=wanted.contact,
            )  # fmt: skip
        now = p.body.time
        kept = self.command.twist.share_of(wanted.twist)
        p.holdups.update(self._holding(), perceived.estimate.pose, now, kept)
        limbs = p.limbs.step(perceived, held=not self._navigates)
        p.body.command(
            BodyCommand(
                self.command.twist,
                p.perceiver.captures(now),
                p.perceiver.measures_depth(now),
                bool(self.mission.emergency_stop),
                *limbs,
            )
        )
        self._log_pose()
        with measure("publish"):
            p.telemetry.publish(self.snapshot)
        with measure("body", self._slept):
            p.body.wait(self.period)
        self.stages.end_step()
        self.steps += 1

    @property
    def perceived(self) -> Perceived:
        """What the newest step has perceived."""
        return self.parts.now.perceived

    @property
    def state(self) -> MissionState:
        """State of the mission."""
        return self.mission.state

    @property
    def reason(self) -> str:
        """Why the mission is in this state; may be empty."""
        return self.mission.reason

    def apply(self, command: Command) -> Ack:
        """Apply a command now, between two steps, as if an operator had sent it."""
        return self._commands.apply(command)

    def pause(self, reason: str) -> None:
        """Pause the mission now; the robot stops, also on its way to the operator's goal."""
        self._commands.stand(reason)

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
        if self.mission.send(_ENDINGS[state], reason):
            return
        if self.parts.tree.outcome == "running":  # a tree that has ended keeps its statuses
            self.parts.tree.halt()
        self._commands.detours.cancel()
        self.parts.navigator.stop_ended(self.parts.body.time)  # it is not stepped any more
        self.parts.telemetry.emit(
            "mission_ended", f"{state}: {reason}" if reason else str(state), source="mission",
            level="info" if state is MissionState.SUCCESS else "warning",
            state=str(state), reason=reason,
        )  # fmt: skip

    @property
    def is_standing(self) -> bool:
        """Whether base and arm stand, by odometry and joints."""
        perceived = self.perceived
        return perceived.motion.twist.stands and self.parts.limbs.is_standing(perceived)

    def counters(self) -> dict[str, float]:
        """Counters by name, for displays and the report."""
        own = {
            "distance": self.distance,
            "recoveries": float(self.parts.tree.recoveries),
            "replans": float(self.parts.navigator.replans),
        }
        return own if self.parts.scorer is None else {**own, **self.parts.scorer.counters()}

    def layers(self) -> dict[str, Layer]:
        """Map, costmaps and scene by name."""
        parts = self.parts
        return {
            "map": parts.perceiver.map_layer,
            **{name: _shown(name, it) for name, it in parts.perceiver.world_model.costmaps.items()},
            "parameters": self._parameters,
            **self._arm.layers(parts.perceiver.estimator.estimate.map_from_odom),
            **(parts.scorer.layers() if parts.scorer is not None else {}),
        }

    def snapshot(self) -> Snapshot:
        """Compose the snapshot of the current step. Its arrays are shared; do not modify them."""
        parts = self.parts
        state, estimate, body = self.perceived, parts.perceiver.estimator.estimate, parts.body
        figures = self._figures.at(body.time)
        return Snapshot(
            time=body.time,
            step=self.steps,
            state=self.state,
            reason=self.reason,
            tree=parts.tree.rows(),
            pose=estimate.pose,
            covariance=estimate.covariance,
            health=estimate.health,
            health_thresholds=estimate.thresholds,
            rivals=estimate.rivals,
            battery=state.battery,
            odometry=state.motion.pose,
            particles=_thinned(parts.perceiver.estimator.particles, SHOWN_PARTICLES),
            scan=parts.robot.perception.scan,
            path=parts.navigator.path,
            local_plan=parts.navigator.local_plan,
            goal=parts.navigator.goal,
            layers=self.layers(),
            commanded=self.command.twist,
            measured=state.motion.twist,
            stages=figures.stages,
            speed=self.pace.factor,
            pace=body.pace if isinstance(body, SimulatedWorld) else 1.0,
            parameters=parts.live_parameters.current(),
            image=self.sensing.image,
            detections=parts.robot.perception.seen_objects,
            mask=parts.robot.perception.colour_mask,
            depth_image=self.sensing.depth_image,
            depth_points=_depth_points(parts, state.depth),
            cameras=parts.perceiver.cameras.states,
            sensors=figures.sensors,
            memory=figures.memory,
            fast_loop=figures.fast_loop,
            arm=self._arm.view(state),
            truth=parts.scorer.truth if parts.scorer else None,
            people=parts.scorer.people if parts.scorer else None,
            tracks=state.at(estimate).world.tracks,
            blackboard=parts.tree.blackboard(),
            counters=self.counters(),
            teleop=parts.navigator.teleoperation is not None,
            detour=self._commands.is_on_detour,
            detour_held=self._commands.holds_detour,
            limitations=self.limitations,
            events=parts.telemetry.recent(SHOWN_EVENTS),
            debugging=parts.debugger.view() if parts.debugger else Debugging(),
            localisation_fault=parts.perceiver.estimator.fault,
            records_lost="; ".join(record.text for record in parts.telemetry.lost),
        )

    @property
    def limitations(self) -> tuple[Limitation, ...]:
        """Why navigation, safety stage, doubt about the pose, and the arm limit the motion now."""
        navigator = self.parts.navigator
        waits = navigator.limitation if self._navigates else None
        every = (self.command.limitation, navigator.doubt, waits, self.parts.limbs.limitation)
        by_cause = {one.cause: one for one in reversed(every) if one is not None}
        return tuple(one for one in every if one is not None and by_cause[one.cause] is one)

    def _holding(self) -> list[Limitation]:
        """The limitations that have an effect: a lost robot may turn to find itself, or rest."""
        waits = self._navigates and self.parts.navigator.is_busy
        stands = waits and self.command.twist == STANDSTILL
        return [one for one in self.limitations if one.cause != LOST or stands]

    def _state_changed(self, before: MissionState, after: MissionState) -> None:
        """Pause and resume the tree and its motion; their time limits do not count meanwhile."""
        now = self.parts.body.time
        if after in HELD and before not in HELD:
            self.parts.tree.pause(now)
            self.parts.navigator.pause(now)
            self.parts.limbs.pause(now)
        elif before in HELD and after not in HELD:
            self.parts.navigator.resume(now)
            self.parts.limbs.resume(now)
            self.parts.tree.resume(now)

    def _freeze(self) -> bool:
        """Freeze a simulation while the robot is held and stands; return whether time stands."""
        idle = self.mission.is_held and self.is_standing and not self._commands.is_on_detour
        return self._world is not None and self._world.freeze(idle)

    def _serve_operator(self) -> None:
        """Apply commands and publish, without a step; time stands still."""
        self._idle()
        self._install_next_tree()
        self._commands.apply_all(held=True)
        perceiver = self.parts.perceiver
        self.parts.now.see(perceiver.at(self.perceived, perceiver.estimator.estimate))
        self.parts.telemetry.publish(self.snapshot)

    @property
    def _navigates(self) -> bool:
        return self.mission.ticks or self._commands.is_on_detour

    def _guard(self, perceived: Perceived) -> None:
        """Let the failsafes react; what a recording contains is no reason to."""
        parts = self.parts
        if isinstance(parts.body, Replay) or self.state.is_over:
            return
        late = self.stages.late_share(self._watched_steps) if parts.body.is_real_time else 0.0
        given = FailsafeInput(
            perceived, self.sensing.health, self.sensing.silence,
            parts.telemetry.operator_silence(), late,
        )  # fmt: skip
        for reaction in parts.failsafes.update(given):
            self._commands.react(reaction.action, reaction.reason)

    def _score(self, last: Odometry, motion: Odometry, estimate: PoseEstimate) -> None:
        """Count the distance, and compare the estimate with the truth, if it is known."""
        self.distance += last.pose.distance_to(motion.pose)
        scorer = self.parts.scorer
        if scorer is not None:
            scorer.score(estimate)
            for kind, text, fields in scorer.take_events():
                self.parts.telemetry.emit(kind, text, source="simulation", **fields)

    def _tick_tree(self) -> None:
        """Tick the mission; a halted tree is replaced once the robot stands."""
        self._install_next_tree()
        if self._commands.is_on_detour:
            self._commands.detours.tick()
        if self._next_tree is not None or not self.mission.ticks:
            return
        if not self._commands.debugging.may_tick():
            return
        self.parts.tree.tick()
        if self.state is MissionState.STARTING:
            self.mission.send(MissionEvent.FIRST_TICK)
        if self.parts.tree.outcome == "success":
            self.end(MissionState.SUCCESS, "")
        elif self.parts.tree.outcome == "failure":
            self.end(MissionState.FAILURE, self.parts.tree.reason)
        self._commands.debugging.after_tick()

    def _navigate(self, perceived: Perceived) -> WantedTwist:
        """Return the velocity of the current task; standstill while the robot is held."""
        if not self._navigates:
            return WantedTwist(STANDSTILL)
        self.parts.limbs.reserve(self.parts.tree.claims if self.mission.ticks else ())
        wanted = self.parts.navigator.step(perceived)
        return wanted if self.parts.perceiver.odometry.is_ready else WantedTwist(STANDSTILL)

    def _slept(self) -> float:
        """Wall seconds that the body has slept; these are not compute time."""
        return self.parts.body.slept

    def _install_next_tree(self) -> None:
        if self._next_tree is not None and self.is_standing and not self.state.is_over:
            self.parts.tree, self._next_tree = self._next_tree(), None
            if self.mission.is_held:
                self.parts.tree.pause(self.parts.body.time)

    def _log_pose(self) -> None:
        """Log the exact pose once per second of robot time; the log is hashed."""
        if self._poses.take(self.steps):
            estimate = self.parts.perceiver.estimator.estimate
            pose = estimate.pose
            self.parts.telemetry.emit(
                "pose", f"at ({pose.x:.2f}, {pose.y:.2f})", source="localisation",
                x=pose.x, y=pose.y, heading=pose.heading,
                health=estimate.health, charge=self.perceived.battery.charge,
            )  # fmt: skip


_ENDINGS = {
    MissionState.SUCCESS: MissionEvent.SUCCEED,
    MissionState.FAILURE: MissionEvent.FAIL,
    MissionState.ABORTED: MissionEvent.ABORT,
    MissionState.INTERRUPTED: MissionEvent.INTERRUPT,
    MissionState.ERROR: MissionEvent.ERROR,
}


def _shown(name: str, costmap: Costmap) -> Layer:
    """Return the layer of a costmap; the local one moves, so that all of it changes."""
    if name == LOCAL:
        return Layer(costmap.version, costmap.grid)
    return Layer(costmap.version, costmap.shown, costmap.changes)


def _thinned(rows: FloatArray, most: int) -> FloatArray:
    step = max(1, -(-len(rows) // most))
    return np.asarray(rows[::step], dtype=np.float32)


def _depth_points(parts: LoopParts, depth: DepthPoints) -> FloatArray | None:
    """Return the obstacles of the depth cameras in the map frame; None while none is used."""
    if not parts.perceiver.depth.is_on:
        return None
    points = _thinned(depth.spatial, SHOWN_DEPTH_POINTS)
    points[:, :2] = parts.perceiver.estimator.estimate.map_from_odom.transform(points[:, :2])
    return points

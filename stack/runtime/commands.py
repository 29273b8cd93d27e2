"""Applies the commands of operators between two steps of the loop."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from stack.body import BodyCommand, Engageable, Replay, SimulatedWorld
from stack.errors import InputError, ParameterError
from stack.navigation.teleoperation import Teleoperation
from stack.runtime.command_schema import (
    AbortArguments,
    BehaviourArguments,
    EmergencyStopArguments,
    GoalArguments,
    ParameterArguments,
    PoseArguments,
    SpeedArguments,
    loggable,
    read_arguments,
)
from stack.runtime.debug_commands import DebugCommands
from stack.runtime.detours import Detours
from stack.runtime.disturbance_commands import disturbance_actions
from stack.runtime.failsafe_parameters import ABORT, HOME, STOP
from stack.runtime.interfaces import LoopParts
from stack.runtime.mission_state import MissionEvent, MissionStateMachine
from stack.telemetry.records import Ack, Command, MissionState
from stack.types import STANDSTILL, OccupancyGrid, Pose2D

End = Callable[[MissionState, str], None]
"""end(state, reason): end the mission with a final state."""


class CommandHandler:
    """Applies commands; acknowledges each and logs it with the step in which it took effect."""

    def __init__(self, parts: LoopParts, mission: MissionStateMachine, end: End) -> None:
        self._parts, self._mission, self._end = parts, mission, end
        self.detours = Detours(parts.telemetry.emit)
        self._home = parts.now.perceived.estimate.pose
        self.debugging = DebugCommands(parts, mission, self._resume_mission)
        self._actions: dict[str, Callable[[Any], str | None]] = {
            "pause": lambda _: self._pause(),
            "resume": lambda _: self._resume(),
            "estop": self._emergency_stop,
            "release": lambda _: self._send(MissionEvent.RELEASE),
            "abort": self._abort,
            "speed": self._speed,
            "set_pose": self._set_pose,
            "set_goal": self._set_goal,
            "cancel_goal": lambda _: self._cancel_goal(),
            "behaviour": self._behaviour,
            "set_parameter": self._set_parameter,
            "teleop": lambda arguments: self._teleoperation().steer(arguments.twist),
            "teleop_done": lambda _: self._teleoperation().release(),
            **disturbance_actions(parts.body),
            **self.debugging.actions,
        }

    @property
    def is_on_detour(self) -> bool:
        """Whether the mission is paused and the robot does what the operator asked for."""
        return self._has_detour and not self.detours.is_held

    @property
    def holds_detour(self) -> bool:
        """Whether what the operator asked for is paused too."""
        return self._has_detour and self.detours.is_held

    @property
    def _has_detour(self) -> bool:
        return self._mission.state is MissionState.PAUSED and self.detours.is_running

    def apply_all(self, held: bool = False) -> None:
        """Apply the commands since the last step, in order.

        Args:
            held: the robot stands and no step is made. Logged, because only step and `held`
                together define when a command took effect.
        """
        self.detours.report()
        for command in self._parts.telemetry.commands():
            self.apply(command, held)

    def apply(self, command: Command, held: bool = False) -> Ack:
        """Apply one command, acknowledge it and log it."""
        refusal, effect = self._execute(command)
        ack = Ack(command.id, not refusal, refusal or effect)
        self._parts.telemetry.acknowledge(ack)
        if command.kind == "speed" and not refusal:
            return ack  # does not affect the run, so it is not in the hashed log
        kind = "teleop" if command.kind == "teleop" and not refusal else "command"
        name = loggable(command.kind)
        self._parts.telemetry.emit(
            kind, f"{name}: {refusal or effect or 'done'}", source="command",
            level="warning" if refusal or command.kind == "estop" else "info",
            command=name, arguments=loggable(command.arguments), refused=refusal, held=held,
        )  # fmt: skip
        return ack

    def _execute(self, command: Command) -> tuple[str, str]:
        """Execute a command; return why it was refused, and a description of its effect.

        Both are empty if it was done and needs no description.
        """
        try:
            arguments = read_arguments(command.kind, command.arguments)
            if self._mission.state.is_over and command.kind not in ("estop", "release"):
                raise InputError(f"the mission is over ({self._mission.state})")
            return "", self._actions[command.kind](arguments) or ""
        except ParameterError as error:
            return f"{error}; {error.hint}" if error.hint else str(error), ""
        except (InputError, TypeError, ValueError) as error:
            return str(error), ""

    def react(self, action: str, reason: str) -> None:
        """Do what a failsafe wants: pause | stop | home | abort."""
        if action == ABORT:
            self._end(MissionState.ABORTED, reason)
        elif action == STOP:
            self._emergency_stop(EmergencyStopArguments(reason))
        elif action == HOME and self._drives:
            self._go_home(reason)
        else:
            self.stand(reason)

    def _go_home(self, reason: str) -> None:
        """Drive to where the mission began; stand if the mission cannot be paused for that."""
        if self._mission.send(MissionEvent.DETOUR, reason):
            self.stand(reason)
            return
        self.detours.cancel()
        task = self._parts.navigator.navigate_to(self._home)
        self.detours.begin("navigate_to_pose", HOME, task)

    def stand(self, reason: str) -> None:
        """Pause without a command; a detour ends too."""
        self._mission.send(MissionEvent.PAUSE, reason)
        self.detours.cancel()
        self.debugging.forget_steps()

    def _send(self, event: MissionEvent, reason: str = "") -> None:
        """Send an event to the mission; raise InputError if it is refused."""
        refusal = self._mission.send(event, reason)
        if refusal:
            raise InputError(refusal)

    def _pause(self) -> str:
        """Pause the mission, or the operator's detour, which keeps its goal."""
        held = self._has_detour
        self._send(MissionEvent.PAUSE, "on the way to your goal" if held else "")
        self.debugging.forget_steps()
        if held:
            self._hold_detour(True)
        return "the drive to the operator's goal pauses" if held else ""

    def _resume(self) -> str:
        """Continue the operator's detour if that is paused, else the mission."""
        if self.holds_detour:
            self._engage()
            self._send(MissionEvent.DETOUR)
            self._hold_detour(False)
            return "the drive to the operator's goal continues"
        self._resume_mission()
        return ""

    def _resume_mission(self) -> None:
        if not self._mission.refusal(MissionEvent.RESUME):
            self._engage()
            self.detours.cancel()  # first: its end must not stop the mission's own motion
        self._send(MissionEvent.RESUME)
        self.debugging.forget_steps()

    def _engage(self) -> None:
        """Ask for control of a body that somebody has taken over; raise InputError if it cannot."""
        body = self._parts.body
        refusal = body.engage() if isinstance(body, Engageable) else ""
        if refusal:
            raise InputError(f"the robot cannot be moved: {refusal}")

    def _hold_detour(self, held: bool) -> None:
        now = self._parts.body.time
        self._parts.navigator.hold_detour(now, held=held)
        self.detours.hold(now, held=held)

    def _cancel_goal(self) -> str:
        """End the drive to the operator's goal; the mission stays paused."""
        if not self._has_detour:
            raise InputError("the robot is not on the way to a goal of yours")
        self.detours.cancel()
        self._send(MissionEvent.PAUSE, "your goal was cancelled")
        return "the operator's goal is cancelled; the mission stays paused"

    def _emergency_stop(self, arguments: EmergencyStopArguments) -> None:
        self._parts.body.command(
            BodyCommand(STANDSTILL, emergency_stop=True)  # at once, not with the next step
        )
        self._send(MissionEvent.EMERGENCY_STOP, arguments.reason)
        self._parts.limbs.emergency_stop()
        self.detours.cancel()

    def _abort(self, arguments: AbortArguments) -> None:
        self._end(MissionState.ABORTED, arguments.reason)

    def _speed(self, arguments: SpeedArguments) -> None:
        body = self._parts.body
        if not isinstance(body, SimulatedWorld):
            raise InputError("cannot change the speed: this robot runs in real time")
        body.pace = arguments.factor

    def _set_pose(self, arguments: PoseArguments) -> None:
        self._parts.robot.localisation.set_pose(
            self._on_map(arguments.pose),
            position_deviation=0.3,
            heading_deviation=0.3,
            source="operator",
        )

    def _set_goal(self, arguments: GoalArguments) -> None:
        """Pause the mission and drive to a pose; `resume` continues the mission's own motion."""
        self._refuse_motion()
        goal = self._on_map(arguments.pose)
        self._engage()
        self._send(MissionEvent.DETOUR)
        self.detours.cancel()
        task = self._parts.navigator.navigate_to(goal)
        self.detours.begin("navigate_to_pose", arguments.tag, task)

    def _behaviour(self, arguments: BehaviourArguments) -> None:
        """Pause the mission and carry out a behaviour; `resume` continues the mission."""
        make = self._parts.make_detour
        if make is None:
            raise InputError("this run has no behaviours")
        ports = dict(port.split("=", 1) for port in arguments.ports)
        tree = make(arguments.name, {name.strip(): value for name, value in ports.items()})
        self._engage()
        self._send(MissionEvent.DETOUR)
        self.detours.begin(arguments.name, arguments.tag, tree)

    def _on_map(self, pose: Pose2D) -> Pose2D:
        """The pose; a mission without a map accepts any.

        Raises:
            InputError: it is outside the map.
        """
        perceiver = self._parts.perceiver
        grid = perceiver.map_layer.content
        if not perceiver.is_mapped or not isinstance(grid, OccupancyGrid):
            return pose
        if grid.contains(*grid.cell_at(pose.x, pose.y)):
            return pose
        (rows, columns), (x, y) = grid.cells.shape, grid.origin
        raise InputError(
            f"({pose.x:g}, {pose.y:g}) is outside the map, which covers x {x:g} to "
            f"{x + columns * grid.resolution:g} m and y {y:g} to {y + rows * grid.resolution:g} m"
        )

    @property
    def _drives(self) -> bool:
        return self._parts.body.description.drivetrain.moves

    def _refuse_motion(self) -> None:
        """Raise InputError if the robot has no wheels, or plays recorded sensors."""
        if not self._drives:
            raise InputError(f"{self._parts.body.description.name} has no wheels")
        if isinstance(self._parts.body, Replay):
            raise InputError("this run plays recorded sensors: no command moves the robot")

    def _teleoperation(self) -> Teleoperation:
        """The running assisted_teleop; raise InputError without one."""
        self._refuse_motion()
        if self._mission.state is not MissionState.RUNNING and not self.is_on_detour:
            raise InputError(f"the mission is {self._mission.state}")
        running = self._parts.navigator.teleoperation
        if running is None:
            raise InputError(
                "the mission drives: velocities are accepted only while assisted_teleop is running"
            )
        return running

    def _set_parameter(self, arguments: ParameterArguments) -> None:
        self._parts.live_parameters.change(arguments.name, arguments.value)

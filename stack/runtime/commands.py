"""Applies the commands of operators between two steps of the loop."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from stack.body import BodyCommand, Replay, SimulatedWorld
from stack.errors import InputError, ParameterError
from stack.navigation.teleoperation import Teleoperation
from stack.robot import Task
from stack.runtime.command_schema import (
    AbortArguments,
    EmergencyStopArguments,
    ParameterArguments,
    PoseArguments,
    SpeedArguments,
    loggable,
    read_arguments,
)
from stack.runtime.debug_commands import DebugCommands
from stack.runtime.disturbance_commands import disturbance_actions
from stack.runtime.interfaces import LoopParts
from stack.runtime.mission_state import MissionEvent, MissionStateMachine
from stack.telemetry.records import Ack, Command, MissionState
from stack.types import STANDSTILL, OccupancyGrid, Pose2D, TaskStatus

End = Callable[[MissionState, str], None]
"""end(state, reason): end the mission with a final state."""


class CommandHandler:
    """Applies commands; acknowledges each and logs it with the step in which it took effect."""

    def __init__(self, parts: LoopParts, mission: MissionStateMachine, end: End) -> None:
        self._parts, self._mission, self._end = parts, mission, end
        self._detour: Task | None = None
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
            "set_parameter": self._set_parameter,
            "teleop": lambda arguments: self._teleoperation().steer(arguments.twist),
            "teleop_done": lambda _: self._teleoperation().release(),
            **disturbance_actions(parts.body),
            **self.debugging.actions,
        }

    @property
    def drives_to_operator_goal(self) -> bool:
        """Whether the mission is paused and the robot drives to the operator's goal."""
        return self._has_detour and not self._parts.navigator.activities.detour_held

    @property
    def holds_operator_goal(self) -> bool:
        """Whether the drive to the operator's goal is paused too."""
        return self._has_detour and self._parts.navigator.activities.detour_held

    @property
    def _has_detour(self) -> bool:
        return (
            self._mission.state is MissionState.PAUSED
            and self._detour is not None
            and self._detour.status is TaskStatus.RUNNING
        )

    def apply_all(self, held: bool = False) -> None:
        """Apply the commands since the last step, in order.

        Args:
            held: the robot stands and no step is made. Logged, because only step and `held`
                together define when a command took effect.
        """
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
        except (InputError, ParameterError, TypeError, ValueError) as error:
            return str(error), ""

    def stand(self, reason: str) -> None:
        """Pause without a command; a drive to the operator's goal ends too."""
        self._mission.send(MissionEvent.PAUSE, reason)
        self._cancel_detour()
        self.debugging.forget_steps()

    def _send(self, event: MissionEvent, reason: str = "") -> None:
        """Send an event to the mission; raise InputError if it is refused."""
        refusal = self._mission.send(event, reason)
        if refusal:
            raise InputError(refusal)

    def _pause(self) -> str:
        """Pause the mission, or the drive to the operator's goal, which keeps its goal."""
        held = self._has_detour
        self._send(MissionEvent.PAUSE, "on the way to your goal" if held else "")
        self.debugging.forget_steps()
        if held:
            self._hold_detour(True)
        return "the drive to the operator's goal pauses" if held else ""

    def _resume(self) -> str:
        """Continue the drive to the operator's goal if that is paused, else the mission."""
        if self.holds_operator_goal:
            self._send(MissionEvent.DETOUR)
            self._hold_detour(False)
            return "the drive to the operator's goal continues"
        self._resume_mission()
        return ""

    def _resume_mission(self) -> None:
        self._send(MissionEvent.RESUME)
        self._detour = None
        self.debugging.forget_steps()

    def _hold_detour(self, held: bool) -> None:
        self._parts.navigator.hold_detour(self._parts.body.time, held=held)

    def _cancel_goal(self) -> str:
        """End the drive to the operator's goal; the mission stays paused."""
        if not self._has_detour:
            raise InputError("the robot is not on the way to a goal of yours")
        self._cancel_detour()
        self._send(MissionEvent.PAUSE, "your goal was cancelled")
        return "the operator's goal is cancelled; the mission stays paused"

    def _emergency_stop(self, arguments: EmergencyStopArguments) -> None:
        self._parts.body.command(BodyCommand(STANDSTILL))  # at once, not with the next step
        self._send(MissionEvent.EMERGENCY_STOP, arguments.reason)
        self._cancel_detour()

    def _cancel_detour(self) -> None:
        """Cancel the drive to the operator's goal; `resume` continues the mission's own motion."""
        if self._detour is not None:
            self._detour.cancel()

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

    def _set_goal(self, arguments: PoseArguments) -> None:
        """Pause the mission and drive to a pose; `resume` continues the mission's own motion."""
        self._refuse_motion_of_recording()
        goal = self._on_map(arguments.pose)
        self._send(MissionEvent.DETOUR)
        self._detour = self._parts.navigator.base.navigate_to(goal)

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

    def _refuse_motion_of_recording(self) -> None:
        """Raise InputError if the robot plays recorded sensors."""
        if isinstance(self._parts.body, Replay):
            raise InputError("this run plays recorded sensors: no command moves the robot")

    def _teleoperation(self) -> Teleoperation:
        """The running assisted_teleop; raise InputError without one."""
        self._refuse_motion_of_recording()
        if self._mission.state is not MissionState.RUNNING:
            raise InputError(f"the mission is {self._mission.state}")
        running = self._parts.navigator.base.teleoperation
        if running is None:
            raise InputError(
                "the mission drives: velocities are accepted only while assisted_teleop is running"
            )
        return running

    def _set_parameter(self, arguments: ParameterArguments) -> None:
        self._parts.tuning.change(arguments.name, arguments.value)

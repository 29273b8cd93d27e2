"""Applies the commands of operators between two steps of the loop."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import isfinite
from typing import Any, Protocol

from stack.errors import InputError, ParameterError
from stack.navigation.teleoperation import Teleoperation
from stack.robot import Task
from stack.runtime.debug_commands import DebugCommands
from stack.runtime.interfaces import Parts
from stack.telemetry.records import Ack, Command, MissionState
from stack.types import Pose2D, TaskStatus, Twist

Arguments = Mapping[str, Any]


class LoopControl(Protocol):
    """The state of the mission, which commands change."""

    state: MissionState
    reason: str
    steps: int

    def end(self, state: MissionState, reason: str) -> None:
        """End the mission."""
        ...


class CommandHandler:
    """Applies commands; acknowledges each and logs it with the step in which it took effect."""

    def __init__(self, parts: Parts, control: LoopControl) -> None:
        self._parts, self._control = parts, control
        self._resume_to = MissionState.RUNNING
        self._detour: Task | None = None
        self.debugging = DebugCommands(parts, control, lambda: self._resume({}))
        self._actions: dict[str, Callable[[Arguments], str | None]] = {
            "pause": self._pause,
            "resume": self._resume,
            "estop": self._emergency_stop,
            "release": self._release,
            "abort": self._abort,
            "speed": self._speed,
            "set_pose": self._set_pose,
            "set_goal": self._set_goal,
            "set_parameter": self._set_parameter,
            "teleop": self._teleop,
            "teleop_done": self._teleop_done,
        }

    @property
    def drives_to_operator_goal(self) -> bool:
        """Whether the mission is paused and the robot drives to the operator's goal."""
        return (
            self._control.state is MissionState.PAUSED
            and self._detour is not None
            and self._detour.status is TaskStatus.RUNNING
        )

    def apply_commands(self, held: bool = False) -> None:
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
        self._parts.telemetry.emit(
            kind, f"{command.kind}: {refusal or effect or 'done'}", source="command",
            level="warning" if refusal or command.kind == "estop" else "info",
            command=command.kind, arguments=dict(command.arguments), refused=refusal, held=held,
        )  # fmt: skip
        return ack

    def _execute(self, command: Command) -> tuple[str, str]:
        """Execute a command; return why it was refused, and a description of its effect.

        Both are empty if it was done and needs no description.
        """
        action, debugging = self._actions.get(command.kind), self.debugging.actions
        if action is None and command.kind not in debugging:
            known = ", ".join([*self._actions, *debugging])
            return f"there is no command {command.kind!r}; available: {known}", ""
        if self._control.state.is_over:
            return f"the mission is over ({self._control.state})", ""
        try:
            if action is not None:
                return action(command.arguments) or "", ""
            return "", debugging[command.kind](command.arguments)
        except KeyError as error:
            return f"{command.kind} needs the argument {error}", ""
        except (InputError, ParameterError, TypeError, ValueError) as error:
            return str(error), ""

    def _pause(self, _: Arguments) -> str | None:
        if self._control.state is MissionState.EMERGENCY_STOP:
            return "the emergency stop is engaged; release it first"
        self._hold()
        self.debugging.forget_steps()
        self._control.state, self._control.reason = MissionState.PAUSED, ""
        return None

    def _resume(self, _: Arguments) -> str | None:
        if self._control.state is not MissionState.PAUSED:
            return f"cannot resume: the mission is {self._control.state}"
        self._parts.navigator.resume(self._parts.body.time)
        self._detour = None
        self.debugging.forget_steps()
        self._control.state, self._control.reason = MissionState.RUNNING, ""
        return None

    def _emergency_stop(self, arguments: Arguments) -> None:
        if self._control.state is not MissionState.EMERGENCY_STOP:
            self._resume_to = self._control.state
        self._hold()
        self._parts.safety.engage(str(arguments.get("reason", "operator")))
        self._control.state = MissionState.EMERGENCY_STOP

    def _release(self, _: Arguments) -> str | None:
        if self._control.state is not MissionState.EMERGENCY_STOP:
            return "the emergency stop is not engaged"
        self._parts.safety.release()
        self._control.state = self._resume_to
        if self._resume_to is not MissionState.PAUSED:
            self._parts.navigator.resume(self._parts.body.time)
        return None

    def _hold(self) -> None:
        """Hold the mission's motion, and cancel a detour."""
        if self._detour is not None:
            self._detour.cancel()
        self._parts.navigator.pause(self._parts.body.time)

    def _abort(self, arguments: Arguments) -> None:
        self._control.end(MissionState.ABORTED, str(arguments.get("reason", "by the operator")))

    def _speed(self, arguments: Arguments) -> str | None:
        if not hasattr(self._parts.body, "pace"):
            return "cannot change the speed: this robot runs in real time"
        factor = float(arguments["factor"])
        if not 0.0 <= factor <= 1000.0:
            return f"speed {factor:g} is not between 0 (as fast as possible) and 1000"
        self._parts.body.pace = factor
        return None

    def _set_pose(self, arguments: Arguments) -> None:
        self._parts.facade.set_pose(
            _pose(arguments), position_deviation=0.3, heading_deviation=0.3, source="operator"
        )

    def _set_goal(self, arguments: Arguments) -> str | None:
        """Pause the mission and drive to a pose; `resume` continues the mission's own motion."""
        if self._control.state not in (MissionState.RUNNING, MissionState.PAUSED):
            return f"the mission is {self._control.state}"
        goal = _pose(arguments)
        self._control.state = MissionState.PAUSED
        self._parts.navigator.pause(self._parts.body.time)
        self._detour = self._parts.facade.navigate_to(goal)
        return None

    def _teleop(self, arguments: Arguments) -> str | None:
        """Drive a velocity for half a second; refused unless assisted_teleop is running."""
        teleoperation = self._teleoperation
        if teleoperation is None:
            return self._teleoperation_refusal
        teleoperation.steer(_twist(arguments))
        return None

    def _teleop_done(self, _: Arguments) -> str | None:
        teleoperation = self._teleoperation
        if teleoperation is None:
            return self._teleoperation_refusal
        teleoperation.release()
        return None

    @property
    def _teleoperation(self) -> Teleoperation | None:
        running = self._control.state is MissionState.RUNNING
        return self._parts.navigator.teleoperation if running else None

    @property
    def _teleoperation_refusal(self) -> str:
        if self._control.state is not MissionState.RUNNING:
            return f"the mission is {self._control.state}"
        return "the mission drives: velocities are accepted only while assisted_teleop is running"

    def _set_parameter(self, arguments: Arguments) -> None:
        self._parts.facade.set_parameter(str(arguments["name"]), arguments["value"])


def _pose(arguments: Arguments) -> Pose2D:
    x, y, heading = (float(arguments[key]) for key in ("x", "y", "heading"))
    if not all(map(isfinite, (x, y, heading))):
        raise ValueError(f"({x}, {y}, {heading}) is not a pose: all values must be finite")
    return Pose2D(x, y, heading)


def _twist(arguments: Arguments) -> Twist:
    names = ("linear", "angular", "lateral")
    linear, angular, lateral = (float(arguments.get(name, 0.0)) for name in names)
    if not all(map(isfinite, (linear, angular, lateral))):
        raise ValueError(
            f"({linear}, {angular}, {lateral}) is not a velocity: all values must be finite"
        )
    return Twist(linear, angular, lateral)

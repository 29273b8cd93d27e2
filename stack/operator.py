"""Carries out what operators command, between two steps of the loop."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import isfinite
from typing import Any, Protocol

from stack.errors import InputError, ParameterError
from stack.loop_parts import Parts
from stack.navigation.tasks import Activity
from stack.navigation.teleoperation import Teleoperation
from stack.robot import Task
from stack.telemetry.records import Ack, Command, MissionState
from stack.types import Pose2D, TaskStatus, Twist

Arguments = Mapping[str, Any]


class Conduct(Protocol):
    """The course of the mission, which commands change."""

    state: MissionState
    steps: int

    def end(self, state: MissionState, reason: str) -> None:
        """Bring the mission to an end."""
        ...


@dataclass(frozen=True)
class Detour:
    """A drive that the operator ordered, and the mission's own that waits meanwhile."""

    task: Task
    set_aside: Activity | None


class Operator:
    """Applies commands; each is acknowledged, and logged with the step in which it took effect."""

    def __init__(self, parts: Parts, conduct: Conduct) -> None:
        self._parts, self._conduct = parts, conduct
        self._resume_to = MissionState.RUNNING
        self._detour: Detour | None = None
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
    def on_detour(self) -> bool:
        """Whether the robot drives where the operator sent it while the mission is paused."""
        return (
            self._conduct.state is MissionState.PAUSED
            and self._detour is not None
            and self._detour.task.status is TaskStatus.RUNNING
        )

    def apply_commands(self) -> None:
        """Carry out everything that came in since the last step, in order."""
        for command in self._parts.telemetry.commands():
            refusal = self._carry_out(command)
            self._parts.telemetry.acknowledge(Ack(command.id, not refusal, refusal))
            if command.kind == "speed" and not refusal:
                continue  # changes nothing in the run, so it stays out of the hashed log
            kind = "teleop" if command.kind == "teleop" and not refusal else "command"
            self._parts.telemetry.emit(
                kind, f"{command.kind}: {refusal or 'done'}", source="command",
                level="warning" if refusal or command.kind == "estop" else "info",
                command=command.kind, arguments=dict(command.arguments), refused=refusal,
            )  # fmt: skip

    def _carry_out(self, command: Command) -> str:
        """Why a command is refused; empty when it is done."""
        action = self._actions.get(command.kind)
        if action is None:
            return f"there is no command {command.kind!r}; there are {', '.join(self._actions)}"
        if self._conduct.state.is_over:
            return f"the mission is over ({self._conduct.state})"
        try:
            return action(command.arguments) or ""
        except KeyError as error:
            return f"{command.kind} needs the argument {error}"
        except (InputError, ParameterError, TypeError, ValueError) as error:
            return str(error)

    def _pause(self, _: Arguments) -> str | None:
        if self._conduct.state is MissionState.EMERGENCY_STOP:
            return "the emergency stop is engaged; release it first"
        if self._detour is not None:
            self._detour.task.cancel()
        self._conduct.state = MissionState.PAUSED
        return None

    def _resume(self, _: Arguments) -> str | None:
        if self._conduct.state is not MissionState.PAUSED:
            return f"nothing to resume: the mission is {self._conduct.state}"
        if self._detour is not None:
            self._parts.navigation.take_up(self._detour.set_aside)
            self._detour = None
        self._conduct.state = MissionState.RUNNING
        return None

    def _emergency_stop(self, arguments: Arguments) -> None:
        if self._conduct.state is not MissionState.EMERGENCY_STOP:
            self._resume_to = self._conduct.state
        self._parts.safety.engage(str(arguments.get("reason", "operator")))
        self._conduct.state = MissionState.EMERGENCY_STOP

    def _release(self, _: Arguments) -> str | None:
        if self._conduct.state is not MissionState.EMERGENCY_STOP:
            return "the emergency stop is not engaged"
        self._parts.safety.release()
        self._conduct.state = self._resume_to
        return None

    def _abort(self, arguments: Arguments) -> None:
        self._conduct.end(MissionState.ABORTED, str(arguments.get("reason", "by the operator")))

    def _speed(self, arguments: Arguments) -> str | None:
        if not hasattr(self._parts.body, "pace"):
            return "this robot runs in real time"
        factor = float(arguments["factor"])
        if not 0.0 <= factor <= 1000.0:
            return f"a speed of {factor:g} is not between 0 (as fast as possible) and 1000"
        self._parts.body.pace = factor
        return None

    def _set_pose(self, arguments: Arguments) -> None:
        self._parts.pilot.set_pose(
            _pose(arguments), position_deviation=0.3, heading_deviation=0.3, source="operator"
        )

    def _set_goal(self, arguments: Arguments) -> str | None:
        """Pause the mission and drive somewhere; `resume` takes its own drive up again."""
        if self._conduct.state not in (MissionState.RUNNING, MissionState.PAUSED):
            return f"the mission is {self._conduct.state}"
        goal = _pose(arguments)
        navigation = self._parts.navigation
        aside = self._detour.set_aside if self._detour else navigation.set_aside()
        self._conduct.state = MissionState.PAUSED
        self._detour = Detour(self._parts.pilot.navigate_to(goal), aside)
        return None

    def _teleop(self, arguments: Arguments) -> str | None:
        """A velocity to drive for half a second; only a behaviour asks for it."""
        teleoperation = self._teleoperation
        if teleoperation is None:
            return self._no_teleoperation
        teleoperation.steer(_twist(arguments))
        return None

    def _teleop_done(self, _: Arguments) -> str | None:
        teleoperation = self._teleoperation
        if teleoperation is None:
            return self._no_teleoperation
        teleoperation.release()
        return None

    @property
    def _teleoperation(self) -> Teleoperation | None:
        running = self._conduct.state is MissionState.RUNNING
        return self._parts.navigation.teleoperation if running else None

    @property
    def _no_teleoperation(self) -> str:
        if self._conduct.state is not MissionState.RUNNING:
            return f"the mission is {self._conduct.state}"
        return "the mission drives: no assisted_teleop is running that would take velocities"

    def _set_parameter(self, arguments: Arguments) -> None:
        self._parts.pilot.set_parameter(str(arguments["name"]), arguments["value"])


def _pose(arguments: Arguments) -> Pose2D:
    x, y, heading = (float(arguments[key]) for key in ("x", "y", "heading"))
    if not all(map(isfinite, (x, y, heading))):
        raise ValueError(f"({x}, {y}, {heading}) is not a pose")
    return Pose2D(x, y, heading)


def _twist(arguments: Arguments) -> Twist:
    names = ("linear", "angular", "lateral")
    linear, angular, lateral = (float(arguments.get(name, 0.0)) for name in names)
    if not all(map(isfinite, (linear, angular, lateral))):
        raise ValueError(f"({linear}, {angular}, {lateral}) is not a velocity")
    return Twist(linear, angular, lateral)

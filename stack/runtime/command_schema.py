"""Schemas of the operator's commands: the arguments of each kind with type, unit, range and size.

Commands come from other processes. Their arguments are checked here before anything is done with
them, so that no command, however malformed, has an effect that it does not describe or ends the
mission. An emergency stop is never refused: a malformed reason is replaced.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi
from typing import Any

from stack.body import pace_problem
from stack.errors import InputError, ParameterError
from stack.parameters import FARTHEST, REQUIRED, Declaration, declarations, parameter, suggestion
from stack.runtime.disturbance_commands import DISTURBANCES
from stack.types import Pose2D, Twist
from stack.types.printable import printable

MAX_TEXT = 300
"""Characters of a text argument."""

MAX_VALUES = 32
"""Items of a list that is the value of a parameter."""

LOGGED_NAMES, LOGGED_DEPTH = 10, 2
"""Arguments of a command in the event log, and depth of lists; valid commands are below."""

FASTEST = 100.0
"""m/s and rad/s: largest velocity; the limits of the robot are far below."""

MAX_TICKS = 1_000_000
LARGEST_NUMBER = 1e15


@dataclass(frozen=True)
class NoArguments:
    """A command without arguments."""


@dataclass(frozen=True)
class EmergencyStopArguments:
    """Arguments of `estop`."""

    reason: str = parameter("operator", help="why, shown to all operators")


@dataclass(frozen=True)
class AbortArguments:
    """Arguments of `abort`."""

    reason: str = parameter("by the operator", help="why, written to the report")


@dataclass(frozen=True)
class SpeedArguments:
    """Arguments of `speed`."""

    factor: float = parameter(REQUIRED, help="simulated seconds per wall second; 0: no limit")

    def __post_init__(self) -> None:
        problem = pace_problem(self.factor)
        if problem:
            raise ParameterError("factor", problem)


@dataclass(frozen=True)
class PoseArguments:
    """Arguments of `set_pose`: a pose in the map frame."""

    x: float = parameter(REQUIRED, "m", at_least=-FARTHEST, at_most=FARTHEST, help="x")
    y: float = parameter(REQUIRED, "m", at_least=-FARTHEST, at_most=FARTHEST, help="y")
    heading: float = parameter(
        REQUIRED, "rad", at_least=-2.0 * pi, at_most=2.0 * pi, help="heading"
    )

    @property
    def pose(self) -> Pose2D:
        """The pose."""
        return Pose2D(self.x, self.y, self.heading)


@dataclass(frozen=True)
class GoalArguments(PoseArguments):
    """Arguments of `set_goal`."""

    tag: str = parameter("", help="returned in the event `detour` when the drive has ended")


@dataclass(frozen=True)
class BehaviourArguments:
    """Arguments of `behaviour`: a behaviour that is carried out while the mission is paused."""

    name: str = parameter(REQUIRED, help="behaviour of the catalogue, such as `spin`")
    ports: Any = parameter((), help="list of NAME=VALUE, values as in a mission file")
    tag: str = parameter("", help="returned in the event `detour` when the behaviour has ended")

    def __post_init__(self) -> None:
        if type(self.ports) not in (list, tuple) or not all(
            isinstance(port, str) and "=" in port for port in self.ports
        ):
            raise ParameterError("ports", "expected a list of texts NAME=VALUE")


@dataclass(frozen=True)
class ParameterArguments:
    """Arguments of `set_parameter`."""

    name: str = parameter(REQUIRED, help="component and parameter: `controller.cruise_speed`")
    value: Any = parameter(REQUIRED, help="new value: a number, text, true or false, or a list")


@dataclass(frozen=True)
class VelocityArguments:
    """Arguments of `teleop`."""

    linear: float = parameter(0.0, "m/s", at_least=-FASTEST, at_most=FASTEST, help="forward")
    angular: float = parameter(0.0, "rad/s", at_least=-FASTEST, at_most=FASTEST, help="to the left")
    lateral: float = parameter(0.0, "m/s", at_least=-FASTEST, at_most=FASTEST, help="to the left")

    @property
    def twist(self) -> Twist:
        """The velocity."""
        return Twist(self.linear, self.angular, self.lateral)


@dataclass(frozen=True)
class StepArguments:
    """Arguments of `step`."""

    ticks: int = parameter(1, help="ticks until the next pause", at_least=1, at_most=MAX_TICKS)


@dataclass(frozen=True)
class BreakArguments:
    """Arguments of `break`."""

    node: str = parameter(REQUIRED, help="number, name, path or file:line of a node")
    generation: int | None = parameter(None, help="reload of the mission that a number is from")


@dataclass(frozen=True)
class UnbreakArguments:
    """Arguments of `unbreak`."""

    node: str = parameter("", help="as for `break`; all breakpoints if it is empty")
    generation: int | None = parameter(None, help="as for `break`")


@dataclass(frozen=True)
class ForceArguments:
    """Arguments of `force`."""

    node: str = parameter(REQUIRED, help="as for `break`")
    status: str = parameter(
        REQUIRED, one_of=("success", "failure", "off", "due"), help="outcome; `due`: of an event"
    )
    code: str = parameter("", help="failure code, such as NO_VALID_PATH")
    generation: int | None = parameter(None, help="as for `break`")


SCHEMAS: dict[str, type] = {
    "pause": NoArguments,
    "resume": NoArguments,
    "estop": EmergencyStopArguments,
    "release": NoArguments,
    "abort": AbortArguments,
    "speed": SpeedArguments,
    "set_pose": PoseArguments,
    "set_goal": GoalArguments,
    "cancel_goal": NoArguments,
    "behaviour": BehaviourArguments,
    "set_parameter": ParameterArguments,
    "teleop": VelocityArguments,
    "teleop_done": NoArguments,
    "break": BreakArguments,
    "unbreak": UnbreakArguments,
    "force": ForceArguments,
    "step": StepArguments,
    "continue": NoArguments,
    **DISTURBANCES,
}
"""Class of the arguments by kind of command."""


def read_arguments(kind: str, given: Mapping[str, Any]) -> Any:
    """The checked arguments of a command, an instance of its class in SCHEMAS.

    Raises:
        InputError: unknown kind, an unknown, missing or malformed argument; says which and what
            is expected.
    """
    schema = SCHEMAS.get(kind)
    if schema is None:
        raise InputError(f"there is no command {_shown(kind)}; available: {', '.join(SCHEMAS)}")
    try:
        return _read(schema, given)
    except ParameterError as error:
        if schema is EmergencyStopArguments:
            return EmergencyStopArguments()
        hint = f"; {error.hint}" if error.hint else ""
        name = f"{error.name}: " if error.name else ""
        raise InputError(f"{kind}: {name}{error.sentence}{hint}") from None


def loggable(value: Any, depth: int = LOGGED_DEPTH) -> Any:
    """A value of bounded size with JSON's types, for events; control characters are escaped.

    Valid arguments are unchanged, so that a logged command can be given again. Larger texts, lists
    and mappings are shortened; everything else becomes the name of its type.
    """
    if value is None or isinstance(value, bool | float):
        return value
    if isinstance(value, int):
        return value if abs(value) < 2**63 else "<huge number>"
    if isinstance(value, str):
        text = printable(value[:MAX_TEXT])
        return text if len(value) <= MAX_TEXT else f"{text}…"
    if depth > 0 and isinstance(value, Mapping):
        names = list(value)[:LOGGED_NAMES]
        items = {str(loggable(name, 0)): loggable(value[name], depth - 1) for name in names}
        return items if len(value) <= LOGGED_NAMES else {**items, "…": f"{len(value)} in all"}
    if depth > 0 and type(value) in (list, tuple):  # an extension type is a subclass
        found = [loggable(item, depth - 1) for item in value[:MAX_VALUES]]
        return found if len(value) <= MAX_VALUES else [*found, f"… {len(value)} in all"]
    return f"<{type(value).__name__}>"


def _read(schema: type, given: Mapping[str, Any]) -> Any:
    known = declarations(schema)
    for name in given:
        if name not in known:
            hint = suggestion(name[:MAX_TEXT], known) if known else "it has no arguments"
            raise ParameterError("", f"there is no argument {_shown(name)}", hint)
    for name, declared in known.items():
        if declared.required and name not in given:
            raise ParameterError("", f"needs the argument {name!r}: {declared.help}")
    return schema(**{name: _checked(known[name], value) for name, value in given.items()})


def _checked(declared: Declaration, value: Any) -> Any:
    """The value of an argument; unlike in files, a number is not written as text.

    Raises:
        ParameterError: wrong type, size or range.
    """
    try:
        _check_size(value)
    except ParameterError as error:
        raise ParameterError(declared.name, error.sentence) from None
    if declared.type is float and isinstance(value, str):
        raise ParameterError(declared.name, f"expected a number, got the text {_shown(value)}")
    return declared.read(value)


def _check_size(value: Any, depth: int = 1) -> None:
    """Raise ParameterError for what no argument can be."""
    if value is None or isinstance(value, bool):
        return
    if isinstance(value, int | float):
        if not abs(value) <= LARGEST_NUMBER:
            got = f"{value:g}" if isinstance(value, float) else "a huge number"
            raise ParameterError("", f"expected a finite number up to 1e15, got {got}")
    elif isinstance(value, str):
        if len(value) > MAX_TEXT:
            raise ParameterError("", f"{len(value)} characters; at most {MAX_TEXT} are accepted")
        if printable(value) != value or "\n" in value or "\t" in value:
            sentence = f"expected one line without control characters, got {_shown(value)}"
            raise ParameterError("", sentence)
    elif type(value) in (list, tuple) and depth > 0:  # an extension type is a subclass
        if len(value) > MAX_VALUES:
            raise ParameterError("", f"a list of {len(value)}; at most {MAX_VALUES} are accepted")
        for item in value:
            _check_size(item, depth - 1)
    else:
        raise ParameterError("", f"unexpected {type(value).__name__}")


def _shown(text: str) -> str:
    shown = printable(repr(text[:60]))
    return shown if len(text) <= 60 else f"{shown}…"

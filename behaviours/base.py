"""Base class of behaviours, with typed ports.

    class NavigateToPose(RobotBehaviour):
        '''Drive to a pose in the map frame.'''

        goal: Pose2D = port("where to go")
        tolerance: float = port("goal tolerance", unit="m", default=0.25, above=0.0)
        path_length: float = output("length of the path driven", unit="m")

A port holds a literal value, or the compiler binds it to a source that is read on every access: a
blackboard key, an argument, a loop variable. An output can be bound to a blackboard key. Set
private attributes in `initialise`, without annotations: an annotated attribute becomes a
constructor argument.
"""

from __future__ import annotations

import typing
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Any, TypeVar, dataclass_transform, overload
from weakref import WeakSet

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from behaviours.timer import Timer
from stack.errors import ParameterError
from stack.parameters import REQUIRED, Declaration, suggestion
from stack.robot import Robot, Task
from stack.types import Failure, FailureCode, Footprint, Pose2D, TaskStatus

T = TypeVar("T")

_RESERVED = frozenset(dir(Behaviour)) | {
    "name", "status", "id", "parent", "children", "robot", "logger", "feedback_message",
    "blackboards", "qualified_name", "iterator", "black_box_level", "failure", "start_timer",
    "pause", "resume",
}  # fmt: skip


class Port:
    """Data descriptor of one port: reads and writes the node's value or its binding."""

    def __init__(self, declared: Declaration, writes: bool) -> None:
        self.declared, self.writes, self.name = declared, writes, ""

    def __set_name__(self, owner: type, name: str) -> None:
        if name in _RESERVED or name.startswith("_"):
            raise TypeError(
                f"{owner.__name__}: a port may not be called {name!r}: the name is private or "
                "belongs to py_trees; choose another one"
            )
        self.name = name

    def __get__(self, node: Any, owner: type) -> Any:
        if node is None:
            return self
        read = node._readers.get(self.name)
        return node._values[self.name] if read is None else read()

    def __set__(self, node: Any, value: Any) -> None:
        node._values[self.name] = value
        write = node._writers.get(self.name)
        if write is not None:
            write(value)


@overload
def port(
    help: str, *, default: T, unit: str = "", at_least: float | None = None,
    at_most: float | None = None, above: float | None = None, one_of: tuple[str, ...] = (),
) -> T: ...  # fmt: skip
@overload
def port(
    help: str, *, unit: str = "", at_least: float | None = None,
    at_most: float | None = None, above: float | None = None, one_of: tuple[str, ...] = (),
) -> Any: ...  # fmt: skip
def port(  # noqa: PLR0913 - the vocabulary of a declaration
    help: str, *, default: Any = REQUIRED, unit: str = "", at_least: float | None = None,
    at_most: float | None = None, above: float | None = None, one_of: tuple[str, ...] = (),
) -> Any:  # fmt: skip
    """Declare an input of a behaviour; the attribute's annotation is its type."""
    declared = Declaration("", None, help, unit, default, at_least, at_most, above, one_of)
    return Port(declared, writes=False)


def output(help: str, *, unit: str = "", init: typing.Literal[False] = False) -> Any:
    """Declare an output of a behaviour; an assignment also writes the bound blackboard key."""
    return Port(Declaration("", None, help, unit, None), writes=True)


DRIVE_FAILURES = (
    FailureCode.NO_VALID_PATH, FailureCode.START_OCCUPIED, FailureCode.GOAL_OCCUPIED,
    FailureCode.START_OUTSIDE_MAP, FailureCode.GOAL_OUTSIDE_MAP, FailureCode.NO_PROGRESS,
    FailureCode.BLOCKED_BY_PERSON,
    FailureCode.COLLISION_AHEAD, FailureCode.LOST, FailureCode.AMBIGUOUS, FailureCode.TIMED_OUT,
    FailureCode.UNSUPPORTED,
)  # fmt: skip
"""Codes of the robot's motion tasks, for `fails_with`."""


@dataclass_transform(kw_only_default=True, field_specifiers=(port, output))
class RobotBehaviour(Behaviour):
    """A leaf of the tree that can command the robot.

    The constructor takes settings only. The robot is passed to `setup`, so that a mission can be
    compiled, checked and drawn without a robot.
    """

    robot: Robot
    failure: Failure | None
    claims: typing.ClassVar[tuple[str, ...]] = ()
    """Resources of the robot that it has for itself: names of `RESOURCES` in
    stack.drivetrain.needs, such as `base`. Behaviours that claim the same one cannot run at the
    same time. It needs what it claims."""
    takes_time: typing.ClassVar[bool] = False
    """Whether it never succeeds in its first tick. Not needed with `claims`."""
    is_instant: typing.ClassVar[bool] = False
    """Whether it always ends in its first tick."""
    duration_port: typing.ClassVar[str] = ""
    """Port with the time that it runs at least, seconds."""
    is_condition: typing.ClassVar[bool] = False
    """Whether it succeeds when its condition is true and only then."""
    can_succeed: typing.ClassVar[bool] = True
    """Whether it can succeed."""
    can_fail: typing.ClassVar[bool] = True
    """Whether it can fail. `check` warns about retries of a behaviour that cannot."""
    fails_with: typing.ClassVar[tuple[str, ...] | None] = None
    """The codes that it can fail with, besides EXCEPTION, FAILED and CANCELLED; None: not known.
    `check` warns about comparisons with other codes."""
    ends_by: typing.ClassVar[tuple[str, ...]] = ()
    """Ports of which one must be set, or it never succeeds."""
    needs: typing.ClassVar[tuple[str, ...]] = ()
    """What the robot must have: names of `stack.drivetrain.needs`, such as `camera`, or several of
    which one is enough: `lidar or sonar`. `check` refuses a mission on a robot without it."""
    failure_ports: typing.ClassVar[tuple[str, ...]] = ()
    """Ports with the code and the reason of its failure."""
    goal_ports: typing.ClassVar[tuple[str, ...]] = ()
    """Ports with poses that the robot drives to, see `standing_pose`; `check` compares them with
    the world and its keep-out zones."""
    area_ports: typing.ClassVar[tuple[str, ...]] = ()
    """Ports with the corners of areas that the robot drives over; `check` compares them with
    keep-out zones."""
    edge_port: typing.ClassVar[str] = ""
    """Port with an edge of the planner's route graph; `check` compares it with the graph."""
    label_port: typing.ClassVar[str] = ""
    """Port with a label of the object detector, which takes the place of a `colour`; `check`
    compares it with the detector."""
    one_port_of: typing.ClassVar[tuple[str, ...]] = ()
    """Ports of which exactly one is given; `check` refuses a node with none or several."""
    joints_port: typing.ClassVar[str] = ""
    """Port with positions of the joints of the arm, for `check`."""
    posture_port: typing.ClassVar[str] = ""
    """Port with a posture of the arm; `check` compares it with the robot."""
    box_ports: typing.ClassVar[tuple[str, ...]] = ()
    """Ports with names of boxes, one or a list; `check` compares them with the world."""
    finds_blocks: typing.ClassVar[bool] = False
    """Whether it finds blocks around an arm."""
    block_port: typing.ClassVar[str] = ""
    """Port with a block whose place is known. Without it the behaviour uses a block that was found,
    and `check` warns if nothing in the mission finds any."""
    drives_backward: typing.ClassVar[bool] = False
    """Whether its speeds are backward ones."""
    arrival_port: typing.ClassVar[str] = ""
    """Port with the pose at which the robot stands after its success."""
    runs_in_tests: typing.ClassVar[bool] = False
    """Whether tests of missions run it unless they mock it: it needs only clock and values."""
    also_known_as: typing.ClassVar[tuple[str, ...]] = ()
    """Its names elsewhere, for example in Nav2; hints for unknown words use them."""

    @classmethod
    def standing_pose(
        cls, pose: Pose2D, footprint: Footprint, ports: Mapping[str, Any]
    ) -> Pose2D | None:
        """Return where the robot stands for a pose of `goal_ports`: there.

        Args:
            pose: map frame.
            footprint: of the robot.
            ports: the values that are known before the mission runs, with defaults.

        Returns:
            Map frame; None if it depends on a port that is not known yet.
        """
        return pose

    def __init__(self, name: str = "", **ports: Any) -> None:
        super().__init__(name or type(self).__name__)
        self.failure = None
        self._followed: Task | None = None
        self._timers: WeakSet[Timer] = WeakSet()
        self._values: dict[str, Any] = {}
        self._readers: dict[str, Callable[[], Any]] = {}
        self._writers: dict[str, Callable[[Any], None]] = {}
        known = self.ports()
        for key in ports.keys() - known.keys():
            raise ParameterError(
                key, f"{type(self).__name__} has no such port", suggestion(key, known)
            )
        self._values.update(dict.fromkeys(self.outputs()))
        for key, declared in known.items():
            value = ports.get(key, declared.default)
            if value is REQUIRED:
                raise ParameterError(key, f"{type(self).__name__} needs this port")
            self._values[key] = value

    @classmethod
    def ports(cls) -> Mapping[str, Declaration]:
        """Return the declarations of the inputs by name, in the order of declaration."""
        return _declared(cls)[0]

    @classmethod
    def outputs(cls) -> Mapping[str, Declaration]:
        """Return the declarations of the outputs by name."""
        return _declared(cls)[1]

    def bind_input(self, name: str, read: Callable[[], Any]) -> None:
        """Read the port with this function from now on."""
        self._readers[name] = read

    def bind_output(self, name: str, write: Callable[[Any], None]) -> None:
        """Also call this function on every assignment to the output."""
        self._writers[name] = write

    def setup(self, **resources: Any) -> None:
        """Store the robot from the resources that the mission runner passes to the tree."""
        self.robot = resources["robot"]

    def fail(self, code: str, sentence: str) -> Status:
        """Return FAILURE with a reason: `self.fail(FailureCode.NO_WALL, "no wall within 1 m")`."""
        self.failure = Failure(code, sentence)
        self.feedback_message = sentence
        return Status.FAILURE

    def start_timer(self) -> Timer:
        """Start a timer for this run; it stands still while the mission is paused."""
        timer = Timer(self.robot)
        timer.restart()
        self._timers.add(timer)
        return timer

    def pause(self, now: float) -> None:
        """Stop the timers; called while the node runs, when the operator pauses the mission.

        An override must call `super().pause(now)`. `update` is not called until `resume`.

        Args:
            now: time on the robot's clock, seconds.
        """
        for timer in self._timers:
            timer.pause(now)

    def resume(self, now: float) -> None:
        """Continue after a pause. An override must call `super().resume(now)`."""
        for timer in self._timers:
            timer.resume(now)

    def follow(self, task: Task) -> Status:
        """Return the task's status as this node's status, with its feedback and failure.

        When the tree ends this node early, the task is cancelled and the robot stops.
        """
        self._followed = task
        if task.status is TaskStatus.RUNNING:
            self.feedback_message = task.feedback
            return Status.RUNNING
        if task.status is TaskStatus.SUCCEEDED:
            self.feedback_message = task.feedback
            return Status.SUCCESS
        why = task.failure or Failure(FailureCode.CANCELLED, "cancelled")
        return self.fail(why.code, why.sentence)

    def terminate(self, new_status: Status) -> None:
        """Cancel the followed task. An override must call `super().terminate(new_status)`."""
        if self._followed is not None:
            self._followed.cancel()
            self._followed = None


@lru_cache(maxsize=512)
def _declared(cls: type) -> tuple[dict[str, Declaration], dict[str, Declaration]]:
    hints = typing.get_type_hints(cls)
    inputs: dict[str, Declaration] = {}
    outputs: dict[str, Declaration] = {}
    for owner in reversed(cls.__mro__):
        for name, item in vars(owner).items():
            if isinstance(item, Port):
                if name not in hints:
                    raise TypeError(f"{cls.__name__}.{name}: a port needs a type annotation")
                declared = replace(item.declared, name=name, type=hints[name])
                (outputs if item.writes else inputs)[name] = declared
    for name in outputs:
        inputs.pop(name, None)
    return inputs, outputs

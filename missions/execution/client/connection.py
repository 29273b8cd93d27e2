"""A live run commanded from code: `with treepilot.connect() as robot`."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable, Coroutine, Iterator, Mapping
from functools import wraps
from typing import Any, Concatenate, ParamSpec, Self, TypeVar

from missions.execution.client.asynchronous import AsyncConnection
from missions.execution.client.conversation import finished, sleep_until_message
from stack.telemetry.records import MissionState, RunInfo, Snapshot
from stack.telemetry.rendezvous import RunHandle
from stack.types import Pose2D

P = ParamSpec("P")
T = TypeVar("T")


def _blocking(
    method: Callable[Concatenate[AsyncConnection, P], Coroutine[Any, Any, T]],
) -> Callable[Concatenate[Connection, P], T]:
    """The method that blocks where that of coroutines suspends."""

    @wraps(method)
    def call(self: Connection, /, *args: P.args, **kwargs: P.kwargs) -> T:
        return finished(method(self.robot, *args, **kwargs))

    return call


def _iterating(
    method: Callable[Concatenate[AsyncConnection, P], AsyncIterator[T]],
) -> Callable[Concatenate[Connection, P], Iterator[T]]:
    """The generator that blocks where that of coroutines suspends."""

    @wraps(method)
    def call(self: Connection, /, *args: P.args, **kwargs: P.kwargs) -> Iterator[T]:
        items = method(self.robot, *args, **kwargs)
        while True:
            try:
                item = finished(_next(items))
            except StopAsyncIteration:
                return
            yield item

    return call


async def _next(items: AsyncIterator[T]) -> T:
    return await anext(items)


class Connection:
    """Connection to a live run. It has no thread and handles no signal.

    Every call raises TelemetryError if the engine does not answer, has ended or is of another
    version. Between two calls nothing is sent or received. The methods are those of
    `AsyncConnection`; they return when it has an answer.

    Attributes:
        robot: the connection of which this one waits for each answer.
    """

    def __init__(self, run: RunHandle, timeout: float) -> None:
        self.robot = AsyncConnection(run, timeout, sleep_until_message)

    def __enter__(self) -> Self:
        finished(self.robot.__aenter__())
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Disconnect; the run continues."""
        self.robot.close()

    @property
    def info(self) -> RunInfo:
        """Description of the run: mission, robot, world, places."""
        return self.robot.info

    @property
    def snapshot(self) -> Snapshot:
        """The state of the run now; the last one of a run that has ended."""
        return finished(self.robot.snapshot)

    @property
    def state(self) -> MissionState:
        """State of the mission."""
        return self.snapshot.state

    @property
    def pose(self) -> Pose2D:
        """Where the robot is, map frame."""
        return self.snapshot.pose

    @property
    def parameters(self) -> Mapping[str, Any]:
        """Current parameters by full name, such as `controller.cruise_speed`."""
        return self.snapshot.parameters

    snapshots = _iterating(AsyncConnection.snapshots)
    poses = _iterating(AsyncConnection.poses)
    events = _iterating(AsyncConnection.events)
    command = _blocking(AsyncConnection.command)
    goto = _blocking(AsyncConnection.goto)
    cancel = _blocking(AsyncConnection.cancel)
    set_pose = _blocking(AsyncConnection.set_pose)
    run_behaviour = _blocking(AsyncConnection.run_behaviour)
    set_parameter = _blocking(AsyncConnection.set_parameter)
    pause = _blocking(AsyncConnection.pause)
    resume = _blocking(AsyncConnection.resume)
    abort = _blocking(AsyncConnection.abort)
    estop = _blocking(AsyncConnection.estop)
    release = _blocking(AsyncConnection.release)
    speed = _blocking(AsyncConnection.speed)
    drop_box = _blocking(AsyncConnection.drop_box)
    move_door = _blocking(AsyncConnection.move_door)
    push = _blocking(AsyncConnection.push)
    lift = _blocking(AsyncConnection.lift)
    silence_sensor = _blocking(AsyncConnection.silence_sensor)
    set_charge = _blocking(AsyncConnection.set_charge)

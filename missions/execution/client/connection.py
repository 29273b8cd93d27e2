"""A live run commanded from code: `with treepilot.connect() as robot`."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable, Coroutine, Iterator, Mapping
from functools import wraps
from math import inf
from typing import Any, Concatenate, ParamSpec, Self, TypeVar

from missions.execution.client.asynchronous import AsyncConnection
from missions.execution.client.conversation import finished, sleep_until_message
from stack.telemetry.records import Event, MissionState, RunInfo, Snapshot
from stack.telemetry.rendezvous import RunHandle
from stack.types import Pose2D

T = TypeVar("T")
P = ParamSpec("P")


def _blocking(
    call: Callable[Concatenate[AsyncConnection, P], Coroutine[Any, Any, T]],
) -> Callable[Concatenate[Connection, P], T]:
    """Return a method that does what a coroutine does, and blocks where that one suspends."""

    @wraps(call, assigned=("__name__", "__doc__", "__annotations__"))
    def method(robot: Connection, /, *args: P.args, **kwargs: P.kwargs) -> T:
        return finished(call(robot._robot, *args, **kwargs))

    return method


class Connection:
    """Connection to a live run. It has no thread and handles no signal.

    Every call raises TelemetryError if the engine does not answer, has ended or is of another
    version. Between two calls nothing is sent or received. Its methods are those of
    `AsyncConnection`, and block where those suspend.
    """

    def __init__(self, run: RunHandle, timeout: float) -> None:
        self._robot = AsyncConnection(run, timeout, sleep_until_message)

    def __enter__(self) -> Self:
        finished(self._robot.__aenter__())
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Disconnect; the run continues."""
        self._robot.close()

    @property
    def info(self) -> RunInfo:
        """Description of the run: mission, robot, world, places."""
        return self._robot.info

    @property
    def snapshot(self) -> Snapshot:
        """The state of the run now; the last one of a run that has ended."""
        return finished(self._robot.snapshot)

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

    def snapshots(self) -> Iterator[Snapshot]:
        """Yield the newest snapshot, at most twenty times a second, until the run ends."""
        return _each(self._robot.snapshots())

    def poses(self) -> Iterator[Pose2D]:
        """Yield the poses of `snapshots`."""
        return _each(self._robot.poses())

    def events(self, timeout: float = inf) -> Iterator[Event]:
        """Yield each event since the connection began, once, in order.

        Args:
            timeout: wall seconds without an event after which it ends; it ends with the run too.
        """
        return _each(self._robot.events(timeout))

    command = _blocking(AsyncConnection.command)
    goto = _blocking(AsyncConnection.goto)
    set_pose = _blocking(AsyncConnection.set_pose)
    run_behaviour = _blocking(AsyncConnection.run_behaviour)
    set_parameter = _blocking(AsyncConnection.set_parameter)
    pause = _blocking(AsyncConnection.pause)
    resume = _blocking(AsyncConnection.resume)
    abort = _blocking(AsyncConnection.abort)
    estop = _blocking(AsyncConnection.estop)
    release = _blocking(AsyncConnection.release)
    speed = _blocking(AsyncConnection.speed)


def _each(items: AsyncIterator[T]) -> Iterator[T]:
    """The items of an iterator that blocks where others would suspend."""
    while True:
        try:
            item = finished(_next(items))
        except StopAsyncIteration:
            return
        yield item


async def _next(items: AsyncIterator[T]) -> T:
    return await anext(items)

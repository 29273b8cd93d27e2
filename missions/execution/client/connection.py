"""A live run commanded from code: `with treepilot.connect() as robot`."""

from __future__ import annotations

from collections.abc import AsyncIterator, Iterator, Mapping
from math import inf
from typing import Any, Self, TypeVar

from missions.execution.client.asynchronous import DETOUR_TIMEOUT, NO_PORTS, AsyncConnection
from missions.execution.client.conversation import finished, sleep_until_message
from stack.telemetry.records import Event, MissionState, RunInfo, Snapshot
from stack.telemetry.rendezvous import RunHandle
from stack.types import Pose2D

T = TypeVar("T")


class Connection:
    """Connection to a live run. It has no thread and handles no signal.

    Every call raises TelemetryError if the engine does not answer, has ended or is of another
    version. Between two calls nothing is sent or received.
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

    def command(self, kind: str, **arguments: Any) -> str:
        """Send any command; return the engine's answer.

        Raises:
            CommandRefused: the engine refuses it; the text gives the reason.
        """
        return finished(self._robot.command(kind, **arguments))

    def goto(
        self, goal: str | Pose2D | float, y: float | None = None,
        heading: float | str | None = None, *, wait: bool = True, timeout: float = DETOUR_TIMEOUT,
    ) -> None:  # fmt: skip
        """Pause the mission and drive to a goal; `resume` continues the mission.

        Args:
            goal: a place, a pose, a text such as `3.2, 1.1, 90deg`, or x in metres.
            y: metres, with x.
            heading: radians or a text such as `90 deg`, with x; None: that of the straight line.
            wait: until the drive has ended.
            timeout: longest wait, wall seconds.

        Raises:
            InputError: there is no such place, or a number is wrong.
            CommandRefused: the engine refuses the goal.
            NavigationError: the drive fails or is cancelled; `failure` says why.
            TelemetryError: it takes longer than the timeout. The robot drives on.
        """
        finished(self._robot.goto(goal, y, heading, wait=wait, timeout=timeout))

    def set_pose(
        self, pose: str | Pose2D | float, y: float | None = None,
        heading: float | str | None = None,
    ) -> None:  # fmt: skip
        """Tell the robot where it is; arguments as for `goto`."""
        finished(self._robot.set_pose(pose, y, heading))

    def run_behaviour(
        self, name: str, given: Mapping[str, Any] = NO_PORTS, /, *, wait: bool = True,
        timeout: float = DETOUR_TIMEOUT, **ports: Any,
    ) -> None:  # fmt: skip
        """Pause the mission and carry out a behaviour; `resume` continues the mission.

        Args:
            name: of the catalogue, such as `spin`; plugins of the mission included.
            given: ports in a mapping, for those that are called `wait` or `timeout`.
            wait: until it has ended.
            timeout: longest wait, wall seconds.
            ports: their values as in a mission file: numbers, texts with units, places, lists.

        Raises:
            CommandRefused: there is no such behaviour, a port is wrong, or the robot lacks what it
                needs.
            NavigationError: it fails or is cancelled; `failure` says why.
            TelemetryError: it takes longer than the timeout. It goes on.
        """
        finished(self._robot.run_behaviour(name, given, wait=wait, timeout=timeout, **ports))

    def set_parameter(self, name: str, value: Any) -> None:
        """Change a parameter, such as `controller.cruise_speed` to 0.3 or `30 cm/s`."""
        finished(self._robot.set_parameter(name, value))

    def pause(self) -> None:
        """Pause the mission; the robot stops."""
        finished(self._robot.pause())

    def resume(self) -> None:
        """Continue after a pause, a goal or a behaviour."""
        finished(self._robot.resume())

    def abort(self, reason: str = "by the operator") -> None:
        """Stop the robot and abort the mission."""
        finished(self._robot.abort(reason))

    def estop(self, reason: str = "operator") -> None:
        """Trigger the emergency stop."""
        finished(self._robot.estop(reason))

    def release(self) -> None:
        """Reset the emergency stop; the mission is paused then."""
        finished(self._robot.release())

    def speed(self, factor: float) -> None:
        """Let a simulation run at so many simulated seconds per second; 0: as fast as it can."""
        finished(self._robot.speed(factor))


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

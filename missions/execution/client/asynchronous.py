"""A live run commanded from coroutines; `Connection` blocks where this one suspends."""

from __future__ import annotations

from collections.abc import AsyncIterator, Mapping
from math import inf
from types import MappingProxyType
from typing import Any, Self

from missions.execution.client.conversation import Conversation, Wait, await_message
from missions.execution.client.goals import pose_of
from stack.errors import NavigationError
from stack.parameters import declarations
from stack.runtime.disturbance_commands import DISTURBANCES
from stack.telemetry.records import Event, MissionState, RunInfo, Snapshot
from stack.telemetry.rendezvous import RunHandle
from stack.types import Pose2D

NO_PORTS: Mapping[str, Any] = MappingProxyType({})

DETOUR_TIMEOUT = 600.0
"""Wall seconds that a drive or a behaviour may take."""


class AsyncConnection:
    """Connection to a live run for coroutines: `async with treepilot.connect_async() as robot`.

    Its members are those of `Connection`, as coroutines: `await robot.goto("desk")`,
    `pose = await robot.pose`, `async for event in robot.events()`.
    """

    def __init__(self, run: RunHandle, timeout: float, wait: Wait = await_message) -> None:
        self._asked = Conversation(run, timeout, wait)

    async def __aenter__(self) -> Self:
        try:
            await self._asked.begin()
        except BaseException:
            self.close()
            raise
        return self

    async def __aexit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Disconnect; the run continues."""
        self._asked.close()

    @property
    def info(self) -> RunInfo:
        """Description of the run: mission, robot, world, places."""
        return self._asked.info

    @property
    async def snapshot(self) -> Snapshot:
        """The state of the run now; the last one of a run that has ended."""
        return await self._asked.snapshot()

    @property
    async def state(self) -> MissionState:
        """State of the mission."""
        return (await self._asked.snapshot()).state

    @property
    async def pose(self) -> Pose2D:
        """Where the robot is, map frame."""
        return (await self._asked.snapshot()).pose

    @property
    async def parameters(self) -> Mapping[str, Any]:
        """Current parameters by full name, such as `controller.cruise_speed`."""
        return (await self._asked.snapshot()).parameters

    async def snapshots(self) -> AsyncIterator[Snapshot]:
        """Yield the newest snapshot, at most twenty times a second, until the run ends."""
        while (snapshot := await self._asked.next_snapshot()) is not None:
            yield snapshot

    async def poses(self) -> AsyncIterator[Pose2D]:
        """Yield the poses of `snapshots`."""
        async for snapshot in self.snapshots():
            yield snapshot.pose

    async def events(self, timeout: float = inf) -> AsyncIterator[Event]:
        """Yield each event since the connection began, once, in order.

        Args:
            timeout: wall seconds without an event after which it ends; it ends with the run too.
        """
        while (event := await self._asked.next_event(timeout)) is not None:
            yield event

    async def command(self, kind: str, /, **arguments: Any) -> str:
        """Send any command; return the engine's answer.

        Raises:
            CommandRefused: the engine refuses it; the text gives the reason.
        """
        return await self._asked.command(kind, arguments)

    async def goto(
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
        await self._detour("set_goal", await self._place(goal, y, heading), wait, timeout)

    async def set_pose(
        self, pose: str | Pose2D | float, y: float | None = None,
        heading: float | str | None = None,
    ) -> None:  # fmt: skip
        """Tell the robot where it is; arguments as for `goto`."""
        await self.command("set_pose", **await self._place(pose, y, heading))

    async def run_behaviour(
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
            TelemetryError: it takes longer than the timeout; it continues.
        """
        written = [f"{port}={_text(value)}" for port, value in {**given, **ports}.items()]
        await self._detour("behaviour", {"name": name, "ports": written}, wait, timeout)

    async def set_parameter(self, name: str, value: Any) -> None:
        """Change a parameter, such as `controller.cruise_speed` to 0.3 or `30 cm/s`."""
        await self.command("set_parameter", name=name, value=value)

    async def pause(self) -> None:
        """Pause the mission; the robot stops."""
        await self.command("pause")

    async def resume(self) -> None:
        """Continue after a pause, a goal or a behaviour."""
        await self.command("resume")

    async def abort(self, reason: str = "by the operator") -> None:
        """Stop the robot and abort the mission."""
        await self.command("abort", reason=reason)

    async def estop(self, reason: str = "operator") -> None:
        """Trigger the emergency stop."""
        await self.command("estop", reason=reason)

    async def release(self) -> None:
        """Reset the emergency stop; the mission is paused then."""
        await self.command("release")

    async def cancel(self) -> None:
        """End the drive or behaviour of `goto` and `run_behaviour`; the mission stays paused."""
        await self.command("cancel_goal")

    async def speed(self, factor: float) -> None:
        """Let a simulation run at so many simulated seconds per second; 0: as fast as it can."""
        await self.command("speed", factor=float(factor))

    async def drop_box(
        self, place: str | Pose2D | None = None, *, length: float | str | None = None,
        width: float | str | None = None, height: float | str | None = None,
    ) -> None:  # fmt: skip
        """Drop a box into the simulated world.

        This and the following methods disturb a simulation; a real robot refuses them. Numbers are
        in metres and radians; texts may have units.

        Args:
            place: a place, a pose or a text such as `3.2, 1.1, 90deg`; None: before the robot.
            length: of the box; None: 0.4 m.
            width: None: 0.4 m.
            height: None: 0.5 m.

        Raises:
            CommandRefused: the robot is real, or its world does not allow it.
            ParameterError: a number is wrong.
        """
        at = {} if place is None else await self._place(place, None, None)
        await self._disturb("drop_box", **at, length=length, width=width, height=height)

    async def move_door(self, name: str = "", *, closed: bool | None = None) -> None:
        """Close or open a door of the simulated world.

        Args:
            name: of the door; empty: the nearest one.
            closed: whether it is closed then; None: the other way than it is.
        """
        await self._disturb("move_door", name=name, closed=closed)

    async def push(
        self, forward: float | str = 0.0, left: float | str = 0.0, turn: float | str = 0.0
    ) -> None:
        """Push the simulated robot: metres in its own directions; an angle, anticlockwise."""
        await self._disturb("push_robot", forward=forward, left=left, turn=turn)

    async def lift(
        self, pose: str | Pose2D | float, y: float | None = None,
        heading: float | str | None = None,
    ) -> None:  # fmt: skip
        """Lift the simulated robot to a pose; its odometry does not notice. Arguments: `goto`."""
        await self._disturb("lift_robot", **await self._place(pose, y, heading))

    async def silence_sensor(self, name: str, *, works: bool = False) -> None:
        """Let a simulated sensor deliver nothing any more; `works`: let it deliver again."""
        await self._disturb("silence_sensor", name=name, works=works)

    async def set_charge(self, charge: float | str) -> None:
        """Set the charge of the simulated battery, in [0, 1] or a text such as `30 %`."""
        await self._disturb("set_charge", charge=charge)

    async def _disturb(self, kind: str, **arguments: Any) -> None:
        known = declarations(DISTURBANCES[kind])
        given = {name: value for name, value in arguments.items() if value is not None}
        await self.command(kind, **{name: known[name].read(value) for name, value in given.items()})

    async def _place(
        self, goal: str | Pose2D | float, y: float | None, heading: float | str | None
    ) -> dict[str, float]:
        pose = pose_of(goal, y, heading, self.info.places, await self.pose)
        return {"x": pose.x, "y": pose.y, "heading": pose.heading}

    async def _detour(
        self, kind: str, arguments: dict[str, Any], wait: bool, timeout: float
    ) -> None:
        if not wait:
            await self._asked.command(kind, arguments)
            return
        ended = await self._asked.detour(kind, arguments, timeout)
        if ended.fields["status"] != "success":
            raise NavigationError(ended.fields["code"], ended.fields["reason"])


def _text(value: Any) -> str:
    """A value of a port as a mission file writes it."""
    if isinstance(value, Pose2D):
        return f"[{value.x!r}, {value.y!r}, {value.heading!r}]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_text, value))}]"
    return str(value)

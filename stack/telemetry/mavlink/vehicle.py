"""The vehicle: what the thread of the link does in each cycle."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, Protocol

from pymavlink.dialects.v20 import all as mav

from stack.mavlink.origin import GeoOrigin
from stack.telemetry.mavlink import small_services, status
from stack.telemetry.mavlink.commands import CommandService, Request
from stack.telemetry.mavlink.geography import Geography
from stack.telemetry.mavlink.guidance import Guidance
from stack.telemetry.mavlink.handover import Handover
from stack.telemetry.mavlink.modes import Modes
from stack.telemetry.mavlink.orders import Orders
from stack.telemetry.mavlink.parameters import ParameterService
from stack.telemetry.mavlink.plan import PlanCheck
from stack.telemetry.mavlink.plan_runner import PlanRunner
from stack.telemetry.mavlink.plan_transfer import PlanTransfer
from stack.telemetry.mavlink.streams import Streams
from stack.telemetry.mavlink.texts import WARNING, Texts
from stack.telemetry.mavlink.vehicle_commands import VehicleCommands

SYSTEM, COMPONENT = 1, 1
HEARTBEAT_PERIOD = 1.0
"""Wall seconds: stations report a lost link after three without a heartbeat."""

SET_MODE = 11
"""Number under which SET_MODE is acknowledged: that of the message, as ArduPilot does."""

Handle = Callable[[Any], object]


class Sends(Protocol):
    """What sends messages: the `Link` of stack/mavlink."""

    def send(self, message: Any) -> bool:
        """Send a message to every station."""


class Vehicle:
    """Answers stations, sends telemetry, and turns commands into orders to the engine.

    Everything happens in `take` and `tick`, in the thread of the link.

    Args:
        handover: to the engine's thread.
        link: sends messages.
        clock: returns wall seconds.
        origin: of the map on Earth, if it is known.
        home_item: `auto`, `always` or `never`: whether the first item of a plan is home.
        identity: of the run.
    """

    def __init__(  # noqa: PLR0913
        self, handover: Handover, link: Sends, clock: Callable[[], float], *,
        origin: GeoOrigin | None = None, home_item: str = "auto", identity: str = "",
    ) -> None:  # fmt: skip
        self._handover, self._clock = handover, clock
        send = self._send = link.send
        texts = self._texts = Texts(send, clock)
        self._orders = Orders(handover, clock)
        self._geography = Geography(origin)
        check = PlanCheck(self._geography, lambda: handover.snapshot)
        self._plan = PlanRunner(handover, self._orders, check, self._geography, send, texts)
        self._transfer = PlanTransfer(self._plan, check, home_item, send, texts, clock)
        self._modes = Modes(handover, self._orders, self._plan, self._geography, texts)
        self._guidance = Guidance(
            handover, self._orders, self._modes, self._geography, texts, clock
        )
        self._streams = Streams(handover, self._geography, send)
        self._parameters = ParameterService(handover, self._orders, send, texts)
        self._vehicle_commands = VehicleCommands(
            handover, self._orders, self._modes, self._plan, self._guidance, self._geography,
            self._streams, send, identity,
        )  # fmt: skip
        handlers = self._vehicle_commands.handlers()
        self._commands = CommandService(handlers, send, texts, clock)
        self._beat: tuple[int, int] | None = None
        self._last_beat = -HEARTBEAT_PERIOD
        self._handles = self._table()

    def _table(self) -> dict[str, Handle]:
        """What is done with a message, by its name; all others are ignored."""
        transfer, parameters = self._transfer, self._parameters
        return {
            "HEARTBEAT": self._hear,
            "COMMAND_LONG": self._commands.receive,
            "COMMAND_INT": self._commands.receive,
            "SET_MODE": self._take_set_mode,
            "MISSION_COUNT": transfer.begin_upload,
            "MISSION_ITEM_INT": transfer.take_item,
            "MISSION_ITEM": transfer.take_item,
            "MISSION_REQUEST_LIST": transfer.list_items,
            "MISSION_REQUEST_INT": transfer.send_item,
            "MISSION_REQUEST": transfer.send_item,
            "MISSION_CLEAR_ALL": transfer.clear,
            "MISSION_SET_CURRENT": transfer.set_current,
            "MISSION_WRITE_PARTIAL_LIST": transfer.refuse_part,
            "MISSION_REQUEST_PARTIAL_LIST": transfer.refuse_part,
            "MISSION_ACK": transfer.take_ack,
            "PARAM_REQUEST_LIST": parameters.list_all,
            "PARAM_REQUEST_READ": parameters.read,
            "PARAM_SET": parameters.change,
            "SET_POSITION_TARGET_LOCAL_NED": self._guidance.take_local_target,
            "SET_POSITION_TARGET_GLOBAL_INT": self._guidance.take_global_target,
            "MANUAL_CONTROL": self._guidance.take_sticks,
            "REQUEST_DATA_STREAM": self._take_stream_request,
            "SET_GPS_GLOBAL_ORIGIN": self._take_origin,
            "SETUP_SIGNING": self._refuse_key,
            "FILE_TRANSFER_PROTOCOL": lambda message: self._send(
                small_services.ftp_refusal(message)
            ),
            "TIMESYNC": lambda message: self._send_any(
                small_services.timesync_answer(message, self._clock())
            ),
            "PING": lambda message: self._send_any(small_services.ping_answer(message)),
        }

    def take(self, message: Any) -> None:
        """Answer a message of a station, unless it is for another vehicle."""
        handle = self._handles.get(message.get_type())
        if handle is not None and _is_for_us(message):
            handle(message)

    def tick(self) -> None:
        """Do what is due: answers of the engine, events, heartbeat, streams, resends."""
        now = self._clock()
        self._orders.settle()
        for event in self._handover.take_events():
            self._texts.tell_event(event)
            self._plan.take_event(event)
        snapshot = self._handover.snapshot
        if self._geography.home is None and snapshot is not None:
            self._geography.home = snapshot.pose
        self._modes.follow()
        self._commands.tick()
        self._transfer.tick(now)
        self._parameters.tick(now)
        self._plan.tick(now)
        self._beat_if_due(now)
        self._streams.tick(now)

    def _beat_if_due(self, now: float) -> None:
        """Send the heartbeat each second, and at once after a change of mode or arming."""
        beat = status.heartbeat(self._handover.snapshot, self._modes.shown)
        shown = beat.base_mode, beat.custom_mode
        if shown != self._beat or now - self._last_beat >= HEARTBEAT_PERIOD:
            self._beat, self._last_beat = shown, now
            self._send(beat)

    def _hear(self, message: Any) -> None:
        """Note that a ground station is there."""
        if message.type == mav.MAV_TYPE_GCS:
            self._handover.heard = self._clock()

    def _send_any(self, message: Any) -> None:
        if message is not None:
            self._send(message)

    def _take_set_mode(self, message: Any) -> None:
        """Carry out the older SET_MODE as a command."""
        sender = message.get_srcSystem(), message.get_srcComponent()
        request = Request(sender, SET_MODE, (message.base_mode, message.custom_mode))
        if message.base_mode & mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED:
            change = partial(self._change_mode, message.custom_mode)
            self._commands.carry_out(request, change)
        else:
            self._commands.carry_out(request, None)

    def _change_mode(self, mode: int, request: Request, answer: Any) -> None:
        self._vehicle_commands.switch(mode, answer)

    def _take_stream_request(self, message: Any) -> None:
        rate = float(message.req_message_rate) if message.start_stop else 0.0
        self._streams.set_group(message.req_stream_id, rate)

    def _take_origin(self, message: Any) -> None:
        refusal = self._geography.set_origin(
            message.latitude, message.longitude, message.altitude / 1000.0
        )
        if refusal:
            self._texts.tell(refusal, WARNING)
            return
        for number in (mav.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN, mav.MAVLINK_MSG_ID_HOME_POSITION):
            self._streams.send_now(number)

    def _refuse_key(self, message: Any) -> None:
        """Refuse SETUP_SIGNING; its key is never shown or kept."""
        self._texts.tell("keys are set on the robot only: treepilot run --mavlink-key", WARNING)


def _is_for_us(message: Any) -> bool:
    """Whether a message is addressed to this vehicle or to all, and does not come from its id."""
    if (message.get_srcSystem(), message.get_srcComponent()) == (SYSTEM, COMPONENT):
        return False
    system = getattr(message, "target_system", getattr(message, "target", 0))
    component = getattr(message, "target_component", 0)
    return system in (0, SYSTEM) and component in (0, COMPONENT)

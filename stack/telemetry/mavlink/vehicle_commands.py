"""The commands (COMMAND_LONG, COMMAND_INT) that the vehicle accepts, by number."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

from pymavlink.dialects.v20 import all as mav

from stack.telemetry.mavlink import status
from stack.telemetry.mavlink.commands import (
    ACCEPTED,
    DENIED,
    FAILED,
    INT_ONLY,
    UNSUPPORTED,
    WRONG_FRAME,
    Answer,
    Handler,
    Request,
    done_by,
)  # fmt: skip
from stack.telemetry.mavlink.geography import GLOBAL_FRAMES, NO_ORIGIN, Geography
from stack.telemetry.mavlink.guidance import Guidance
from stack.telemetry.mavlink.handover import Handover
from stack.telemetry.mavlink.modes import Mode, Modes, is_armed
from stack.telemetry.mavlink.orders import Orders
from stack.telemetry.mavlink.plan_runner import CRUISE_SPEED, PlanRunner
from stack.telemetry.mavlink.streams import Streams
from stack.telemetry.mavlink.texts import Send
from stack.telemetry.records import MissionState
from stack.types import Pose2D

CHANGE_MODE = 1
"""Flag of DO_REPOSITION: change to GUIDED."""


@dataclass
class VehicleCommands:
    """Handlers of commands.

    Attributes:
        send: sends a message.
        identity: of the run.
    """

    handover: Handover
    orders: Orders
    modes: Modes
    plan: PlanRunner
    guidance: Guidance
    geography: Geography
    streams: Streams
    send: Send
    identity: str

    def handlers(self) -> dict[int, Handler]:
        """Handler by number of the command."""
        return {
            mav.MAV_CMD_COMPONENT_ARM_DISARM: self._arm,
            mav.MAV_CMD_DO_SET_MODE: self._set_mode,
            mav.MAV_CMD_MISSION_START: self._start,
            mav.MAV_CMD_DO_PAUSE_CONTINUE: self._pause,
            mav.MAV_CMD_DO_REPOSITION: self._reposition,
            mav.MAV_CMD_DO_CHANGE_SPEED: self._speed,
            mav.MAV_CMD_NAV_RETURN_TO_LAUNCH: lambda _, answer: self.switch(Mode.RTL, answer),
            mav.MAV_CMD_DO_SET_HOME: self._set_home,
            mav.MAV_CMD_DO_SET_MISSION_CURRENT: self._set_current,
            mav.MAV_CMD_GET_HOME_POSITION: lambda _, answer: self._tell(
                mav.MAVLINK_MSG_ID_HOME_POSITION, answer
            ),
            mav.MAV_CMD_REQUEST_MESSAGE: lambda request, answer: self._tell(
                _number(request.parameters[0]), answer
            ),
            mav.MAV_CMD_SET_MESSAGE_INTERVAL: self._set_interval,
            mav.MAV_CMD_GET_MESSAGE_INTERVAL: self._get_interval,
            mav.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: lambda _, answer: self._tell(
                mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION, answer
            ),
        }  # fmt: skip

    def switch(self, mode: int, answer: Answer) -> None:
        """Change the mode: SET_MODE, and DO_SET_MODE."""
        self.modes.switch(mode, done_by(answer))

    def _arm(self, request: Request, answer: Answer) -> None:
        """Arm: release the emergency stop. Disarm: engage it. The force flag changes nothing."""
        wanted = request.parameters[0]
        snapshot = self.handover.snapshot
        if wanted not in (0.0, 1.0):
            answer(DENIED, f"arm is 0 or 1, not {wanted:g}")
        elif snapshot is None:
            answer(DENIED, "the mission has not started")
        elif wanted == 0.0:
            system, component = request.sender
            reason = f"disarmed by station {system}/{component}"
            self.orders.give("estop", done_by(answer), reason=reason)
        elif snapshot.state is MissionState.EMERGENCY_STOP:
            self.orders.give("release", done_by(answer))
        elif is_armed(snapshot):
            answer(ACCEPTED, "")
        else:
            answer(DENIED, f"cannot be armed: the mission is {snapshot.state}")

    def _set_mode(self, request: Request, answer: Answer) -> None:
        flags, mode = _number(request.parameters[0]), _number(request.parameters[1])
        if flags & mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED:
            self.switch(mode, answer)
        else:
            answer(UNSUPPORTED, "")

    def _start(self, request: Request, answer: Answer) -> None:
        """MISSION_START at an item; 0 is wherever the plan stands."""
        first = _number(request.parameters[0])
        refusal = self.plan.set_current(first) if first > 0 and self.plan.has_plan else ""
        if refusal:
            answer(DENIED, refusal)
        else:
            self.switch(Mode.AUTO, answer)

    def _pause(self, request: Request, answer: Answer) -> None:
        if request.parameters[0] == 0.0:
            self.switch(Mode.HOLD, answer)
        elif request.parameters[0] == 1.0:
            self.modes.resume(done_by(answer))
        else:
            answer(DENIED, "0 pauses and 1 continues")

    def _reposition(self, request: Request, answer: Answer) -> None:
        if request.frame is None:
            answer(INT_ONLY, "")
        elif request.frame not in GLOBAL_FRAMES:
            answer(WRONG_FRAME, "")
        elif not is_armed(self.handover.snapshot):
            answer(DENIED, "the robot is disarmed")
        elif (
            self.modes.shown is not Mode.GUIDED and not _number(request.parameters[1]) & CHANGE_MODE
        ):
            answer(DENIED, "a new goal needs the mode GUIDED, or the flag that changes to it")
        else:
            yaw = request.parameters[3]
            self.guidance.reposition(request.frame, *request.place, yaw, done_by(answer))

    def _speed(self, request: Request, answer: Answer) -> None:
        speed = request.parameters[1]
        if not isfinite(speed) or speed in (-1.0, -2.0):
            answer(ACCEPTED, "")
        else:
            self.orders.give(
                "set_parameter", done_by(answer), name=CRUISE_SPEED, value=float(speed)
            )

    def _set_home(self, request: Request, answer: Answer) -> None:
        snapshot = self.handover.snapshot
        if snapshot is None:
            answer(DENIED, "the mission has not started")
            return
        if request.parameters[0] == 1.0:
            self.geography.home = snapshot.pose
        elif request.frame is None:
            answer(INT_ONLY, "")
            return
        elif request.frame not in GLOBAL_FRAMES:
            answer(WRONG_FRAME, "")
            return
        else:
            place = self.geography.place(*request.place)
            if place is None:
                answer(DENIED, NO_ORIGIN)
                return
            self.geography.home = Pose2D(*place, snapshot.pose.heading)
        self.streams.send_now(mav.MAVLINK_MSG_ID_HOME_POSITION)
        answer(ACCEPTED, "")

    def _set_current(self, request: Request, answer: Answer) -> None:
        seq = _number(request.parameters[0])
        refusal = self.plan.set_current(self.plan.first if seq < 0 else seq)
        answer(DENIED if refusal else ACCEPTED, refusal)

    def _tell(self, number: int, answer: Answer) -> None:
        """Acknowledge and send a message, or refuse."""
        if number == mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION:
            answer(ACCEPTED, "")
            self.send(status.autopilot_version(self.identity))
            return
        if number == mav.MAVLINK_MSG_ID_MISSION_CURRENT:
            answer(ACCEPTED, "")
            self.plan.tell_current()
            return
        known = self.streams.interval(number) != 0
        message = self.streams.message(number)
        if message is None:
            answer(FAILED if known else UNSUPPORTED, "")
            return
        answer(ACCEPTED, "")
        self.send(message)

    def _set_interval(self, request: Request, answer: Answer) -> None:
        number, interval = _number(request.parameters[0]), request.parameters[1]
        answer(ACCEPTED if self.streams.set_interval(number, interval) else UNSUPPORTED, "")

    def _get_interval(self, request: Request, answer: Answer) -> None:
        number = _number(request.parameters[0])
        answer(ACCEPTED, "")
        interval = self.streams.interval(number)
        self.send(mav.MAVLink_message_interval_message(number & 0xFFFF, interval))


def _number(value: float) -> int:
    """A whole number in a float parameter; -1 if there is none."""
    return int(value) if isfinite(value) and abs(value) < 2**31 else -1

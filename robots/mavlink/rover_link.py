"""Link to a rover: finds it, asks for control, streams setpoints, and gives its messages.

It has no thread and no clock of its own: the process of the fast loop calls `cycle` at a steady
rate, which does all that is due. The person with the
transmitter wins: a rover whose mode changes, or that is disarmed, while we drive it, gets no
setpoint any more until control is asked for again (`Order.engagement`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any

from robots.mavlink.autopilots import BY_NAME, CUSTOM_MODE
from robots.mavlink.hearing import AUTOPILOT_COMPONENT, Hearing, Rover
from robots.mavlink.requests import Requests
from stack.mavlink.address import MavlinkAddress
from stack.mavlink.frames import frd_twist
from stack.mavlink.link import Link, MakeCodec, Received, opening_problem

COMPONENT = 191
"""Our component: MAV_COMP_ID_ONBOARD_COMPUTER."""

HEARTBEAT_PERIOD, SETPOINT_PERIOD, ESTIMATE_PERIOD, TIMESYNC_PERIOD = 1.0, 0.05, 0.05, 0.5
"""Seconds. Autopilots ask for at least 4 setpoints a second (ArduRover) or 2 (PX4)."""

ASK_PERIOD = 1.0
"""Seconds between two requests to change the mode or to arm."""

SILENCE = 1.5
"""Seconds without any message after which the rover is lost: at 50 messages a second even a link
that loses most of them is not silent so long."""

SILENT_HEARTBEAT = 3.5
"""Seconds without a heartbeat after which its mode is not known any more."""

REOPEN_PERIOD = 1.0
"""Seconds between two attempts to open the link again."""

ENGAGING_TIME = 5.0
"""Seconds after which a rover that does not change its mode or is not armed is a problem."""

STOP_TIME, STANDING = 2.0, 0.05
"""Seconds that a rover gets to stop before it is disarmed, and the speed of a standing one, m/s."""

BODY_NED = 8
"""Frame of the setpoints; ArduRover drops BODY_FRD (12) without a word."""

VELOCITY_AND_YAW_RATE = 0x5C7
"""Mask of a setpoint: position, acceleration and yaw are ignored. Without the yaw rate a negative
vx means `turn round and drive forward` to ArduRover."""


class Phase(StrEnum):
    """How far the link has got."""

    SEARCHING = "searching"
    STANDING_BY = "standing by"
    ENGAGING = "engaging"
    DRIVING = "driving"
    TAKEN_OVER = "taken over"
    LOST = "lost"
    RELEASING = "releasing"
    RELEASED = "released"


@dataclass(frozen=True, slots=True)
class Order:
    """What the rover shall do.

    Attributes:
        linear: forward, m/s.
        angular: to the left, rad/s.
        engagement: 0: not driven by us, disarmed if we have armed it; a number that has not been
            used before: ask for the mode and arm; the same number: go on.
    """

    linear: float = 0.0
    angular: float = 0.0
    engagement: int = 0


STAND = Order()


class RoverLink:
    """Drives one rover.

    Args:
        address: where it is.
        own_system: our MAVLink id.
        system: id of the rover; 0: the only one that is there.
        autopilot: `auto`, or a name.
        wanted: (message id, Hz) that the rover is asked to send.
        origin: latitude and longitude, degrees, that the rover is told as its origin; or empty.
        now: seconds of the clock that `cycle` gets.
        make_codec: of signed frames; None: they are not signed.
        open_link: for tests.

    Attributes:
        heard: what the rover has told.
        phase: how far the link has got.
        estimate: returns the message with our estimate of the pose, or None, for the time `now`.
    """

    def __init__(  # noqa: PLR0913 - all but the first are set by name
        self, address: MavlinkAddress, *, own_system: int, system: int = 0,
        autopilot: str = "auto", wanted: tuple[tuple[int, float], ...] = (),
        origin: tuple[float, ...] = (), now: float = 0.0, make_codec: MakeCodec | None = None,
        open_link: Callable[..., Link] = Link,
    ) -> None:  # fmt: skip
        self.address = address
        self._own, self._open_link, self._make_codec = own_system, open_link, make_codec
        self._link: Link | None = None
        self._opening_problem, self._next_opening = "", now
        self.phase, self._reason = Phase.SEARCHING, ""
        self._requests = Requests(wanted)
        self.heard = Hearing(
            own_system, system, BY_NAME.get(autopilot), self._requests.acknowledged
        )
        self._restarts = 0
        self._origin, self._next_origin = origin, now
        self.estimate: Callable[[Any, float], Any | None] = lambda dialect, now: None
        self._engagement, self._now, self._lost_at = 0, now, now
        self._engaged_since = self._asked = now
        self._we_armed, self._releasing_since = False, now
        self._next_beat = self._next_setpoint = self._next_timesync = now
        self._next_estimate = now

    # What others ask.

    @property
    def dialect(self) -> Any:
        """pymavlink's module with messages, for `send`."""
        from pymavlink.dialects.v20 import all as dialect

        return dialect

    @property
    def problem(self) -> str:
        """Why the rover does not obey; empty while it does, or is on the way to."""
        if self._link is None:
            return self._opening_problem or f"MAVLink address {self.address}: not open"
        if self.phase is Phase.SEARCHING:
            refused = self._link.counters.refused if self._make_codec is not None else 0
            why = f"; {refused} frames were not signed with the key of the body" if refused else ""
            return f"no heartbeat of a rover on {self.address}{why}"
        if self.phase is Phase.ENGAGING and self._now - self._engaged_since > ENGAGING_TIME:
            return self._waiting_for
        shown = (Phase.TAKEN_OVER, Phase.LOST, Phase.STANDING_BY)
        return self._reason if self.phase in shown else ""

    @property
    def _waiting_for(self) -> str:
        rover = self.rover
        assert rover is not None
        wanted, said = rover.autopilot.driving, self.heard.last_text
        missing = "to be armed" if rover.mode == wanted else f"for the mode {wanted}"
        return f"the rover still waits {missing}" + (f" ({said})" if said else "")

    @property
    def rover(self) -> Rover | None:
        """The rover; None until it is found."""
        return self.heard.rover

    def counted(self) -> dict[str, int]:
        """What has passed the connection since it was opened, by name."""
        return {} if self._link is None else asdict(self._link.counters)

    def close(self) -> None:
        """Close the connection. Safe to call twice."""
        if self._link is not None:
            self._link.close()
            self._link = None

    # The cycle.

    def cycle(self, now: float, order: Order, wait: float = 0.0) -> list[Received]:
        """Do all that is due; return the new messages of the rover.

        Args:
            now: seconds of a steady clock, also that of the link's arrival times.
            order: what the rover shall do.
            wait: seconds to wait for a first message.
        """
        self._now = now
        if self._link is None and not self._opened(now):
            return []
        assert self._link is not None
        try:
            received = self._link.receive(wait)
            found = [item for item in received if self.heard.takes(item)]
            self._advance(now, order)
            self._send_due(self._link, now, order)
        except OSError as error:
            self._fail(now, error)
            return []
        return found

    def _opened(self, now: float) -> bool:
        if now < self._next_opening:
            return False
        self._next_opening = now + REOPEN_PERIOD
        try:
            self._link = self._open_link(
                self.address, system=self._own, component=COMPONENT, make_codec=self._make_codec
            )
        except OSError as error:
            self._opening_problem = opening_problem(self.address, error)
            return False
        self.heard.figures.reopened += bool(self._opening_problem)
        self._opening_problem = ""
        return True

    def _fail(self, now: float, error: OSError) -> None:
        """Close a connection that is gone; it is opened again later."""
        self.close()
        self._opening_problem = opening_problem(self.address, error)
        self._next_opening = now + REOPEN_PERIOD
        if self.rover is not None and self.phase is not Phase.LOST:
            self._lose(self._opening_problem)

    # Control.

    def _advance(self, now: float, order: Order) -> None:
        """Go on to the next phase."""
        rover = self.rover
        if rover is None:
            return
        if self.phase is Phase.SEARCHING:
            self.phase = Phase.STANDING_BY
        if self._restarts != self.heard.figures.restarts:
            self._restarts = self.heard.figures.restarts
            self._requests.repeat()  # it has forgotten the rates
        self._listen(now, rover)
        if order.engagement == 0:
            self._release(now, rover)
        elif order.engagement != self._engagement and self.phase is not Phase.LOST:
            self._engagement = order.engagement
            self.phase, self._reason = Phase.ENGAGING, ""
            self._engaged_since, self._asked = now, now - ASK_PERIOD
        if self.phase is Phase.ENGAGING:
            self._engage(now, rover)
        elif self.phase is Phase.DRIVING:
            self._watch(rover)

    def _listen(self, now: float, rover: Rover) -> None:
        """Notice that the rover is not heard any more, or again."""
        if self.phase is Phase.LOST:
            if now - rover.heard < SILENCE and now - rover.beat < SILENT_HEARTBEAT:
                # It stays a problem until control is asked for: the brain may not have seen it.
                again = f"the rover was lost ({self._reason}); `resume` asks for control again"
                self.phase, self._reason = Phase.STANDING_BY, again if self._engagement else ""
                self._requests.repeat()
        elif now - rover.heard > SILENCE:
            self._lose(f"nothing heard from the rover for {now - rover.heard:.1f} s")
        elif now - rover.beat > SILENT_HEARTBEAT:
            self._lose(f"no heartbeat of the rover for {now - rover.beat:.1f} s")

    def _lose(self, why: str) -> None:
        self.phase, self._reason, self._lost_at = Phase.LOST, why, self._now
        self.heard.figures.losses += 1

    def _engage(self, now: float, rover: Rover) -> None:
        """Ask for the driving mode, then to be armed; both until it is so."""
        autopilot = rover.autopilot
        if rover.mode == autopilot.driving and rover.armed:
            self.phase = Phase.DRIVING
            return
        if now - self._asked < ASK_PERIOD or now - self._engaged_since < autopilot.streams_first:
            return
        self._asked = now
        if rover.mode != autopilot.driving:
            mode = float(autopilot.driving_number)
            self._command(rover, self.dialect.MAV_CMD_DO_SET_MODE, float(CUSTOM_MODE), mode)
        else:
            self._we_armed = True
            self._command(rover, self.dialect.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)

    def _watch(self, rover: Rover) -> None:
        """Notice that somebody else has taken over."""
        why = ""
        if not rover.armed:
            why = "the rover was disarmed"
        elif rover.mode != rover.autopilot.driving:
            why = f"the rover's mode was changed from {rover.autopilot.driving} to {rover.mode}"
        if why:
            said = f" ({self.heard.last_text})" if self.heard.last_text else ""
            self.phase, self._we_armed = Phase.TAKEN_OVER, self._we_armed and rover.armed
            self._reason = f"{why}{said}; `resume` asks for {rover.autopilot.driving} again"

    def _release(self, now: float, rover: Rover) -> None:
        """Stop and disarm a rover that we drive; leave one alone that somebody else drives."""
        self._engagement = 0
        if self.phase in (Phase.DRIVING, Phase.ENGAGING):
            self.phase, self._releasing_since, self._asked = Phase.RELEASING, now, -ASK_PERIOD
        if self.phase is Phase.RELEASING:
            waited = now - self._releasing_since
            stopped = waited > STOP_TIME or (waited > 0.2 and rover.speed < STANDING)
            if rover.mode != rover.autopilot.driving or not rover.armed:
                self.phase = Phase.RELEASED
            elif stopped and not self._we_armed:
                self.phase = Phase.RELEASED
            elif stopped and now - self._asked >= ASK_PERIOD:
                self._asked = now
                self._command(rover, self.dialect.MAV_CMD_COMPONENT_ARM_DISARM, 0.0)

    # Sending.

    def _send_due(self, link: Link, now: float, order: Order) -> None:
        if now >= self._next_beat:
            self._next_beat = now + HEARTBEAT_PERIOD
            d = link.dialect
            link.send(
                d.MAVLink_heartbeat_message(
                    d.MAV_TYPE_ONBOARD_CONTROLLER, d.MAV_AUTOPILOT_INVALID, 0, 0,
                    d.MAV_STATE_ACTIVE, 3,
                )
            )  # fmt: skip
        rover = self.rover
        if rover is None:
            return
        if now >= self._next_timesync:
            self._next_timesync = now + TIMESYNC_PERIOD
            link.send(link.dialect.MAVLink_timesync_message(0, int(now * 1e9)))
        for message in self._requests.due(now, link.dialect, rover, self.heard.values):
            link.send(message)
        if now >= self._next_estimate:
            self._next_estimate = max(self._next_estimate + ESTIMATE_PERIOD, now)
            message = self.estimate(link.dialect, now)
            if message is not None:
                link.send(message)
        if self._origin and not self.heard.has_origin and now >= self._next_origin:
            self._next_origin = now + ASK_PERIOD
            latitude, longitude = (round(degrees * 1e7) for degrees in self._origin)
            link.send(
                link.dialect.MAVLink_set_gps_global_origin_message(
                    rover.system, latitude, longitude, 0
                )
            )
        if self._streams and now >= self._next_setpoint:
            # From the time that was due, so that the mean rate does not depend on the cycle's.
            self._next_setpoint = max(self._next_setpoint + SETPOINT_PERIOD, now)
            drives = self.phase is Phase.DRIVING and order.engagement != 0
            link.send(self._setpoint(now, rover, order if drives else STAND))
            self.heard.figures.setpoints += 1

    @property
    def _streams(self) -> bool:
        """Whether setpoints are sent.

        PX4 wants to see them before it changes its mode; a rover that is not heard any more may
        still hear us, and is told to stop.
        """
        if self.phase is Phase.LOST:
            return self._now - self._lost_at < STOP_TIME
        return self.phase in (Phase.ENGAGING, Phase.DRIVING, Phase.RELEASING)

    def _setpoint(self, now: float, rover: Rover, order: Order) -> Any:
        forward, right, yaw_rate = frd_twist(order.linear, 0.0, order.angular)
        return self.dialect.MAVLink_set_position_target_local_ned_message(
            int(now * 1000.0) & 0xFFFFFFFF, rover.system, AUTOPILOT_COMPONENT, BODY_NED,
            VELOCITY_AND_YAW_RATE, 0.0, 0.0, 0.0, forward, right, 0.0, 0.0, 0.0, 0.0, 0.0, yaw_rate,
        )  # fmt: skip

    def _command(self, rover: Rover, number: int, *values: float) -> None:
        assert self._link is not None
        padded = (*values, *(0.0,) * (7 - len(values)))
        self._link.send(
            self.dialect.MAVLink_command_long_message(
                rover.system, AUTOPILOT_COMPONENT, number, 0, *padded
            )
        )

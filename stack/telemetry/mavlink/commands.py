"""MAVLink's command protocol: every command is acknowledged, and a resent one is not run twice.

A command that waits for the engine is acknowledged as IN_PROGRESS until the engine has answered.
COMMAND_INT has no counter of resends: the same command from the same station within RESEND_TIME
counts as resent, unless any other command came in between.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import all as mav

from stack.telemetry.mavlink.texts import WARNING, Send, Texts

ACCEPTED, DENIED = mav.MAV_RESULT_ACCEPTED, mav.MAV_RESULT_DENIED
REJECTED, UNSUPPORTED = mav.MAV_RESULT_TEMPORARILY_REJECTED, mav.MAV_RESULT_UNSUPPORTED
FAILED, IN_PROGRESS = mav.MAV_RESULT_FAILED, mav.MAV_RESULT_IN_PROGRESS
INT_ONLY = mav.MAV_RESULT_COMMAND_INT_ONLY
WRONG_FRAME = 9
"""MAV_RESULT_COMMAND_UNSUPPORTED_MAV_FRAME, which this dialect has no name for."""

PATIENCE = 0.3
"""Wall seconds after which a command that waits for the engine is acknowledged as IN_PROGRESS, and
again each time: stations resend after 0.5 s."""

RESEND_TIME = 2.0
MAX_STATIONS = 32

Sender = tuple[int, int]
"""System and component id."""

Answer = Callable[[int, str], None]
"""answer(result, text): acknowledge; a text is sent to the operator. Called once."""


@dataclass(frozen=True, slots=True)
class Request:
    """A command of a station.

    Attributes:
        sender: who asks.
        command: its number.
        parameters: its first four; a COMMAND_LONG has seven.
        frame: of the place, of a COMMAND_INT; None for a COMMAND_LONG.
        place: x and y of a COMMAND_INT, mostly latitude and longitude in 1e-7 degrees.
        confirmation: number of times that it was resent before.
    """

    sender: Sender
    command: int
    parameters: tuple[float, ...]
    frame: int | None = None
    place: tuple[int, int] = (0, 0)
    confirmation: int = 0

    @property
    def content(self) -> str:
        """All but the counter, for comparison: NaN does not equal itself."""
        return repr((self.sender, self.command, self.parameters, self.frame, self.place))


Handler = Callable[[Request, Answer], None]


def read_request(message: Any) -> Request:
    """The request of a COMMAND_LONG or COMMAND_INT."""
    sender = message.get_srcSystem(), message.get_srcComponent()
    first = message.param1, message.param2, message.param3, message.param4
    if message.get_type() == "COMMAND_INT":
        return Request(sender, message.command, first, message.frame, (message.x, message.y))
    more = message.param5, message.param6, message.param7
    return Request(sender, message.command, first + more, confirmation=message.confirmation)


@dataclass
class _Open:
    """A command that waits for the engine."""

    content: str
    told: float


class CommandService:
    """Receives commands, calls their handlers and acknowledges.

    Args:
        handlers: by number of the command.
        send: sends a message.
        texts: of refusals.
        clock: returns wall seconds.
    """

    def __init__(
        self, handlers: Mapping[int, Handler], send: Send, texts: Texts,
        clock: Callable[[], float],
    ) -> None:  # fmt: skip
        self._handlers, self._send, self._texts, self._clock = handlers, send, texts, clock
        self._open: dict[tuple[Sender, int], _Open] = {}
        self._last: tuple[str, int, float] = "", 0, 0.0

    def receive(self, message: Any) -> None:
        """Carry out a COMMAND_LONG or COMMAND_INT."""
        self.carry_out(read_request(message), self._handlers.get(message.command))

    def carry_out(self, request: Request, handler: Handler | None) -> None:
        """Call the handler of a request, unless the request was resent.

        Args:
            request: of a station.
            handler: calls back once, now or later; None: there is no such command.
        """
        place, now = (request.sender, request.command), self._clock()
        waiting = self._open.get(place)
        if waiting is not None:
            same = waiting.content == request.content
            self._acknowledge(request, IN_PROGRESS if same else REJECTED)
            return
        content, result, time = self._last
        resent = request.confirmation > 0 or request.frame is not None
        if resent and content == request.content and now - time < RESEND_TIME:
            self._acknowledge(request, result)
            return
        if handler is None or len(self._open) >= MAX_STATIONS:
            self._acknowledge(request, UNSUPPORTED if handler is None else REJECTED)
            return
        self._last = "", 0, 0.0
        self._open[place] = _Open(request.content, now)

        def answer(result: int, text: str = "") -> None:
            del self._open[place]
            self._last = request.content, result, self._clock()
            self._acknowledge(request, result)
            if text:
                self._texts.tell(text, WARNING)

        handler(request, answer)

    def tick(self) -> None:
        """Tell stations whose commands still wait for the engine."""
        now = self._clock()
        for (sender, command), waiting in self._open.items():
            if now - waiting.told >= PATIENCE:
                waiting.told = now
                self._acknowledge(Request(sender, command, ()), IN_PROGRESS)

    def _acknowledge(self, request: Request, result: int) -> None:
        progress = 255 if result == IN_PROGRESS else 0  # 255: unknown
        self._send(
            mav.MAVLink_command_ack_message(request.command, result, progress, 0, *request.sender)
        )


def done_by(answer: Answer) -> Callable[[str], None]:
    """A callback for an order to the engine that answers a command."""
    return lambda refusal: answer(DENIED if refusal else ACCEPTED, refusal)

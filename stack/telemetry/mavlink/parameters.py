"""MAVLink's parameter protocol: the public numeric parameters of the running components.

Values are sent as ArduPilot does (C_CAST): the number itself as a float, beside its type.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from math import isfinite
from struct import error as struct_error
from struct import pack, unpack
from typing import Any

from pymavlink.dialects.v20 import all as mav

from stack.telemetry.mavlink.handover import Handover
from stack.telemetry.mavlink.orders import Orders
from stack.telemetry.mavlink.parameter_names import short_names
from stack.telemetry.mavlink.texts import WARNING, Send, Texts
from stack.types import ParameterTable

REAL, WHOLE, TRUTH = (
    mav.MAV_PARAM_TYPE_REAL32, mav.MAV_PARAM_TYPE_INT32, mav.MAV_PARAM_TYPE_UINT8,
)  # fmt: skip

LISTED_AT_ONCE = 5
LIST_PERIOD = 0.02
"""Parameters sent together in answer to a list request, and wall seconds between: 250 a second."""


class ParameterService:
    """Lists, reads and changes parameters for stations."""

    def __init__(self, handover: Handover, orders: Orders, send: Send, texts: Texts) -> None:
        self._handover, self._orders, self._send, self._texts = handover, orders, send, texts
        self._names: dict[str, str] = {}
        self._listing, self._next, self._sent = False, 0, 0.0

    def list_all(self, message: Any) -> None:
        """Answer PARAM_REQUEST_LIST, from the next `tick` on."""
        self._read_names()
        self._listing, self._next = True, 0

    def read(self, message: Any) -> None:
        """Answer PARAM_REQUEST_READ by name, or by index if it is not negative."""
        self._read_names()
        names = list(self._names)
        if message.param_index >= 0:
            short = names[message.param_index] if message.param_index < len(names) else ""
        else:
            short = message.param_id
        if short in self._names:
            self._tell(short)
        else:
            which = f"index {message.param_index}" if message.param_index >= 0 else repr(short)
            self._texts.tell(f"there is no parameter {which}", WARNING)

    def change(self, message: Any) -> None:
        """Carry out PARAM_SET; the answer carries the new value, or the old one if refused."""
        self._read_names()
        short = message.param_id
        if short not in self._names:
            self._texts.tell(f"there is no parameter {short!r}", WARNING)
            return
        old, given = self._value(short), float(message.param_value)
        value: float | int | bool = given
        if not isfinite(given):
            self._refused(short, f"{given} is not a finite number")
            return
        if isinstance(old, bool):
            value = given != 0.0
        elif isinstance(old, int):
            value = round(given)
        else:
            value = _shortest(given)
        full = self._names[short]
        done = partial(self._changed, short, value)
        self._orders.give("set_parameter", done, name=full, value=value)

    def tick(self, now: float) -> None:
        """Send the next part of a list, wall seconds."""
        if not self._listing or now - self._sent < LIST_PERIOD:
            return
        self._sent = now
        names = list(self._names)
        for short in names[self._next : self._next + LISTED_AT_ONCE]:
            self._tell(short)
        self._next += LISTED_AT_ONCE
        self._listing = self._next < len(names)

    def _changed(self, short: str, value: float, refusal: str) -> None:
        if refusal:
            self._refused(short, refusal)
        else:
            self._tell(short, value)

    def _refused(self, short: str, why: str) -> None:
        self._texts.tell(f"{short} is unchanged: {why}", WARNING)
        self._tell(short)

    def _tell(self, short: str, value: float | None = None) -> None:
        present = self._value(short) if value is None else value
        kind = TRUTH if isinstance(present, bool) else WHOLE if isinstance(present, int) else REAL
        index = list(self._names).index(short)
        number = float(present) if isinstance(present, int | float) else float("nan")
        self._send(mav.MAVLink_param_value_message(
            short.encode(), number, kind, len(self._names), index
        ))  # fmt: skip

    def _value(self, short: str) -> Any:
        return self._values.get(self._names[short])

    @property
    def _values(self) -> Mapping[str, Any]:
        snapshot = self._handover.snapshot
        return {} if snapshot is None else snapshot.parameters

    def _read_names(self) -> None:
        """The short names of what can be told as a number; they stay for the run."""
        snapshot = self._handover.snapshot
        layer = snapshot.layers.get("parameters") if snapshot is not None else None
        if self._names or layer is None or not isinstance(layer.content, ParameterTable):
            return
        self._names = short_names(
            item.name for item in layer.content.parameters
            if item.public and isinstance(item.start, int | float)
        )  # fmt: skip


def _shortest(value: float) -> float:
    """The shortest decimal that becomes the same 32-bit float: 0.8, not 0.800000011920929."""
    try:
        for digits in range(1, 10):
            text = float(f"{value:.{digits}g}")
            if unpack("<f", pack("<f", text)) == unpack("<f", pack("<f", value)):
                return text
    except (OverflowError, struct_error):
        pass
    return value

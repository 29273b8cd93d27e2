"""MAVLink's mission protocol: stations upload, download and clear plans.

The old plan stays until the last item of a new one has come and all are accepted. One station
uploads at a time. Fences and rally points are empty and stay so.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from pymavlink.dialects.v20 import all as mav

from stack.telemetry.mavlink.commands import Sender
from stack.telemetry.mavlink.plan import MAX_ITEMS, OK, Item, PlanCheck, is_home, read_item
from stack.telemetry.mavlink.plan_runner import PlanRunner
from stack.telemetry.mavlink.texts import NOTICE, WARNING, Send, Texts

ITEM_PERIOD, TRIES = 0.25, 12
"""Wall seconds until an item is asked for again, and how often before the upload is given up."""

REPEAT_TIME = 10.0
"""Wall seconds for which a repeated last item is acknowledged again: the ack may be lost."""

PLAN, FENCE, RALLY, EVERY = 0, 1, 2, 255
DENIED, CANCELLED = mav.MAV_MISSION_DENIED, mav.MAV_MISSION_OPERATION_CANCELLED
UNSUPPORTED, NO_SPACE = mav.MAV_MISSION_UNSUPPORTED, mav.MAV_MISSION_NO_SPACE
BAD_SEQUENCE = mav.MAV_MISSION_INVALID_SEQUENCE
BUSY = "the plan is being driven: change to HOLD or GUIDED before changing it"


@dataclass
class _Upload:
    """A running upload."""

    sender: Sender
    count: int
    asked: float
    items: list[Item] = field(default_factory=list)
    tries: int = 0


class PlanTransfer:
    """Exchanges plans with stations.

    Args:
        runner: has the plan.
        check: of items.
        home_item: `auto`, `always` or `never`: whether the first item is home.
        send: sends a message.
        texts: of refusals.
        clock: returns wall seconds.
    """

    def __init__(  # noqa: PLR0913
        self, runner: PlanRunner, check: PlanCheck, home_item: str, send: Send,
        texts: Texts, clock: Callable[[], float],
    ) -> None:  # fmt: skip
        self._runner, self._check, self._home_item = runner, check, home_item
        self._send, self._texts, self._clock = send, texts, clock
        self._upload: _Upload | None = None
        self._finished: tuple[Sender, int, int, float] = ((0, 0), -1, OK, 0.0)

    def begin_upload(self, message: Any) -> None:
        """Answer MISSION_COUNT: ask for the first item."""
        sender, kind = _sender(message), message.mission_type
        if self._upload is not None and self._upload.sender != sender:
            self._acknowledge(sender, DENIED, kind)
            self._texts.tell("another station is uploading a plan", WARNING)
        elif kind != PLAN:
            empty = kind in (FENCE, RALLY) and message.count == 0
            self._acknowledge(sender, OK if empty else UNSUPPORTED, kind)
        elif self._runner.is_active:
            self._refuse(sender, DENIED, BUSY)
        elif message.count > MAX_ITEMS:
            self._refuse(sender, NO_SPACE, f"a plan may have at most {MAX_ITEMS} items")
        elif message.count == 0:
            self._upload = None
            self._runner.replace((), has_home=False)
            self._acknowledge(sender, OK)
        else:
            self._upload = _Upload(sender, message.count, self._clock())
            self._ask(self._upload)

    def take_item(self, message: Any) -> None:
        """Take a MISSION_ITEM_INT or MISSION_ITEM of the running upload."""
        upload, sender = self._upload, _sender(message)
        if message.mission_type != PLAN:
            self._acknowledge(sender, UNSUPPORTED, message.mission_type)
        elif upload is None or upload.sender != sender:
            self._repeat(sender, message.seq)
        elif message.seq != len(upload.items):
            self._ask(upload)  # an item out of order: ask for the one that is next
        else:
            self._take(upload, read_item(message))

    def _take(self, upload: _Upload, item: Item) -> None:
        first = upload.items[0] if upload.items else item
        has_home = upload.count > 1 and is_home(first, self._home_item)
        home = has_home and item.seq == 0
        result, why = self._check.problem(item, home=home)
        if result != OK:
            self._upload = None
            self._refuse(upload.sender, result, why)
            return
        upload.items.append(item)
        upload.tries = 0
        if len(upload.items) < upload.count:
            self._ask(upload)
            return
        self._upload = None
        if self._runner.is_active:  # it was started meanwhile
            self._refuse(upload.sender, DENIED, BUSY)
            return
        self._runner.replace(upload.items, has_home=has_home)
        self._acknowledge(upload.sender, OK)
        self._finished = upload.sender, upload.count - 1, OK, self._clock()

    def _repeat(self, sender: Sender, seq: int) -> None:
        """Acknowledge a repeated last item again; other items without an upload are an error."""
        whom, last, result, time = self._finished
        if (whom, last) == (sender, seq) and self._clock() - time < REPEAT_TIME:
            self._acknowledge(sender, result)
        elif self._upload is None:
            self._acknowledge(sender, BAD_SEQUENCE)
        else:
            self._acknowledge(sender, DENIED)

    def list_items(self, message: Any) -> None:
        """Answer MISSION_REQUEST_LIST with the number of items."""
        kind = message.mission_type
        if kind not in (PLAN, FENCE, RALLY):
            self._acknowledge(_sender(message), UNSUPPORTED, kind)
            return
        count = len(self._runner.items) if kind == PLAN else 0
        self._send(mav.MAVLink_mission_count_message(*_sender(message), count, kind))

    def send_item(self, message: Any) -> None:
        """Answer MISSION_REQUEST_INT and the older MISSION_REQUEST."""
        sender, items = _sender(message), self._runner.items
        if message.mission_type != PLAN or message.seq >= len(items):
            self._acknowledge(sender, BAD_SEQUENCE, message.mission_type)
            return
        item = items[message.seq]
        current = int(item.seq == self._runner.current)
        head = (
            *sender, item.seq, item.frame, item.command, current, item.autocontinue,
            *item.parameters,
        )  # fmt: skip
        if message.get_type() == "MISSION_REQUEST_INT":
            answer = mav.MAVLink_mission_item_int_message(*head, item.x, item.y, item.z, PLAN)
        else:
            answer = mav.MAVLink_mission_item_message(
                *head, item.x / 1e7, item.y / 1e7, item.z, PLAN
            )
        self._send(answer)

    def clear(self, message: Any) -> None:
        """Answer MISSION_CLEAR_ALL."""
        sender, kind = _sender(message), message.mission_type
        if kind not in (PLAN, FENCE, RALLY, EVERY):
            self._acknowledge(sender, UNSUPPORTED, kind)
        elif kind in (PLAN, EVERY) and self._runner.is_active:
            self._refuse(sender, DENIED, BUSY, kind)
        elif self._upload is not None and self._upload.sender != sender:
            self._acknowledge(sender, DENIED, kind)
        else:
            if kind in (PLAN, EVERY):
                self._upload = None
                self._runner.replace((), has_home=False)
            self._acknowledge(sender, OK, kind)

    def set_current(self, message: Any) -> None:
        """Answer MISSION_SET_CURRENT with MISSION_CURRENT, or with a text."""
        refusal = self._runner.set_current(message.seq)
        if refusal:
            self._texts.tell(refusal, WARNING)

    def refuse_part(self, message: Any) -> None:
        """Refuse the transfer of a part of a plan."""
        self._acknowledge(_sender(message), UNSUPPORTED, message.mission_type)

    def take_ack(self, message: Any) -> None:
        """A station ends its upload by an ack with an error; after a download it is ignored."""
        upload = self._upload
        if upload is not None and upload.sender == _sender(message) and message.type != OK:
            self._upload = None
            self._texts.tell("the upload of a plan was cancelled", NOTICE)

    def tick(self, now: float) -> None:
        """Ask again for an item that has not come; give up after TRIES."""
        upload = self._upload
        if upload is None or now - upload.asked < ITEM_PERIOD:
            return
        if upload.tries >= TRIES:
            self._upload = None
            missing = f"item {len(upload.items)} has not come; the upload is given up"
            self._refuse(upload.sender, CANCELLED, missing)
            return
        upload.tries += 1
        self._ask(upload)

    def _ask(self, upload: _Upload) -> None:
        upload.asked = self._clock()
        seq = len(upload.items)
        self._send(mav.MAVLink_mission_request_int_message(*upload.sender, seq, PLAN))

    def _refuse(self, sender: Sender, result: int, why: str, kind: int = PLAN) -> None:
        self._acknowledge(sender, result, kind)
        self._texts.tell(f"plan refused: {why}", WARNING)

    def _acknowledge(self, sender: Sender, result: int, kind: int = PLAN) -> None:
        self._send(mav.MAVLink_mission_ack_message(*sender, result, kind))


def _sender(message: Any) -> Sender:
    return message.get_srcSystem(), message.get_srcComponent()

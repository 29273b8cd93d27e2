"""Where two runs part: the first difference that matters, and the first of any bit."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import zip_longest
from math import hypot

from missions.execution.repeat import differing_events
from missions.inspection.page.story import Story
from stack.telemetry.records import Event

APART = 0.01
"""Metres by which two poses differ in a way that matters."""


def difference(one: Story, other: Story) -> str:
    """Return the sentences for people: what differs first, and up to where all bits are equal."""
    names = one.name, other.name
    exact = [event for event in differing_events(one.events, other.events) if event is not None]
    if not exact:
        return "the two runs are equal, event by event"
    parted = _parted(one.events, other.events, names)
    time, kind = exact[0].time, exact[0].kind
    bits = f"bit by bit they are equal up to {time:.2f} s (event {exact[0].number}, {kind})"
    if not parted:
        return f"the same happens in both runs, and the poses agree within {APART:g} m; {bits}"
    return f"{min(parted)[1]}; {bits}"


def _parted(
    one: Iterable[Event], other: Iterable[Event], names: tuple[str, str]
) -> list[tuple[float, str]]:
    """Return the first event, and the first pose, in which two runs differ: time and sentence."""
    old, new = list(one), list(other)
    found = []
    for a, b in zip_longest(_happened(old), _happened(new)):
        if _essence(a) != _essence(b):
            time = min(event.time for event in (a, b) if event is not None)
            words = [_words(name, event) for name, event in zip(names, (a, b), strict=True)]
            found.append((time, f"the first difference that matters: {', but '.join(words)}"))
            break
    for a, b in zip(_poses(old), _poses(new), strict=False):
        away = hypot(*(float(a.fields[axis]) - float(b.fields[axis]) for axis in "xy"))
        if away > APART:
            found.append((a.time, f"the poses differ by {away:.2f} m at {a.time:.1f} s"))
            break
    return found


def _happened(events: Iterable[Event]) -> list[Event]:
    return [event for event in events if event.kind != "pose"]


def _poses(events: Iterable[Event]) -> list[Event]:
    return [event for event in events if event.kind == "pose"]


def _essence(event: Event | None) -> tuple[object, ...]:
    """What is compared of an event: its kind and text, and of a node the new status."""
    return () if event is None else (event.kind, event.text, event.fields.get("to"))


def _words(name: str, event: Event | None) -> str:
    return f"{name} ends" if event is None else f"{name}: {event.text} ({event.time:.1f} s)"

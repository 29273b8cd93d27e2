"""Shrinks settings that break a mission: fewer, and closer to the defaults, as long as they do."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass
from typing import TypeVar

from missions.execution.fit.faults import NONE, PREFIX
from missions.sweeps.sweep import FAULTS

HALVINGS = 4
"""How often the way from a number to its default is halved."""

T = TypeVar("T")

Settings = Mapping[str, str]
Tries = Generator[Settings, bool, T]


@dataclass(frozen=True, slots=True)
class Number:
    """A setting that is a number.

    Attributes:
        value: in its unit.
        unit: as written; may be empty.
        default: to which it is moved; None: there is none.
    """

    value: float
    unit: str = ""
    default: float | None = None

    def text(self, value: float) -> str:
        """Return another value as text."""
        return f"{value:g} {self.unit}".rstrip()


@dataclass
class Shrinking:
    """Tries simpler settings one after another.

    Its generators yield settings and are sent whether the mission breaks with them.

    Args:
        number: returns the number that a setting is; None if it is none.
        budget: number of tries.
    """

    number: Callable[[str, str], Number | None]
    budget: int

    def shrink(self, settings: Settings) -> Tries[dict[str, str]]:
        """Return the simplest settings found with which it breaks."""
        found = yield from self._without_faults(dict(settings))
        for name in [*found]:
            if name == FAULTS or name not in found:
                continue
            rest = {other: text for other, text in found.items() if other != name}
            if (yield from self._try(rest)):
                found = rest
        for name in [*found]:
            found = yield from self._closer(found, name)
        return found

    def _without_faults(self, settings: dict[str, str]) -> Tries[dict[str, str]]:
        """Return the settings without the faults that do not matter."""
        if FAULTS not in settings:
            return settings
        for name in settings[FAULTS].split("+"):
            names = [other for other in settings[FAULTS].split("+") if other != name]
            rest = {
                other: text for other, text in settings.items()
                if not other.startswith(f"{PREFIX}{name}.")
            }  # fmt: skip
            rest[FAULTS] = "+".join(names) or NONE
            if (yield from self._try(rest)):
                settings = rest
        return settings

    def _closer(self, settings: dict[str, str], name: str) -> Tries[dict[str, str]]:
        """Return the settings with a number closer to its default, and with fewer digits."""
        number = self.number(name, settings[name])
        if number is None:
            return settings
        failing = number.value
        if number.default is not None:
            passing = number.default
            for _ in range(HALVINGS):
                middle = (failing + passing) / 2.0
                if (yield from self._try({**settings, name: number.text(middle)})):
                    failing = middle
                else:
                    passing = middle
        changed = {**settings, name: number.text(failing)} if failing != number.value else settings
        rounded = {**settings, name: number.text(float(f"{failing:.2g}"))}
        if rounded != changed and (yield from self._try(rounded)):
            return rounded
        return changed

    def _try(self, settings: Settings) -> Tries[bool]:
        if self.budget <= 0:
            return False
        self.budget -= 1
        return (yield settings)

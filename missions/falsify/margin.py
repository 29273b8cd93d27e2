"""Margins of runs: how far a run is from breaking a requirement, as one number.

A requirement is a condition on a figure of a run, `clearance > 0.1`. Its margin is the distance of
the figure from the number, relative to the number: 0.5 for a clearance of 15 cm, -0.5 for one of
5 cm. The margin of a run is the least of its requirements; a run that collides, or does not
succeed, has at most -1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from missions.sweeps.claims import COMPARISONS, read_condition
from missions.sweeps.figures import MEASURES
from missions.sweeps.row import SweepRow
from stack.errors import InputError
from stack.parameters import suggestion

BROKEN = -1.0
"""Largest margin of a run that collides or does not succeed."""

IRRELEVANT = 1.0e3
"""Margin of a run that the mission refuses: it tells nothing."""

DEFAULTS = {"clearance": "clearance > 0.02", "error": "error < 0.5"}
"""Requirements that a figure alone stands for; `time` is below the time limit."""


@dataclass(frozen=True, slots=True)
class Requirement:
    """What a run must have.

    Attributes:
        text: as written.
        figure: key of MEASURES.
        below: whether the figure must be below the number; otherwise above.
    """

    text: str
    figure: str
    below: bool
    number: float

    def margin(self, row: SweepRow) -> float:
        """Return the relative distance from the number; above 0 if the run has what it must."""
        value = MEASURES[self.figure].read(row)
        if value is None:
            return IRRELEVANT
        apart = self.number - value if self.below else value - self.number
        return apart / (abs(self.number) or 1.0)


def read_requirement(text: str, time_limit: float) -> Requirement:
    """Read `clearance > 0.1`, or a figure alone.

    Raises:
        InputError: it is something else.
    """
    word = text.strip()
    defaults = {**DEFAULTS, "time": f"time < {time_limit:g}"}
    condition = read_condition(defaults.get(word, word)) if _is_condition(word, defaults) else None
    if condition is None or condition.figure not in MEASURES:
        known = list(defaults)
        raise InputError(
            f"--margin {text}: expected a figure of a run, or a condition on one",
            f"write 'clearance > 0.1'; {suggestion(word, known)}",
        )
    below = condition.comparison.startswith("<")
    return Requirement(condition.text, condition.figure, below, condition.number)


def _is_condition(word: str, defaults: dict[str, str]) -> bool:
    return word in defaults or any(sign in word for sign in COMPARISONS)


def margin_of(row: SweepRow, requirements: Sequence[Requirement]) -> float:
    """Return the margin of a run: below 0 if it is a counterexample."""
    if not row.counts:
        return IRRELEVANT
    least = min((one.margin(row) for one in requirements), default=IRRELEVANT)
    if row.is_success and not row.collisions:
        return least
    return min(BROKEN, least)

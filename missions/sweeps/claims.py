"""Claims about sweeps: `success > 0.97 at 95 %` for `--until`, `success < 0.95` for `--fail-if`."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from operator import ge, gt, le, lt

from missions.sweeps.figures import FIGURES, RATES
from missions.sweeps.row import SweepRow
from missions.sweeps.statistics import is_proved
from stack.errors import InputError
from stack.parameters import suggestion

COMPARISONS = {"<": lt, "<=": le, ">": gt, ">=": ge}

_CLAIM = re.compile(r"success\s*>\s*([\d.]+)\s*(%?)\s+at\s+([\d.]+)\s*%")
_CONDITION = re.compile(r"([a-z_.]+)\s*(<=|>=|<|>)\s*([-+]?[\d.]+(?:e[-+]?\d+)?)\s*(%?)")


@dataclass(frozen=True, slots=True)
class Claim:
    """A claim about the rate of success.

    Attributes:
        text: as written.
        rate: above which the rate of success is claimed to be.
        error: probability of a wrong answer that is accepted.
    """

    text: str
    rate: float
    error: float

    def verdict(self, rows: Sequence[SweepRow]) -> bool | None:
        """Whether the claim is proved (True) or its opposite (False); None: neither yet."""
        return Decision(self, rows).verdict

    def describe(self, rows: Sequence[SweepRow]) -> str:
        """Return the verdict in words."""
        words = {True: "proved", False: "refuted: its opposite is proved", None: "not decided"}
        return f"{self.text}: {words[self.verdict(rows)]}"


class Decision:
    """Verdict on a claim, after each run.

    Runs count in the order of their numbers, up to the first one that is missing: a run that fails
    may take longer, so that those which are over are no fair sample.

    Args:
        claim: about the runs.
        rows: of the runs so far.

    Attributes:
        verdict: as of `Claim.verdict`; the first one that the runs give.
    """

    def __init__(self, claim: Claim, rows: Iterable[SweepRow]) -> None:
        self.verdict: bool | None = None
        self._claim = claim
        self._waiting: dict[int, SweepRow] = {}
        self._number = self._successes = self._trials = 0
        for row in rows:
            self.add(row)

    def add(self, row: SweepRow) -> None:
        """Take a further run into account."""
        self._waiting[row.number] = row
        while self.verdict is None and self._number in self._waiting:
            counted = self._waiting.pop(self._number)
            self._number += 1
            if counted.counts:
                self._successes += counted.is_success
                self._trials += 1
                self.verdict = is_proved(
                    self._successes, self._trials, self._claim.rate, self._claim.error
                )


def read_claim(text: str) -> Claim:
    """Read `success > 0.97 at 95 %`.

    Raises:
        InputError: it is something else.
    """
    found = _CLAIM.fullmatch(text.strip())
    example = "write it as 'success > 0.97 at 95 %'"
    if found is None:
        raise InputError(f"{text}: not a claim about the rate of success", example)
    rate = _number(found[1]) * (0.01 if found[2] else 1.0)
    certainty = _number(found[3]) * 0.01
    if not 0.0 < rate < 1.0:
        raise InputError(f"{text}: the rate {rate:g} is not between 0 and 1", example)
    if not 0.5 <= certainty < 1.0:
        raise InputError(f"{text}: the certainty {certainty:.4g} is not in [0.5, 1)", example)
    return Claim(text.strip(), rate, 1.0 - certainty)


@dataclass(frozen=True, slots=True)
class Condition:
    """A condition on a figure of a sweep.

    Attributes:
        text: as written.
        figure: key of FIGURES.
        comparison: < | <= | > | >=
    """

    text: str
    figure: str
    comparison: str
    number: float

    def holds(self, rows: Sequence[SweepRow]) -> bool:
        """Whether it holds; of a figure that no run has, it does, so that a check cannot pass."""
        value = FIGURES[self.figure](rows)
        return value is None or bool(COMPARISONS[self.comparison](value, self.number))

    def describe(self, rows: Sequence[SweepRow]) -> str:
        """Return the condition, whether it holds, and the value of its figure."""
        value = FIGURES[self.figure](rows)
        if value is None:
            return f"{self.text}: holds, since no run has this figure"
        holds = "holds" if self.holds(rows) else "does not hold"
        return f"{self.text}: {holds}, {self.figure} is {value:.4g}"


def read_condition(text: str) -> Condition:
    """Read `success < 0.95`.

    Raises:
        InputError: it is something else.
    """
    found = _CONDITION.fullmatch(text.strip())
    if found is None:
        raise InputError(
            f"{text}: not FIGURE, a comparison and a number",
            "write it as 'success < 0.95'",
        )
    if found[1] not in FIGURES:
        raise InputError(f"{text}: there is no figure {found[1]!r}", suggestion(found[1], FIGURES))
    number = _number(found[3]) * (0.01 if found[4] else 1.0)
    if found[1] in RATES and not 0.0 <= number <= 1.0:
        raise InputError(
            f"{text}: {found[1]} is from 0 to 1", f"write it as '{found[1]} {found[2]} 95 %'"
        )
    return Condition(text.strip(), found[1], found[2], number)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{text!r} is not a number") from None

"""Factors of faults: when they begin, how long they last, and their numbers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import isfinite

from missions.execution.fit.faults import PREFIX
from missions.sweeps.factors import UNIFORM, Factor
from stack.parameters import Declaration, declarations
from stack.sim.faults.fault import BEFORE, LASTING
from stack.sim.faults.registry import fault_kind

LASTS = (0.5, 10.0)
"""Seconds that a fault lasts."""


def fault_factors(kinds: Sequence[str], seconds: float) -> Iterator[Factor]:
    """Yield the factors of faults.

    Args:
        kinds: names of kinds, each once.
        seconds: that the mission takes without them: they begin in this time.

    Raises:
        InputError: there is no such kind.
    """
    for name in kinds:
        kind = fault_kind(name)
        if kind.kind != BEFORE:
            yield Factor(f"{PREFIX}{name}.at", UNIFORM, low=0.0, high=seconds, unit="s")
        if kind.kind == LASTING:
            yield Factor(f"{PREFIX}{name}.for", UNIFORM, low=LASTS[0], high=LASTS[1], unit="s")
        for declared in declarations(kind.Parameters).values():
            if _is_range(declared):
                low = declared.above if declared.at_least is None else declared.at_least
                low = (low or 0.0) + (1e-3 if declared.above is not None else 0.0)
                yield Factor(
                    f"{PREFIX}{name}.{declared.name}", UNIFORM, low=low,
                    high=float(declared.at_most or 0.0), unit=declared.unit,
                )  # fmt: skip


def _is_range(declared: Declaration) -> bool:
    """Whether a number is public and has a default between two ends."""
    ends = (declared.above if declared.at_least is None else declared.at_least, declared.at_most)
    return (
        declared.public and declared.type is float
        and isinstance(declared.default, float)
        and all(end is not None and isfinite(end) for end in ends)
    )  # fmt: skip

"""Sampling of settings: a scrambled Halton sequence, which fills a box evenly.

J. H. Halton, "On the efficiency of certain quasi-random sequences of points", Numerische
Mathematik 2 (1960); the digits of each place are permuted at random as in A. B. Owen, "A randomized
Halton algorithm in R", arXiv:1706.02808 (2017). Twenty points leave smaller gaps than twenty
independent ones, and unlike in a grid every point has a new value of each parameter. The same seed
gives the same points.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import count, islice

import numpy as np

from missions.tuning.ranges import Range
from stack.streams import stream
from stack.types import FloatArray

Settings = Mapping[str, str]
"""`controller.cruise_speed` -> value as text."""

Box = Sequence[tuple[float, float]]
"""Lower and upper fraction of each range."""

SHRINK = 0.5
"""Largest width of a refinement box, as a fraction of the box before."""


def halton(points: int, dimensions: int, seed: int) -> FloatArray:
    """Return a scrambled Halton sequence (points, dimensions) in [0, 1)."""
    generator = stream(seed, "tune")
    columns = [_radical_inverse(points, base, generator) for base in islice(_primes(), dimensions)]
    return np.column_stack(columns) if columns else np.empty((points, 0))


def sampled(
    ranges: Sequence[Range], points: int, seed: int, box: Box | None = None
) -> list[Settings]:
    """Return distinct settings from the whole ranges, or from a box in them."""
    box = box or [(0.0, 1.0)] * len(ranges)
    found: dict[tuple[str, ...], None] = {}
    for row in halton(points, len(ranges), seed):
        shares = [low + float(u) * (high - low) for u, (low, high) in zip(row, box, strict=True)]
        found[tuple(item.text_at(u) for item, u in zip(ranges, shares, strict=True))] = None
    names = [item.name for item in ranges]
    return [dict(zip(names, texts, strict=True)) for texts in found]


def refined_box(ranges: Sequence[Range], best: Sequence[Settings], turn: int) -> Box:
    """Return the box around the best settings; its largest width halves with each turn.

    Args:
        ranges: the ranges.
        best: the best third of the settings, best first.
        turn: number of the refinement, from 1.
    """
    return [_side(item, [item.share_of(one[item.name]) for one in best], turn) for item in ranges]


def _side(item: Range, shares: list[float], turn: int) -> tuple[float, float]:
    widest = SHRINK**turn
    margin = 0.1 * widest  # a side must have a width, and better values may lie just outside
    if item.values:  # complete values: the best ones and those listed between them
        margin = 0.5 / len(item.values)
        return max(0.0, min(shares) - margin), min(1.0, max(shares) + margin)
    low, high = max(0.0, min(shares) - margin), min(1.0, max(shares) + margin)
    if high - low <= widest:
        return low, high
    low = min(max(shares[0] - widest / 2.0, low), high - widest)
    return low, low + widest


def _radical_inverse(points: int, base: int, generator: np.random.Generator) -> FloatArray:
    """Return 0.d1 d2 d3… of n = …d3 d2 d1 in the base, with the digits permuted by place."""
    places = int(np.ceil(32.0 / np.log2(base)))
    remaining, weight = np.arange(points), 1.0
    result = np.zeros(points)
    for _ in range(places):
        weight /= base
        remaining, digits = np.divmod(remaining, base)
        result += weight * generator.permutation(base)[digits]
    return np.minimum(result, np.nextafter(1.0, 0.0))


def _primes() -> Iterator[int]:
    """Yield 2, 3, 5, 7…"""
    found: list[int] = []
    for number in count(2):
        if all(number % prime for prime in found):
            found.append(number)
            yield number

"""Seeded random streams by name: independent streams for independent users."""

from __future__ import annotations

from functools import cache
from hashlib import sha256

import numpy as np


def stream(seed: int, name: str, step: int = 0) -> np.random.Generator:
    """Return the random generator for (seed, name, step): the same numbers in every process.

    Optional sensors draw the noise of each measurement from a new stream with its step, so that
    using one sensor does not change any other result.
    """
    # An array of words is the same entropy as a list of integers, and faster.
    entropy = np.array(entropy_of(seed, name, step), dtype=np.uint32)
    return np.random.Generator(np.random.PCG64(entropy))


def entropy_of(seed: int, name: str, step: int) -> list[int]:
    """Return the words of 32 bits that seed the stream for (seed, name, step)."""
    return [*_words(seed), *_words(step), *_words_of(name)]


def _words(number: int) -> list[int]:
    """Return a number as words of 32 bits, the lowest first, as NumPy's SeedSequence does."""
    if number < 0:
        raise ValueError(f"the seed or step {number} is negative")
    words = [number & 0xFFFFFFFF]
    while number := number >> 32:
        words.append(number & 0xFFFFFFFF)
    return words


@cache
def _words_of(name: str) -> tuple[int, ...]:
    digest = sha256(name.encode()).digest()[:16]
    return tuple(np.frombuffer(digest, dtype=np.uint32).tolist())

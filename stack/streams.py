"""Seeded random streams by name: independent streams for independent users."""

from __future__ import annotations

from hashlib import sha256

import numpy as np


def stream(seed: int, name: str, step: int = 0) -> np.random.Generator:
    """Return the random generator for (seed, name, step): the same numbers in every process.

    Optional sensors draw the noise of each measurement from a new stream with its step, so that
    using one sensor does not change any other result.
    """
    words = np.frombuffer(sha256(name.encode()).digest()[:16], dtype=np.uint32)
    return np.random.Generator(np.random.PCG64([seed, step, *(int(word) for word in words)]))

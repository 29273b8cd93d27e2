"""Seeded random streams by name, so that one user of randomness never disturbs another."""

from __future__ import annotations

from hashlib import sha256

import numpy as np


def stream(seed: int, name: str, step: int = 0) -> np.random.Generator:
    """The generator for (seed, name, step): the same three, the same numbers, in any process.

    Optional sensors draw each frame's noise from a fresh stream with the step it belongs to, so
    that subscribing to one changes nothing else.
    """
    words = np.frombuffer(sha256(name.encode()).digest()[:16], dtype=np.uint32)
    return np.random.Generator(np.random.PCG64([seed, step, *(int(word) for word in words)]))

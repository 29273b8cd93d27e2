"""Random streams of a sensor's measurements: a new one for each, those of `stack.streams`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.random.bit_generator import ISeedSequence

from stack.compilation import KernelTypes
from stack.streams import entropy_of


class MeasurementStreams:
    """The streams for (seed, name) and each step.

    NumPy's SeedSequence hashes the entropy in Python and takes longer than the noise of a scan.
    Here the same hash is compiled.
    """

    @staticmethod
    def kernels() -> KernelTypes:
        """Return the kernels of the streams."""
        from stack.sim.sensors.kernels import SEEDING  # imports numba

        return SEEDING

    def __init__(self, seed: int, name: str) -> None:
        from stack.sim.sensors.kernels import seed_state  # imports numba

        self._seed, self._name, self._seed_state = seed, name, seed_state

    def at(self, step: int) -> np.random.Generator:
        """Return the generator `stream(seed, name, step)`."""
        entropy = np.array(entropy_of(self._seed, self._name, step))
        hashed = _Hashed(self._seed_state(entropy))
        return np.random.Generator(np.random.PCG64(hashed))  # type: ignore[arg-type]


class _Hashed(ISeedSequence):
    """Entropy of which the state of a PCG64 has been hashed."""

    def __init__(self, state: Any) -> None:
        self._state = state

    def generate_state(self, n_words: int, dtype: Any = np.uint32) -> Any:
        """Return the four words of 64 bits that PCG64 asks for."""
        assert (n_words, dtype) == (4, np.uint64)
        return self._state

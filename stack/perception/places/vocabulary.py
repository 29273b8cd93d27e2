"""Visual vocabulary and whole-picture descriptors (VLAD) for the retrieval of keyframes.

H. Jégou et al., "Aggregating local descriptors into a compact image representation", CVPR 2010;
normalised within each word (R. Arandjelović, A. Zisserman, "All about VLAD", CVPR 2013).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stack.perception.places.features import Descriptors, squared_distances
from stack.streams import stream
from stack.types import FloatArray

WORDS, ROUNDS, SAMPLES = 32, 10, 8000
"""Words of a vocabulary, rounds of k-means, and most descriptors that it is trained with."""


@dataclass(frozen=True, slots=True)
class Vocabulary:
    """Visual words. words: (k, 128) whole numbers, so that all distances are exact."""

    words: NDArray[np.uint8]

    def describe(self, descriptors: Descriptors) -> FloatArray:
        """Return the VLAD of a picture's descriptors: (128 k,) of length 1, or all 0."""
        total = np.zeros(self.words.shape, dtype=np.int64)
        if len(descriptors):
            nearest = squared_distances(descriptors, self.words).argmin(axis=1)
            difference = descriptors.astype(np.int64) - self.words[nearest]
            np.add.at(total, nearest, difference)
        lengths = np.sqrt((total**2).sum(axis=1, keepdims=True).astype(np.float64))
        rows = total / np.maximum(lengths, 1.0)
        flat: FloatArray = rows.ravel()
        return flat / max(float(np.sqrt((flat * flat).sum())), 1e-9)


def trained(pictures: Sequence[Descriptors]) -> Vocabulary:
    """Return the vocabulary of some pictures by k-means.

    The words are the means of the descriptors that are nearest to them, rounded. The start is
    drawn from a fixed stream: the same pictures give the same vocabulary.
    """
    every = np.concatenate(list(pictures))
    random = stream(0, "place vocabulary")
    if len(every) > SAMPLES:
        every = every[np.sort(random.choice(len(every), SAMPLES, replace=False))]
    distinct = np.unique(every, axis=0)
    chosen = random.choice(len(distinct), min(WORDS, len(distinct)), replace=False)
    words = distinct[np.sort(chosen)]
    for _ in range(ROUNDS):
        nearest = squared_distances(every, words).argmin(axis=1)
        totals = np.zeros((len(words), every.shape[1]), dtype=np.int64)
        np.add.at(totals, nearest, every.astype(np.int64))
        counts = np.bincount(nearest, minlength=len(words))
        means = np.rint(totals / np.maximum(counts, 1)[:, None]).astype(np.uint8)
        words = np.where(counts[:, None] > 0, means, words)
    return Vocabulary(words)

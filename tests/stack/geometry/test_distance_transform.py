"""Distance transform: the exact distances, in every bit."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from stack.geometry.distance_transform import distances_to_zero


@given(arrays.arrays(np.bool_, arrays.array_shapes(min_dims=2, max_dims=2, max_side=24)))
@settings(deadline=None, max_examples=150)
def test_every_distance_is_the_root_of_a_whole_number(cells):
    rows, columns = np.indices(cells.shape)
    zeros = np.argwhere(~cells)
    if len(zeros):
        away = (rows[..., None] - zeros[:, 0]) ** 2 + (columns[..., None] - zeros[:, 1]) ** 2
        expected = np.sqrt(away.min(axis=2).astype(np.float32))
    else:
        expected = np.full(cells.shape, np.inf, np.float32)
    assert distances_to_zero(cells).tobytes() == expected.tobytes()


@given(st.integers(0, 63))
@settings(deadline=None, max_examples=40)
def test_the_place_in_memory_does_not_matter(offset):
    """In OpenCV's own transform the last bit of some cells depends on it."""
    image = (np.random.default_rng(3).random((211, 167)) > 0.02).astype(np.uint8)
    memory = np.empty(image.size + 64, np.uint8)
    moved = memory[offset : offset + image.size].reshape(image.shape)
    moved[:] = image
    assert distances_to_zero(moved).tobytes() == distances_to_zero(image).tobytes()

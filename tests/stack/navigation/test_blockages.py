import numpy as np

from stack.navigation.plans.choice import Blockages

RADIUS, FIRST_HOLD = 0.6, 10.0
THROUGH = np.column_stack([np.linspace(0, 8, 100), np.full(100, 3.0)])
AROUND = np.column_stack([np.linspace(0, 8, 100), np.full(100, 1.0)])


def test_a_blockage_rejects_paths_through_it_for_a_while():
    blockages = Blockages(RADIUS, FIRST_HOLD)
    blockages.note((4.0, 3.0), 100.0)
    assert blockages.bar(THROUGH, 100.0)
    assert not blockages.bar(AROUND, 100.0)
    assert blockages.bar(THROUGH, 100.0 + FIRST_HOLD - 0.1)
    assert not blockages.bar(THROUGH, 100.0 + FIRST_HOLD)


def test_time_and_radius_are_those_that_are_set():
    blockages = Blockages(0.2, 4.0)
    blockages.note((4.0, 3.0), 0.0)
    assert not blockages.bar(AROUND + np.array([0.0, 1.7]), 1.0)  # 0.3 m beside it
    assert blockages.bar(THROUGH, 3.9) and not blockages.bar(THROUGH, 4.0)


def test_a_repeated_blockage_is_remembered_twice_as_long():
    blockages = Blockages(RADIUS, FIRST_HOLD)
    blockages.note((4.0, 3.0), 0.0)
    blockages.note((4.3, 3.2), 20.0)  # 0.36 m away: the same
    assert blockages.bar(THROUGH, 20.0 + 2 * FIRST_HOLD - 0.1)
    assert not blockages.bar(THROUGH, 20.0 + 2 * FIRST_HOLD)


def test_a_blockage_seen_again_in_time_is_only_extended():
    blockages = Blockages(RADIUS, FIRST_HOLD)
    blockages.note((4.0, 3.0), 0.0)
    blockages.note((4.0, 3.0), 5.0)
    assert not blockages.bar(THROUGH, 5.0 + FIRST_HOLD)

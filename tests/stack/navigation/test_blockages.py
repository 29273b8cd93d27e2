import numpy as np

from stack.navigation.blockages import FIRST_HOLD, Blockages

THROUGH = np.column_stack([np.linspace(0, 8, 100), np.full(100, 3.0)])
AROUND = np.column_stack([np.linspace(0, 8, 100), np.full(100, 1.0)])


def test_a_blockage_rejects_paths_through_it_for_a_while():
    blockages = Blockages()
    blockages.note((4.0, 3.0), 100.0)
    assert blockages.bar(THROUGH, 100.0)
    assert not blockages.bar(AROUND, 100.0)
    assert blockages.bar(THROUGH, 100.0 + FIRST_HOLD - 0.1)
    assert not blockages.bar(THROUGH, 100.0 + FIRST_HOLD)


def test_a_repeated_blockage_is_remembered_twice_as_long():
    blockages = Blockages()
    blockages.note((4.0, 3.0), 0.0)
    blockages.note((4.3, 3.2), 20.0)  # 0.36 m away: the same
    assert blockages.bar(THROUGH, 20.0 + 2 * FIRST_HOLD - 0.1)
    assert not blockages.bar(THROUGH, 20.0 + 2 * FIRST_HOLD)


def test_a_blockage_seen_again_in_time_is_only_extended():
    blockages = Blockages()
    blockages.note((4.0, 3.0), 0.0)
    blockages.note((4.0, 3.0), 5.0)
    assert not blockages.bar(THROUGH, 5.0 + FIRST_HOLD)

"""Detections and the mask of a colour in rerun."""

import numpy as np
import pytest

from stack.telemetry.rerun.snapshots import MASK_SHOWN
from stack.types import ColourMask, Detection
from tests.stack.telemetry.rerun_recording import drawn, rows_by_entity

CHAIR = Detection("chair", 0.0, (2.0, 2.5), 0.05, 0.5, 0.9, (1, 2, 5, 6), 0.75)
BOXES, POINTS, MASK = "/world/camera/objects", "/world/objects", "/world/camera/mask"


@pytest.fixture
def recorded(tmp_path, info, snapshot_at):
    """Return a function that records snapshots, one in 0.2 s; the rows of each entity."""

    def record(*changes):
        bare = {"detections": (), "mask": None}
        return rows_by_entity(drawn(tmp_path, info, [
            snapshot_at(time=0.2 * n, **(bare | change)) for n, change in enumerate(changes)
        ]))  # fmt: skip

    return record


def test_detections_are_drawn_when_they_change_and_hidden_at_the_end(recorded):
    seen = {"detections": (CHAIR,)}
    rows = recorded({}, seen, seen, seen, {})
    # The frame, the detection and its removal.
    assert rows[BOXES] == rows[POINTS] == 3


def test_without_detections_nothing_is_written(recorded):
    assert not {BOXES, POINTS, MASK} & recorded({}, {}).keys()


def test_the_mask_of_a_colour_is_drawn_and_hidden_later(recorded):
    masks = [{"mask": ColourMask("red", 0.2 * n, np.eye(6, 8, dtype=np.uint8))} for n in range(10)]
    rows = recorded(*masks, *[{}] * round(MASK_SHOWN / 0.2 + 2))
    # Frame, colours, 10 masks, and the removal.
    assert rows[MASK] == 2 + 10 + 1

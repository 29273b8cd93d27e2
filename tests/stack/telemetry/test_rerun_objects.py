"""Detections and the mask of a colour in rerun."""

import numpy as np
import pytest

from stack.telemetry.rerun.sink import RerunSink
from stack.telemetry.rerun.snapshots import MASK_SHOWN
from stack.types import ColourMask, Detection
from tests.stack.telemetry.test_rerun_sink import rerun, rows_by_entity

CHAIR = Detection("chair", 0.0, (2.0, 2.5), 0.05, 0.5, 0.9, (1, 2, 5, 6), 0.75)
BOXES, POINTS, MASK = "/world/camera/objects", "/world/objects", "/world/camera/mask"


@pytest.fixture
def recorded(tmp_path, info, snapshot_at):
    """Return a function that records snapshots, one in 0.2 s; the rows of each entity."""

    def record(*changes):
        sink = RerunSink(tmp_path / "mission.rrd")
        sink.open(info)
        for number, change in enumerate(changes):
            time = 0.2 * number
            sink.snapshot(snapshot_at(time=time, **{"detections": (), "mask": None, **change}))
        sink.close(None)
        assert rerun("print", sink.path).returncode == 0
        return rows_by_entity(sink.path)

    return record


def test_detections_are_drawn_when_they_change_and_hidden_at_the_end(recorded):
    seen = {"detections": (CHAIR,)}
    rows = recorded({}, seen, seen, seen, {})
    # The frame, the detection and its removal.
    assert rows[BOXES] == rows[POINTS] == 3


def test_without_detections_nothing_is_written(recorded):
    assert not {BOXES, POINTS, MASK} & recorded({}, {}).keys()


def test_the_mask_of_a_colour_is_drawn_at_the_rate_of_pictures_and_hidden_later(recorded):
    masks = [{"mask": ColourMask("red", 0.2 * n, np.eye(6, 8, dtype=np.uint8))} for n in range(10)]
    rows = recorded(*masks, *[{}] * round(MASK_SHOWN / 0.2 + 2))
    # Frame, colours, 2 s at 2 Hz, and the removal.
    assert rows[MASK] == 2 + 4 + 1

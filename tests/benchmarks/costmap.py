"""Updates of costmaps and of the tracker with 720 beams: compute time on one core."""

from __future__ import annotations

from time import process_time

import numpy as np

from stack.costmap.choosing import read_layers
from stack.costmap.costmap import Costmap
from stack.costmap.layer import LayerUpdate, Posed
from stack.costmap.parameters import CostmapParameters
from stack.perception.tracking.parameters import TrackerParameters
from stack.perception.tracking.tracker import Tracker
from stack.types import (
    FREE,
    OCCUPIED,
    FloatArray,
    Footprint,
    OccupancyGrid,
    Pose2D,
    Scan,
    TrackedObject,
)
from tests.benchmarks.table import Rows

BEAMS, UPDATES, WARM = 720, 220, 20
LANE = [[-5.0, -5.0], [5.0, -5.0], [5.0, 5.0], [-5.0, 5.0]]
EVERYTHING = [
    "static", "obstacle", "range", "denoise", {"use": "keepout", "zones": [LANE[:3]]},
    {"use": "preferred_lanes", "zones": [LANE]}, "social",
]  # fmt: skip


def run() -> Rows:
    """Median and 95th percentile of an update, milliseconds of processor time."""
    usual: list[object] = ["static", "obstacle"]
    cases = [
        ("local 200 x 200, standing", usual, 10.0, 0.0),
        ("local 200 x 200, 0.8 m/s and turning", usual, 10.0, 0.08),
        ("local 200 x 200, every layer, 5 people, moving", EVERYTHING, 10.0, 0.08),
        ("global 600 x 800, moving", usual, None, 0.08),
    ]
    rows = [
        _row(title, _updates(layers, window, stride)) for title, layers, window, stride in cases
    ]
    return [*rows, _row("tracker, 46 things", _tracking())]


def _row(what: str, seconds: FloatArray) -> dict[str, object]:
    return {
        "what": what, "beams": BEAMS, "updates": seconds.size,
        "median_ms": round(1e3 * float(np.median(seconds)), 3),
        "p95_ms": round(1e3 * float(np.percentile(seconds, 95)), 3),
    }  # fmt: skip


def _map() -> OccupancyGrid:
    cells = np.full((600, 800), FREE, dtype=np.int8)
    cells[::90] = cells[:, ::110] = OCCUPIED
    cells[40:50] = cells[:, 50:56] = FREE
    return OccupancyGrid(cells, 0.05, (-20.0, -15.0))


def _scans() -> list[Scan]:
    """A ragged room with lidar noise, so that marks flicker all round."""
    random = np.random.default_rng(1)
    angles = np.arange(BEAMS) * 2 * np.pi / BEAMS
    room = 1.6 + 0.5 * np.sin(3 * angles) + 0.3 * np.sign(np.sin(23 * angles))
    return [
        Scan(0.1 * step, (room + random.normal(0, 0.01, BEAMS)).astype(np.float32),
             0.0, 2 * np.pi / BEAMS, 0.08, 12.0)
        for step in range(UPDATES)
    ]  # fmt: skip


def _updates(layers: list[object], window: float | None, stride: float) -> FloatArray:
    parameters = CostmapParameters()
    costmap = Costmap(
        parameters, Footprint.circle(0.22), _map(), window=window,
        layers=read_layers(layers, parameters),
    )  # fmt: skip
    taken = []
    for step, scan in enumerate(_scans()):
        pose = Pose2D(stride * step - 8.0, 0.5 * stride * step - 4.0, stride * step)
        tracks = _walkers(pose, 0.1 * step)
        update = LayerUpdate(pose, 0.1 * step, {"lidar": Posed(scan, pose)}, (), tracks)
        began = process_time()
        costmap.update(update)
        _ = costmap.grid
        taken.append(process_time() - began)
    return np.array(taken[WARM:])


def _walkers(pose: Pose2D, time: float) -> tuple[TrackedObject, ...]:
    """Five people around the robot."""
    return tuple(
        TrackedObject(
            number, time, (pose.x + number - 2.0, pose.y + 1.0), (1.0, 0.2), 0.25, np.eye(4)
        )
        for number in range(5)
    )


def _tracking() -> FloatArray:
    tracker = Tracker(TrackerParameters(), _map())
    taken = []
    for step, scan in enumerate(_scans()):
        began = process_time()
        tracker.update(Pose2D(-8.0, -4.0, 0.0), scan, 0.1 * step)
        taken.append(process_time() - began)
    return np.array(taken[WARM:])

import tempfile

import numpy as np
import pytest

from stack.telemetry.records import (
    Layer,
    MissionState,
    RunInfo,
    SceneShape,
    Snapshot,
    StageTiming,
    TreeRow,
)
from stack.types import (
    Battery,
    CameraModel,
    ColourMask,
    CostGrid,
    Detection,
    Footprint,
    Image,
    Marker,
    OccupancyGrid,
    Path,
    Pose2D,
    Scan,
    TrackedObject,
    Twist,
)


class Clock:
    """A wall clock that stands still until told otherwise."""

    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def runtime_directory(monkeypatch):
    """A private place for sockets with a path short enough for one."""
    with tempfile.TemporaryDirectory(prefix="tp", dir="/tmp") as folder:
        monkeypatch.setenv("XDG_RUNTIME_DIR", folder)
        monkeypatch.setattr("stack.telemetry.rendezvous.usual_folders", list)
        yield folder


@pytest.fixture
def info():
    return RunInfo(
        "test_run-1", "test_run", "A test", "rover", "office", 7, Footprint.circle(0.3),
        markers=(Marker(3, 0.2, (1.0, 2.0, 0.5), 1.57),),
        places={"dock": Pose2D(1.0, 2.0, 0.5)},
    )  # fmt: skip


def make_snapshot(time=1.0, step=20, map_version=1, **changes):
    """A snapshot with something in every field."""
    camera = CameraModel(8, 6, 7.0, (0.2, 0.0, 0.3))
    layers = {
        "map": Layer(map_version, OccupancyGrid(np.full((60, 80), -1, np.int8), 0.05, (-1.0, 2.0))),
        "local_costmap": Layer(4, CostGrid(np.zeros((20, 20), np.uint8), 0.05)),
        "scene": Layer(1, (SceneShape("box", Pose2D(1.0, 2.0), (1.0, 0.5, 1.0), (0.5, 0.5, 0.5)),)),
    }
    values = {
        "time": time, "step": step, "state": MissionState.RUNNING, "reason": "",
        "tree": (
            TreeRow(0, -1, "Patrol", "sequence", "running", since=0.5),
            TreeRow(1, 0, "to the dock", "navigate_to_pose", "running", "3.2 m to go", 0.5),
        ),
        "pose": Pose2D(1.0, 2.0, 0.25), "covariance": np.diag([0.01, 0.02, 0.03]),
        "health": 0.9, "battery": Battery(0.8),
        "particles": np.arange(30, dtype=np.float32).reshape(10, 3),
        "scan": Scan(time, np.array([1.0, np.inf, np.nan], np.float32), -1.0, 1.0, 0.1, 12.0),
        "path": Path(np.arange(9.0).reshape(3, 3)), "goal": Pose2D(3.0, 4.0),
        "layers": layers, "commanded": Twist(0.5, 0.1), "measured": Twist(0.4, 0.1),
        "stages": {"tree": StageTiming(0.001, 0.002, 10)}, "speed": 12.0,
        "parameters": {"controller.cruise_speed": 0.5, "planner.kind": "a_star"},
        "image": Image(time, np.full((6, 8, 3), 7, np.uint8), camera),
        "truth": Pose2D(1.01, 2.0, 0.25), "people": np.array([[3.0, 3.0, 0.2]]),
        "blackboard": {"round": "3"}, "counters": {"replans": 2.0},
        "tracks": (
            TrackedObject(
                4, time, (3.0, 3.0), (0.5, -0.2), 0.2, np.diag([0.01, 0.02, 0.1, 0.1]), "person"
            ),
        ),
        "detections": (
            Detection("chair", time, (2.0, 2.5), 0.05, 0.5, 0.9, (1, 2, 5, 6), 0.75),
        ),
        "mask": ColourMask("red", time, np.eye(6, 8, dtype=np.uint8)),
    }  # fmt: skip
    return Snapshot(**(values | changes))


@pytest.fixture
def snapshot_at():
    return make_snapshot

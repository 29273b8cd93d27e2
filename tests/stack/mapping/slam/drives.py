"""Mapping and localising drives in the drawn rooms, without a simulation."""

from itertools import pairwise
from pathlib import Path

import numpy as np

from robots.load import find_robot, read_robot
from stack.frames.buffer import TransformBuffer
from stack.mapping.graph_files import saved_files
from stack.mapping.ros_map import map_files
from stack.mapping.slam.estimator import SlamEstimator
from stack.mapping.slam.mapper import Mapper
from stack.mapping.slam.parameters import SlamParameters
from stack.mapping.slam.pose_graph_localiser import PoseGraphLocaliser
from stack.mapping.whole_files import replace_folder
from stack.types import STANDSTILL, FloatArray, Observation, Odometry, Pose2D
from tests.stack.mapping.slam.rooms import scan_at

ROBOT = read_robot(find_robot("scout", Path()))


def line(*corners: tuple[float, float], step: float = 0.1) -> list[Pose2D]:
    """Poses along straight lines, with turns of at most 0.25 rad on the spot."""
    poses: list[Pose2D] = []
    for (x, y), (to_x, to_y) in pairwise(corners):
        heading = float(np.arctan2(to_y - y, to_x - x))
        if poses:
            turn = (heading - poses[-1].heading + np.pi) % (2 * np.pi) - np.pi
            count = int(np.ceil(abs(turn) / 0.25))
            before = poses[-1].heading
            poses += [Pose2D(x, y, before + turn * k / count) for k in range(1, count)]
        count = max(1, round(float(np.hypot(to_x - x, to_y - y)) / step))
        share = np.arange(count + 1) / count
        poses += [Pose2D(x + s * (to_x - x), y + s * (to_y - y), heading) for s in share.tolist()]
    return poses


def mapped(walls: FloatArray, poses: list[Pose2D], mapper: Mapper | None = None) -> Mapper:
    """Map a room with noisy scans and exact odometry."""
    if mapper is None:
        mapper = Mapper(SlamParameters())
        mapper.start(poses[0])
    for k, pose in enumerate(poses):
        mapper.add(0.1 * k, pose, scan_at(walls, pose, 0.1 * k, 0.01, k))
    return mapper


def saved(mapper: Mapper, folder: Path) -> Path:
    """Save the map and the graph of a mapper."""
    files = map_files(mapper.grid(), "map.yaml", "map.pgm")
    replace_folder(folder, {**files, **saved_files(mapper.graph)})
    return folder


class EstimatorDrive:
    """Drives an estimator with the scans of a room and odometry of a frame of its own."""

    def __init__(self, mapper: Mapper, folder: Path, start: Pose2D | None, kind=PoseGraphLocaliser):
        self.estimator: SlamEstimator = kind(SlamParameters(), ROBOT, mapper.grid(), 1)
        self.estimator.load_map(mapper.grid(), folder, start)
        self.frames, self.time, self.errors = TransformBuffer(), 0.0, []

    def run(self, walls: FloatArray, poses: list[Pose2D]):
        """Follow the poses with exact odometry; return the newest estimate."""
        for pose in poses:
            self.step(walls, pose, Pose2D(30.0, -7.0, 1.0).compose(pose))
        return self.estimator.estimate

    def step(self, walls: FloatArray, pose: Pose2D, odometry: Pose2D):
        """Give the estimator the scan at a pose, and odometry; return its estimate."""
        self.time += 0.1
        self.frames.add(Odometry(self.time, odometry, STANDSTILL))
        scan = scan_at(walls, pose, self.time, 0.01, round(self.time * 10))
        estimate = self.estimator.update(Observation(self.time, {"lidar": scan}), self.frames)
        self.errors.append(estimate.pose.distance_to(pose))
        return estimate

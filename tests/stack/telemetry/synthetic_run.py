"""A made-up but consistent run: a rover drives round an office, to have something to show."""

from dataclasses import dataclass
from functools import cached_property
from math import cos, pi, sin

import cv2
import numpy as np

from stack.streams import stream
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
    CostGrid,
    Footprint,
    Image,
    Marker,
    OccupancyGrid,
    Path,
    Pose2D,
    Scan,
    Twist,
)

RESOLUTION = 0.05
WIDTH, DEPTH = 14.0, 9.0
WALLS = [  # x, y of the middle, length, width
    (7.0, 0.05, 14.0, 0.1), (7.0, 8.95, 14.0, 0.1), (0.05, 4.5, 0.1, 9.0), (13.95, 4.5, 0.1, 9.0),
    (4.6, 7.4, 0.1, 3.0), (4.6, 4.2, 0.1, 1.6), (2.3, 5.9, 2.2, 0.1), (9.4, 1.5, 0.1, 3.0),
    (9.4, 5.6, 0.1, 2.6), (11.6, 4.9, 2.4, 0.1), (6.2, 3.4, 1.6, 0.1),
]  # fmt: skip
FURNITURE = [
    (2.0, 7.7, 1.6, 0.8), (1.0, 3.6, 0.8, 1.6), (6.9, 7.9, 1.4, 0.7), (12.3, 7.6, 1.4, 0.8),
    (12.5, 1.6, 0.8, 1.6), (6.1, 5.5, 0.9, 0.9),
]  # fmt: skip
PLANTS = [(5.1, 8.4), (13.3, 5.4), (8.9, 0.6), (0.6, 8.4)]
ROUTE = np.array(
    [
        (1.2, 1.2),
        (4.4, 1.6),
        (7.6, 2.0),
        (8.2, 3.7),
        (8.0, 6.2),
        (9.6, 7.7),
        (11.2, 7.4),
        (11.6, 6.0),
    ]
)
SPEED = 0.6
URDF = """<?xml version="1.0"?>
<robot name="rover">
  <material name="shell"><color rgba="0.20 0.46 0.62 1"/></material>
  <material name="dark"><color rgba="0.10 0.11 0.13 1"/></material>
  <material name="lamp"><color rgba="0.95 0.62 0.20 1"/></material>
  <link name="base_link">
    <visual><origin xyz="0 0 0.14"/><geometry><box size="0.52 0.36 0.14"/></geometry>
      <material name="shell"/></visual>
  </link>
  <link name="left_wheel"><visual><origin rpy="1.5708 0 0"/>
    <geometry><cylinder radius="0.09" length="0.06"/></geometry>
    <material name="dark"/></visual></link>
  <link name="right_wheel"><visual><origin rpy="1.5708 0 0"/>
    <geometry><cylinder radius="0.09" length="0.06"/></geometry>
    <material name="dark"/></visual></link>
  <link name="lidar"><visual>
    <geometry><cylinder radius="0.06" length="0.08"/></geometry>
    <material name="lamp"/></visual></link>
  <joint name="left" type="continuous"><parent link="base_link"/><child link="left_wheel"/>
    <origin xyz="0 0.21 0.09"/><axis xyz="0 1 0"/></joint>
  <joint name="right" type="continuous"><parent link="base_link"/><child link="right_wheel"/>
    <origin xyz="0 -0.21 0.09"/><axis xyz="0 1 0"/></joint>
  <joint name="lidar_mount" type="fixed"><parent link="base_link"/><child link="lidar"/>
    <origin xyz="0.1 0 0.25"/></joint>
</robot>
"""
NODES = [
    (-1, "Office patrol", "sequence"), (0, "Battery guard", "fallback"), (0, "Rounds", "repeat"),
    (2, "Visit every desk", "sequence"), (3, "to the kitchen", "navigate_to_pose"),
    (3, "Inspect", "wait"), (3, "to the meeting room", "navigate_to_pose"), (0, "Dock", "dock"),
]  # fmt: skip


@dataclass
class SyntheticRun:
    """The run as functions of time."""

    seed: int = 1

    def info(self, run_id="synthetic-1"):
        corners = np.array([[0.27, 0.24], [-0.27, 0.24], [-0.27, -0.24], [0.27, -0.24]])
        return RunInfo(
            run_id, "office_patrol", "Office patrol", "rover", "office", self.seed,
            Footprint(corners), urdf=URDF,
            markers=(Marker(3, 0.2, (4.54, 7.2, 0.6), pi), Marker(4, 0.2, (9.34, 5.6, 0.6), pi)),
            places={
                "dock": Pose2D(1.2, 1.2), "kitchen": Pose2D(8.2, 3.7),
                "meeting room": Pose2D(11.6, 6.0),
            },
        )  # fmt: skip

    @cached_property
    def grid(self):
        rows, columns = round(DEPTH / RESOLUTION), round(WIDTH / RESOLUTION)
        cells = np.zeros((rows, columns), np.int8)
        for x, y, length, width in WALLS + FURNITURE:
            low = np.round(np.array([y - width / 2, x - length / 2]) / RESOLUTION).astype(int)
            high = np.round(np.array([y + width / 2, x + length / 2]) / RESOLUTION).astype(int)
            cells[low[0] : high[0], low[1] : high[1]] = 100
        for x, y in PLANTS:
            centre = (round(x / RESOLUTION), round(y / RESOLUTION))
            cv2.circle(cells.view(np.uint8), centre, 5, 100, -1)
        cells[-40:, -50:][cells[-40:, -50:] == 0] = -1
        return OccupancyGrid(cells, RESOLUTION)

    @cached_property
    def costs(self):
        free = (self.grid.cells != 100).astype(np.uint8)
        distance = cv2.distanceTransform(free, cv2.DIST_L2, 5) * RESOLUTION
        cost = np.where(distance < 0.9, 252 * np.exp(-4.0 * (distance - 0.24)), 0.0)
        cost = np.clip(cost, 0, 252).astype(np.uint8)
        cost[distance < 0.24] = 253
        cost[free == 0] = 254
        return cost

    @cached_property
    def scene(self):
        grey, wood, green = (0.62, 0.66, 0.74), (0.62, 0.46, 0.34), (0.30, 0.56, 0.38)
        boxes = [
            SceneShape("box", Pose2D(x, y), (length, width, height), colour)
            for things, height, colour in ((WALLS, 0.7, grey), (FURNITURE, 0.55, wood))
            for x, y, length, width in things
        ]
        plants = [SceneShape("cylinder", Pose2D(x, y), (0.5, 0.5, 0.6), green) for x, y in PLANTS]
        return tuple(boxes + plants)

    @cached_property
    def route(self):
        """(n, 3) the whole way, smoothed, a point every few centimetres."""
        t = np.linspace(0, len(ROUTE) - 1, 600)
        points = np.column_stack([np.interp(t, range(len(ROUTE)), ROUTE[:, k]) for k in (0, 1)])
        points = np.pad(points, ((60, 60), (0, 0)), mode="edge")
        box = np.ones(121) / 121
        points = np.column_stack([np.convolve(points[:, k], box, "valid") for k in (0, 1)])
        heading = np.arctan2(*np.gradient(points, axis=0)[:, ::-1].T)
        return np.column_stack([points, heading])

    def truth_at(self, time):
        lengths = np.r_[0, np.cumsum(np.linalg.norm(np.diff(self.route[:, :2], axis=0), axis=1))]
        index = int(np.searchsorted(lengths, min(time * SPEED, lengths[-1] - 1e-6)))
        return index, Pose2D(*map(float, self.route[index]))

    def scan_from(self, pose, time):
        angles = np.linspace(-pi, pi, 360, endpoint=False)
        ranges = np.full(360, np.inf, np.float32)
        blocked = self.grid.cells == 100
        for distance in np.arange(8.0, 0.1, -0.04):
            x = pose.x + distance * np.cos(angles + pose.heading)
            y = pose.y + distance * np.sin(angles + pose.heading)
            column = np.clip((x / RESOLUTION).astype(int), 0, blocked.shape[1] - 1)
            row = np.clip((y / RESOLUTION).astype(int), 0, blocked.shape[0] - 1)
            ranges[blocked[row, column]] = distance
        return Scan(time, ranges, -pi, 2 * pi / 360, 0.1, 8.0)

    def image_from(self, pose, time):
        camera = CameraModel(320, 240, 260.0, (0.25, 0.0, 0.25), pitch=0.1)
        picture = np.full((240, 320, 3), (24, 28, 38), np.uint8)
        picture[130:] = (52, 58, 70)
        shift = int(160 + 400 * sin(pose.heading - 0.8))
        cv2.rectangle(picture, (shift - 50, 70), (shift + 50, 170), (150, 108, 78), -1)
        cv2.rectangle(picture, (shift + 90, 40), (shift + 240, 180), (98, 108, 126), -1)
        cv2.circle(picture, (shift - 110, 140), 30, (72, 130, 92), -1)
        return Image(time, picture, camera)

    def tree_at(self, time):
        there = time >= 9.0
        states = [
            "running", "success", "running", "running", "success" if there else "running",
            "idle" if not there else "running" if time < 12.0 else "success",
            "running" if time >= 12.0 else "idle", "idle",
        ]  # fmt: skip
        messages = {4: "" if there else f"{9.0 - time:.1f} m to go", 6: "9.3 m to go"}
        return tuple(
            TreeRow(n, parent, name, kind, state, messages.get(n, "") if state == "running" else "")
            for n, ((parent, name, kind), state) in enumerate(zip(NODES, states, strict=True))
        )

    def snapshot_at(self, time):
        noise = stream(self.seed, "synthetic", round(time * 1000))
        index, truth = self.truth_at(time)
        wobble = noise.normal(0, 0.008, 2)
        pose = Pose2D(
            truth.x + 0.02 * sin(time) + wobble[0], truth.y + 0.02 * cos(time) + wobble[1],
            truth.heading,
        )  # fmt: skip
        spread = noise.normal(0, (0.07, 0.05, 0.06), (300, 3))
        particles = np.add(spread, (pose.x, pose.y, pose.heading)).astype(np.float32)
        row, column = self.grid.cell_at(pose.x, pose.y)
        top, left = max(row - 30, 0), max(column - 30, 0)
        local = CostGrid(
            self.costs[top : row + 30, left : column + 30], RESOLUTION,
            (left * RESOLUTION, top * RESOLUTION),
        )  # fmt: skip
        layers = {
            "map": Layer(1, self.grid),
            "global_costmap": Layer(1 + int(time / 5), CostGrid(self.costs, RESOLUTION)),
            "local_costmap": Layer(1 + round(time * 10), local),
            "scene": Layer(1, self.scene),
        }
        speed = SPEED * (0.9 + 0.1 * sin(2.0 * time))
        person = (6.0 + 1.5 * sin(0.4 * time), 4.4, 0.22)
        ahead = self.route[index : index + 60]
        return Snapshot(
            time=time, step=round(time * 20), state=MissionState.RUNNING, reason="",
            tree=self.tree_at(time), pose=pose, covariance=np.diag([0.005, 0.0025, 0.004]),
            health=0.92 + 0.05 * sin(0.7 * time), battery=Battery(0.83 - 0.002 * time),
            odometry=truth, particles=particles, scan=self.scan_from(truth, time),
            path=Path(self.route[index:]) if index < len(self.route) - 2 else None,
            local_plan=Path(ahead) if len(ahead) > 2 else None,
            goal=Pose2D(*map(float, self.route[-1])), layers=layers,
            commanded=Twist(speed, 0.2 * sin(time)),
            measured=Twist(speed + noise.normal(0, 0.015), 0.2 * sin(time)),
            stages={"tree": StageTiming(0.001, 0.002, 10)}, speed=12.0,
            image=self.image_from(truth, time) if round(time * 10) % 5 == 0 else None,
            truth=truth, people=np.array([person, (11.0, 2.6 + sin(0.5 * time), 0.22)]),
        )  # fmt: skip

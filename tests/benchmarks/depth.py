"""Depth cameras: missions with and without them, time of the stage, latency of an obstacle."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path
from statistics import median
from time import thread_time
from typing import Any

import numpy as np

from missions.bench.bench import Options
from missions.execution.prepare import RunOptions, prepare
from missions.execution.run import Run
from missions.sweeps.mission_table import measured
from robots.load import find_robot, read_robot
from stack.drivetrain.description import DepthCameraDescription, RobotDescription
from stack.frames.buffer import TransformBuffer
from stack.perception.depth.obstacles import DepthObstacles
from stack.perception.depth.parameters import DepthParameters
from stack.sim.sensors.rendering import CameraRenderer
from stack.sim.sensors.requests import RenderRequest, RenderSetup
from stack.sim.worlds.world import World
from stack.types import (
    LETHAL_COST,
    DepthImage,
    FloatArray,
    Observation,
    Odometry,
    Pose2D,
    Twist,
)
from tests.benchmarks.table import Rows

MISSIONS = ("32_table_tops", "36_glass_and_edges")
WIDTHS = (160, 320, 640)
PICTURES, STEP = 120, 0.05
"""Pictures on a drive through the lounge, metres from one to the next."""

CLOSINGS = 20
WORLD = """
world: gate
bounds: [-1, -2, 4, 2]
start: here
places: {{here: [0, 0, 0]}}
walls: [{{points: [[-1, -2], [4, -2], [4, 2], [-1, 2]], closed: true}}]
doors: [{{name: gate, from: [1.2, -0.5], to: [1.2, 0.5]}}]
timeline:
{timeline}
"""
MISSION = """
mission: watch the gate
robot: scout
world: ./gate.yaml
navigation: {depth: {obstacles: true}, costmap: {layers: [depth]}}
run: {wait: {time: 1 h}}
"""


def contact_table(seeds: int, options: Options) -> Rows:
    """A row for each mission, with its depth camera on and off."""
    rows: Rows = []
    for name in MISSIONS:
        for word, value in (("on", "true"), ("off", "false")):
            runs = measured(replace(
                options, out=options.out / name / word, seeds=range(seeds), names=(name,),
                parameters={"depth.obstacles": value},
            ))  # fmt: skip
            rows.append({
                "mission": name, "depth camera": word,
                "success": f"{sum(run.is_success for run in runs)}/{seeds}",
                "without contact": f"{sum(run.collisions == 0 for run in runs)}/{seeds}",
                "contacts": sum(run.collisions or 0 for run in runs),
                "time s": median(run.seconds or 0.0 for run in runs),
            })  # fmt: skip
    return rows


def stage_table() -> Rows:
    """A row for each size of the picture: processor time of the depth stage and of its layer."""
    plan = prepare(MISSIONS[0], RunOptions())
    return [_stage_row(plan.robot, plan.world, plan.start, width) for width in WIDTHS]


def _stage_row(robot: RobotDescription, world: World, start: Pose2D, width: int) -> dict[str, Any]:
    camera = _resized(robot.depth_cameras["depth"], width)
    poses = [start.compose(Pose2D(STEP * n / 3, 0.0, 0.02 * n)) for n in range(PICTURES)]
    pictures = _rendered(robot, world, camera, poses)
    stage = DepthObstacles(
        replace(robot, depth_cameras={"depth": camera}), DepthParameters(obstacles=True)
    )
    frames, taken, found = TransformBuffer(10.0), [], 0
    for number, (pose, depth) in enumerate(zip(poses, pictures, strict=True)):
        now = 0.1 * number
        frames.add(Odometry(now, pose, Twist()))
        image = DepthImage(now, depth, camera.model, camera.range_min, camera.range_max)
        began = thread_time()
        found = len(stage.update(Observation(now, {"depth": image}), frames).spatial)
        taken.append(1e3 * (thread_time() - began))
    return {
        "picture": f"{width} x {camera.model.height}", "pictures": PICTURES, "points": found,
        "median ms": float(np.median(taken[1:])), "p99 ms": float(np.percentile(taken[1:], 99)),
    }  # fmt: skip


def _resized(camera: DepthCameraDescription, width: int) -> DepthCameraDescription:
    """The same camera with pictures of another width, 4 : 3."""
    scale = width / camera.model.width
    model = replace(
        camera.model, width=width, height=round(camera.model.height * scale),
        focal_length=camera.model.focal_length * scale,
    )  # fmt: skip
    return replace(camera, model=model)


def _rendered(
    robot: RobotDescription, world: World, camera: DepthCameraDescription, poses: list[Pose2D]
) -> list[FloatArray]:
    renderer = CameraRenderer(RenderSetup(world, robot.model, camera, "depth"))
    try:
        return [
            np.asarray(renderer.render(RenderRequest(
                number, (pose.x, pose.y, 0.0),
                (0.0, 0.0, np.sin(pose.heading / 2), np.cos(pose.heading / 2)),
                np.empty((0, 3)), {}, seed=1,
            )))
            for number, pose in enumerate(poses)
        ]  # fmt: skip
    finally:
        renderer.close()


def latency_table() -> Rows:
    """How long after the exposure a door that closes is an obstacle, in simulated time."""
    times = [3.0 + 4.0 * n + 0.013 * n for n in range(CLOSINGS)]
    lines = [
        line
        for time in times
        for line in (
            f"  - {{when: {{time: {time:.3f} s}}, close_door: gate}}",
            f"  - {{when: {{time: {time + 2.0:.3f} s}}, open_door: gate}}",
        )
    ]
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "gate.yaml").write_text(WORLD.format(timeline="\n".join(lines)), "utf-8")
        file = Path(folder) / "watch.yaml"
        file.write_text(MISSION, "utf-8")
        seen = _closings(file, times)
    rate = read_robot(find_robot("scout", Path())).depth_cameras["depth"].rate
    return [
        {
            "in": where, "doors": len(rows),
            "after exposure s": max(row[0] for row in rows),
            "frames": max(row[0] for row in rows) * rate,
            "after the door s": max(row[1] for row in rows),
        }
        for where, rows in seen.items()
    ]  # fmt: skip


def _closings(file: Path, times: list[float]) -> dict[str, list[tuple[float, float]]]:
    """Seconds from the first picture of each closed door, and from the door, to the obstacle.

    A picture shows the door when it was exposed after it closed.
    """
    options = RunOptions(serve=False)
    run = Run(prepare(file, options), options)
    parts = run.engine.runtime.parts
    costmap = parts.perceiver.world_model.local_costmap
    seen: dict[str, list[tuple[float, float]]] = {"obstacle points": [], "local costmap": []}
    exposed: dict[float, float] = {}
    try:
        for time in times:
            while run.engine.body.time < time + 1.0:
                begins = run.engine.body.time
                run.step()
                image = run.engine.runtime.perceived.newest("depth", DepthImage)
                if image is None or image.stamp < time:
                    continue
                exposed.setdefault(time, image.stamp)
                found = {
                    "obstacle points": len(run.engine.runtime.perceived.depth.points) > 0,
                    "local costmap": bool((costmap.marks.cells == LETHAL_COST).any()),
                }
                for where, is_there in found.items():
                    if is_there and len(seen[where]) < len(exposed):
                        seen[where].append((begins - exposed[time], begins - time))
            while run.engine.body.time < time + 3.0:
                run.step()
    finally:
        run.close()
    return seen

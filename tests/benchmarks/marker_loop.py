"""SLAM around a bare block of corridors, with and without a marker that closes the loop.

Scans of 5 m see nothing on the walls by which the end of the loop could be recognised: the robot
starts in the middle of a side, and the corner from which it comes back was out of sight then.
"""

from __future__ import annotations

from dataclasses import replace
from math import pi
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from missions.execution.prepare import RunOptions, prepare
from missions.execution.run import Run
from stack.sim.worlds.rasterise import rasterise
from stack.types import Marker, Pose2D
from tests.benchmarks.mapping import compared
from tests.benchmarks.table import Rows

LENGTH, WIDTH, CORRIDOR = 20.0, 14.0, 2.0
"""Metres: of the block with its corridors, and across one of them."""

SLIP = 0.1
"""Slip of the wheels in the simulation; `scout` has 0.02."""

MARKER = Marker(7, 0.2, (11.0, 0.06, 0.4), pi / 2)

ROUND = 2.0 * (LENGTH + WIDTH) - 4.0 * CORRIDOR + 1.5
"""Metres along the middle of the corridors, and 1.5 m of them again."""

WORLD = f"""
world: ring
format: 1
doc: A corridor around a block, with nothing on its walls.
bounds: [-0.5, -0.5, {LENGTH + 0.5}, {WIDTH + 0.5}]
start: middle
places: {{middle: [{0.5 * LENGTH - 1.5}, 1.0, 0 deg]}}
walls:
  - {{points: [[0, 0], [{LENGTH}, 0], [{LENGTH}, {WIDTH}], [0, {WIDTH}]], closed: true}}
boxes:
  - name: block
    at: [{0.5 * LENGTH}, {0.5 * WIDTH}, 0 deg]
    size: [{LENGTH - 2.0 * CORRIDOR}, {WIDTH - 2.0 * CORRIDOR}, 1.0]
"""

MISSION = f"""
mission: around the block
format: 1
robot: scout
world: ring.yaml
markers: none
map: none
localisation: {{use: slam, match_range: 5 m}}
navigation: {{markers: {{survey: true}}}}
run:
  wall_follow: {{side: left, distance: 1 m, until_travelled: {ROUND} m}}
"""


def run(first: int, seeds: int) -> Rows:
    """Rows of the errors without and with the marker, over seeds."""
    return [_row(name, markers, range(first, first + seeds))
            for name, markers in (("none", ()), ("one", (MARKER,)))]  # fmt: skip


def _row(name: str, markers: tuple[Marker, ...], seeds: range) -> dict[str, object]:
    found = np.array([drive(seed, markers) for seed in seeds])
    end, keyframes, overlap = found.T
    return {
        "markers": name, "runs": len(seeds),
        "at the end cm": 100.0 * float(np.median(end)), "largest cm": 100.0 * float(end.max()),
        "keyframes cm": 100.0 * float(np.median(keyframes)), "IoU": float(np.median(overlap)),
    }  # fmt: skip


def drive(seed: int, markers: tuple[Marker, ...]) -> tuple[float, float, float]:
    """Drive round once; return the error at the end, the root mean square one of the keyframes, and
    the intersection over union of the map with the world."""
    with TemporaryDirectory() as folder:
        (Path(folder) / "ring.yaml").write_text(WORLD, "utf-8")
        mission = Path(folder) / "mission.yaml"
        mission.write_text(MISSION, "utf-8")
        options = RunOptions(seed=seed, serve=False, out=Path(folder) / "run")
        plan = prepare(mission, options)
        plan = replace(
            plan, world=replace(plan.world, markers=markers),
            robot=replace(plan.robot, odometry=replace(plan.robot.odometry, slip=SLIP)),
        )  # fmt: skip
        truth: dict[float, Pose2D] = {}
        current = Run(plan, options, [])
        try:
            runtime, simulation = current.engine.runtime, current.engine.simulation
            assert simulation is not None
            while not current.is_over:
                truth[round(runtime.parts.body.time, 3)] = simulation.truth.pose
                current.step()
            estimator = runtime.parts.perceiver.estimator
            end = estimator.estimate.pose.distance_to(simulation.truth.pose)
            errors = [
                keyframe.pose.distance_to(truth[stamp])
                for keyframe in estimator.mapper.graph.keyframes.values()
                if (stamp := round(keyframe.stamp, 3)) in truth
            ]
            grid = estimator.mapper.grid()  # the shown one is a second or two older
        finally:
            current.close()
    start = plan.start
    overlap = compared(grid, rasterise(plan.world, grid.resolution), (start.x, start.y), 0.22)[1]
    return end, float(np.sqrt(np.mean(np.square(errors)))), overlap

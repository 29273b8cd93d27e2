"""Localisation in a bare corridor of 40 m, with and without markers fed continuously.

Nothing on the walls shows the lidar where along the corridor the robot is. `run()` gives a row for
each error of the odometry, with and without markers.
"""

from __future__ import annotations

from dataclasses import replace
from math import degrees
from pathlib import Path

import numpy as np

from missions.bench.bench import Options
from missions.execution.prepare import RunOptions, prepare
from missions.execution.run import Run
from stack.sim.worlds.world import World
from stack.sim.worlds.world_file import read_world
from stack.types import Marker
from tests.benchmarks.experiment_monitor import LocalisationMonitor, Sample, speed_of
from tests.benchmarks.experiments import (
    EXPERIMENTS,
    PATROL,
    LocalisationEntry,
    make_case,
)
from tests.benchmarks.table import Rows

SCALES = (0.01, 0.05)
"""Errors of the wheels' diameter in the simulation; the first one is that of `scout`."""

SECONDS = 120.0
SPACING, HEIGHT, OFF_WALL = 8.0, 0.4, 0.055
"""Metres between two markers along the corridor, on alternate walls; of their centres."""


def run(first: int, seeds: int, folder: Path) -> Rows:
    """Rows of errors, containment, health and pictures used, for `seeds` worlds from a seed on."""
    return [
        _row(scale, range(first, first + seeds), folder, localise=localise)
        for scale in SCALES
        for localise in (False, True)
    ]


def _row(scale: float, seeds: range, folder: Path, *, localise: bool) -> dict[str, object]:
    monitors, fixes, health = [], 0, []
    for seed in seeds:
        monitor, used, healths = drive(seed, folder, scale, localise=localise)
        monitors.append(monitor)
        fixes += used
        health += healths
    errors = np.array([error for monitor in monitors for error in monitor.errors])
    contained = sum(monitor.contained for monitor in monitors)
    bins = np.array([monitor.bins for monitor in monitors]).sum(axis=0)
    return {
        "odometry": f"{100.0 * scale:g} %", "markers": "on" if localise else "off",
        "runs": len(seeds),
        "mean cm": 100.0 * float(errors[:, 0].mean()),
        "95 % cm": 100.0 * float(np.percentile(errors[:, 0], 95)),
        "largest cm": 100.0 * float(errors[:, 0].max()),
        "largest °": degrees(float(errors[:, 1].max())),
        "contained %": 100.0 * contained / len(errors),
        "health": float(np.mean(health)), "right %": 100.0 * float(bins[:, 2].sum() / len(errors)),
        "pictures used": fixes,
    }  # fmt: skip


def drive(
    seed: int, folder: Path, scale: float, *, localise: bool
) -> tuple[LocalisationMonitor, int, list[float]]:
    """Patrol the corridor; return the errors, the number of pictures used, and the health."""
    case = make_case(LocalisationEntry("corridor", seed, Options(folder)))
    options = RunOptions(
        seed=seed, arguments={"goals": case.goals}, world=str(case.file), serve=False,
        parameters={"markers.localise": str(localise).lower()},
    )  # fmt: skip
    plan = prepare(PATROL, options)
    markers = markers_along(read_world(case.file))
    odometry = replace(plan.robot.odometry, scale_error=scale)
    plan = replace(
        plan, markers=markers, world=replace(plan.world, markers=markers),
        robot=replace(plan.robot, odometry=odometry),
    )  # fmt: skip
    monitor, health = LocalisationMonitor(EXPERIMENTS["corridor"]), []
    current = Run(plan, options, [])
    try:
        runtime, simulation = current.engine.runtime, current.engine.simulation
        assert simulation is not None
        estimator = runtime.parts.perceiver.estimator
        while not current.is_over and runtime.perceived.time < SECONDS:
            truth = simulation.truth
            current.step()
            twist = truth.twist
            speed = speed_of(twist.linear, twist.lateral, twist.angular)
            sample = Sample(runtime.perceived.time, estimator.estimate, truth.pose, speed)
            monitor.update(sample, runtime.period)
            health.append(estimator.estimate.health)
        return monitor, runtime.parts.perceiver.markers.fixes, health
    finally:
        current.close()


def markers_along(world: World) -> tuple[Marker, ...]:
    """Return markers on alternate walls of the generated corridor, every SPACING metres."""
    walls = [wall.points for wall in world.walls if np.ptp(wall.points[:, 0]) > 30.0]
    low, high = sorted(float(points[0, 1]) for points in walls)
    places = np.arange(SPACING, 40.0, SPACING).tolist()
    return tuple(
        Marker(n, 0.2, (x, low + OFF_WALL, HEIGHT), np.pi / 2)
        if n % 2
        else Marker(n, 0.2, (x, high - OFF_WALL, HEIGHT), -np.pi / 2)
        for n, x in enumerate(places)
    )

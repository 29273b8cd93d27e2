"""Errors of surveyed markers in the office: on a known map, and while mapping (SLAM)."""

from __future__ import annotations

from dataclasses import dataclass
from math import degrees
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from missions.execution.prepare import RunOptions, prepare
from missions.execution.resources import WORLDS
from missions.execution.run import Run
from stack.mapping.marker_maps import MARKERS_YAML, read_marker_map
from stack.sim.worlds.rasterise import rasterise
from stack.sim.worlds.world_file import read_world
from stack.types import FloatArray, Marker, wrap_angle
from tests.benchmarks.benchmark import FILES
from tests.benchmarks.layouts import NONE
from tests.benchmarks.mapping import compared
from tests.benchmarks.table import Rows

SURVEY = FILES / "survey.yaml"
ON_MAP = "map: from_world"
MAPPING = "map: none\nlocalisation: slam"
CASES = {"known map, mcl": ON_MAP, "unknown, slam": MAPPING}


def run(first: int, runs: int) -> Rows:
    """Rows of markers found, their errors, these in deviations, and errors of pose and map."""
    return [_row(name, header, first, runs) for name, header in CASES.items()]


def _row(name: str, header: str, first: int, runs: int) -> dict[str, object]:
    found = [survey(header, seed) for seed in range(first, first + runs)]
    errors = np.concatenate([one.errors for one in found])
    metres, turns, sigmas, turn_sigmas = errors.T
    total = runs * len(read_world(WORLDS / "office.yaml").markers)
    overlaps = [one.overlap for one in found if one.overlap is not None]
    return {
        "map": name, "runs": runs, "surveyed": f"{len(errors)} of {total}",
        "median cm": 100.0 * float(np.median(metres)), "largest cm": 100.0 * float(metres.max()),
        "median °": float(np.median(turns)), "largest °": float(turns.max()),
        "within 2 deviations %": 100.0 * float(((sigmas <= 2.0) & (turn_sigmas <= 2.0)).mean()),
        "pose cm": 100.0 * float(np.mean([one.pose_error for one in found])),
        "IoU": f"{np.mean(overlaps):.3f}" if overlaps else NONE,
    }  # fmt: skip


@dataclass(frozen=True)
class Survey:
    """Result of a run.

    Attributes:
        errors: (n, 4) of the markers: metres, degrees, and both in standard deviations.
        pose_error: of the estimate while driving, metres, mean.
        overlap: intersection over union of the drawn map and the world; None without one.
    """

    errors: FloatArray
    pose_error: float
    overlap: float | None


def survey(header: str, seed: int) -> Survey:
    """Run the survey with further lines of the mission."""
    with TemporaryDirectory() as folder:
        mission = Path(folder) / SURVEY.name
        mission.write_text(f"{SURVEY.read_text('utf-8')}{header}\n", "utf-8")
        options = RunOptions(
            seed=seed, serve=False, out=Path(folder) / "run",
            arguments={},
        )  # fmt: skip
        plan, away = prepare(mission, options), []
        current = Run(plan, options, [])
        try:
            parts, simulation = current.engine.runtime.parts, current.engine.simulation
            assert simulation is not None
            while not current.is_over:
                truth = simulation.truth.pose
                current.step()
                away.append(parts.perceiver.estimator.estimate.pose.distance_to(truth))
            saved = parts.robot.map.save(str(Path(folder) / "saved"))
            drawn = parts.perceiver.estimator.grid if "slam" in header else None
        finally:
            current.close()
        overlap = None
        if drawn is not None:
            walls, start = rasterise(plan.world, drawn.resolution), (plan.start.x, plan.start.y)
            overlap = compared(drawn, walls, start, plan.robot.footprint.inscribed_radius)[1]
        truths = {one.number: one for one in plan.world.markers}
        rows = [
            _errors(one, truths[one.number]) for one in read_marker_map(Path(saved) / MARKERS_YAML)
        ]
        return Survey(np.array(rows), float(np.mean(away)), overlap)


def _errors(found: Marker, right: Marker) -> tuple[float, float, float, float]:
    away = float(np.hypot(*np.subtract(found.position[:2], right.position[:2])))
    turn = abs(wrap_angle(found.heading - right.heading))
    return (
        away, degrees(turn), away / found.position_deviation, turn / found.heading_deviation,
    )  # fmt: skip

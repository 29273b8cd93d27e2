"""Errors of surveyed markers in the office: on a known map, and while mapping (SLAM)."""

from __future__ import annotations

from math import degrees
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from missions.execution.prepare import RunOptions, prepare
from missions.execution.resources import MISSIONS, WORLDS
from missions.execution.run import Run
from stack.mapping.marker_maps import MARKERS_YAML, read_marker_map
from stack.sim.worlds.world_file import read_world
from stack.types import FloatArray, wrap_angle
from tests.benchmarks.table import Rows

SURVEY = MISSIONS / "bench" / "survey.yaml"
ON_MAP = "map: from_world"
MAPPING = "map: none\nlocalisation: slam"
CASES = {"known map, mcl": ON_MAP, "unknown, slam": MAPPING}


def run(first: int, runs: int) -> Rows:
    """Rows of markers found, of their errors, and of the errors in standard deviations."""
    return [_row(name, header, first, runs) for name, header in CASES.items()]


def _row(name: str, header: str, first: int, runs: int) -> dict[str, object]:
    errors = np.concatenate([survey(header, seed) for seed in range(first, first + runs)])
    metres, turns, sigmas, turn_sigmas = errors.T
    total = runs * len(read_world(WORLDS / "office.yaml").markers)
    return {
        "map": name, "runs": runs, "surveyed": f"{len(errors)} of {total}",
        "median cm": 100.0 * float(np.median(metres)), "largest cm": 100.0 * float(metres.max()),
        "median °": float(np.median(turns)), "largest °": float(turns.max()),
        "within 2 deviations %": 100.0 * float(((sigmas <= 2.0) & (turn_sigmas <= 2.0)).mean()),
    }  # fmt: skip


def survey(header: str, seed: int) -> FloatArray:
    """Run the survey; return (n, 4): metres, degrees, and both in standard deviations."""
    with TemporaryDirectory() as folder:
        mission = Path(folder) / SURVEY.name
        mission.write_text(f"{SURVEY.read_text('utf-8')}{header}\n", "utf-8")
        options = RunOptions(
            seed=seed, serve=False, out=Path(folder) / "run",
            arguments={},
        )  # fmt: skip
        current = Run(prepare(mission, options), options, [])
        try:
            while not current.is_over:
                current.step()
            saved = current.engine.runtime.parts.facade.save_map(str(Path(folder) / "saved"))
        finally:
            current.close()
        truth = {one.number: one for one in read_world(WORLDS / "office.yaml").markers}
        rows = []
        for one in read_marker_map(Path(saved) / MARKERS_YAML):
            right = truth[one.number]
            away = float(np.hypot(*np.subtract(one.position[:2], right.position[:2])))
            turn = abs(wrap_angle(one.heading - right.heading))
            rows.append((
                away, degrees(turn), away / one.position_deviation, turn / one.heading_deviation,
            ))  # fmt: skip
        return np.array(rows)

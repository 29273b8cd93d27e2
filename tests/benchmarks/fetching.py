"""How often the mobile manipulator fetches the red block from random places.

`python -m tests.benchmarks.fetching` prints the table.

Each run is mission 53 with three blocks at random places and turns on the counter. A run has
succeeded when the mission has, the red block truly stands on the tray, and the robot has touched
nothing but what it grasps (physics, in every step).
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable
from operator import attrgetter
from pathlib import Path
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
import yaml

from missions.execution.prepare import RunOptions, prepare
from missions.execution.run import Run
from stack.streams import stream
from stack.types import FloatArray

ROOT = Path(__file__).parents[2] / "missions"
MISSION, WORLD = ROOT / "53_fetch.yaml", ROOT / "worlds" / "parts_store.yaml"

AREA = ((7.38, 7.56), (2.35, 2.85))
"""Of the centres of blocks, x and y, metres: in reach from the place before the counter."""

APART = 0.1
"""Metres between two centres at least."""


def random_world(seed: int) -> dict[str, Any]:
    """The store with its blocks at random places."""
    draw, world = stream(seed, "blocks"), yaml.safe_load(WORLD.read_text("utf-8"))
    placed: list[np.ndarray] = []
    for block in world["blocks"]:
        while True:
            at = np.array([draw.uniform(*side) for side in AREA])
            if all(np.hypot(*(at - other)) > APART for other in placed):
                break
        placed.append(at)
        block["at"] = [*at.round(3).tolist(), f"{draw.uniform(-180.0, 180.0):.1f} deg"]
    return world


class Row(NamedTuple):
    """Outcome of a run: times in seconds; where the red block is at the end, world frame."""

    done: bool
    reason: str
    contacts: int
    simulated: float
    wall: float
    at: FloatArray


TIMES = (attrgetter("simulated"), attrgetter("wall"))


def run_once(seed: int, folder: Path, watch: Callable[[Run], None] = lambda _: None) -> Row:
    """Run the mission in the world of a seed; `watch` is called after each step."""
    (folder / "world.yaml").write_text(yaml.safe_dump(random_world(seed)), "utf-8")
    text = MISSION.read_text("utf-8").replace("world: parts_store", "world: ./world.yaml")
    (folder / "mission.yaml").write_text(text, "utf-8")
    options = RunOptions(seed=seed, serve=False)
    began = perf_counter()
    run = Run(prepare(folder / "mission.yaml", options), options)
    try:
        while not run.is_over:
            run.step()
            watch(run)
        report = run.finish()
        simulation = run.engine.simulation
        assert simulation is not None
        at, tally = np.array(simulation.blocks[0].position), simulation.tally
    finally:
        run.close()
    on_tray = abs(at[0] - 0.50) < 0.12 and abs(at[1] - 1.0) < 0.12 and 0.53 < at[2] < 0.56
    contacts = tally.by_robot + tally.against_standing
    done = report.status == "success" and on_tray and not contacts
    seconds = perf_counter() - began
    return Row(done, report.reason, contacts, report.simulated_seconds, seconds, at)


def main() -> None:
    """Run the seeds of the command line and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first", type=int, default=0)
    given = parser.parse_args()
    rows = []
    for seed in range(given.first, given.first + given.seeds):
        with tempfile.TemporaryDirectory() as folder:
            row = run_once(seed, Path(folder))
        rows.append(row)
        outcome, place = "ok" if row.done else "FAILED", row.at.round(3)
        times = f"{row.simulated:5.1f} s {row.wall:5.1f} s"
        print(f"{seed:3d} {outcome} {times} {place} {row.contacts} {row.reason}", flush=True)
    good = sum(row.done for row in rows)
    simulated, wall = (np.mean([times(row) for row in rows]) for times in TIMES)
    print(f"{good} of {len(rows)}; mean simulated {simulated:.1f} s, wall {wall:.1f} s")


if __name__ == "__main__":
    main()

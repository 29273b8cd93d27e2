"""How often an arm does what its missions say, in random scenes.

`python -m tests.benchmarks.arm_picking` prints the table; `--mission` chooses among the scenes of
tests/benchmarks/arm_scenes.py. A run has succeeded when the mission has, each block is within 1 cm
of where it belongs, and nothing was touched that should not be: the physics is watched in every
step.
"""

from __future__ import annotations

import argparse
import tempfile
from collections import Counter
from pathlib import Path
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
import yaml

from missions.execution.prepare import RunOptions, prepare
from missions.execution.run import Run
from robots.simulated import SimulatedBody
from tests.benchmarks.arm_scenes import SCENES, Scene

NEAR = 0.01
"""Metres from its place within which a block has been placed."""

UPWARDS = 0.7
"""Vertical part of the normal of a contact with what carries a block, at least."""

MOVED = 0.005
"""Metres by which a block that the arm shall leave alone may move."""


class ContactWatch:
    """Notes what the arm touches in each physics step, besides the blocks that it handles.

    Unintended are contacts of any link with anything else, of links that are no fingers with
    blocks, and of a block between the fingers with anything at its sides.

    Args:
        simulation: body of the only robot, which has an arm.
        handled: numbers of the blocks that the fingers may touch.

    Attributes:
        unintended: what touched what, with the number of physics steps.
    """

    def __init__(self, simulation: SimulatedBody, handled: frozenset[int]) -> None:
        engine: Any = simulation._simulation._engine
        robot = engine._robots[0]
        self._scene, self._bullet, self._client = engine.scene, engine.bullet, engine.client
        self._robot, self._fingers = robot.body, robot._arm.fingers
        blocks = [body for body in self._scene.obstacles if self._scene.is_block(body)]
        self._handled = {blocks[number] for number in handled}
        self._step, engine.step = engine.step, self._stepped
        self.unintended: Counter[str] = Counter()

    def _stepped(self, count: int = 1) -> None:
        for _ in range(count):
            self._step(1)
            self._look()

    def _look(self) -> None:
        held = set()
        for point in self._points(self._robot):
            other, link = point[2], point[3]
            if other in (self._robot, self._scene.floor) or link < 0:
                continue
            if link in self._fingers and other in self._handled:
                held.add(other)
            else:
                self._note(self._link(link), other)
        for block in held:
            for point in self._points(block):
                if point[2] != self._robot and abs(point[7][2]) < UPWARDS:
                    self._note(self._scene.obstacles[block], point[2])

    def _points(self, body: int) -> list[Any]:
        """Return the contacts of a body that carry a force."""
        found = self._bullet.getContactPoints(body, physicsClientId=self._client)
        return [point for point in found if point[9] > 0.0]

    def _link(self, link: int) -> str:
        info = self._bullet.getJointInfo(self._robot, link, physicsClientId=self._client)
        name: str = info[12].decode()
        return name

    def _note(self, who: str, other: int) -> None:
        self.unintended[f"{who} touches {self._scene.obstacles.get(other, 'the floor')}"] += 1


class Row(NamedTuple):
    """Outcome of a run.

    Attributes:
        seed: of scene and run.
        about: the scene.
        status: of the mission.
        reason: of its failure, with the code.
        error: largest distance of a block from its place, metres.
        contacts: unintended ones.
        moved: largest way of a block that the arm shall leave alone, metres.
        simulated: duration, seconds.
        wall: duration, seconds.
    """

    seed: int
    about: str
    status: str
    reason: str
    error: float
    contacts: Counter[str]
    moved: float
    simulated: float
    wall: float

    @property
    def is_good(self) -> bool:
        """Whether all was as wanted."""
        placed = self.status == "success" and self.error <= NEAR
        return placed and not self.contacts and self.moved <= MOVED

    def __str__(self) -> str:
        """A line of the table."""
        touched = ", ".join(f"{name} ({count})" for name, count in self.contacts.items())
        words = [f"{self.seed:3d} {'ok    ' if self.is_good else 'FAILED'} {self.about:18}"]
        words += [f"{1e3 * self.error:4.0f} mm", f"{self.simulated:5.1f} s", f"{self.wall:5.1f} s"]
        moved = f"moved {1e3 * self.moved:.0f} mm" if self.moved > MOVED else ""
        return " ".join(filter(None, [*words, self.reason, touched, moved]))


def run_once(scene: Scene, seed: int, folder: Path) -> Row:
    """Run the mission of a scene."""
    (folder / "world.yaml").write_text(yaml.safe_dump(scene.world), "utf-8")
    text = scene.mission.read_text("utf-8")
    named = next(line for line in text.splitlines() if line.startswith("world: "))
    (folder / "mission.yaml").write_text(text.replace(named, "world: ./world.yaml"), "utf-8")
    options = RunOptions(seed=seed, serve=False)
    began = perf_counter()
    run = Run(prepare(folder / "mission.yaml", options), options)
    try:
        simulation = run.engine.simulation
        watch, before = ContactWatch(simulation, scene.handled), simulation.blocks
        while not run.is_over:
            run.step()
        report = run.finish()
        after = simulation.blocks
    finally:
        run.close()
    left = [n for n in range(len(after)) if n not in scene.handled]
    ways = [np.subtract(after[n].position, before[n].position) for n in left]
    return Row(
        seed, scene.about, report.status, report.reason, scene.error(after), watch.unintended,
        max((float(np.linalg.norm(way)) for way in ways), default=0.0),
        report.simulated_seconds, perf_counter() - began,
    )  # fmt: skip


def main() -> None:
    """Run the seeds of the command line and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--mission", choices=SCENES, default="pick")
    parser.add_argument("--seeds", type=int, default=50)
    parser.add_argument("--first", type=int, default=0)
    given = parser.parse_args()
    rows = []
    for seed in range(given.first, given.first + given.seeds):
        with tempfile.TemporaryDirectory() as folder:
            rows.append(run_once(SCENES[given.mission](seed), seed, Path(folder)))
        print(rows[-1], flush=True)
    print(table_of(rows))


def table_of(rows: list[Row]) -> str:
    """Return the sums of all runs."""
    good = sum(row.is_good for row in rows)
    codes = Counter(row.reason.split()[0] for row in rows if row.status != "success")
    placed = [row.error for row in rows if row.status == "success"]
    lines = [
        f"{good} of {len(rows)} as wanted ({100.0 * good / len(rows):.0f} %)",
        f"missions that failed: {dict(codes) or 'none'}",
        f"runs with unintended contacts: {sum(bool(row.contacts) for row in rows)}",
        f"runs in which other blocks moved: {sum(row.moved > MOVED for row in rows)}",
        f"worst place: {1e3 * max(placed, default=float('nan')):.1f} mm",
        f"mean duration: simulated {np.mean([row.simulated for row in rows]):.1f} s, "
        f"wall {np.mean([row.wall for row in rows]):.1f} s",
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    main()

"""How much later a command reaches the body when the cameras are on, in real time: `run()`.

A control period begins when its time has come on the wall clock; the lateness of its command is the
wall time from then until the body receives it. It contains all waiting and computing of the step:
for pictures that are due, for their transfer and for the perception. Runs with and without cameras
take turns, each in a process of its own, so that other work on the machine meets both.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from statistics import median
from time import monotonic, thread_time  # noqa: TID251 - measures the wall clock
from typing import Any

import numpy as np

from missions.execution.prepare import RunOptions, prepare
from missions.execution.run import Run
from robots.bodies import BodySetup
from robots.simulated import SimulatedBody
from stack.body import BodyCommand
from stack.types import Observation
from tests.benchmarks.table import Rows

MISSION, SECONDS = "02_office_patrol", 20.0
SETTLED = 3.0
"""Seconds at the start that do not count: renderers start, caches fill."""

FIGURES = ("p50 ms", "p99 ms", "computed p50 ms", "computed p99 ms")

SITUATIONS: dict[str, tuple[str, str]] = {
    "off": ("asked", "false"), "on": ("on", "true"),
}  # fmt: skip
"""Colour camera and depth camera of a run, as `camera` and `depth.obstacles`."""


class TimedBody(SimulatedBody):
    """A simulated robot that notes how late each command comes.

    Attributes:
        lateness: wall seconds from the beginning of the period.
        computed: processor seconds of the loop's thread from sensing to the command.
    """

    def __init__(self, setup: BodySetup) -> None:
        super().__init__(setup.robot, setup.world, start=setup.start, seed=setup.seed)
        self.pace = setup.pace
        self.lateness: list[float] = []
        self.computed: list[float] = []
        self._began = 0.0

    def sense(self) -> Observation:
        """Note the processor time at which the step begins, then sense."""
        self._began = thread_time()
        return super().sense()

    def command(self, command: BodyCommand) -> None:
        """Note the lateness, then command."""
        due = self._simulation.pace.due
        if due is not None and self.time >= SETTLED:
            self.lateness.append(monotonic() - due)
            self.computed.append(thread_time() - self._began)
        super().command(command)


def run(pairs: int) -> Rows:
    """A row without cameras, one with, and the difference: medians over the pairs."""
    found: dict[str, list[dict[str, float]]] = {name: [] for name in SITUATIONS}
    for number in range(pairs):
        for name in [*SITUATIONS] if number % 2 == 0 else [*reversed(SITUATIONS)]:
            found[name].append(_measured(name, number))
    rows: Rows = []
    for name, runs in found.items():
        rows.append({
            "cameras": name, "runs": pairs, "load": median(run["load"] for run in runs),
            **{key: median(run[key] for run in runs) for key in FIGURES},
        })  # fmt: skip
    differences = {
        key: median(on[key] - off[key] for off, on in zip(found["off"], found["on"], strict=True))
        for key in FIGURES
    }
    load = median(run["load"] for runs in found.values() for run in runs)
    return [*rows, {"cameras": "later with them", "runs": pairs, "load": load, **differences}]


def _measured(situation: str, seed: int) -> dict[str, float]:
    """Figures of one run in a process of its own."""
    words = [sys.executable, "-m", "tests.benchmarks.cameras", situation, str(seed)]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    figures: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    print(f"  cameras {situation}, seed {seed}: {figures}", file=sys.stderr)
    return figures


def timed(situation: str, seed: int, seconds: float = SECONDS) -> TimedBody:
    """The body of a run in real time, with its times."""
    camera, depth = SITUATIONS[situation]
    options = RunOptions(
        seed=seed, speed=1.0, serve=False, camera=camera, parameters={"depth.obstacles": depth}
    )
    bodies: list[TimedBody] = []
    make: Callable[[BodySetup], TimedBody] = lambda setup: _kept(bodies, TimedBody(setup))  # noqa: E731
    mission = Run(prepare(MISSION, options), options, make_body=make)
    try:
        while not mission.is_over and mission.engine.body.time < seconds:
            while not mission.is_ready():
                mission.serve()
            mission.step()
        mission.interrupt("measured")
    finally:
        mission.close()
    return bodies[0]


def _kept(bodies: list[TimedBody], body: TimedBody) -> TimedBody:
    bodies.append(body)
    return body


def main(situation: str, seed: str) -> None:
    """Print the figures of one run as JSON."""
    load = os.getloadavg()[0]
    body = timed(situation, int(seed))
    late, computed = 1e3 * np.array(body.lateness), 1e3 * np.array(body.computed)
    print(json.dumps({
        "load": load, **_percentiles("", late), **_percentiles("computed ", computed),
    }))  # fmt: skip


def _percentiles(name: str, times: np.ndarray[Any, Any]) -> dict[str, float]:
    """Median and 99 % of times in milliseconds."""
    return {
        f"{name}{key} ms": float(np.percentile(times, share))
        for key, share in (("p50", 50), ("p99", 99))
    }


if __name__ == "__main__":
    main(*sys.argv[1:])

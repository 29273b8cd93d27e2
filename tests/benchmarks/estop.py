"""Emergency stop: wall time from the operator's key to the zero command at the robot's body.

The operator and the engine are two processes that read the same clock (CLOCK_MONOTONIC). The body
of the engine stamps each zero command that it gets while the emergency stop is engaged.
"""

from __future__ import annotations

import json
import random
import subprocess
import sys
import tempfile
import time  # the operator's side of the measurement takes wall time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median
from typing import Any
from uuid import uuid4

from missions.execution.prepare import RunOptions, prepare
from missions.execution.run import Run
from robots.bodies import BodySetup
from robots.simulated import SimulatedBody
from stack.body import BodyCommand
from stack.errors import TelemetryError
from stack.runtime.loop import Runtime
from stack.telemetry.client import TelemetryClient
from stack.telemetry.records import Ack, Command, new_identity
from stack.telemetry.rendezvous import RunHandle, find_run, live_runs
from stack.types import STANDSTILL
from tests.benchmarks.hall import hall_world
from tests.benchmarks.table import Rows

PATROL = """\
mission: to and fro
robot: scout
world: office
run:
  sequence:
    - navigate_to_pose: {goal: $kitchen}
    - navigate_to_pose: {goal: $dock}
  repeat: forever
"""
PLANNING = """\
mission: plan all the time
robot: scout
world: ./hall.yaml
navigation: {planner: hybrid_astar, navigator: {replan_period: 0.2 s}}
run:
  sequence:
    - navigate_to_pose: {goal: $far}
    - navigate_to_pose: {goal: [30, 30, 45 deg]}
  repeat: forever
"""
FLOOD_RATE = 2000
START_TIMEOUT, ANSWER_TIMEOUT = 300.0, 30.0
"""Wall seconds that an engine gets to compile its kernels and to answer."""


@dataclass(frozen=True)
class Situation:
    """What the engine does while the key is pressed.

    Attributes:
        held: the mission is paused when the key is pressed.
        viewers: dashboards that watch.
        flood: another client sends FLOOD_RATE commands a second.
        planning: count only presses during which a plan is computed.
    """

    name: str
    speed: float = 1.0
    held: bool = False
    viewers: int = 0
    flood: bool = False
    planning: bool = False


SITUATIONS = (
    Situation("driving, real time"),
    Situation("driving, as fast as possible", speed=0.0),
    Situation("driving, 0.001 of real time", speed=0.001),
    Situation("held", held=True),
    Situation("while hybrid A* plans", speed=0.0, planning=True),
    Situation("with 3 viewers", viewers=3),
    Situation(f"another client sends {FLOOD_RATE} commands/s", flood=True),
)


def stop_times(presses: int) -> Rows:
    """A row for each situation."""
    return [_row(situation, presses) for situation in SITUATIONS]


def _row(situation: Situation, presses: int) -> dict[str, Any]:
    with _engine(situation) as (run, stamps), ExitStack() as others:
        for _ in range(situation.viewers):
            others.enter_context(_process("view", run.identity))
        if situation.flood:
            others.enter_context(_process("flood", run.identity))
        found = _press(run, stamps, situation, presses)
    found.sort()
    print(f"{situation.name}: {median(found):.1f} ms", file=sys.stderr, flush=True)
    return {
        "situation": situation.name,
        "presses": len(found),
        "median ms": median(found),
        "99 % ms": found[round(0.99 * (len(found) - 1))],
        "worst ms": found[-1],
    }


@contextmanager
def _engine(situation: Situation) -> Iterator[tuple[RunHandle, Path]]:
    """Start an engine; yield its run and the file of its stamps."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "hall.yaml").write_text(hall_world(), "utf-8")
        mission, stamps = Path(folder) / "mission.yaml", Path(folder) / "stamps"
        mission.write_text(PLANNING if situation.planning else PATROL, "utf-8")
        stamps.touch()
        options = RunOptions(speed=situation.speed, identity=new_identity())
        message = json.dumps([str(mission), str(stamps), asdict(options)])
        with _process("engine", message) as engine:
            yield _announced(engine, options.identity), stamps


def _announced(engine: subprocess.Popen[bytes], identity: str) -> RunHandle:
    deadline = time.monotonic() + START_TIMEOUT  # noqa: TID251
    while time.monotonic() < deadline:  # noqa: TID251
        assert engine.poll() is None, "the engine ended before it was watched"
        for run in live_runs():
            if run.identity == identity:
                return run
        time.sleep(0.05)  # noqa: TID251
    raise AssertionError("the engine did not announce its run")


@contextmanager
def _process(role: str, argument: str) -> Iterator[subprocess.Popen[bytes]]:
    """One of this module's processes, killed at the end."""
    process = subprocess.Popen([sys.executable, "-m", "tests.benchmarks.estop", role, argument])
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def _press(run: RunHandle, stamps: Path, situation: Situation, presses: int) -> list[float]:
    """Press and release the emergency stop; return the milliseconds until the body stopped."""
    client, generator, found = TelemetryClient(run), random.Random(0), list[float]()
    _until(client, lambda: client.poll() is not None)
    while len(found) < presses:
        if situation.held:
            _tell(client, "pause")
        _rest(client, generator.uniform(0.1, 0.25))
        known = len(stamps.read_text("utf-8").splitlines())
        sent = time.monotonic()  # noqa: TID251
        assert _tell(client, "estop").done
        stamp, planning = stamps.read_text("utf-8").splitlines()[known].split()
        if planning == "True" or not situation.planning:
            found.append(1000.0 * (float(stamp) - sent))
        assert _tell(client, "release").done
        if not situation.held:
            assert _tell(client, "resume").done
    client.close()
    return found


def _rest(client: TelemetryClient, seconds: float) -> None:
    deadline = time.monotonic() + seconds  # noqa: TID251
    while time.monotonic() < deadline:  # noqa: TID251
        client.poll()
        time.sleep(0.02)  # noqa: TID251


def _tell(client: TelemetryClient, kind: str) -> Ack:
    command, acks = Command(uuid4().hex, kind), list[Ack]()
    client.send(command)
    _until(client, lambda: acks.extend(client.acks()) or any(a.id == command.id for a in acks))
    return next(ack for ack in acks if ack.id == command.id)


def _until(client: TelemetryClient, arrived: Callable[[], object]) -> None:
    deadline = time.monotonic() + ANSWER_TIMEOUT  # noqa: TID251
    while not arrived():
        assert time.monotonic() < deadline and not client.is_over  # noqa: TID251
        time.sleep(0.001)  # noqa: TID251


class StampedBody(SimulatedBody):
    """A simulated robot that writes down when it is told to stand by an emergency stop.

    Attributes:
        runtime: None until the run is built.
    """

    stamps: Path
    runtime: Runtime | None = None

    def command(self, command: BodyCommand) -> None:
        """Pass the command on; then append the time, and whether a plan is being computed."""
        super().command(command)
        if self.runtime is None or command.twist != STANDSTILL:
            return
        if self.runtime.mission.emergency_stop:
            now = time.monotonic()  # noqa: TID251
            worker = self.runtime.parts.navigator.tools.planner_worker
            planning = any(not plan.over for plan in worker._open)
            with self.stamps.open("a", encoding="utf-8") as file:
                file.write(f"{now:.6f} {planning}\n")


def engine(message: str) -> None:
    """Run a mission with a stamped body until it is killed."""
    mission, stamps, settings = json.loads(message)
    options = RunOptions(**settings)

    def make_body(setup: BodySetup) -> StampedBody:
        body = StampedBody(setup.robot, setup.world, start=setup.start, seed=setup.seed)
        body.stamps, body.pace = Path(stamps), setup.pace
        return body

    run = Run(prepare(mission, options), options, make_body=make_body)
    body = run.engine.body
    assert isinstance(body, StampedBody)
    body.runtime = run.engine.runtime
    try:
        while not run.is_over:
            if run.is_ready():
                run.step()
            else:
                run.serve()
    finally:
        run.close()


def view(identity: str) -> None:
    """Watch a run as a dashboard does, twenty times a second."""
    client = TelemetryClient(find_run(identity))
    while not client.is_over:
        client.poll()
        client.events()
        time.sleep(0.05)  # noqa: TID251


def flood(identity: str) -> None:
    """Send FLOOD_RATE commands a second, which the mission refuses one by one."""
    client = TelemetryClient(find_run(identity))
    count, began = 0, time.monotonic()  # noqa: TID251
    while not client.is_over:
        client.poll()
        client.acks()
        due = int(FLOOD_RATE * (time.monotonic() - began))  # noqa: TID251
        while count < due:
            count += 1
            try:
                client.send(Command(str(count), "teleop", {"linear": 0.1}))
            except TelemetryError:
                break  # the engine reads more slowly: this one is lost
        time.sleep(0.005)  # noqa: TID251


if __name__ == "__main__":
    {"engine": engine, "view": view, "flood": flood}[sys.argv[1]](sys.argv[2])

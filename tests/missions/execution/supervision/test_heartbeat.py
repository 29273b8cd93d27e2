"""The memory that engine and supervisor share: neither ever reads a half-written value."""

import os
import signal
import subprocess
import sys
from itertools import count
from pathlib import Path

from missions.execution.supervision.heartbeat import Heartbeat, Phase

ROOT = Path(__file__).parents[4]
ENGINE = """
import sys
from missions.execution.supervision.heartbeat import Heartbeat, Phase
heartbeat = Heartbeat(int(sys.argv[1]))
heartbeat.phase = Phase.RUNNING
for step in range(1, 150_000):
    heartbeat.beat(step, float(step), float(step))
    heartbeat.phase = Phase.RUNNING
"""


def test_a_beat_is_read_whole_while_it_is_written():
    """Beats used to be cleared and then written: one in twenty was read as zeros or as parts."""
    heartbeat, shared = Heartbeat.create()
    heartbeat.phase = Phase.RUNNING
    heartbeat.beat(1, 1.0, 1.0)
    wrong = 0
    with subprocess.Popen(
        [sys.executable, "-c", ENGINE, str(shared)], cwd=ROOT, pass_fds=[shared]
    ) as engine:
        for number in count():
            beat = heartbeat.read()
            whole = beat.wall > 0.0 and beat.time == beat.distance == beat.step
            wrong += not (whole and beat.phase is Phase.RUNNING)
            if number % 100 == 0 and engine.poll() is not None:
                break
    os.close(shared)
    assert engine.returncode == 0
    assert heartbeat.read().step == 149_999
    assert wrong == 0


def test_before_the_first_step_a_beat_is_empty():
    heartbeat, shared = Heartbeat.create()
    os.close(shared)
    beat = heartbeat.read()
    assert (beat.phase, beat.wall, beat.step) == (Phase.STARTING, 0.0, 0)


def test_no_beat_is_half_written_wherever_the_engine_is_suspended():
    heartbeat, descriptor = Heartbeat.create()
    heartbeat.beat(1, 0.05, 0.0)
    child = os.fork()
    if child == 0:
        engine = Heartbeat(descriptor)
        while True:
            engine.beat(2, 0.1, 0.0)
    try:
        for _ in range(100):  # in two of three, `Struct.pack_into` had just cleared the memory
            os.kill(child, signal.SIGSTOP)
            os.waitpid(child, os.WUNTRACED)
            beat = heartbeat.read()
            assert beat.wall > 0.0 and beat.step in (1, 2)
            os.kill(child, signal.SIGCONT)
    finally:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        os.close(descriptor)

"""Memory that engine and supervisor share."""

from __future__ import annotations

import os
import signal
import time

from missions.execution.supervision.heartbeat import Heartbeat, Phase, Request


def test_what_one_side_writes_the_other_reads():
    heartbeat, descriptor = Heartbeat.create()
    other = Heartbeat(descriptor)
    os.close(descriptor)
    heartbeat.phase = Phase.RUNNING
    heartbeat.beat(7, 0.35, 1.5)
    other.request = Request.HUNG_UP
    beat = other.read()
    assert (beat.phase, beat.step, beat.time, beat.distance) == (Phase.RUNNING, 7, 0.35, 1.5)
    assert 0.0 <= time.monotonic() - beat.wall < 60.0  # noqa: TID251 - as the supervisor does
    assert heartbeat.request is Request.HUNG_UP


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

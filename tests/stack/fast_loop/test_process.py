"""A brain and its fast loop as real processes: what happens when one is killed or frozen."""

import os
import signal
import subprocess
import sys
from time import monotonic, sleep  # noqa: TID251 - waits for other processes

import numpy as np
import pytest

from stack.drivetrain.differential import Wheels
from stack.drivetrain.limits import Limits
from stack.drivetrain.wheel_loop import (
    DRIVING,
    LEVEL,
    LINEAR,
    MEASURED_SPEEDS,
    OFF,
    WheelGains,
    block,
    loop_plan,
)
from stack.errors import BodyError, InputError, ParameterError
from stack.fast_loop.client import SILENT, FastLoop, LoopSetup
from stack.fast_loop.driver import GROUP
from stack.types import Twist
from tests.benchmarks.dead_man import SCOUT, SPEED, STIFF, stops_after

pytestmark = pytest.mark.xdist_group("fast_loop")

DRIVE = Wheels(("l",), ("r",), 0.1, 0.4).drivetrain(Limits(linear_acceleration=20.0))
WAITS = 30.0


@pytest.fixture
def start():
    loops = []

    def make(**settings):
        gains = settings.pop("gains", WheelGains())
        loops.append(FastLoop(LoopSetup(loop_plan(DRIVE, 0.3, 2.0, gains), **settings)))
        return loops[-1]

    yield make
    for loop in loops:
        loop.close()


def state_of(loop):
    feedback = loop.feedback()
    return None if feedback is None else np.frombuffer(feedback.state)


def until(condition, act=lambda: None):
    """Wait for a condition on other processes, and act meanwhile as a brain does: at 50 Hz."""
    limit = monotonic() + WAITS
    while not condition():
        assert monotonic() < limit
        act()
        sleep(0.02)


def drive(loop, speed=0.5):
    until(
        lambda: (state := state_of(loop)) is not None and state[LINEAR] == speed,
        lambda: loop.command(Twist(speed)),
    )


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP], ids=["killed", "frozen"])
@pytest.mark.parametrize("deceleration", [STIFF, SCOUT], ids=["stiff", "scout"])
def test_the_wheels_stand_when_the_brain_is_gone(number, deceleration):
    """A killed brain is noticed at once, a frozen one so early that it stands after 0.3 s.

    For a stop of v / a = 0.167 s that is not before 0.15 s, and it stands at 0.317 s. 0.03 s are
    for the lag of the wheels and two cycles; the system may take 0.1 s more to end a process.
    """
    stop = stops_after(number, deceleration)[0]
    needs = SPEED / deceleration
    noticed = 0.1 if number == signal.SIGKILL else max(0.15, 0.3 - needs)
    assert stop.noticed <= noticed + 0.03 + stop.gap
    assert stop.stood <= noticed + needs + 0.03 + stop.gap
    assert stop.stood <= 0.35 + stop.gap


def test_a_loop_that_is_frozen_or_killed_is_a_problem(start):
    loop = start()
    drive(loop)
    assert loop.problem == ""
    os.kill(loop.pid, signal.SIGSTOP)
    began = monotonic()
    until(lambda: loop.problem)
    assert monotonic() - began >= SILENT - 0.1  # not at once: a busy machine is no fault
    assert loop.problem == "the fast loop has not answered for more than 0.3 s"
    for _ in range(5):  # what the brain said meanwhile is as old as the gap
        loop.command(Twist(0.8))
    os.kill(loop.pid, signal.SIGCONT)
    until(lambda: loop.problem == "")
    until(lambda: state_of(loop)[LINEAR] == 0.0)
    os.kill(loop.pid, signal.SIGKILL)
    until(lambda: loop.has_ended)
    assert loop.problem == "the fast loop was killed (SIGKILL)"


def test_an_emergency_stop_stands_until_it_is_released(start):
    loop = start()
    drive(loop)
    loop.emergency_stop()
    loop.command(Twist(0.5))  # at once, before the loop has read the stop
    until(lambda: state_of(loop)[LEVEL] == OFF, lambda: loop.command(Twist(0.5)))
    assert loop.feedback().stops == 1
    loop.release()
    until(lambda: state_of(loop)[LEVEL] == DRIVING, lambda: loop.command(Twist()))
    assert state_of(loop)[LINEAR] == 0.0
    loop.emergency_stop()
    until(lambda: state_of(loop)[LEVEL] == OFF, lambda: loop.command(Twist()))


def test_gains_of_the_loop_bring_wheels_with_inertia_to_their_speed(start):
    loop = start(gains=WheelGains(p=0.3, i=1.0, speed=0.05, friction=0.1))
    drive(loop)
    wanted = pytest.approx([5.0, 5.0], abs=0.05)  # 0.5 m/s at a radius of 0.1 m
    until(
        lambda: block(state_of(loop), MEASURED_SPEEDS) == wanted, lambda: loop.command(Twist(0.5))
    )


def test_statistics_count_every_cycle(start):
    loop = start(rate=200.0)
    until(lambda: loop.statistics().cycles > 60, lambda: loop.command(Twist()))
    timing = loop.statistics()
    assert sum(timing.late) == timing.cycles
    assert 0.0 < timing.percentile(0.5) <= timing.percentile(0.999) <= timing.worst
    loop.close()
    assert loop.statistics().cycles >= timing.cycles  # the memory outlives its writer


def test_wrong_setups_are_refused(start):
    with pytest.raises(InputError, match=r"no driver 'emulatd'; did you mean 'emulated'"):
        start(driver="emulatd")
    with pytest.raises(ParameterError, match="lagg"):
        start(parameters={"lagg": 0.1})


DRIVERS = """
import time
from stack.errors import BodyError
from stack.fast_loop.driver import Driver

class Dead(Driver):
    def open(self): raise BodyError("can0: no such device")
    def exchange(self, command, feedback): pass

class Slow(Dead):
    def open(self): time.sleep(60.0)

class Late(Dead):
    def open(self): pass
    def exchange(self, command, feedback): raise BodyError("bus off")

class Echo(Dead):
    heard = ()
    def open(self): pass
    def receive(self, message): self.heard = (message[::-1],)
    def messages(self):
        heard, self.heard = self.heard, ()
        return heard

class Hot(Dead):
    def open(self): self.began = None
    def exchange(self, command, feedback):
        self.began = self.began or command.now
        feedback.problem = "motor 2: 91 °C" if command.now - self.began < 0.5 else ""
"""


@pytest.fixture
def drivers(tmp_path, monkeypatch):
    """An installed package with drivers."""
    (tmp_path / "odd_drivers.py").write_text(DRIVERS)
    metadata = tmp_path / "odd-1.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: odd\nVersion: 1\n")
    names = ("Dead", "Slow", "Late", "Echo", "Hot")
    entries = "".join(f"{name.lower()} = odd_drivers:{name}\n" for name in names)
    (metadata / "entry_points.txt").write_text(f"[{GROUP}]\n{entries}")
    monkeypatch.syspath_prepend(tmp_path)


def test_a_driver_that_fails_is_reported_in_its_own_words(start, drivers):
    with pytest.raises(BodyError, match=r"^can0: no such device$"):
        start(driver="dead")
    with pytest.raises(BodyError, match="the driver 'slow' did not open within 3 s"):
        start(driver="slow", opens_within=3.0)
    loop = start(driver="late")
    until(lambda: loop.has_ended)
    assert loop.problem == "the fast loop ended with code 3: bus off"


def test_a_fault_releases_the_wheels_until_it_is_over(start, drivers):
    loop = start(driver="hot")
    until(lambda: loop.fault, lambda: loop.command(Twist(0.5)))
    assert (loop.fault, loop.problem) == ("motor 2: 91 °C", "")
    assert state_of(loop)[LINEAR] < 0.5
    until(lambda: not loop.fault, lambda: loop.command(Twist(0.5)))
    drive(loop)


def test_messages_go_to_the_driver_and_back(start, drivers):
    loop = start(driver="echo")
    found = []
    assert loop.send(b"abc")
    until(lambda: found.extend(loop.messages()) or found)
    assert found == [b"cba"]


def test_the_process_imports_nothing_of_the_brain():
    heavy = ("pybullet", "cv2", "py_trees", "zmq", "rerun", "textual", "gtsam", "typer")
    loads = "import sys, treepilot.drivers, stack.fast_loop.process"
    code = f"{loads}; print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_what_is_not_granted_is_said_with_the_command_that_grants_it(monkeypatch):
    from stack.fast_loop import privileges

    def refuse(*_):
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    monkeypatch.setattr(os, "sched_setaffinity", lambda *_: None)
    monkeypatch.setattr(privileges, "_lock_memory", lambda: None)
    found = {item.name: item for item in privileges.acquire()}
    assert found["priority"].problem == "Operation not permitted"
    assert "rtprio 60" in found["priority"].remedy
    assert found["memory"].problem == ""
    assert len(found) == 3

"""Whole missions with faulty cameras: an event, slower, then standstill; and on when it returns."""

from __future__ import annotations

import os
import signal
from dataclasses import replace
from math import hypot

import pytest

from robots.scripted import ScriptedBody, scans_of
from robots.simulated import SimulatedBody
from stack.types import Observation
from tests.missions.execution.live_run import LiveRun
from tests.stack.perception.cameras.pictures import (
    DEPTH_FAULTS,
    PIXEL_FAULTS,
    broken,
    colour_picture,
    floor_picture,
)

DRIVE = """
start: [1.0, 2.4, 0]
run: {drive_on_heading: {distance: 2.5 m, speed: 0.5}}
"""
DEPTH = {"parameters": {"depth.obstacles": "true"}}
FAULTY = (1.5, 4.0)
"""Seconds between which the camera has the fault."""


class Driven:
    """A mission on a scripted robot whose cameras have a fault for a while.

    Args:
        name: of the faulty camera.
        fault: picture, time -> what arrives, or None.
    """

    def __init__(self, folder, name, fault, **options):
        self.name, self.fault, self.number, self.due = name, fault, 0, 0.0
        self.run = LiveRun(folder, DRIVE, make_body=self._body, watch=False, **options)
        self.speeds = {}
        runtime = self.run.runtime
        for _ in range(400):
            time = runtime.parts.body.time
            runtime.step()
            twist = runtime.command.twist
            self.speeds[time] = hypot(twist.linear, twist.angular)
            if runtime.state.is_over:
                break
        self.run.close()

    def _body(self, setup):
        scans, made = scans_of(setup.robot, setup.world), {}
        cameras = {"camera": colour_picture, "depth": floor_picture}

        def script(time, pose):
            found = dict(scans(time, pose))
            if time < self.due - 1e-9:
                return found
            self.due, self.number = time + 0.1, self.number + 1
            for name, make in cameras.items():
                picture = make(time, self.number)
                if name == self.name and FAULTY[0] <= time < FAULTY[1]:
                    picture = self.fault(picture, time, made)
                if picture is not None:
                    found[name] = picture
            return found

        return ScriptedBody(setup.robot, script, start=setup.start)

    def between(self, start, end):
        return [speed for time, speed in self.speeds.items() if start <= time < end]

    @property
    def events(self):
        found = [event for event in self.run.kept.events if event.kind == "camera"]
        return [(event.fields["camera"], event.fields["fault"]) for event in found]

    @property
    def status(self):
        return str(self.run.runtime.state)


def frozen(picture, time, kept):
    return replace(kept.setdefault("frozen", picture), stamp=time)


def late(picture, time, kept):
    return replace(picture, stamp=time - 3.0) if time > FAULTY[0] + 3.0 else None


CONTENT = {
    name: (lambda picture, time, kept, change=change: broken(picture, change), word)
    for name, (change, word) in {**PIXEL_FAULTS, **DEPTH_FAULTS}.items()
}
BEHAVIOUR = {
    "stops": (lambda picture, time, kept: None, "silent"),
    "is frozen": (frozen, "frozen"),
    "is from the future": (lambda p, time, kept: replace(p, stamp=time + 5.0), "stamp"),
}
CHOSEN = ["truncated", "NaN", "all zero"]
FAULTS = {name: CONTENT[name] for name in CHOSEN} | BEHAVIOUR


@pytest.mark.parametrize("fault", FAULTS)
def test_without_its_depth_camera_a_robot_slows_down_stops_and_goes_on(fault, tmp_path):
    change, word = FAULTS[fault]
    driven = Driven(tmp_path / "m", "depth", change, **DEPTH)
    assert driven.events[0] == ("depth", word) and driven.events[-1] == ("depth", "")
    # The last good picture is that of 1.4 s; a frozen one is noticed after five repeats. From an
    # age of 0.3 s on the robot drives 0.15 m/s, and from 1 s on it stands.
    known = 1.4 + (0.5 if fault == "is frozen" else 0.0)
    assert max(driven.between(0.5, known)) == pytest.approx(0.5)
    slow, still = driven.between(known + 0.7, known + 0.95), driven.between(known + 1.2, 4.0)
    assert max(slow) <= 0.15 + 1e-6 and min(slow) > 0.1
    assert max(still) == 0.0
    assert max(driven.between(4.0, 6.0)) > 0.4
    assert driven.status == "success"


@pytest.mark.parametrize("fault", ["truncated", "stops", "is frozen"])
def test_a_mission_that_needs_no_colour_camera_ignores_its_faults(fault, tmp_path):
    change, word = FAULTS[fault]
    driven = Driven(tmp_path / "m", "camera", change, camera="on", **DEPTH)
    assert driven.status == "success"
    assert driven.events[0] == ("camera", word)
    assert min(driven.between(1.2, 4.0)) == pytest.approx(0.5)  # never slower


def test_pictures_that_are_seconds_late_do_not_count_as_new(tmp_path):
    driven = Driven(tmp_path / "m", "depth", late, **DEPTH)
    assert max(driven.between(2.6, 4.0)) == 0.0
    assert driven.status == "success"


def test_a_robot_whose_depth_camera_never_delivers_does_not_drive(tmp_path):
    driven = Driven(tmp_path / "m", "depth", lambda *_: None, **DEPTH)
    assert driven.events[0] == ("depth", "silent")


class Killed(SimulatedBody):
    """A simulated robot whose renderer is killed at 1.5 s."""

    killed = False

    def sense(self) -> Observation:
        if self.time >= 1.5 and not self.killed:
            self.killed = True
            os.kill(self._robot.cameras["depth"]._renderer._process.pid, signal.SIGKILL)
        return super().sense()


def test_a_killed_renderer_is_started_again_and_the_mission_goes_on(tmp_path):
    def make(setup):
        return Killed(setup.robot, setup.world, start=setup.start, seed=setup.seed)

    run = LiveRun(tmp_path / "m", DRIVE, make_body=make, watch=False, **DEPTH)
    try:
        for _ in range(300):
            run.runtime.step()
            if run.runtime.state.is_over:
                break
    finally:
        run.close()
    assert str(run.runtime.state) == "success"
    found = [event.text for event in run.kept.events if event.kind == "renderer"]
    assert found == [
        "the renderer of the camera depth was killed (SIGKILL); the next picture starts another one"
    ]

"""The last commands of a run: whatever fails, the robot is told to stop and is let go of."""

import pytest

from missions.execution.prepare import RunOptions, prepare
from missions.execution.run import Run
from robots.scripted import ScriptedBody, scans_of
from stack.body import STOP
from stack.errors import BodyError
from tests.missions.execution.live_run import Kept

MISSION = """mission: straight on
robot: scout
world: small_room
run: {drive_on_heading: {distance: 1.2 m, speed: 0.2}}
"""


class NotedBody(ScriptedBody):
    """Notes its commands of a standstill and when it is let go of."""

    def __init__(self, notes, *arguments, **more):
        super().__init__(*arguments, **more)
        self.notes = notes

    def command(self, command):
        super().command(command)
        if command == STOP:
            self.notes.append("standstill")

    def close(self):
        self.notes.append("body closed")


class NotedSink(Kept):
    def __init__(self, notes):
        super().__init__()
        self.notes = notes

    def close(self, report):
        self.notes.append("records closed")


@pytest.fixture
def moving(tmp_path):
    """A run whose robot has begun to move, and the notes of it."""
    file, notes = tmp_path / "straight.yaml", []
    file.write_text(MISSION)

    def make(setup):
        return NotedBody(notes, setup.robot, scans_of(setup.robot, setup.world), start=setup.start)

    options = RunOptions(serve=False)
    run = Run(prepare(file, options), options, [NotedSink(notes)], make)
    for _ in range(20):
        run.step()
    assert run.engine.body.commands[-1].twist.linear > 0.0
    notes.clear()
    yield run, notes
    run.close()


def fail(*_, **__):
    raise ZeroDivisionError


def test_the_robot_stops_before_anything_is_closed(moving):
    run, notes = moving
    run.close()
    assert notes == ["standstill", "records closed", "body closed"]


@pytest.mark.parametrize("part", ["navigator", "objects", "estimator"])
def test_a_part_that_cannot_be_closed_keeps_no_other_open(moving, monkeypatch, part):
    run, notes = moving
    parts = run.engine.runtime.parts
    closed = {
        "navigator": parts.navigator,
        "objects": parts.perceiver.objects,
        "estimator": parts.perceiver.estimator,
    }
    for name, one in closed.items():
        monkeypatch.setattr(one, "close", lambda *_, name=name: notes.append(f"{name} closed"))
    monkeypatch.setattr(closed[part], "close", fail)
    with pytest.raises(ZeroDivisionError):
        run.close()
    assert notes[:3] == ["standstill", "records closed", "body closed"]
    others = closed.keys() - {part}
    assert set(notes[3:]) == {f"{name} closed" for name in others}


def test_a_body_that_refuses_the_last_command_is_closed_with_its_records(moving, monkeypatch):
    run, notes = moving

    def refuse(command):
        raise BodyError("the link is down")

    monkeypatch.setattr(run.engine.body, "command", refuse)
    run.close()
    assert notes == ["records closed", "body closed"]


@pytest.mark.parametrize("error", [ZeroDivisionError, BodyError])
def test_an_error_in_every_step_stops_the_robot(moving, monkeypatch, error):
    """The steps end before they command the body."""
    run, notes = moving

    def fail(*_):
        raise error("in every step")

    monkeypatch.setattr(run.engine.runtime.parts.perceiver.odometry, "update", fail)
    run.step()
    assert notes == ["standstill"]
    while not run.is_over:
        run.step()
    assert set(notes) == {"standstill"}
    assert run.engine.body.commands[-1] == STOP


def test_the_motion_is_stopped_with_the_mission(moving, monkeypatch):
    """It is not stepped any more, and has a controller to let go of."""
    run, notes = moving
    navigator = run.engine.runtime.parts.navigator
    monkeypatch.setattr(navigator.activities.current, "stop", notes.append)
    run.interrupt()
    assert notes == [run.engine.body.time]

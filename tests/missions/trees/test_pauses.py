"""Pauses: every time limit, delay and hold gets the same amount of unpaused time."""

from dataclasses import dataclass, field

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from py_trees.common import Status

from behaviours.testing import ScriptedRobot as PlainRobot
from stack.types import Battery
from tests.missions.mission_fakes import BURST_AT, Ran, ScriptedRobot, ran, read_text

TICKS = 60
"""Six seconds; every mission below ends earlier or repeats itself."""

LIMITED = {
    "timeout": "run: {act: runs, timeout: 1.7 s}",
    "delay of a retry": "run: {act: fails, retry: {attempts: 3, delay: 900 ms}}",
    "every": "run: {reactive: [{act: a, every: 700 ms}, {wait: 4 s}]}",
    "every across halts": "run: {parallel: [{act: a, every: 2 s, timeout: 3 s}], repeat: 2}",
    "wait": "run: {sequence: [{wait: 1.2 s}, {wait: 300 ms}, {act: a}]}",
    "drive_for": "run: {drive_for: {time: 1.3 s, linear: 0.2}}",
    "take_photo": "run: {take_photo: {patience: 1.4 s}, on_failure: continue}",
    "mission end": "run: {sequence: [{act: fails, on_failure: continue}, {wait: 2 s}]}",
    "hold of an event": """
        events:
          - low: {when: battery.charge < 0.3, hold: 1.1 s, do: {wait: 500 ms}, then: resume}
        run: {wait: 3 s, timeout: 2.5 s}
        """,
    "event in a branch with limits": """
        events:
          - low: {when: battery.charge < 0.3, hold: 600 ms, do: {wait: 1 s}, then: resume}
        run:
          sequence:
            - {act: fails, retry: {attempts: 2, delay: 800 ms}, on_failure: continue}
            - {sequence: [{wait: 5 s}], timeout: 2 s}
        """,
    "event that restarts": """
        events:
          - low: {when: battery.charge < 0.3, hold: 600 ms, do: {wait: 1 s}, then: restart}
        run: {parallel: [{wait: 5 s}, {act: a, every: 500 ms, repeat: 3}], timeout: 1.5 s}
        """,
    "nothing to see": "run: {wall_follow: {until_time: 2 s}}",
    "localisation is fine": "run: {relocalise: {only_if_lost: true}}",
}


@dataclass
class BlindRobot(ScriptedRobot):
    """A robot without a camera and a lidar, with a low battery."""

    battery: Battery = field(default_factory=lambda: Battery(0.2))

    def image(self):
        return None


def history(folder, text, pauses):
    """All that happens in six unpaused seconds, with the number of the tick.

    Args:
        pauses: tick -> lengths of the pauses before it, milliseconds; a negative one is a resume
            without a pause, and every pause is begun twice.
    """
    robot = BlindRobot(answers={"runs": "r", "fails": "f"})
    it = Ran(read_text(folder, text), robot)
    found = []
    for number in range(TICKS):
        for length in pauses.get(number, ()):
            if length >= 0:
                it.tree.pause(robot.time)
                robot.advance(length / 1000)
                it.tree.pause(robot.time)
            it.tree.resume(robot.time)
        it.ticks()
        found += [(number, event["text"], event["fields"]) for event in it.events]
        it.events.clear()
        found.append((number, [row.message for row in it.tree.rows()]))
    return found


@pytest.mark.parametrize("limit", LIMITED)
@settings(deadline=None, max_examples=25)
@given(
    pauses=st.dictionaries(
        st.integers(0, TICKS - 1), st.lists(st.integers(-1, 10_000), max_size=3), max_size=12
    )
)
def test_pauses_change_nothing_but_the_time(tmp_path_factory, limit, pauses):
    folder = tmp_path_factory.mktemp("mission")
    text = LIMITED[limit]
    assert history(folder, text, pauses) == history(folder, text, {})


def test_a_pause_within_a_pre_empted_branch_counts_once(tmp_path):
    """Timeout 2 s: 1 s before the event, pre-empted for 1 s and paused for 10 s, then 1 s."""
    it = ran(tmp_path, """
        events:
          - low: {when: battery.charge < 0.3, do: {wait: 1 s}, then: resume}
        run: {wait: 60 s, timeout: 2 s}
        """)  # fmt: skip
    it.ticks(10)
    it.robot.battery = Battery(0.2)
    it.ticks(5)
    it.tree.pause(it.robot.time)
    it.robot.advance(10.0)
    it.tree.resume(it.robot.time)
    it.robot.battery = Battery(1.0)
    it.ticks(15)
    assert it.tree.status is Status.RUNNING
    it.ticks(1)
    assert it.robot.time == pytest.approx(10.0 + 3.0 + 0.1)
    assert it.tree.failure.sentence == "not finished after 2 s"


def test_a_behaviour_is_paused_only_while_it_runs(tmp_path):
    it = ran(tmp_path, "run: {sequence: [{pausable: a}, {pausable: b}, {pausable: c}]}")
    it.robot.answers["b"] = "rs"
    it.ticks()
    it.tree.pause(it.robot.time)
    it.robot.advance(5.0)
    it.tree.resume(it.robot.time)
    assert it.robot.log == [("pause", "b", 0.1), ("resume", "b", 5.1)]


def test_an_exception_in_pause_is_that_nodes_failure(tmp_path):
    it = ran(tmp_path, "run: {broken: pause}")
    it.ticks()
    it.tree.pause(it.robot.time)
    it.tree.resume(it.robot.time)
    assert it.tree.status is Status.RUNNING
    it.ticks()
    assert it.tree.reason == f"test > broken: EXCEPTION ValueError: burst in pause {BURST_AT}"


def test_a_behaviour_halted_in_a_pause_is_not_resumed(tmp_path):
    it = ran(tmp_path, "run: {pausable: a}")
    it.robot.answers["a"] = "r"
    it.ticks()
    it.tree.pause(it.robot.time)
    it.tree.halt()
    it.tree.resume(it.robot.time)
    assert it.robot.log == [("pause", "a", 0.1)]


def test_the_plain_robot_is_enough_for_the_test_of_a_plugin():
    """As in docs/behaviours.md: the kit pauses a behaviour without a tree."""
    from behaviours.flow.wait import Wait
    from behaviours.testing import pause, tick

    robot, wait = PlainRobot(), Wait(time=1.0)
    assert tick(wait, robot, 0.5) is Status.RUNNING
    pause(wait, robot, 60.0)
    assert tick(wait, robot, 0.4) is Status.RUNNING
    assert tick(wait, robot, 0.1) is Status.SUCCESS
    assert robot.time == pytest.approx(61.0)

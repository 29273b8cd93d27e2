"""`finally`, `invert`, `repeat: {until: …}`, `switch`, `fail` and `unset`."""

import numpy as np
import pytest
from py_trees.common import Status

from missions.trees import show
from stack.types import Battery, Failure, Path, Pose2D, Twist
from tests.missions.mission_fakes import ran


@pytest.fixture
def run(tmp_path):
    return lambda text, **overrides: ran(tmp_path, text, **overrides)


@pytest.mark.parametrize(("end", "status"), [("s", Status.SUCCESS), ("f", Status.FAILURE)])
def test_finally_runs_after_success_and_failure_and_keeps_the_outcome(run, end, status):
    it = run("run: {act: a, finally: {act: z}}")
    it.robot.answers.update(a=f"r{end}", z="rs")
    it.ticks(2)
    assert it.robot.log[-1] == "z starts"
    it.ticks()
    assert it.robot.log[-1] == "z done"
    assert it.tree.status is status


def test_the_first_cause_stays_the_failure_of_the_node(run):
    it = run("run: {act: a, finally: {check: robot.speed > 9}}")
    it.robot.answers["a"] = "f"
    it.ticks()
    assert it.tree.failure.code == "NO_WALL"
    it = run("run: {act: a, finally: {check: robot.speed > 9}}")
    it.ticks()
    assert it.tree.failure.code == "CHECK_FAILED"


def test_a_halted_node_runs_its_finally_for_one_tick_before_anything_else_starts(run):
    it = run("""
        run:
          sequence:
            - {act: a, finally: {sequence: [{act: y}, {act: z}, {act: never}]}, timeout: 100 ms,
               name: inner, on_failure: continue}
            - sequence: [{act: b, finally: {sequence: [{act: y}, {act: z}]}}]
              while: time < 0.25
              on_failure: continue
            - act: c
        """)
    it.robot.answers.update(a="r", b="r", z="rsr")
    it.ticks(4)
    assert it.robot.log[:8] == [
        "a starts", "a halted", "y starts", "y done", "z starts", "z done", "never starts",
        "never done",
    ]  # fmt: skip
    # `timeout` is inside `finally`: a's ended by itself. b is halted: z has one tick.
    assert it.robot.log[8:] == [
        "b starts", "b halted", "y starts", "y done", "z starts", "z halted", "c starts", "c done",
    ]  # fmt: skip
    text = next(event["text"] for event in it.events if event["kind"] == "finally")
    assert text == "finally: sequence: is halted after one tick, because its node was halted"


def test_finally_runs_when_the_operator_halts_the_mission_and_not_twice(run):
    it = run("run: {act: a, finally: {act: z}}")
    it.robot.answers["a"] = "r"
    it.ticks()
    it.tree.halt()
    it.tree.halt()
    assert it.robot.log == ["a starts", "a halted", "z starts", "z done"]


def test_finally_does_not_run_for_a_skipped_node_or_one_that_an_event_interrupts(run):
    it = run("run: {sequence: [{act: a, when: robot.speed > 9, finally: {act: z}}, {act: b}]}")
    assert it.ticks() == ["b starts", "b done"]
    it = run("""
        events: [{low: {when: battery.charge < 0.3, do: {act: dock}}}]
        run: {act: a, finally: {act: z}}
        """)
    it.robot.answers["a"] = "rrs"
    it.ticks()
    it.robot.battery = Battery(0.1)
    it.ticks(2)
    assert it.robot.log == [
        "a starts", "a halted", "dock starts", "dock done", "a starts", "a done", "z starts",
        "z done",
    ]  # fmt: skip


def test_invert(run):
    it = run("run: {sequence: [{check: robot.speed > 9, invert: true}, {act: a}]}")
    assert it.ticks() == ["a starts", "a done"]
    it = run("run: {act: a, invert: true}")
    it.ticks()
    assert it.tree.reason == "test > act: CHECK_FAILED act succeeded, inverted"


def test_repeat_until_runs_at_least_once_and_ends_with_its_condition(run):
    it = run("""
        blackboard: {n: {type: int, initial: 5}}
        run: {set: {n: $n + 1}, repeat: {until: $n > 3}}
        """)
    it.ticks()
    assert it.tree.status is Status.SUCCESS
    it = run("""
        blackboard: {n: {type: int, initial: 0}}
        run: {set: {n: $n + 1}, repeat: {until: $n >= 3}}
        """)
    it.ticks(2)
    assert it.tree.status is Status.RUNNING
    it.ticks()
    assert (it.tree.status, it.tree.values()["n"]) == (Status.SUCCESS, 3)


SWITCH = """
arguments: {mode: {type: text, one_of: [fast, slow, off], default: fast}}
run:
  switch:
    value: $mode
    cases: {fast: {act: a}, slow: {act: b, when: robot.speed > 9}}
    %s
"""


def test_switch_runs_one_case_or_the_default(run):
    default = "default: {act: d}"
    assert run(SWITCH % default).ticks() == ["a starts", "a done"]
    assert run(SWITCH % default, mode="slow").ticks() == []
    assert run(SWITCH % default, mode="off").ticks() == ["d starts", "d done"]
    assert "case fast" in show.text(run(SWITCH % default).tree)


def test_switch_without_a_case_fails_with_the_text(run):
    it = run(SWITCH % "", mode="off")
    it.ticks()
    assert it.tree.failure == Failure("CHECK_FAILED", "no case for 'off': $mode (off)")


def test_switch_over_the_failure_that_is_dealt_with(run):
    it = run("""
        run:
          fallback:
            - act: a
            - switch:
                value: error
                cases: {LOST: {act: l}, NO_WALL: {act: w}}
                default: {act: d}
        """)
    it.robot.answers["a"] = "f"
    assert it.ticks()[-1] == "w done"


def test_switch_chooses_once(run):
    it = run("""
        blackboard: {mode: {type: text, initial: x}}
        run: {switch: {value: $mode, cases: {x: {act: a}}, default: {act: d}}}
        """)
    it.robot.answers["a"] = "rrs"
    it.ticks()
    it.tree.write("mode", "y")
    it.ticks(2)
    assert it.robot.log == ["a starts", "a done"]


@pytest.mark.parametrize("code", ["SHELF_EMPTY", "FIRE_DOOR_CLOSED", "DOOR_LOCKED", "PATH_LOST"])
def test_fail_has_a_code_and_a_reason_also_one_that_resembles_a_known_one(run, code):
    it = run(
        """
        arguments: {shelf: {type: text, default: A3}}
        run: {fail: {code: CODE, because: "nothing on ${shelf}"}}
        """.replace("CODE", code)
    )
    it.ticks()
    assert it.tree.failure == Failure(code, "nothing on A3")


def test_unset_removes_values(run):
    it = run("""
        blackboard: {n: {type: int, optional: true}, m: {type: int, optional: true}}
        run:
          sequence:
            - set: {n: 1, m: 2}
            - unset: [$n, $m]
            - check: $n is not set
        """)
    it.ticks()
    assert it.tree.status is Status.SUCCESS
    assert it.tree.blackboard() == {"n": "not set", "m": "not set"}


PIPELINE = """
blackboard: {path: {type: Path, optional: true}}
run:
  use: drive
  with: {goal: [4, 0]}
trees:
  drive:
    in: {goal: Pose}
    do:
      parallel:
        succeed_on: one
        do:
          - sequence:
              - compute_path: {goal: $goal}
                out: {path: $path}
                recover: {attempts: 3, round_robin: [{clear_costmap: global}]}
              - wait: 1 s
            repeat: forever
          - sequence:
              - wait_until: $path is set
              - follow_path: $path
"""


def test_a_pipeline_of_planner_and_controller_replans_at_its_rate(run):
    """Nav2's pipeline as one's own tree: a plan a second, the robot follows the newest one."""
    it = run(PIPELINE)
    it.robot.lasting = True
    first, second = path(0.0), path(1.0)
    it.ticks()
    assert it.robot.calls_of("plan") == [{"goal": Pose2D(4.0, 0.0), "start": None}]
    it.robot.task.fail("NO_VALID_PATH", "no way")
    it.ticks(2)  # recovery, next attempt
    assert it.robot.calls_of("clear_costmap") == [{"which": "global"}]
    assert len(it.robot.calls_of("plan")) == 2
    it.robot.task.succeed(first)
    it.ticks(2)
    assert it.robot.calls_of("follow_path") == [{"path": first}]
    drive = it.robot.motion
    it.ticks(11)
    it.robot.task.fail("NO_VALID_PATH", "no way")
    it.ticks(2)
    assert it.tree.blackboard()["path"] == "not set"
    assert drive.failure is None, "it stays on the last path"
    it.robot.task.succeed(second)
    it.ticks(2)
    assert [call["path"] for call in it.robot.calls_of("follow_path")] == [first, second]
    assert drive.failure.code == "CANCELLED"
    it.robot.motion.succeed()
    it.ticks()
    assert it.tree.status is Status.SUCCESS


def path(y):
    return Path(np.array([[0.0, y, 0.0], [4.0, y, 0.0]]))


def test_a_path_can_be_written_in_the_mission(run):
    it = run("run: {follow_path: [[0, 0], [2, 0, 90 deg], [2, 1], [2, 3]]}")
    it.ticks()
    points = it.robot.calls_of("follow_path")[0]["path"].points
    right = np.pi / 2
    assert points == pytest.approx(
        np.array([[0, 0, 0], [2, 0, right], [2, 1, right], [2, 3, right]])
    )


def test_a_plan_fails_with_the_code_of_the_planner(run):
    it = run("run: {compute_path: {goal: [1, 0], start: [0, 1]}}")
    it.robot.lasting = True
    it.ticks()
    it.robot.task.fail("GOAL_OCCUPIED", "a wall")
    it.ticks()
    assert it.tree.failure == Failure("GOAL_OCCUPIED", "a wall")
    assert it.robot.speed == Twist()

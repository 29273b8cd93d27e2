"""What belongs to whom: `error`, outputs, the first cause, the work of a tick."""

import pytest
from py_trees.common import Status

from stack.types import Failure, Pose2D
from tests.missions.mission_fakes import ran


@pytest.fixture
def run(tmp_path):
    return lambda text, **overrides: ran(tmp_path, text, **overrides)


def test_error_is_the_failure_that_the_innermost_node_deals_with(run):
    """`NO_WALL` is what act fails with, `CHECK_FAILED` comes from a check."""
    it = run("""
        run:
          fallback:
            - act: a
            - sequence:
                - say: "outer ${error}"
                - fallback:
                    - check: robot.speed > 9
                    - say: "inner ${error}"
                - {check: robot.speed > 9, on_failure: continue}
                - say: "outer ${error}"
                - check: robot.speed > 9
                  recover: {attempts: 2, round_robin: [{say: "recover ${error}"}]}
                  on_failure: continue
        """)
    it.robot.answers["a"] = "f"
    it.ticks(4)
    assert it.robot.log == [
        "a starts", "a failed", "outer NO_WALL", "inner CHECK_FAILED", "outer NO_WALL",
        "recover CHECK_FAILED",
    ]  # fmt: skip
    assert it.tree.status is Status.SUCCESS


def test_an_event_does_not_touch_error(run):
    it = run("""
        events:
          - low: {when: time > 0.05, do: {fallback: [{check: robot.speed > 9}, {act: c}]}}
        run:
          fallback: [{act: a}, {sequence: [{act: b}, {say: "${error}"}]}]
        """)
    it.robot.answers.update(a="f", b="rs")
    it.ticks(2)
    assert it.robot.log[-1] == "NO_WALL"


def test_a_loop_that_goes_on_after_a_failure_does_not_touch_error(run):
    it = run("""
        run:
          fallback:
            - act: a
            - sequence:
                - for_each: {word: [one, two]}
                  on_failure: continue
                  do: {check: robot.speed > 9}
                - say: "${error}"
        """)
    it.robot.answers.update(a="f")
    assert it.ticks()[-1] == "NO_WALL"


def test_the_first_cause_of_a_parallel_is_the_first_in_time(run):
    it = run("run: {parallel: {succeed_on: 2, do: [{act: a}, {check: time > 9}, {act: b}]}}")
    it.robot.answers.update(a="rf", b="r")
    it.ticks(2)
    assert it.tree.failure.code == "CHECK_FAILED"


def test_on_failure_covers_while(run):
    it = run("run: {sequence: [{act: a, while: time < 0.05, on_failure: continue}, {act: b}]}")
    it.robot.answers["a"] = "r"
    it.ticks(2)
    assert it.robot.log == ["a starts", "a halted", "b starts", "b done"]


PHOTOS = """
blackboard: {photo: {type: path, optional: true}, driven: {type: length, initial: 7}}
"""


def test_a_failed_output_leaves_its_key_unset(run):
    it = run(f"""{PHOTOS}
run:
  for_each: {{goal: [[1, 0], [2, 0]]}}
  on_failure: continue
  do: {{use: inspect, with: {{goal: $goal}}, out: {{picture: $photo}}}}
trees:
  inspect:
    in: {{goal: Pose}}
    out: {{picture: path}}
    do:
      sequence:
        - {{take_photo: {{}}, out: {{image: $picture}}}}
        - navigate_to_pose: $goal
""")
    it.robot.answers["shut"] = (2.0,)
    it.ticks()
    assert it.tree.blackboard()["photo"] == "not set", "the photo of the first shelf"
    it = run(f"{PHOTOS}\nrun: {{navigate_to_pose: $lobby, out: {{path_length: $driven}}}}")
    it.robot.answers["shut"] = (9.0,)
    it.ticks()
    assert it.tree.blackboard()["driven"] == "7", "an initial value stays"


def test_an_unbound_output_is_unset_in_every_run(run):
    it = run("""
        run: {use: look, repeat: 2}
        trees:
          look:
            out: {picture: path}
            do:
              sequence:
                - act: x
                  when: $picture is not set
                - {take_photo: {}, out: {image: $picture}}
        """)
    it.ticks(2)
    assert it.robot.log.count("x starts") == 2


def test_long_loops_give_the_tick_back(run):
    """100 items a tick, over all loops; nested ones still get at least one item each."""
    keys = "blackboard: {n: {type: int, initial: 0}}"
    items = "[" + ", ".join(map(str, range(60))) + "]"
    it = run(f"{keys}\nrun: {{for_each: {{i: {items}}}, do: {{for_each: {{j: {items}}}, "
             "do: {set: {n: $n + 1}}}}")  # fmt: skip
    it.ticks()
    # The outer loop's first item and 60 inner ones, its second one and 38.
    assert it.tree.values()["n"] == 98
    assert it.tree.status is Status.RUNNING
    it.ticks(60)
    assert it.tree.status is Status.SUCCESS
    assert it.tree.values()["n"] == 3600


def test_navigate_to_pose_follows_its_key(run):
    it = run("""
        blackboard: {goal: {type: Pose, initial: [1, 0]}}
        run: {navigate_to_pose: {goal: $goal}}
        """)
    it.robot.lasting = True
    it.ticks(5)
    it.tree.write("goal", Pose2D(2.0, 0.0))
    it.ticks(5)  # .. 0.9 s; at most one change a second
    assert it.robot.log == [Pose2D(1.0, 0.0)]
    it.ticks()
    assert it.robot.log == [Pose2D(1.0, 0.0), Pose2D(2.0, 0.0)]
    it.tree.write("goal", Pose2D(3.0, 0.0))
    it.robot.task.succeed()
    it.ticks(9)
    assert it.tree.status is Status.RUNNING, "it is at the former goal"
    it.ticks()
    it.robot.task.succeed()
    it.ticks()
    assert it.robot.log[-1] == Pose2D(3.0, 0.0)
    assert it.tree.status is Status.SUCCESS


def test_an_exception_leaves_the_robot_standing(run):
    it = run("run: {sequence: [{stray: x, on_failure: continue}, {act: b}]}")
    it.robot.lasting = True
    it.ticks()
    assert [name for name, _ in it.robot.calls] == ["spin", "drive_for"]
    assert it.robot.twist.angular == it.robot.twist.linear == 0.0
    assert it.robot.log == ["b starts", "b done"]


def test_an_exception_in_terminate_still_cancels_the_task(run):
    it = run("run: {stubborn: x, timeout: 100 ms}")
    it.robot.lasting = True
    it.ticks(2)
    assert it.robot.motion.failure == Failure("CANCELLED", "cancelled")

"""What each node of the mission language does, tick by tick, on a scripted robot.

One file of short tests: they share the scripted robot and its log of starts and ends.
"""

import pytest
from py_trees.common import Status

from stack.types import Battery, Failure, Pose2D, Twist
from tests.missions.mission_fakes import ran


@pytest.fixture
def run(tmp_path):
    return lambda text, **overrides: ran(tmp_path, text, **overrides)


def test_sequence_goes_on_within_a_tick_and_remembers_where_it_was(run):
    it = run("run: {sequence: [{act: a}, {act: b}, {act: c}]}")
    it.robot.answers["b"] = "rrs"
    assert it.ticks() == ["a starts", "a done", "b starts"]
    it.ticks(2)
    assert it.robot.log[3:] == ["b done", "c starts", "c done"]
    assert it.tree.status is Status.SUCCESS
    assert it.tree.ticks == 3


def test_fallback_tries_the_next_and_stops_at_the_first_success(run):
    it = run("run: {fallback: [{act: a}, {act: b}, {act: c}]}")
    it.robot.answers["a"] = "f"
    assert it.ticks() == ["a starts", "a failed", "b starts", "b done"]
    assert it.tree.status is Status.SUCCESS


def test_fallback_fails_with_the_last_failure(run):
    it = run("run: {fallback: [{act: a}, {act: b}]}")
    it.robot.answers.update(a="f", b="f")
    it.ticks()
    assert it.tree.failure == Failure("NO_WALL", "b found no wall")


def test_reactive_starts_at_the_first_child_and_halts_when_a_check_fails(run):
    it = run("run: {reactive: [{check: battery.charge > 0.5}, {act: a}]}")
    it.robot.answers["a"] = "r"
    it.ticks(3)
    assert it.robot.log == ["a starts"]
    it.robot.battery = Battery(0.4)
    it.ticks()
    assert it.robot.log == ["a starts", "a halted"]
    assert it.tree.reason == "test > check: CHECK_FAILED not true: battery.charge (0.4) > 0.5"


def test_a_move_starts_only_after_the_pre_empted_child_is_halted(run):
    it = run("""
        run:
          reactive_fallback:
            - sequence: [{check: battery.charge < 0.3}, {drive: dock}]
            - sequence: [{act: prepare}, {drive: work}]
        """)
    it.robot.answers.update(work="r", dock="r")
    it.ticks(2)
    it.robot.battery = Battery(0.2)
    it.ticks(2)
    assert it.robot.log[-3:] == ["work starts", "work halted", "dock starts"]


def test_nodes_without_motion_are_halted_within_the_tick_before_later_children(run):
    it = run("""
        run: {reactive_fallback: [{sequence: [{check: battery.charge < 0.3}, {act: a}]}, {act: b}]}
        """)
    it.robot.answers.update(a="r", b="r")
    it.ticks(2)
    it.robot.battery = Battery(0.2)
    assert it.ticks() == ["b starts", "a starts", "b halted"]


def test_a_plain_class_that_is_run_again_does_not_halt_the_drive(run):
    """It has no `claims`, so it does not move the robot."""
    it = run("run: {reactive: [{py_trees.behaviours.Success: {}}, {drive: work}]}")
    it.robot.answers["work"] = "r"
    assert it.ticks(3) == ["work starts"]


def test_a_failing_earlier_child_that_moved_starts_the_later_one_again(run):
    it = run("run: {reactive_fallback: [{drive: a}, {act: b}]}")
    it.robot.answers.update(a="ff", b="r")
    it.ticks()
    assert it.robot.log == ["a starts", "a failed", "b starts"]
    it.ticks()
    assert it.robot.log[3:] == ["b halted", "a starts", "a failed", "b starts"]


def test_halting_goes_through_the_whole_subtree_the_deepest_first(run):
    it = run("""
        run:
          reactive:
            - check: battery.charge > 0.5
            - parallel: [{act: a, timeout: 9 s}, {sequence: [{act: b}, {act: c}]}]
        """)
    it.robot.answers.update(a="r", c="r")
    it.ticks()
    it.events.clear()
    it.tree.halt()
    assert it.robot.log == ["a starts", "b starts", "b done", "c starts", "a halted", "c halted"]
    assert it.changes() == [
        "check: success > idle", "act: running > idle", "timeout 9 s: running > idle",
        "act: success > idle", "act: running > idle", "sequence: running > idle",
        "parallel: running > idle", "reactive: running > idle",
    ]  # fmt: skip
    assert it.tree.status is Status.INVALID


@pytest.mark.parametrize(
    ("policy", "answers", "status", "log"),
    [
        ("all", {"a": "s", "b": "s", "c": "s"}, Status.SUCCESS, "c done"),
        ("all", {"a": "r", "b": "f", "c": "s"}, Status.FAILURE, "a halted"),
        ("one", {"a": "r", "b": "s", "c": "s"}, Status.SUCCESS, "a halted"),
        ("one", {"a": "f", "b": "f", "c": "f"}, Status.FAILURE, "c failed"),
        ("2", {"a": "s", "b": "f", "c": "s"}, Status.SUCCESS, "c done"),
        ("2", {"a": "f", "b": "r", "c": "f"}, Status.FAILURE, "b halted"),
    ],
)
def test_parallel_is_decided_as_early_as_possible_and_halts_the_rest(
    run, policy, answers, status, log
):
    it = run(
        f"run: {{parallel: {{succeed_on: {policy}, do: [{{act: a}}, {{act: b}}, {{act: c}}]}}}}"
    )
    it.robot.answers.update(answers)
    it.ticks()
    assert it.tree.status is status
    assert it.robot.log[-1] == log


def test_parallel_ticks_a_finished_child_no_more(run):
    it = run("run: {parallel: [{act: a}, {act: b}]}")
    it.robot.answers["b"] = "rrs"
    it.ticks(3)
    assert it.robot.log.count("a starts") == 1
    assert it.tree.status is Status.SUCCESS


def test_round_robin_takes_the_next_child_in_every_run(run):
    it = run("run: {round_robin: [{act: a}, {act: b}, {act: c}], repeat: 4}")
    it.robot.answers["b"] = "f"
    it.ticks(4)
    starts = [entry[0] for entry in it.robot.log if "starts" in entry]
    assert starts == ["a", "b", "c", "a", "b", "c"]


def test_round_robin_fails_when_all_fail(run):
    it = run("run: {round_robin: [{act: a}, {act: b}]}")
    it.robot.answers.update(a="f", b="f")
    it.ticks()
    assert it.tree.failure == Failure("NO_WALL", "b found no wall")


def test_for_each_runs_once_per_item_in_order(run):
    it = run("run: {for_each: {word: [one, two]}, do: {say: $word}}")
    assert it.ticks() == ["one", "two"]
    assert it.tree.status is Status.SUCCESS


def test_for_each_over_nothing_succeeds_without_running_anything(run):
    it = run("run: {for_each: {word: []}, do: {say: $word}}")
    assert it.ticks() == []
    assert it.tree.status is Status.SUCCESS


FAILING_PATROL = """
places: {desk_a: [1, 0], desk_b: [2, 0]}
run:
  for_each: {desk: [$desk_a, $desk_b]}
  name: each desk
  %s
  do:
    sequence:
      - navigate_to_pose: $desk
      - act: look
        name: visit
"""


def test_for_each_stops_at_a_failure_and_the_reason_names_the_item(run):
    it = run(FAILING_PATROL % "")
    it.robot.answers["look"] = "sf"
    it.ticks()
    assert it.tree.reason == (
        "test > each desk (desk = desk_b) > visit: NO_WALL look found no wall"
    )


def test_for_each_with_on_failure_continue_reports_and_continues(run):
    it = run(FAILING_PATROL % "on_failure: continue")
    it.robot.answers["look"] = "fs"
    it.ticks()
    assert it.tree.status is Status.SUCCESS
    told = [event["text"] for event in it.events if event["kind"] == "failure_passed_over"]
    assert told == ["desk = desk_a > visit: NO_WALL look found no wall"]


def test_on_failure_continue_makes_a_failure_a_success(run):
    it = run("run: {sequence: [{act: a, on_failure: continue}, {act: b}]}")
    it.robot.answers["a"] = "f"
    assert it.ticks()[-1] == "b done"


def test_a_skipped_node_does_not_change_the_outcome_of_its_parent(run):
    it = run("""
        blackboard: {n: {type: int, initial: 1}}
        run:
          sequence:
            - act: a
              when: $n > 1
            - fallback: [{act: b, when: $n > 1}, {act: c, when: $n == 1}]
        """)
    assert it.ticks() == ["c starts", "c done"]


def test_when_is_evaluated_only_at_the_start(run):
    it = run("run: {act: a, when: battery.charge > 0.5}")
    it.robot.answers["a"] = "rrs"
    it.ticks()
    it.robot.battery = Battery(0.1)
    it.ticks(2)
    assert it.tree.status is Status.SUCCESS


def test_while_halts_the_moment_the_condition_is_false(run):
    it = run("run: {act: a, while: robot.speed < 0.1}")
    it.robot.answers["a"] = "r"
    it.ticks()
    it.robot.speed = Twist(-0.2)
    it.ticks()
    assert it.robot.log == ["a starts", "a halted"]
    assert it.tree.failure == Failure("CHECK_FAILED", "robot.speed (0.2) < 0.1")


def test_timeout_runs_on_the_robots_clock(run):
    it = run("run: {act: a, timeout: 500 ms}")
    it.robot.answers["a"] = "r"
    it.ticks(5)
    assert it.tree.status is Status.RUNNING  # ticked at 0.0 .. 0.4 s
    it.ticks()
    assert it.tree.reason == "test > act: TIMED_OUT not finished after 0.5 s"
    assert it.robot.log == ["a starts", "a halted"]


def test_a_time_limit_quotes_what_held_the_robot(run):
    it = run("run: {act: a, timeout: 500 ms}")
    it.robot.answers["a"], it.robot.held_by = "r", "held 0.4 of 0.5 s: stopped: a person 0.3 m away"
    it.ticks(6)
    assert it.tree.failure.sentence == (
        "not finished after 0.5 s; held 0.4 of 0.5 s: stopped: a person 0.3 m away"
    )


def test_a_success_in_the_tick_of_the_limit_counts(run):
    it = run("run: {act: a, timeout: 100 ms}")
    it.robot.answers["a"] = "rs"
    it.ticks(2)
    assert it.tree.status is Status.SUCCESS


def test_timeout_is_per_attempt(run):
    it = run("run: {act: a, timeout: 300 ms, retry: 2}")
    it.robot.answers["a"] = "r"
    it.ticks(8)
    # Starts at 0.0, halted at 0.3; starts again at 0.4, halted at 0.7.
    assert it.robot.log == ["a starts", "a halted", "a starts", "a halted"]
    assert it.tree.failure.code == "TIMED_OUT"
    assert it.tree.ticks == 8


def test_retry_waits_between_attempts_and_reports_the_last_failure(run):
    it = run("run: {act: a, retry: {attempts: 3, delay: 300 ms}}")
    it.robot.answers["a"] = "f"
    it.ticks(7)
    # Attempts at 0.0, 0.3 and 0.6 s.
    assert it.robot.log == ["a starts", "a failed"] * 3
    assert it.tree.failure == Failure("NO_WALL", "a found no wall")


def test_retry_makes_one_attempt_per_tick(run):
    it = run("run: {act: a, retry: 5}")
    it.robot.answers["a"] = "ffs"
    it.ticks(2)
    assert it.tree.status is Status.RUNNING
    it.ticks()
    assert it.tree.status is Status.SUCCESS


def test_repeat_counts_runs_and_forever_never_ends(run):
    it = run("run: {act: a, repeat: 3}")
    it.ticks(9)
    assert it.robot.log.count("a starts") == 3
    endless = run("run: {act: a, repeat: forever}")
    endless.ticks(50)
    assert endless.tree.status is Status.RUNNING
    assert endless.robot.log.count("a starts") == 50
    assert shown(endless)["repeat forever"] == "50 times"


def shown(it):
    """The message of each row, by its name."""
    return {row.name: row.message for row in it.tree.rows()}


@pytest.mark.parametrize("inside", ["", ", retry: 2", ", timeout: 9 s"])
def test_a_repeat_does_not_count_the_results_that_every_repeats(run, inside):
    it = run(f"run: {{act: a, every: 60 s, repeat: forever{inside}}}")
    it.ticks(9)
    assert it.robot.log.count("a starts") == 1
    assert shown(it)["repeat forever"] == ""


def test_recover_runs_the_next_recovery_then_tries_again(run):
    it = run("""
        run:
          act: a
          recover: {attempts: 4, round_robin: [{act: x}, {act: y}]}
        """)
    it.robot.answers.update(a="fffs", y="f")
    it.ticks(4)
    starts = [entry[0] for entry in it.robot.log if "starts" in entry]
    assert starts == list("axayaxa")
    assert it.tree.status is Status.SUCCESS
    assert it.tree.recoveries == 3
    recoveries = [event for event in it.events if event["kind"] == "recovery"]
    assert [event["fields"]["attempt"] for event in recoveries] == [1, 2, 3]
    assert recoveries[0]["text"] == "act after NO_WALL: a found no wall"


def test_recover_gives_up_with_the_failure_of_the_last_attempt(run):
    it = run("run: {act: a, recover: {attempts: 2, round_robin: [{act: x}]}}")
    it.robot.answers["a"] = "f"
    it.ticks(5)
    assert it.robot.log == [
        "a starts", "a failed", "x starts", "x done", "a starts", "a failed",
    ]  # fmt: skip
    assert it.tree.failure == Failure("NO_WALL", "a found no wall")


@pytest.mark.parametrize(("unless", "starts"), [("error == NO_WALL", 1), ("attempt == 2", 2)])
def test_recover_unless_gives_up_at_once(run, unless, starts):
    it = run(
        f"run: {{act: a, recover: {{attempts: 9, unless: {unless}, round_robin: [{{act: x}}]}}}}"
    )
    it.robot.answers["a"] = "f"
    it.ticks(9)
    assert it.robot.log.count("a starts") == starts


def test_decorators_have_the_documented_order(run):
    it = run("""
        run:
          act: a
          timeout: 1 s
          retry: 2
          recover: {attempts: 2, round_robin: [{act: x}]}
          repeat: 2
          on_failure: continue
          while: time < 9
          when: time < 9
        """)
    kinds = [row.kind for row in it.tree.rows()]
    assert kinds == [
        "when", "on_failure", "while", "repeat", "recover", "retry", "timeout", "act", "act",
    ]  # fmt: skip


def test_trees_read_their_inputs_live_and_write_where_they_are_bound(run):
    it = run("""
        blackboard: {photo: {type: path, optional: true}, word: {type: text, initial: one}}
        run:
          sequence:
            - {use: look, with: {said: $word, where: $lobby}, out: {picture: $photo}}
            - set: {word: "'two'"}
            - {use: look, with: {said: $word, where: [1, 2]}}
        trees:
          look:
            in: {said: text, where: Pose}
            out: {picture: path}
            do:
              sequence:
                - say: $said
                - navigate_to_pose: $where
                - take_photo
                - act: x
                  when: $picture is not set
                - {take_photo: {}, out: {image: $picture}}
        """)
    assert it.ticks() == [
        "one", Pose2D(9.0, 9.0), "x starts", "x done",
        "two", Pose2D(1.0, 2.0), "x starts", "x done",
    ]  # fmt: skip
    assert it.tree.blackboard() == {"photo": "images/photo_0000.00s.png", "word": "two"}


def test_ports_outputs_and_assignments_reach_the_blackboard(run):
    it = run("""
        blackboard: {driven: {type: length, initial: 0}, n: {type: int, initial: 1}}
        run:
          sequence:
            - {navigate_to_pose: $lobby, out: {path_length: $driven}}
            - set: {n: $n * 2 + 1, driven: $driven + 1 m}
        """)
    it.robot.lasting = True
    it.ticks()
    it.robot.odometry = Pose2D(2.5, 0.0)
    it.robot.task.succeed()
    it.ticks()
    assert it.tree.blackboard() == {"driven": "3.5", "n": "3"}


def test_lists_are_put_together_when_they_are_read(run):
    it = run("""
        run: {for_each: {pose: [[1, 0], [2, 0]]}, do: {visit: {goals: [$lobby, $pose]}}}
        """)
    lobby = Pose2D(9.0, 9.0)
    assert it.ticks() == [[lobby, Pose2D(1.0, 0.0)], [lobby, Pose2D(2.0, 0.0)]]


def test_two_runs_of_one_mission_share_nothing(run):
    text = """
        blackboard: {n: {type: int, initial: 0}}
        run: {set: {n: $n + 1}, repeat: 2}
        """
    first, second = run(text), run(text)
    first.ticks(2)
    second.ticks(1)
    assert (first.tree.blackboard(), second.tree.blackboard()) == ({"n": "2"}, {"n": "1"})


def test_a_value_outside_a_ports_range_is_that_nodes_failure(run):
    it = run("""
        blackboard: {far: {type: length, initial: -1 m}}
        run: {back_up: {distance: $far}}
        """)
    it.ticks()
    sentence = "distance: -1 m must be above 0 m"
    assert it.tree.failure == Failure("OUT_OF_RANGE", sentence)


def test_plain_py_trees_classes_take_part(run):
    it = run("run: {py_trees.behaviours.TickCounter: {duration: 2, completion_status: success}}")
    it.ticks(2)
    assert it.tree.status is Status.RUNNING
    it.ticks()
    assert it.tree.status is Status.SUCCESS
    assert it.tree.rows()[0].name == "TickCounter"

"""Events and `every`, tick by tick on a scripted robot."""

import pytest
from py_trees.common import Status

from missions.trees import show
from stack.types import Battery, Failure, Twist
from tests.missions.mission_fakes import ran

LOW = "when: battery.charge < 0.3"


@pytest.fixture
def run(tmp_path):
    return lambda text, **overrides: ran(tmp_path, text, **overrides)


def patrol(then="resume", more=""):
    return f"""
        events:
          - low:
              {LOW}
              do: {{drive: dock}}
              then: {then}
        run:
          sequence:
            - act: a
            - sequence: [{{act: b}}, {{drive: c}}, {{act: d}}]
              {more}
        """


def low(it, charge=0.2):
    it.robot.battery = Battery(charge)


def test_resume_keeps_the_place_and_starts_only_what_was_running_again(run):
    it = run(patrol())
    it.robot.answers.update(c="rrrs", dock="rs")
    it.ticks(2)
    low(it)
    it.ticks()
    assert it.robot.log[-3:] == ["c starts", "c halted", "dock starts"]
    low(it, 0.9)
    it.ticks()
    # dock is done and c starts again in the same tick; a and b do not.
    assert it.robot.log[-2:] == ["dock done", "c starts"]
    it.ticks()
    assert it.robot.log[-3:] == ["c done", "d starts", "d done"]
    assert it.robot.log.count("a starts") == it.robot.log.count("b starts") == 1
    assert it.tree.status is Status.SUCCESS


def test_while_an_event_is_under_way_the_interrupted_branch_shows_as_idle(run):
    it = run(patrol())
    it.robot.answers.update(c="r", dock="rs")
    it.ticks()
    low(it)
    it.ticks()
    rows = {row.name: row.status for row in it.tree.rows()}
    assert rows["drive"] == "idle"
    assert [row.status for row in it.tree.rows() if row.kind == "sequence"] == ["idle", "idle"]
    low(it, 1.0)
    it.ticks()
    assert [row.status for row in it.tree.rows() if row.kind == "sequence"] == ["running"] * 2
    assert [event["text"] for event in it.events if event["kind"].startswith("event")] == [
        "low: battery.charge (0.2) < 0.3; interrupts sequence", "low is done: resume",
    ]  # fmt: skip


def test_restart_begins_run_again(run):
    it = run(patrol("restart"))
    it.robot.answers.update(c="rrs", dock="s")
    it.ticks(2)
    low(it)
    it.tree.tick()
    low(it, 1.0)
    it.ticks(2)
    assert it.robot.log.count("a starts") == 2
    assert it.tree.status is Status.SUCCESS


def test_abort_ends_the_mission_as_failed(run):
    it = run(patrol("abort"))
    it.robot.answers.update(c="r")
    it.ticks(2)
    low(it)
    it.ticks()
    assert it.robot.log[-3:] == ["c halted", "dock starts", "dock done"]
    assert it.tree.failure == Failure("CANCELLED", "the event 'low' ends the mission")
    assert all(row.status != "running" for row in it.tree.rows())


def test_the_failure_of_an_event_is_the_missions(run):
    it = run(patrol())
    it.robot.answers.update(c="r", dock="f")
    it.ticks(2)
    low(it)
    it.ticks()
    assert it.tree.reason == "test > low > drive: NO_WALL dock found no wall"
    assert it.robot.log[-3:] == ["c halted", "dock starts", "dock failed"]
    it.tree.halt()
    assert sum("starts" in entry for entry in it.robot.log) * 2 == len(it.robot.log)


def test_hold_needs_a_condition_that_is_true_without_a_break(run):
    it = run("""
        events: [{low: {when: battery.charge < 0.3, hold: 300 ms, do: {act: dock}}}]
        run: {act: a}
        """)
    it.robot.answers.update(a="r")
    low(it)
    it.ticks(3)  # true at 0.0, 0.1, 0.2 s
    low(it, 1.0)
    it.ticks()
    low(it)
    it.ticks(3)  # true at 0.4, 0.5, 0.6 s
    assert "dock starts" not in it.robot.log
    it.ticks()  # 0.7 s
    assert it.robot.log[1:] == ["a halted", "dock starts", "dock done", "a starts"]


def test_an_event_runs_to_its_end_when_its_condition_becomes_false(run):
    it = run(patrol())
    it.robot.answers.update(c="r", dock="rrrs")
    low(it)
    it.ticks()
    low(it, 1.0)
    it.ticks(2)
    assert it.robot.log == ["dock starts"]
    it.ticks()
    assert it.robot.log[1:4] == ["dock done", "a starts", "a done"]


def starts(it):
    return [entry.split()[0] for entry in it.robot.log if "starts" in entry]


def test_an_event_fires_when_its_condition_becomes_true_and_not_while_it_stays_true(run):
    it = run("""
        events: [{low: {when: battery.charge < 0.3, hold: 200 ms, do: {act: dock}}}]
        run: {act: a}
        """)
    it.robot.answers.update(a="r")
    low(it)
    it.ticks(60)  # true from the start: due at 0.2 s, once
    assert starts(it) == ["a", "dock", "a"]
    low(it, 1.0)
    it.ticks()
    low(it)
    it.ticks(3)
    assert starts(it) == ["a", "dock", "a", "dock", "a"]


def test_again_fires_while_the_condition_stays_true_that_far_apart(run):
    it = run("""
        events: [{low: {when: battery.charge < 0.3, again: 1 s, do: {act: dock}}}]
        run: {act: a}
        """)
    it.robot.answers.update(a="r", dock="rrrrrrrrrrrrrrrs")
    low(it)
    it.ticks(16)  # 1.5 s in the first run, which ends at 1.5 s
    assert starts(it) == ["dock", "a"]
    it.robot.answers.update(dock="s")
    it.ticks(9)  # .. 2.4 s
    assert starts(it) == ["dock", "a"]
    it.ticks()  # 2.5 s, a second after the end
    assert starts(it) == ["dock", "a", "dock", "a"]


def test_an_event_that_waits_for_its_turn_is_dropped_if_its_condition_is_false_by_then(run):
    it = run(TWO)
    it.robot.answers.update(a="r", look="rrs")
    it.robot.health = 0.1
    it.ticks()
    low(it)
    it.ticks()
    low(it, 1.0)
    it.ticks(3)
    assert starts(it) == ["look", "a"]


def test_two_events_due_at_once_run_one_after_the_other_without_a_tick_of_the_mission(run):
    it = run(TWO)
    it.robot.answers.update(a="r")
    it.ticks()
    low(it)
    it.robot.health = 0.1
    it.ticks()
    assert starts(it) == ["a", "look", "say", "dock", "x", "a"]


def test_restart_makes_all_edges_new(run):
    it = run("""
        blackboard: {n: {type: int, initial: 0}}
        events:
          - low: {when: battery.charge < 0.3, do: {act: dock}}
          - far: {when: $n == 1, do: {sequence: [{set: {n: 2}}, {act: back}]}, then: restart}
        run: {act: a}
        """)
    it.robot.answers.update(a="r")
    low(it)
    it.ticks()
    assert starts(it) == ["dock", "a"]
    it.tree.write("n", 1)
    it.ticks()
    assert starts(it) == ["dock", "a", "back", "dock", "a"]


def test_the_robot_stands_before_the_event_starts(run):
    it = run(patrol())
    it.robot.answers.update(c="r", dock="r")
    it.ticks()
    low(it)
    it.robot.speed = Twist(0.3)
    it.ticks(3)
    assert it.robot.log[-1] == "c halted"
    low(it, 1.0)  # it has fired; what becomes of the condition does not matter
    it.robot.speed = Twist(0.01)
    it.ticks()
    assert it.robot.log[-1] == "dock starts"


def test_an_event_does_not_wait_for_ever_for_a_robot_that_is_pushed(run):
    it = run(patrol())
    it.robot.answers.update(c="r", dock="r")
    it.robot.speed = Twist(0.3)
    low(it)
    it.ticks(50)  # 0.0 .. 4.9 s
    assert "dock starts" not in it.robot.log
    it.ticks()
    assert it.robot.log[-1] == "dock starts"
    assert any("the robot does not stand after 5 s" in event["text"] for event in it.events)


def test_a_condition_that_cannot_be_computed_is_false_and_says_so_once(run):
    it = run("""
        blackboard: {n: {type: int, optional: true}, m: {type: int, initial: 0}}
        events:
          - many: {when: $n > 2, do: {act: b}}
          - half: {when: 1 / $m > 2, do: {act: b}}
        run: {sequence: [{act: a}, {set: {n: 1, m: 1}}]}
        """)
    it.robot.answers["a"] = "rrrs"
    it.ticks(4)
    assert it.tree.status is Status.SUCCESS
    assert [event["text"] for event in it.events if event["kind"] == "event_not_computed"] == [
        "many: `when` counts as false: $n is read, but nothing has written it yet",
        "half: `when` counts as false: division by zero in 1 / $m (0) > 2",
    ]


def test_events_of_a_tree_are_alive_while_it_runs(run):
    it = run("""
        run: {sequence: [{act: a}, {use: t}, {act: c}]}
        trees:
          t:
            events: [{low: {when: battery.charge < 0.3, do: {act: dock}}}]
            do: {act: b}
        """)
    it.robot.answers.update(a="rs", b="r", c="r")
    low(it)
    it.ticks()
    assert starts(it) == ["a"]
    it.ticks()
    assert starts(it) == ["a", "dock", "b"]
    low(it, 1.0)
    it.ticks()
    low(it)
    it.ticks()
    assert starts(it) == ["a", "dock", "b", "dock", "b"]
    it.robot.answers.update(b="s")
    it.ticks()
    low(it, 1.0)
    it.ticks()
    low(it)
    it.ticks(2)
    assert starts(it)[-1] == "c"


def test_an_outer_event_interrupts_an_event_of_a_tree_and_both_resume(run):
    it = run("""
        events: [{lost: {when: localisation.health < 0.3, do: {act: look}}}]
        run: {use: t}
        trees:
          t:
            events: [{low: {when: battery.charge < 0.3, do: {drive: dock}}}]
            do: {act: b, timeout: 1 s}
        """)
    it.robot.answers.update(b="r", dock="rrr", look="rs")
    it.ticks()
    low(it)
    it.ticks()
    it.robot.health = 0.1
    it.ticks(2)
    it.robot.answers.update(dock="s")
    assert starts(it) == ["b", "dock", "look", "dock"]
    it.ticks()
    assert starts(it)[-1] == "b"
    it.ticks(8)
    assert it.tree.status is Status.RUNNING, "the limit stood still from 0.1 to 0.4 s"
    it.ticks(2)
    assert it.tree.failure.code == "TIMED_OUT"


TWO = """
    events:
      - lost: {when: localisation.health < 0.3, do: {drive: look}}
      - low: {when: battery.charge < 0.3, do: {sequence: [{act: say}, {drive: dock}, {act: x}]}}
    run: {drive: a}
    """


def test_only_an_earlier_event_pre_empts_an_event_which_resumes_then(run):
    it = run(TWO)
    it.robot.answers.update(a="r", dock="rrs", look="rs")
    it.ticks()
    low(it)
    it.ticks()
    it.robot.health = 0.1
    it.ticks()
    it.robot.health = 0.9
    low(it, 0.9)
    it.ticks(3)
    assert it.robot.log == [
        "a starts", "a halted", "say starts", "say done", "dock starts", "dock halted",
        "look starts", "look done", "dock starts", "dock done", "x starts", "x done", "a starts",
    ]  # fmt: skip


def test_a_later_event_waits_for_an_earlier_one(run):
    it = run(TWO)
    it.robot.answers.update(a="r", look="rrs")
    it.robot.health = 0.1
    it.ticks()
    low(it)
    it.ticks()
    assert it.robot.log == ["look starts"]
    it.ticks()
    assert it.robot.log[1:4] == ["look done", "say starts", "say done"]


def test_time_limits_and_delays_stand_still_while_a_branch_is_interrupted(run):
    it = run(patrol(more="timeout: 1 s"))
    it.robot.answers.update(c="r", dock="r")
    it.ticks(5)  # 0.0 .. 0.4 s
    low(it)
    it.ticks(20)  # interrupted at 0.5 s
    low(it, 1.0)
    it.robot.answers.update(dock="s")
    it.ticks()  # resumed at 2.5 s, so the limit is at 3.0 s
    it.ticks(4)
    assert it.tree.status is Status.RUNNING
    it.ticks()
    assert it.tree.failure.code == "TIMED_OUT"


def test_for_each_retry_and_parallel_keep_their_place(run):
    it = run("""
        events: [{low: {when: battery.charge < 0.3, do: {act: dock}}}]
        run:
          for_each: {word: [one, two]}
          do:
            sequence:
              - say: $word
              - parallel: [{act: p}, {drive: q}]
                retry: 2
        """)
    it.robot.answers.update(q="rfrs")
    it.ticks(2)
    low(it)
    it.robot.answers.update(q="rrs")
    it.tree.tick()
    low(it, 1.0)
    it.ticks(4)
    said = [entry for entry in it.robot.log if entry in ("one", "two")]
    assert said == ["one", "two"]
    # p: first attempt, second attempt, and once for "two"; not again when resumed.
    assert it.robot.log.count("p starts") == 3
    assert it.tree.status is Status.SUCCESS


def test_the_drawing_has_the_events(run):
    it = run(patrol())
    drawn = show.text(it.tree)
    assert drawn.splitlines()[1:4] == [
        "└─ · events",
        "   ├─ · low [event]  when battery.charge < 0.3, then resume",
        "   │  └─ · drive  who dock",
    ]  # fmt: skip


def test_every_keeps_the_last_result_until_its_period_is_over(run):
    it = run("""
        run: {reactive: [{act: look, every: 300 ms}, {act: go}]}
        """)
    it.robot.answers.update(go="r")
    it.ticks(7)  # 0.0, 0.3 and 0.6 s
    assert it.robot.log.count("look starts") == 3
    assert it.robot.log.count("go starts") == 1


def test_every_keeps_a_failure_too_with_its_reason(run):
    it = run("run: {act: look, every: 1 s, repeat: forever}")
    it.robot.answers.update(look="sf")
    it.ticks(5)
    assert it.robot.log.count("look starts") == 1
    it.ticks(6)
    assert it.tree.failure == Failure("NO_WALL", "look found no wall")


def test_every_does_not_end_a_run_under_way_and_counts_from_start_to_start(run):
    it = run("run: {repeat: forever, sequence: [{act: look, every: 300 ms}, {wait: 100 ms}]}")
    it.robot.answers.update(look="rrrrs")
    it.ticks(5)
    assert it.robot.log == ["look starts", "look done"]


def test_a_halted_run_left_no_result_so_every_starts_again(run):
    it = run("""
        run:
          reactive_fallback:
            - check: robot.speed > 1
            - {act: look, every: 10 s}
        """)
    it.robot.answers.update(look="r")
    it.ticks()
    it.tree.halt()
    it.ticks()
    assert it.robot.log == ["look starts", "look halted", "look starts"]

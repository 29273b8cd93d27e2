"""Breakpoints hold a node before it starts; forced nodes return their outcome without a run."""

import pytest

from missions.trees.compiler import compile_mission
from missions.trees.debugging import TreeDebugger
from stack.errors import InputError
from tests.missions.mission_fakes import ran, read_text

TWO = """
    run:
      sequence:
        - act: {who: a}
        - act: {who: b}
          name: second
"""


def debugged(folder, text, *breakpoints):
    it = ran(folder, text)
    debugger = TreeDebugger(it.tree)
    for node in breakpoints:
        debugger.set_breakpoint(node)
    return it, debugger


def test_a_node_is_held_before_anything_of_it_is_called(tmp_path):
    it, debugger = debugged(tmp_path, TWO, "second")
    assert it.ticks() == ["a starts", "a done"]
    assert debugger.pop_breakpoint_hits() == ("'second' (mission.yaml:5)",)
    assert debugger.pop_breakpoint_hits() == ()
    assert it.tree.outcome == "running"
    assert debugger.view().held == (2,)
    assert it.ticks() == ["a starts", "a done", "b starts", "b done"]
    assert it.tree.outcome == "success"
    assert debugger.view().held == ()


def test_earlier_nodes_of_the_same_tick_do_not_run_again(tmp_path):
    it, _ = debugged(tmp_path, """
        blackboard: {n: {type: int, initial: 0}}
        run:
          sequence:
            - set: {n: $n + 1}
            - reactive:
                - check: $n == 1
                - act: {who: b}
                  name: second
    """, "second")  # fmt: skip
    it.ticks(2)
    assert it.tree.outcome == "success"
    assert it.tree.blackboard() == {"n": "1"}


@pytest.mark.parametrize(
    ("wrapped", "stops"),
    [
        ("retry: 3", 2),  # each attempt starts the node again: f, s
        ("timeout: 9 s\n  every: 1 s", 1),
        ("when: true", 1),
        ("while: true", 1),
        ("recover: {attempts: 3, round_robin: [say: hm]}", 2),
    ],
)
def test_breakpoints_hold_under_every_modifier(tmp_path, wrapped, stops):
    text = "run:\n  act: {who: a}\n  name: it\n  " + wrapped.replace("\n", "\n") + "\n"
    it, debugger = debugged(tmp_path, text, "it")
    it.robot.answers["a"] = "fs" if stops == 2 else "s"
    counted = 0
    for _ in range(20):
        it.ticks()
        counted += len(debugger.pop_breakpoint_hits())
        if it.tree.outcome != "running":
            break
    assert it.tree.outcome == "success"
    assert counted == stops


def test_a_running_node_is_not_held_before_it_has_ended(tmp_path):
    it, debugger = debugged(tmp_path, TWO)
    it.robot.answers["a"] = "rrs"
    it.ticks()
    debugger.set_breakpoint("act")
    it.ticks(2)
    assert it.robot.log == ["a starts", "a done"]
    assert debugger.pop_breakpoint_hits() == ("'second' (mission.yaml:5)",)


def test_a_node_pre_empted_while_held_is_held_again_at_its_next_start(tmp_path):
    it, debugger = debugged(tmp_path, """
        run:
          reactive_fallback:
            - check: battery.charge < 0.5
            - act: {who: b}
              name: second
    """, "second")  # fmt: skip
    it.ticks()
    assert len(debugger.pop_breakpoint_hits()) == 1
    it.robot.battery = type(it.robot.battery)(0.1)
    it.ticks()
    assert it.tree.outcome == "success"
    assert it.robot.log == []
    assert debugger.view().held == ()


def test_parallel_branches_go_on_in_the_tick_that_reaches_a_breakpoint(tmp_path):
    it, debugger = debugged(tmp_path, """
        run:
          parallel:
            - act: {who: a}
              name: first
            - act: {who: b}
    """, "first")  # fmt: skip
    assert it.ticks() == ["b starts", "b done"]
    assert len(debugger.pop_breakpoint_hits()) == 1
    it.ticks()
    assert it.tree.outcome == "success"


def test_the_root_and_a_composite_can_be_held(tmp_path):
    it, _ = debugged(tmp_path, TWO, "0")
    assert it.ticks() == []
    assert it.changes() == []
    it.ticks()
    assert it.tree.outcome == "success"
    assert it.changes()[-1] == "sequence: idle > success"


def test_halting_a_held_tree_calls_nothing(tmp_path):
    it, _ = debugged(tmp_path, TWO, "second")
    it.ticks()
    it.tree.halt()
    assert it.robot.log == ["a starts", "a done"]
    assert it.tree.outcome == "idle"


def test_clearing_takes_the_gate_away(tmp_path):
    it, debugger = debugged(tmp_path, TWO, "second")
    record = it.tree.records[2]
    assert record.gate is not None
    debugger.clear_breakpoint("second")
    assert record.gate is None
    with pytest.raises(InputError, match="no breakpoint at 'second'"):
        debugger.clear_breakpoint("second")
    assert debugger.clear_breakpoint() == "there are no breakpoints"
    it.ticks()
    assert it.tree.outcome == "success"


def test_a_breakpoint_cleared_while_its_node_is_held_lets_it_start(tmp_path):
    it, debugger = debugged(tmp_path, TWO, "second")
    it.ticks()
    debugger.clear_breakpoint()
    it.ticks()
    assert it.tree.outcome == "success"


@pytest.mark.parametrize(("outcome", "ends"), [("success", "success"), ("failure", "failure")])
def test_a_forced_node_answers_without_being_run(tmp_path, outcome, ends):
    it, debugger = debugged(tmp_path, TWO)
    debugger.force("second", outcome, "NO_WALL" if outcome == "failure" else "")
    assert it.ticks() == ["a starts", "a done"]
    assert it.tree.outcome == ends
    assert it.changes()[1] == f"second: idle > {ends}"
    if ends == "failure":
        assert it.tree.reason == "test > second: NO_WALL forced by the operator"


def test_forcing_what_runs_halts_it_first_and_off_lets_it_run_again(tmp_path):
    it, debugger = debugged(tmp_path, """
        run:
          act: {who: a}
          repeat: 3
    """)  # fmt: skip
    it.robot.answers["a"] = "rrs"
    it.ticks()
    debugger.force("act", "success")
    assert debugger.view().forced == {"1": "success"}
    it.ticks()
    assert it.robot.log == ["a starts", "a halted"]
    debugger.force("act", "off")
    assert debugger.view().forced == {}
    it.ticks(3)
    assert it.robot.log == ["a starts", "a halted", "a starts", "a done", "a starts", "a done"]


def test_an_event_can_be_fired(tmp_path):
    it, debugger = debugged(tmp_path, """
        run: {wait: {time: 9}}
        events:
          - bell: {when: battery.charge < 0.1, do: {act: {who: bell}}, then: resume}
    """)  # fmt: skip
    it.ticks()
    debugger.force("bell", "due")
    it.ticks(2)
    assert it.robot.log == ["bell starts", "bell done"]
    with pytest.raises(InputError, match="not an event"):
        debugger.force("wait", "due")


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("second", "sucess"), "did you mean 'success'"),
        (("second", "failure", "NO_WAL"), "did you mean 'NO_WALL'"),
        (("secnd", "success"), "did you mean 'second'"),
    ],
)
def test_invalid_debug_commands_are_refused(tmp_path, arguments, sentence):
    with pytest.raises(InputError, match=sentence):
        debugged(tmp_path, TWO)[1].force(*arguments)


def test_breakpoints_and_outcomes_move_to_another_tree_by_path(tmp_path):
    _, debugger = debugged(tmp_path, TWO, "second", "0")
    debugger.force("act", "success")
    text = TWO.replace("- act: {who: a}", "- say: new\n        - act: {who: a}")
    other = compile_mission(read_text(tmp_path, text))
    assert debugger.move_to(other) == []
    assert debugger.view().breakpoints == (0, 3)
    assert sorted(debugger.view().forced) == ["2", "3"]
    third = compile_mission(read_text(tmp_path, "run: {say: only}"))
    assert debugger.move_to(third) == ["sequence", "sequence/act", "sequence/second"]


def test_a_node_with_another_path_is_found_by_its_old_name_or_line(tmp_path):
    _, debugger = debugged(tmp_path, TWO, ":4", "2")
    renamed = TWO.replace("- act: {who: a}", "- drive: {who: a}").replace("second", "2nd")
    other = compile_mission(read_text(tmp_path, renamed))
    assert debugger.move_to(other) == ["sequence/second"]
    assert debugger.view().breakpoints == (1,)


def test_values_with_the_same_declaration_are_taken_over(tmp_path):
    old = ran(tmp_path, """
        blackboard:
          kept: {type: int, initial: 0}
          other: {type: int, initial: 0}
          far: {type: float, unit: m, initial: 1.0}
          never: {type: int}
        run: {sequence: [{set: {kept: 7, other: 8, far: 2.5}}, {check: $never is set}]}
    """)  # fmt: skip
    old.ticks()
    new = ran(tmp_path, """
        blackboard:
          kept: {type: int, initial: 1}
          other: {type: text, initial: none yet}
          far: {type: float, unit: s, initial: 3.0}
          never: {type: int, initial: 5}
          more: {type: bool, initial: true}
        run: {check: $kept == 7 and $other == "" and $far > 0 and $more and $never == 1}
    """)  # fmt: skip
    assert new.tree.inherit(old.tree) == ["kept = 7"]
    values = new.tree.values()
    assert values == {"kept": 7, "other": "none yet", "far": 3.0, "never": 5, "more": True}
    assert new.tree.ticks == old.tree.ticks


def test_breakpoints_and_forced_outcomes_replace_no_method_of_a_node(tmp_path):
    it, debugger = debugged(tmp_path, TWO, "second")
    debugger.force("#1", "failure")
    for record in it.tree.records:
        own = vars(record.node)
        replaced = [name for name in own if callable(getattr(type(record.node), name, None))]
        assert replaced == [], record.kind

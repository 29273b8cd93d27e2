"""Expressions at ports and in `set`, lists, and the failures of values."""

import pytest

from missions.language.expressions import arithmetic
from stack.types import Battery, Failure, Pose2D
from tests.missions.mission_fakes import ran, read_text

HEAD = """
places: {dock: [1, 2, 90 deg]}
arguments: {most: {type: int, default: 3}, pause: {type: duration, default: 2 s}}
blackboard:
  n: {type: int, initial: 2}
  x: {type: length, initial: 4 m}
  f: {type: float, initial: 0.5}
  far: {type: length, optional: true}
  word: {type: text, initial: a}
  goals: {type: list of Pose, initial: [[1, 1]]}
  times: {type: list of duration, initial: [1 s, 3 s]}
  numbers: {type: list of float, unit: m, initial: [1, 20 cm]}
  where: {type: Pose, optional: true}
run: """


def seconds_of(folder, text):
    """Simulated seconds of a mission that succeeds, ticked every 0.1 s."""
    it = ran(folder, HEAD + text + "\n")
    while it.tree.outcome in ("idle", "running") and it.robot.time < 100.0:
        it.ticks()
    assert it.tree.outcome == "success", it.tree.reason
    return it.robot.time


@pytest.mark.parametrize(
    ("node", "seconds"),
    [
        ("{wait: $n * 2 s}", 4.1),  # the tick in which it succeeds takes 0.1 s too
        ("{wait: {time: $n * $pause}}", 4.1),
        ("{wait: $pause * 2}", 4.1),
        ("{wait: battery.charge * 3 s}", 3.1),
        ("{wait: $x / (2 m / 1 s)}", 2.1),
        ("{wait: '$times[1]'}", 3.1),
        ("{wait: 'max($n, 1) * 1 s'}", 2.1),
        ("{wait: 1 s, repeat: $n + 1}", 3.3),
        ("{wait: 9 s, timeout: $n * 1 s, on_failure: continue}", 2.1),
        ("{for_each: {t: [1 s, 2 s]}, do: {wait: $t}}", 3.1),
        ("{for_each: {t: [$pause, 500 ms]}, do: {wait: 2 * $t}}", 5.1),
        ("{for_each: {t: $times}, do: {wait: $t}}", 4.1),
        ("{for_each: {t: 'append($times, 2 s)'}, do: {wait: $t}}", 6.1),
        ("{use: rest, with: {time: $n * 1 s}}\ntrees: {rest: {in: {time: duration}, "
         "do: {wait: $time + 1 s}}}", 3.1),
    ],
)  # fmt: skip
def test_ports_take_expressions(tmp_path, node, seconds):
    assert seconds_of(tmp_path, node) == pytest.approx(seconds, abs=0.01)


@pytest.mark.parametrize(
    ("goal", "pose"),
    [
        ("[$x + 1 m, $n, 90 deg]", Pose2D(5.0, 2.0, 1.5707963267948966)),
        ("'pose($x, -$x)'", Pose2D(4.0, -4.0, 0.0)),
        ("'$goals[0]'", Pose2D(1.0, 1.0, 0.0)),
        ("'append($goals, $dock)[1]'", Pose2D(1.0, 2.0, 1.5707963267948966)),
    ],
)
def test_poses_from_numbers_and_lists(tmp_path, goal, pose):
    it = ran(tmp_path, f"{HEAD}{{navigate_to_pose: {{goal: {goal}}}}}\n")
    it.ticks()
    assert it.robot.log == [pose]


@pytest.mark.parametrize(
    ("assigned", "said"),
    [
        ("{word: 'at ${dock}, ${n} of ${most}'}", "at dock, 2 of 3"),
        ("{word: \"'a ${n}'\"}", "a ${n}"),  # in quotes inside the expression: a literal
        ("{far: 'distance($dock, pose(4, 6))'}", "5 m"),
        ("{far: 'abs($x - 10 m)'}", "6 m"),
        ("{far: '$numbers[1] * 2'}", "0.4 m"),
        ("{n: '7 % $n'}", "1"),
        ("{n: '-7 % 3'}", "2"),
        ("{n: length($word)}", "1"),
        ("{n: length($goals)}", "1"),
        ("{f: max($numbers) / 1 m}", "1"),
        ("{f: 'min(3, 2.5)'}", "2.5"),
        ("{goals: 'append($goals, $dock)'}", "[[1.00, 1.00, 0 deg], [1.00, 2.00, 90 deg]]"),
        ("{goals: []}", "[]"),
        ("{goals: [$dock, $dock]}", "[[1.00, 2.00, 90 deg], [1.00, 2.00, 90 deg]]"),
        ("{goals: [[1, 2], $dock]}", "[[1.00, 2.00, 0 deg], [1.00, 2.00, 90 deg]]"),
        ("{where: [$x, $x + 1 m]}", "[4.00, 5.00, 0 deg]"),
        ("{times: [$pause, 1]}", "[2, 1]"),
    ],
)
def test_assignments(tmp_path, assigned, said):
    key = assigned[1:].partition(":")[0]
    it = ran(tmp_path, f'{HEAD}{{sequence: [{{set: {assigned}}}, {{say: "${{{key}}}"}}]}}\n')
    it.ticks()
    assert it.robot.log == [said]


def test_an_expression_at_a_port_keeps_its_value_while_the_node_runs(tmp_path):
    it = ran(tmp_path, f"{HEAD}{{wait: battery.charge * 10 s}}\n")
    it.robot.battery = Battery(0.2)
    it.ticks(15)
    it.robot.battery = Battery(1.0)
    it.ticks(6)
    assert it.tree.outcome == "success"  # after 2 s, not 10 s


def test_each_run_of_a_node_computes_its_expressions_again(tmp_path):
    it = ran(tmp_path, HEAD + "{sequence: [{wait: $n * 1 s}, {set: {n: $n + 1}}], repeat: 2}\n")
    it.ticks(52)
    assert it.tree.outcome == "success"
    assert it.robot.time == pytest.approx(5.2)  # 2 s and 3 s, and the ticks


FAILURES = [
    ("{set: {n: $n + 9223372036854775807}}", "OVERFLOW",
     "the whole number exceeds 64 bits in $n (2) + 9223372036854775807"),
    ("{set: {f: $f * 1e308 * 1e308}}", "OVERFLOW",
     "the number is too large in $f (0.5) * 1e308 * 1e308"),
    ("{set: {f: 9007199254740993 + $n - 2}}", "OVERFLOW",
     "9007199254740993 cannot be stored exactly in a key or port of the type float"),
    ("{set: {f: 1 / ($n - 2)}}", "DIVISION_BY_ZERO", "division by zero in 1 / ($n (2) - 2)"),
    ("{check: '$n % ($n - 2) == 0'}", "DIVISION_BY_ZERO",
     "remainder of a division by zero in $n (2) % ($n (2) - 2) == 0"),
    ("{wait: 1 s / ($n - 2)}", "DIVISION_BY_ZERO", "division by zero in 1 s / ($n (2) - 2)"),
    ("{wait: -$n * 1 s}", "OUT_OF_RANGE", "time: -2 s must be at least 0 s"),
    ("{wait: 1 s, repeat: $n - 2}", "OUT_OF_RANGE", "repeat: 0 must be at least 1"),
    ("{wait: '$times[$n]'}", "OUT_OF_RANGE",
     "there is no item 2: the last index is 1 in $times[$n (2)]"),
    ("{set: {f: '$times[0 - 1] / 1 s'}}", "OUT_OF_RANGE", None),
    ("{navigate_to_pose: {goal: 'pose($x * 1e6, 0)'}}", "OUT_OF_RANGE", None),
    ("{sequence: [{set: {goals: []}}, {navigate_to_pose: {goal: '$goals[0]'}}]}", "OUT_OF_RANGE",
     "there is no item 0: the list is empty in $goals[0]"),
]  # fmt: skip


@pytest.mark.parametrize(("node", "code", "sentence"), FAILURES)
def test_values_that_cannot_be_computed_fail_the_node(tmp_path, node, code, sentence):
    it = ran(tmp_path, f"{HEAD}{node}\n")
    it.ticks(3)
    assert it.tree.outcome == "failure"
    assert it.tree.failure.code == code
    assert it.tracebacks == []
    if sentence is not None:
        assert it.tree.failure == Failure(code, sentence)


@pytest.mark.parametrize("code", ["OVERFLOW", "DIVISION_BY_ZERO", "OUT_OF_RANGE", "NOT_SET"])
def test_missions_can_name_the_codes(tmp_path, code):
    failing = {
        "OVERFLOW": "set: {n: $n + 9223372036854775807}",
        "DIVISION_BY_ZERO": "check: 1 / ($n - 2) > 1",
        "OUT_OF_RANGE": "wait: '$times[7]'",
        "NOT_SET": "wait: $far / 1 m * 1 s",
    }[code]
    # A camera that may fail: the check must believe that $far can be set.
    it = ran(tmp_path, f"""{HEAD}
  fallback:
    - sequence: [{{fallback: [{{check: $n == 2}}, {{set: {{far: 1 m}}}}]}}, {{{failing}}}]
    - {{check: error == {code}}}
""")  # fmt: skip
    it.ticks(2)
    assert it.tree.outcome == "success", it.tree.reason


def test_a_behaviour_whose_port_has_no_value_does_not_begin(tmp_path):
    it = ran(tmp_path, HEAD + "{navigate_to_pose: {goal: '$goals[3]'}}\n")
    it.ticks()
    assert it.robot.log == []
    assert it.tree.failure.code == "OUT_OF_RANGE"


@pytest.mark.parametrize(
    ("body", "code"),
    [
        ("{set: {n: $n * $n}}", "OVERFLOW"),  # 2, 4, 16, … 2^64 in the sixth run
        ('{set: {word: "${word}${word}"}}', "OVERFLOW"),  # 2^14 characters in the 14th
        ("{set: {goals: 'append($goals, $dock)'}}", "OVERFLOW"),  # 51 items
    ],
)
def test_values_cannot_grow_without_bound(tmp_path, body, code, monkeypatch):
    monkeypatch.setattr(arithmetic, "MAX_ITEMS", 50)
    it = ran(tmp_path, f"{HEAD}{{repeat: forever, {body[1:]}\n")
    ticks = 0
    while it.tree.outcome in ("idle", "running") and ticks < 60:
        it.tree.tick()
        ticks += 1
    assert it.tree.failure.code == code
    assert ticks == {"n": 6, "w": 14, "g": 50}[body[7]]


def test_events_modifiers_and_lists_take_expressions(tmp_path):
    it = ran(
        tmp_path,
        """
        blackboard: {n: {type: int, initial: 2}, x: {type: length, initial: 1 m}}
        events: [{low: {when: battery.charge < 0.5, hold: $n * 1 s, do: {set: {n: 0}}}}]
        run: {sequence: [{navigate_through: {goals: [[$x, 2], $lobby]}}, {wait: 9 s}]}
        """,
    )
    it.robot.battery = Battery(0.1)
    it.ticks(19)
    assert it.tree.values()["n"] == 2
    it.ticks(3)  # 2 s have passed
    assert it.tree.values()["n"] == 0
    goals = next(given["goals"] for name, given in it.robot.calls if name == "navigate_through")
    assert goals == [Pose2D(1.0, 2.0), Pose2D(9.0, 9.0)]


def test_units_of_loop_variables_reach_texts(tmp_path):
    it = ran(tmp_path, HEAD + '{for_each: {t: [3 s, 50 cm]}, do: {say: "${t}"}}\n'
             .replace("50 cm", "5 min"))  # fmt: skip
    it.ticks()
    assert it.robot.log == ["3 s", "300 s"]


def test_words_among_texts_stay_texts(tmp_path):
    it = ran(tmp_path, HEAD + '{for_each: {t: [3 s, soon]}, do: {say: "${t}"}}\n')
    it.ticks()
    assert it.robot.log == ["3 s", "soon"]


def test_drawings_show_the_expression(tmp_path):
    mission = read_text(tmp_path, HEAD + "{wait: {time: $n * 2 s}}\n")
    assert mission.root.detail == "time $n * 2 s"

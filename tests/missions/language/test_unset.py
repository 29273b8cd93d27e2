"""`unset` in the order of writes and reads: what must fail is found, and nothing else."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missions.language.reading.mission import FaultyMissionError
from tests.missions.mission_fakes import Ran, ScriptedRobot, read_text

HEAD = "blackboard: {k: {type: int, optional: true, doc: a}}\n"


def codes(folder, text):
    try:
        return [f"{item.code} {item.mark.line}" for item in read_text(folder, text).warnings]
    except FaultyMissionError as error:
        return [f"{item.code} {item.mark.line}" for item in error.findings]


def sequence(*nodes):
    """A mission of these nodes; the first is in line 4."""
    return f"{HEAD}run:\n  sequence:\n" + "".join(f"  - {node}\n" for node in nodes)


SET, UNSET, READ = "set: {k: 1}", "unset: $k", "say: '${k}'"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (sequence(SET, UNSET, READ), ["E143 6"]),
        (sequence(SET, UNSET, "wait_until: $k is set"), ["E163 6"]),
        (sequence(SET, UNSET, "{say: a, when: $k is set}"), ["W107 6"]),
        (sequence(SET, UNSET, SET, READ), []),
        (sequence(SET, "{unset: $k, when: time > 3}", READ), []),
        (sequence(SET, f"fallback: [{{sequence: [{{act: a}}, {{{UNSET}}}]}}, {{act: b}}]", READ),
         []),
        (sequence(SET, f"{{sequence: [{{act: a}}, {{{UNSET}}}], on_failure: continue}}", READ), []),
        (sequence(SET, f"{{sequence: [{{act: a}}, {{{UNSET}}}], finally: {{{READ}}}}}"), []),
        (sequence(SET, f"{{sequence: [{{act: a}}, {{{UNSET}}}], recover: {{attempts: 2, "
                       f"round_robin: [{{{READ}}}]}}}}"), []),
        (sequence(SET, f"parallel: [{{sequence: [{{{UNSET}}}, {{wait_until: $k is set}}]}}, "
                       f"{{sequence: [{{act: a}}, {{{SET}}}]}}]"), []),
        (sequence(SET, "use: t", READ) + "trees: {t: {do: {unset: $k}}}\n", ["E143 6"]),
        (sequence(UNSET, "wait_until: $k is set")
         + "events: [{a: {when: time > 3, do: {set: {k: 1}}}}]\n", []),
    ],
)  # fmt: skip
def test_what_is_unset_for_certain_is_not_read(tmp_path, text, expected):
    assert codes(tmp_path, text) == expected


def test_the_message_says_which_line_unsets_the_key(tmp_path):
    for last, says in (
        (READ, "$k is read here, but line 5 unsets it, and nothing can have written it since"),
        ("wait_until: $k is set", "line 5 unsets it, and nothing writes $k"),
    ):
        with pytest.raises(FaultyMissionError, match=says.replace("$", r"\$")):
            read_text(tmp_path, sequence(SET, UNSET, last))


LEAVES = st.sampled_from(["set: {k: 1}", "unset: $k", "say: '${k}'", "check: $k is set", "act: N"])
MODIFIERS = st.sampled_from(
    ["", "", "", "on_failure: continue", "invert: true", "when: $k is set", "retry: 2",
     "repeat: 2", "finally: {unset: $k}", "finally: {set: {k: 2}}",
     "recover: {attempts: 3, round_robin: [{unset: $k}, {set: {k: 3}}]}"]
)  # fmt: skip


@st.composite
def trees(draw, depth=3):
    """A node; each leaf is on a line of its own."""
    if depth == 0 or draw(st.integers(0, 2)) == 0:
        return f"\n  {{{draw(LEAVES)}}}"
    children = ", ".join(draw(st.lists(trees(depth - 1), min_size=2, max_size=3)))
    kind = draw(st.sampled_from(["sequence", "sequence", "fallback", "reactive"]))
    return f"{{{kind}: [{children}], {draw(MODIFIERS)}}}"


def named(text):
    """The text with a name for each leaf: its line, as findings give it."""
    lines = [
        f"  {{name: n{number}, " + line[3:].replace("N", f"a{number}")
        if line.startswith("  {") else line
        for number, line in enumerate(text.splitlines(), 1)
    ]  # fmt: skip
    return "\n".join(lines)


def ends(mission, answers):
    """The names of the nodes that succeeded in a run."""
    robot = ScriptedRobot()
    robot.answers = answers
    it = Ran(mission, robot)
    it.ticks(25)
    return {change.split(": ")[0] for change in it.changes() if change.endswith("> success")}


@settings(deadline=None, max_examples=80)
@given(tree=trees(), data=st.data())
def test_what_is_reported_fails_in_every_run(tmp_path_factory, tree, data):
    """A read without a value never succeeds, a check that is always false neither."""
    text = named(f"{HEAD}run: {tree}\n")
    try:
        mission = read_text(tmp_path_factory.mktemp("m"), text)
        found = mission.warnings
    except FaultyMissionError as error:
        mission, found = error.mission, error.findings
    reported = {
        f"n{item.mark.line}"
        for item in found
        if item.code == "E143" or "the check always fails" in item.sentence
    }
    for _ in range(3 if reported else 0):
        lines = range(1, text.count("\n") + 1)
        answers = {f"a{n}": data.draw(st.sampled_from(["s", "f", "fs", "sf", "rs"])) for n in lines}
        assert not reported & ends(mission, answers), text

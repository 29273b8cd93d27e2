"""Every kind of node and every key is known to all that use the registries."""

import ast
from dataclasses import replace
from pathlib import Path

import pytest
from rich.cells import cell_len

from behaviours.catalogue import find_behaviours
from missions.editor.markdown import word_text
from missions.inspection.diagnosis import findings_of
from missions.inspection.listing import description_of, installed, rows_of
from missions.language.keys import ANY_KEY, MODIFIERS, Form, required
from missions.language.kinds import CONTROLS, KINDS, NODES, outline_of
from missions.language.kinds.composite import CompositeStep
from missions.language.kinds.kind import Shape
from missions.language.kinds.leaf import CONDITION_GLYPH, LEAF_GLYPH
from missions.language.reading.words import Draft, WordRole
from missions.language.sections import PLACES, SECTIONS, mission_words
from missions.trees.compiler import compile_mission
from missions.trees.show import dot
from tests.missions.language.reference import value_words
from tests.missions.mission_fakes import read_text
from tui.terminal.ascii_glyphs import GLYPHS

PAGE = (Path(__file__).parents[3] / "docs" / "reference.md").read_text("utf-8")

HEAD = "mission: m\nrobot: scout\nworld: office\n"


@pytest.mark.parametrize("word", KINDS)
def test_a_kind_is_compiled_to_its_class_and_drawn_with_its_glyph(tmp_path, word):
    kind = KINDS[word]
    tree = compile_mission(read_text(tmp_path, f"{HEAD}run: {kind.example}\n"))
    records = [item for item in tree.execution.records.values() if item.kind == word]
    assert [type(item.node) for item in records] == [kind.node]
    assert [row.glyph for row in tree.rows() if row.kind == word] == [kind.glyph]
    assert f"shape={kind.outline}" in dot(tree)


def test_a_kind_without_a_method_is_refused():
    assert all(kind.step is not None and kind.read is not None for kind in NODES.values())

    class Incomplete(CompositeStep):
        """A kind whose author has forgotten how long it takes, and its node."""

    with pytest.raises(TypeError, match="Incomplete lacks build, least_time"):
        replace(NODES["sequence"], step=Incomplete)


@pytest.mark.parametrize("word", NODES)
def test_a_kind_is_known_to_hover_list_describe_and_docs(word):
    kind, known = NODES[word], installed()
    assert word_text(word).startswith(f"**{word}**: {kind.doc}")
    assert (word, kind.doc) in rows_of("nodes", known)
    assert description_of(word, known).startswith(f"{word}: {kind.doc}")
    assert f"| `{word}` | " in PAGE


@pytest.mark.parametrize("word", MODIFIERS)
def test_a_modifier_is_known_to_hover_list_describe_and_docs(word):
    key, known = MODIFIERS[word], installed()
    assert word_text(word) == f"**{word}**: {key.doc}"
    assert (word, key.doc) in rows_of("modifiers", known)
    assert description_of(word, known).startswith(f"{word}: {key.doc}")
    assert f"| `{word}` | " in PAGE


def test_every_modifier_that_adds_a_node_is_a_kind():
    without_node = {"name", "with", "out", "do"}
    assert set(MODIFIERS) - without_node == set(CONTROLS) - {"case", "event", "events"}


@pytest.mark.parametrize("section", SECTIONS)
def test_every_key_has_a_form_and_a_sentence(section):
    keys = SECTIONS[section]
    assert PLACES[section]
    for word, key in keys.items():
        assert key.word == word
        assert key.doc and value_words(key)
        if key.form in (Form.NAMED, Form.NAMED_LIST, Form.LIST, Form.SECTION, Form.MOCKS):
            assert key.section in SECTIONS
        if key.form is Form.VALUE:
            assert key.declared is not None


FULL = """\
mission: m
format: 1
doc: All keys.
robot: scout
world: small_room
start: dock
initial_pose: start
map: from_world
markers: from_world
places: {shelf: [1.0, 1.0]}
parameters: []
navigation: {planner: astar}
localisation: mcl
odometry: ekf
plugins: []
include: []
arguments:
  dwell: {type: float, unit: s, default: 3, range: [1, 9], doc: How long.}
  word: {type: text, default: a, one_of: [a, b]}
blackboard:
  count: {type: int, initial: 0, optional: true, keep: true, doc: How often.}
  far: {type: float, unit: m, initial: 2}
events:
  - low: {when: battery.charge < 0.2, hold: 2 s, again: 9 s, do: {say: low}, then: resume}
run:
  sequence:
    - parallel: {succeed_on: one, do: [{say: a}, {wait: $dwell}]}
    - spin: 90 deg
      retry: {attempts: 2, delay: 1 s}
    - switch: {value: $word, cases: {a: {say: b}}, default: {say: c}}
      repeat: {until: time > 9 s}
    - navigate_to_pose: $shelf
      recover: {attempts: 2, unless: error == LOST, round_robin: [{wait: 1 s}]}
    - use: look
      with: {angle: 90 deg}
      out: {seen: $count}
faults: [{push: {left: 1 m}, at: 3 s}, {gyro_bias: {}, for: 3 s}]
trees:
  look:
    in: {angle: {type: float, unit: rad, default: 0, doc: To the left.}}
    out: {seen: int}
    doc: Look there.
    events:
      - hot: {when: battery.charge > 0.9, do: {say: hot}}
    do: {sequence: [{spin: $angle}, {set: {seen: 1}}, {say: "${word} ${far}"}]}
tests:
  - name: a
    arguments: {dwell: 2 s}
    mock: {spin: {returns: [failure, success], takes: 2 s, sets: {}}}
    at: {1 s: {battery.charge: 0.5}}
    expect: {status: success, ran: {spin: 3}, order: [spin], within: 10 min, count: 1}
"""
"""Every key of every section but `failure`, which contradicts `status`."""


REPLAYED = "replayed robot"
"""A mission has one robot, and this one drives; tests/missions/execution/test_foreign_logs.py."""


def words_of(path, text):
    """The findings and the keys of sections: (section, word) -> position of the word."""
    draft = Draft(text)
    findings = findings_of(path, draft)
    roles = (WordRole.SECTION_KEY, WordRole.EXPECTATION, WordRole.MODIFIER)
    return findings, [word for word in draft.words.items if word.role in roles]


def section_of(word):
    return {WordRole.EXPECTATION: "expectation", WordRole.MODIFIER: "node"}.get(
        word.role, word.owner
    )


def test_readers_know_every_key_of_the_table_and_report_others(tmp_path):
    path = tmp_path / "full.yaml"
    findings, words = words_of(path, FULL)
    assert [str(item) for item in findings if item.severity == "error"] == []
    met = {(section_of(word), str(word.node.value)) for word in words}
    wanted = {(name, key) for name, keys in SECTIONS.items() for key in keys}
    modifiers = {("node", word) for word in MODIFIERS}
    of_file = {("tree file", word) for word in SECTIONS["tree file"]}
    unmet = {key for key in wanted - met - modifiers - of_file if key[0] != REPLAYED}
    assert unmet == {("expectation", "failure"), ("expectation", ANY_KEY)}
    lines = FULL.splitlines()
    for word in words:  # one letter too many is a finding at this place
        section, key = section_of(word), str(word.node.value)
        if section not in SECTIONS or (section == "expectation" and key not in SECTIONS[section]):
            continue
        line, column = word.node.mark.line, word.node.mark.column
        wrong = list(lines)
        row = wrong[line - 1]
        wrong[line - 1] = f"{row[: column - 1]}{key}x{row[column - 1 + len(key) :]}"
        codes = {item.code for item in findings_of(path, Draft("\n".join(wrong) + "\n"))}
        assert codes & {"E101", "E210", "E112", "E115", "E123", "E130", "E170"}, (
            section,
            key,
            codes,
        )


@pytest.mark.parametrize(
    ("section", "word"),
    [(name, key) for name, keys in SECTIONS.items() if name != REPLAYED for key in required(keys)],
)
def test_readers_report_a_missing_required_key(tmp_path, section, word):
    path = tmp_path / "full.yaml"
    _, words = words_of(path, FULL)
    places = [item.node.mark for item in words
              if section_of(item) == section and item.node.value == word]  # fmt: skip
    assert places
    lines = FULL.splitlines()
    # `doc` takes any text, so its value replaces the missing key's without another finding.
    mark = places[0]
    row = lines[mark.line - 1]
    lines[mark.line - 1] = f"{row[: mark.column - 1]}qqqqqq{row[mark.column - 1 + len(word) :]}"
    findings = findings_of(path, Draft("\n".join(lines) + "\n"))
    sentences = " ".join(item.sentence for item in findings)
    assert f"needs the key {word!r}" in sentences or f"needs `{word}`" in sentences or (
        f"{section} needs a list of nodes" in sentences
        or "round_robin needs a list of nodes" in sentences
    ), sentences  # fmt: skip


@pytest.mark.parametrize(
    "glyph", [*(kind.glyph for kind in KINDS.values()), CONDITION_GLYPH, LEAF_GLYPH]
)
def test_glyphs_are_one_cell_wide_and_have_an_ascii_character(glyph):
    assert cell_len(glyph) == 1
    assert glyph.isascii() or glyph in GLYPHS


def test_behaviours_do_not_have_the_words_of_the_language():
    assert {"sequence", "switch", "unset", "retry", "finally", "use"} <= mission_words()
    assert not mission_words() & set(find_behaviours().names())


def test_leaves_are_ellipses():
    assert outline_of("say") == "ellipse"


def test_every_shape_is_used():
    assert {kind.shape for kind in KINDS.values()} == set(Shape)


def test_only_the_file_of_a_kind_knows_its_class():
    """What other modules need of a node, they ask `Step`: then a new kind is one file."""
    kinds = Path(__file__).parents[3] / "missions" / "language" / "kinds"
    classes = {kind.step.__name__ for kind in NODES.values() if kind.step} | {"CompositeStep"}
    named = {
        (file.name, node.id)
        for file in kinds.parents[1].rglob("*.py")
        if file.parent != kinds
        for node in ast.walk(ast.parse(file.read_text("utf-8")))
        if isinstance(node, ast.Name) and node.id in classes
    }
    assert named == set()

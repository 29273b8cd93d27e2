"""YAML texts as nodes, and the sentence and position of every syntax error."""

import re
from pathlib import Path

import pytest
import yaml

from missions.execution.resources import MISSIONS
from stack.documents import Findings, read_text, yaml_nodes
from stack.documents.yaml_problems import explain
from stack.errors import InputError

JARGON = re.compile(r"block end|flow|scalar|node content|stream|token|simple key|not YAML")

PROBLEMS = [
    ("a: [", "1:4", "the `[` that opens here is not closed"),
    ("b: 1\na: {c: [1], \n\n", "2:4", "the `{` that opens here is not closed"),
    ("run:\n  - a\n# x\n\n b: c\n", "5:2", "the indentation of this line matches no line above"),
    ("a: 1\n\tb: 2\n", "2:1", "a tab is not allowed here"),
    ("a:\n\t- b\n", "2:1", "a tab is not allowed here"),
    ("a: @b\n", "1:4", "a value cannot begin with @"),
    ("a: `b\n", "1:4", "a value cannot begin with `"),
    ("a: %b\n", "1:4", "a value cannot begin with %"),
    ("%b: 1\n", "1:1", "a line cannot begin with %"),
    ("run\nworld: office\n", "1:1", "this line is not `key: value`"),
    ("mission: x\nworld office\nrun: y\n", "2:1", "this line is not `key: value`"),
    ("a: b: c\n", "1:5", "a second `: ` in one value"),
    (
        "mission: x\n  robot: y\n",
        "2:3",
        "this line is indented deeper than the line above, which already has a value",
    ),
    ("a: - b\n", "1:4", "a list item `- ` is not allowed here"),
    ("a: b\n- c\n", "2:1", "unexpected list item `- ` among keys"),
    ("run:\n  sequence:\n    - say: a\n    say: b\n", "4:5", "unexpected key among list items"),
    ("run:\n  - a\n b: c\n", "3:2", "the indentation of this line matches no line above"),
    ("a:\n    b: 1\n   c: 2\n", "3:4", "the indentation of this line matches no line above"),
    (
        "a:\n  b: 1\n    c: 2\n",
        "3:5",
        "this line is indented deeper than the line above, which already has a value",
    ),
    ("a: 'b\nc: d\n", "1:4", "the quote ' that opens here is not closed"),
    ('a: "b\nc: d\n', "1:4", 'the quote " that opens here is not closed'),
    ('a: "x\\d"\n', "1:7", "\\d is not a valid escape in double quotes"),
    ('a: "\\x1"\n', "1:7", "this escape needs 2 hexadecimal digits"),
    ("a: [1, 2\nb: 3\n", "1:4", "the list that opens here with `[` is not closed"),
    ("a: [1, 2\n", "1:4", "the list that opens here with `[` is not closed"),
    ("a: {x: 1\nb: 3\n", "1:4", "the mapping that opens here with `{` is not closed"),
    ("a: {x: 1, y: [1, 2}\n", "1:19", "a `,` or the closing `]` is missing here"),
    ("a: [1, 2]]\n", "1:10", "unmatched `]`"),
    ("a: {x: 1}}\n", "1:10", "unmatched `}`"),
    ("a: [{x: 1} {y: 2}]\n", "1:12", "a `,` or the closing `]` is missing here"),
    ("a: 'x' y\n", "1:8", "unexpected text after the value"),
    ("a: [b, , c]\n", "1:8", "a value is missing before `,`"),
    ("a: *b\n", "1:4", "there is no value with the name of this alias"),
    ("a: * b\n", "1:4", "a name is missing after *"),
    ("a: & b\n", "1:4", "a name is missing after &"),
    ("a: !e!x b\n", "1:4", "a value cannot begin with !"),
    ("a: | b\n  c\n", "1:6", "the text after `|` or `>` must begin on the next line"),
    ("a: >5x\n c\n", "1:6", "the text after `|` or `>` must begin on the next line"),
    ("  a: 1\nb: 2\n", "2:1", "unexpected text after the end of the document"),
    ("{a: 1} b\n", "1:8", "unexpected text after the end of the document"),
    ("a: 1\n? b\nc\n", "3:1", "this line is not `key: value`"),
    ("a: ? b\n", "1:4", "a value cannot begin with `? `"),
    ("a: 1\nb\n", "2:1", "this line is not `key: value`"),
    ("- a\nb: 1\n", "2:1", "unexpected key among list items"),
    ("a: [x: 1: 2]\n", "1:9", "a `,` or the closing `]` is missing here"),
    ("a: {b c: d e: f}\n", "1:13", "a `,` or the closing `}` is missing here"),
    ("a: 1\n}\n", "2:1", "unmatched `}`"),
    ("'a: 1\n", "1:1", "the quote ' that opens here is not closed"),
    ("a: it's\nb: 'it's'\n", "2:8", "unexpected text after the value"),
    ("a: {b: 1,\nc: 2\n", "1:4", "the mapping that opens here with `{` is not closed"),
    (
        "a:\n- b\n  c: 1\n - d\n",
        "3:3",
        "this line is indented deeper than the line above, which already has a value",
    ),
    (
        "a: b\n c: d\n",
        "2:2",
        "this line is indented deeper than the line above, which already has a value",
    ),
    ("a: 'b' c: d\n", "1:8", "unexpected text after the value"),
    ('say: "a" b\n', "1:10", "unexpected text after the value"),
    ('a: ["b" c]\n', "1:9", "a `,` or the closing `]` is missing here"),
    ("a: ,b\n", "1:4", "a value is missing before `,`"),
    ("a: ]\n", "1:4", "a value is missing before `]`"),
    ("a: }\n", "1:4", "a value is missing before `}`"),
    ("a: 1,\nb: [,]\n", "2:5", "a value is missing before `,`"),
    (
        "run:\n  sequence:\n  - wait: 1 s\n   - say: a\n",
        "4:4",
        "the indentation of this line matches no line above",
    ),
    ("run: {wait: 1 s\n  say: b}\n", "1:6", "the mapping that opens here with `{` is not closed"),
    ("a:1\nb: 2\n", "1:1", "this line is not `key: value`"),
    ('a: "b\\\n', "1:4", 'the quote " that opens here is not closed'),
    ("x: {a: b, c\nd: e\n", "1:4", "the mapping that opens here with `{` is not closed"),
    ("a: %b\n%b: c\n", "1:4", "a value cannot begin with %"),
    ("%YAML 3.0\n---\na: 1\n", "1:1", "a line cannot begin with %"),
    ("a: !<x y\n", "1:4", "a value cannot begin with !"),
    ("a:\n- ? b\n ? c\n", "3:2", "the indentation of this line matches no line above"),
    ("a: " + "[" * 61 + "]" * 61, "1:64", "nested more than 60 deep"),
    ("[a]: {b\n", "1:6", "the mapping that opens here with `{` is not closed"),
]


def refusal(text):
    with pytest.raises(InputError) as caught:
        read_text(text, "file")
    (finding,) = caught.value.findings
    return finding


@pytest.mark.parametrize(("text", "place", "sentence"), PROBLEMS)
def test_a_syntax_error_is_explained_in_plain_words(text, place, sentence):
    finding = refusal(text)
    assert (finding.code, f"{finding.mark.line}:{finding.mark.column}") == ("E004", place)
    assert finding.sentence == sentence
    assert finding.hint, "a fix is proposed"
    assert not JARGON.search(f"{finding.sentence} {finding.hint}")


@pytest.mark.skipif(not yaml.__with_libyaml__, reason="PyYAML alone takes it")
def test_an_error_of_libyaml_alone_is_explained_in_plain_words():
    finding = refusal("a: {b:, c}\n")
    assert (finding.mark.column, finding.sentence) == (6, "unexpected `:` inside a value")


def test_an_error_that_is_not_in_the_table_still_has_its_place():
    mark = yaml.Mark("file", 0, 2, 4, None, 0)
    problem = explain(yaml.MarkedYAMLError(problem="new\nwords", problem_mark=mark), "a")
    assert (problem.line, problem.column, problem.sentence) == (3, 5, "not YAML: new words")


def test_an_alias_is_the_value_of_its_anchor():
    text = "a: &x [1, &y {b: 2}]\nc: *x\nd: *y\n"
    assert read_text(text, "file").plain() == {
        "a": [1, {"b": 2}],
        "c": [1, {"b": 2}],
        "d": {"b": 2},
    }


@pytest.mark.parametrize(
    ("text", "place", "code"),
    [
        ("a: &x [*x]\n", "1:8", "E008"),
        ("a: !!str 1\n", "1:4", "E009"),
        ("a: &x !!str 1\n", "1:4", "E009"),
        ("a: ! 1\n", "1:4", "E009"),
        ("[a]: 1\n", "1:1", "E010"),
        ("a: 1\nb: {c: 1, c: 2}\n", "2:11", "E011"),
        ("a: .nan\n", "1:4", "E012"),
        ("a: 1\n---\nb: 1\n", "2:1", "E006"),
        ("---\n---\n", "1:1", "E005"),
        ("a: b\x00\n", "1:5", "E003"),
    ],
)
def test_unsupported_yaml_is_refused(text, place, code):
    finding = refusal(text)
    assert (finding.code, f"{finding.mark.line}:{finding.mark.column}") == (code, place)


def test_the_expansion_of_aliases_is_limited():
    lines = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    lines += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]" for n in range(1, 9)]
    assert refusal("\n".join(lines)).code == "E008"


@pytest.mark.parametrize("file", sorted(MISSIONS.rglob("*.yaml")), ids=lambda file: file.stem)
def test_libyaml_and_pyyaml_read_the_same(file: Path, monkeypatch):
    text = file.read_text("utf-8")
    fast = yaml_nodes.compose(text, "file", Findings())
    monkeypatch.setattr(yaml_nodes, "_Parser", yaml.SafeLoader)
    assert yaml_nodes.compose(text, "file", Findings()) == fast


def test_equal_texts_are_parsed_once_and_the_file_name_in_positions_is_that_of_each():
    text = "a: [1, 2]\n"
    first = read_text(text, "one.yaml")
    assert read_text(text, "one.yaml") is first
    assert read_text(text, "two.yaml").mark.file == "two.yaml"
    assert read_text("a: [1, 3]\n", "one.yaml").plain() == {"a": [1, 3]}

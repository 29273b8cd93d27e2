"""Findings are for people: no code reads their sentences and hints back."""

import ast
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGES = ("missions", "behaviours", "robots", "stack", "tui")
FOR_PEOPLE = ("sentence", "hint")
SEARCHES = ("search", "match", "fullmatch", "findall", "finditer", "split", "sub")


def modules(*words):
    """The syntax trees of the modules in which one of the words occurs."""
    for file in sorted(file for package in PACKAGES for file in (ROOT / package).rglob("*.py")):
        text = file.read_text("utf-8")
        if any(word in text for word in words):
            yield str(file.relative_to(ROOT)), ast.parse(text)


def read_back(tree):
    """The lines of a module that look into a sentence or hint instead of passing it on."""
    for node in ast.walk(tree):
        looked_at = []
        if isinstance(node, ast.Attribute | ast.Subscript):  # .startswith(…), [0]
            looked_at = (
                [] if isinstance(node, ast.Attribute) and node.attr == "fix" else [node.value]
            )
        elif isinstance(node, ast.Compare):
            looked_at = [node.left, *node.comparators]
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            looked_at = node.args if node.func.attr in SEARCHES else []
        for part in looked_at:
            if isinstance(part, ast.Attribute) and part.attr in FOR_PEOPLE:
                yield node.lineno


def test_no_code_looks_into_a_sentence_or_hint():
    modules_with = modules(".sentence", ".hint")
    assert [f"{file}:{line}" for file, tree in modules_with for line in read_back(tree)] == []


def test_the_rule_sees_what_it_forbids():
    for line in ("'a' in item.hint", "item.hint.startswith('a')", "PATTERN.search(item.sentence)",
                 "item.sentence[0]", "item.hint == 'a'"):  # fmt: skip
        assert list(read_back(ast.parse(line))) == [1], line
    for line in ("print(item.hint)", "f'{item.sentence}'", "item.hint.fix", "item.hint or 'a'"):
        assert list(read_back(ast.parse(line))) == [], line


def test_a_suggested_word_is_written_in_one_place():
    """So that each finding that suggests a word has it as its `fix`, too."""
    assert [file for file, _ in modules("did you mean")] == ["stack/parameters/names.py"]

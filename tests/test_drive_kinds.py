"""Nothing outside stack/drivetrain depends on the kind of drive: callers ask a drivetrain.

robots/wheels.py maps the words of robot.yaml to the classes; it creates wheels and asks as well.
"""

import ast
from collections.abc import Iterator

import pytest

from tests.test_import_rules import ROOT, TOP, files_of, imported_names

PACKAGE = ROOT / "stack" / "drivetrain"
READER = ROOT / "robots" / "wheels.py"
KINDS = {"differential", "skid_steered", "omnidirectional", "ackermann"}
"""Modules with the classes of the kinds."""

SETTINGS = {"stack.drivetrain.skid_steered.Skid"}
"""Settings of a robot file, which its schema lists."""

CLASSES = {
    node.name
    for kind in KINDS
    for node in ast.parse((PACKAGE / f"{kind}.py").read_text("utf-8")).body
    if isinstance(node, ast.ClassDef)
}

OUTSIDE = [file for top in TOP for file in files_of(top) if not file.is_relative_to(PACKAGE)]


def branches_on_kind(tree: ast.AST) -> Iterator[int]:
    """Lines that test the class of a drivetrain or of its wheels, or compare its `kind`."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") in ("isinstance", "type"):
            names = {part.id for part in ast.walk(node) if isinstance(part, ast.Name)}
            if names & CLASSES or _mentions(node, "drivetrain"):
                yield node.lineno
        elif isinstance(node, ast.MatchClass) and getattr(node.cls, "id", "") in CLASSES:
            yield node.cls.lineno
        elif isinstance(node, ast.Compare) and _mentions(node, "kind"):
            yield node.lineno
        elif isinstance(node, ast.Match) and _mentions(node.subject, "kind"):
            yield node.lineno


def _mentions(node: ast.AST, attribute: str) -> bool:
    """Whether `….drivetrain.kind`, or for the attribute "drivetrain" any drivetrain, is used."""
    for part in ast.walk(node):
        owner = part.value if isinstance(part, ast.Attribute) and attribute == "kind" else part
        if isinstance(part, ast.Attribute) and part.attr.lstrip("_") == attribute:
            names = (getattr(owner, "attr", ""), getattr(owner, "id", ""))
            if any(name.lstrip("_") == "drivetrain" for name in names):
                return True
    return False


@pytest.mark.parametrize(
    "line",
    [
        "isinstance(robot.wheels, OmniWheels)", "isinstance(robot.drivetrain, Ackermann)",
        "robot.drivetrain.kind == 'omni'", "self._drivetrain.kind in ('omni', 'ackermann')",
        "drivetrain.kind is x", "type(robot.drivetrain) is object",
    ],
)  # fmt: skip
def test_a_branch_is_found(line):
    assert list(branches_on_kind(ast.parse(f"if {line}: pass"))) == [1]


@pytest.mark.parametrize("line", ["world.kind == 'map'", "print(robot.drivetrain.kind)"])
def test_other_kinds_and_the_word_itself_are_no_branch(line):
    assert not list(branches_on_kind(ast.parse(line)))


def test_nobody_else_branches_on_the_kind_of_drive():
    texts = {file: file.read_text("utf-8") for file in OUTSIDE}
    found = [
        f"{file.relative_to(ROOT)}:{line}"
        for file, text in texts.items()
        if any(name in text for name in {"drivetrain", *CLASSES})  # others cannot branch
        for line in branches_on_kind(ast.parse(text))
    ]
    assert not found


def test_nobody_else_names_the_kinds():
    modules = {f"stack.drivetrain.{kind}" for kind in KINDS}
    found = [
        f"{file.relative_to(ROOT)} imports {name}"
        for file in OUTSIDE
        if file != READER
        for name in imported_names(file)
        if name not in SETTINGS and (name in modules or name.rpartition(".")[0] in modules)
    ]
    assert not found

"""Every parameter is read: a setting without effect is worse than none."""

from __future__ import annotations

import ast
from collections import defaultdict
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("stack", "robots", "behaviours", "missions", "tui")


def parameters_of(tree: ast.Module) -> dict[str, set[str]]:
    """The names of the `parameter(...)` fields of each class of a module."""
    found: dict[str, set[str]] = defaultdict(set)
    for cls in (node for node in ast.walk(tree) if isinstance(node, ast.ClassDef)):
        for field in cls.body:
            match field:
                case ast.AnnAssign(ast.Name(name), _, ast.Call(ast.Name("parameter"))):
                    found[cls.name].add(name)
    return found


def reads_and_imports(tree: ast.Module) -> tuple[set[str], set[str]]:
    """The attributes that a module reads, and the modules that it imports from, as paths."""
    reads, imports = set(), set()
    for node in ast.walk(tree):
        match node:
            case ast.Attribute(_, name, ast.Load()):
                reads.add(name)
            case ast.ImportFrom(str(module)):
                imports.add(module.replace(".", "/"))
    return reads, imports


def unread(sources: dict[str, str]) -> set[str]:
    """`Class.name` of the parameters that nothing reads.

    A read counts in the package that declares the parameter and in every module that imports from
    it: the attribute of another part of treepilot with the same name is no read.

    Args:
        sources: module path (`stack/planning/astar.py`) -> source.
    """
    trees = {path: ast.parse(text) for path, text in sources.items()}
    modules = {path: reads_and_imports(tree) for path, tree in trees.items()}
    missing = set()
    for path in (path for path, text in sources.items() if "parameter(" in text):
        package = path.rpartition("/")[0]
        known: set[str] = set()
        for other, (reads, imports) in modules.items():
            if any(f"{name}/".startswith(f"{package}/") for name in (other, *imports)):
                known |= reads
        for cls, names in parameters_of(trees[path]).items():
            missing |= {f"{cls}.{name}" for name in names - known}
    return missing


@pytest.fixture(scope="module")
def product() -> dict[str, str]:
    return {
        str(path.relative_to(ROOT)): path.read_text("utf-8")
        for package in PACKAGES
        for path in (ROOT / package).rglob("*.py")
    }


def test_every_parameter_is_read(product):
    assert unread(product) == set()


def test_a_parameter_that_nothing_reads_is_found():
    declared = (
        "class P:\n    speed: float = parameter(1.0, help='x')\n    gone: int = parameter(1)\n"
    )
    sources = {
        "stack/a/p.py": declared,
        "stack/a/user.py": "def f(p: P): return p.speed",
        "stack/b/other.py": "print(road.gone)",
    }
    assert unread(sources) == {"P.gone"}

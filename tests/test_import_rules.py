"""Who may import whom. The lists are the architecture; change them on purpose or not at all."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

FOUNDATION = {
    "stack.types", "stack.errors", "stack.parameters", "stack.documents", "stack.streams",
    "stack.drivetrain.description", "stack.drivetrain.kinematics",
}  # fmt: skip

MAY_IMPORT = {
    "stack": {"stack"},
    "robots": {"robots", "stack.body", "stack.sim", *FOUNDATION},
    "behaviours": {
        "behaviours", "stack.types", "stack.robot", "stack.errors", "stack.parameters",
    },
    "tui": {"tui", "stack.types", "stack.telemetry", "stack.errors"},
    "missions": {"missions", "behaviours", "stack", "robots", "tui"},
}  # fmt: skip

WITHIN_STACK = {
    "types": set(),
    "errors": {"types"},
    "parameters": {"types", "errors"},
    "findings": {"errors"},
    "yaml_problems": set(),
    "yaml_nodes": {"errors", "findings", "yaml_problems"},
    "documents": {"errors", "findings", "parameters", "yaml_nodes"},
    "streams": set(),
    "description": {"types", "parameters"},
    "kinematics": {"types", "description"},
    "body": {"types", "description"},
    "robot": {"types"},
    "components": {"types", "errors", "parameters", "description"},
}

ONE_PLACE = {
    "pybullet": {"stack/sim"},
    "rerun": {"stack/telemetry"},
    "pymavlink": {"stack/telemetry", "robots"},
    "zmq": {"stack/telemetry"},
    "msgpack": {"stack/telemetry"},
    "textual": {"tui"},
    "typer": {"missions"},
    "pygls": {"missions/editor"},
    "lsprotocol": {"missions/editor"},
    "yaml": {"stack"},
    "py_trees": {"missions", "behaviours"},
}


def imported_modules(file: Path) -> Iterator[str]:
    """Names of all modules that a file imports, wherever in it, type checking included."""
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            yield node.module
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


def covered(module: str, allowed: set[str]) -> bool:
    """Whether the module, or a package around it, is on the list."""
    parts = module.split(".")
    return any(".".join(parts[: n + 1]) in allowed for n in range(len(parts)))


def files_of(package: str) -> list[Path]:
    return sorted((ROOT / package).rglob("*.py"))


@pytest.mark.parametrize("package", MAY_IMPORT)
def test_imports_point_inwards(package):
    wrong = [
        f"{file.relative_to(ROOT)} imports {module}"
        for file in files_of(package)
        for module in imported_modules(file)
        if module.split(".")[0] in MAY_IMPORT and not covered(module, MAY_IMPORT[package])
    ]
    assert not wrong


@pytest.mark.parametrize("module", WITHIN_STACK)
def test_the_foundation_of_stack_stays_low(module):
    allowed = {f"stack.{name}" for name in WITHIN_STACK[module]}
    found = set(imported_modules(ROOT / "stack" / f"{module}.py"))
    assert {name for name in found if name.startswith("stack")} <= allowed


@pytest.mark.parametrize("library", ONE_PLACE)
def test_heavy_libraries_are_imported_in_one_place(library):
    wrong = [
        str(file.relative_to(ROOT))
        for package in MAY_IMPORT
        for file in files_of(package)
        if any(covered(module, {library}) for module in imported_modules(file))
        and not any(file.is_relative_to(ROOT / place) for place in ONE_PLACE[library])
    ]
    assert not wrong


def test_the_estimators_never_see_the_simulation():
    for room in ("localisation", "mapping", "costmap", "planning", "control", "safety"):
        for file in files_of(f"stack/{room}"):
            assert not any(covered(module, {"stack.sim"}) for module in imported_modules(file))

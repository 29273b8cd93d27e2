"""What users copy imports the public interface alone: pages, templates, examples, the sample."""

from __future__ import annotations

import ast
import sys
from functools import partial
from pathlib import Path

import pytest

from behaviours.scaffold import new_behaviour
from missions.inspection.component_scaffold import KINDS, new_component
from tests.test_docs import PAGES, blocks_of

ROOT = Path(__file__).parents[2]
EXAMPLES = (ROOT / "missions" / "my_behaviours", ROOT / "tests" / "behaviours" / "sample_package")
PUBLIC = {"treepilot", "treepilot.testing", "treepilot.drivers", "treepilot.gym"}
OTHERS = {
    "numpy", "pytest", "my_rover", "gymnasium", "stable_baselines3", "torch",
    *sys.stdlib_module_names,
}  # fmt: skip
"""Libraries of the examples; `my_rover` is the reader's own package."""


def imported_modules(text: str) -> set[str]:
    """Modules that a text imports, wherever in it."""
    nodes = [*ast.walk(ast.parse(text))]
    names = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    return names | {f"{node.module}" for node in nodes if isinstance(node, ast.ImportFrom)}


def internal_modules(text: str) -> set[str]:
    return {
        name for name in imported_modules(text) - PUBLIC if name.partition(".")[0] not in OTHERS
    }


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_pages(page):
    for block in blocks_of(page):
        if block.language == "python":
            assert internal_modules(block.text) == set(), f"{page.name}:{block.line}"


@pytest.mark.parametrize("folder", EXAMPLES, ids=lambda folder: folder.name)
def test_examples(folder):
    files = [*folder.rglob("*.py")]
    assert files
    for file in files:
        assert internal_modules(file.read_text("utf-8")) == set(), file


@pytest.mark.parametrize("kind", ["behaviour", *KINDS])
def test_templates(kind, tmp_path):
    write = new_behaviour if kind == "behaviour" else partial(new_component, kind)
    for file in write("my_own", tmp_path):
        assert internal_modules(file.read_text("utf-8")) == set()

"""docs/dashboard.md lists exactly the keys of the tables in tui/keys.py."""

from pathlib import Path

import pytest

from tui.keys import (
    DRAFT_KEYS,
    FOUND_KEYS,
    KEYS,
    PICKER_KEYS,
    PLOT_KEYS,
    TREE_KEYS,
    TREE_SENTENCE,
    Key,
)
from tui.replay.app import REPLAY_KEYS

PAGE = Path(__file__).parents[2] / "docs" / "dashboard.md"


def rows(keys: tuple[Key, ...]) -> list[str]:
    """The lines of a table of keys, without its head."""
    return [f"| `{key.shown}` | {key.sentence} |" for key in keys if key.sentence]


def section(title: str) -> list[str]:
    """The rows below a heading of the page."""
    text = PAGE.read_text("utf-8").partition(f"\n## {title}\n")[2].partition("\n## ")[0]
    lines = [line for line in text.splitlines() if line.startswith("|")]
    return lines[2:]


@pytest.mark.parametrize(
    ("title", "keys"),
    [
        ("Keys", (*KEYS, Key(" ".join(k.shown for k in TREE_KEYS), "", "", TREE_SENTENCE))),
        ("Parameters", PICKER_KEYS),
        ("Goals and poses", DRAFT_KEYS),
        ("Search", FOUND_KEYS),
        ("Plots", PLOT_KEYS),
        ("Keys of a replay", REPLAY_KEYS),
    ],
)
def test_the_page_lists_the_keys(title, keys):
    assert section(title) == rows(keys)

"""Drawings show exactly the compiled tree."""

import re

import pytest

from missions.trees import show
from missions.trees.compiler import compile_mission
from tests.missions.mission_fakes import ran, read_text

MISSION = """
mission: two desks
places: {desk_a: [1, 0]}
run:
  sequence:
    - navigate_to_pose: $desk_a
      name: to the desk
      timeout: 90 s
    - use: look
trees:
  look:
    do: {fallback: [{check: battery.charge > 0.2}, {say: "too \\"low\\""}]}
"""


@pytest.fixture
def tree(tmp_path):
    return compile_mission(read_text(tmp_path, MISSION))


def test_text_draws_every_node_without_a_robot(tree):
    assert show.text(tree).splitlines() == [
        "two desks",
        "└─ · sequence",
        "   ├─ · timeout 90 s",
        "   │  └─ · to the desk [navigate_to_pose]  goal $desk_a",
        "   └─ · look [use]",
        "      └─ · fallback",
        "         ├─ · check  battery.charge > 0.2",
        '         └─ · say  text too "low"',
    ]


def test_text_in_colours_shows_how_far_it_is(tmp_path):
    it = ran(tmp_path, "run: {sequence: [{act: a}, {wait: 1 s}, {act: b}]}")
    it.ticks()
    drawn = show.text(it.tree, colour=True)
    assert "\x1b[32m✓ act" in drawn
    assert "\x1b[33m▶ wait" in drawn
    assert "\x1b[" not in show.text(it.tree)


@pytest.mark.parametrize(("draw", "arrow"), [(show.dot, "->"), (show.mermaid, "-->")])
def test_graphs_draw_every_node_and_lead_from_parent_to_child(tree, draw, arrow):
    drawn = draw(tree)
    nodes = re.findall(r"^  n(\d+)(?: \[label=|\(\[|\{\{|\[)", drawn, re.MULTILINE)
    assert nodes == ["0", "1", "2", "3", "4", "5", "6"]  # depth first, as `text` lists them
    edges = re.findall(rf"^  n(\d+) {arrow} n(\d+);?$", drawn, re.MULTILINE)
    assert edges == [("0", "1"), ("1", "2"), ("0", "3"), ("3", "4"), ("4", "5"), ("4", "6")]


def test_quotes_in_texts_do_not_break_the_graphs(tree):
    assert '\\"low\\"' in show.dot(tree)
    assert "#quot;low#quot;" in show.mermaid(tree)

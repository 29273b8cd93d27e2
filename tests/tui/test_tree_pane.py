"""What the tree pane chooses, shows and joins by lines."""

from dataclasses import replace

import pytest
from textual.app import App

from stack.telemetry.records import TreeRow
from tests.tui.sample_source import SampleSource
from tui.panes.tree_pane import TreePane, default_selection, stems


def row(number, parent, status="idle", message=""):
    return TreeRow(number, parent, f"node {number}", "sequence", status, message)


def test_lines_join_each_row_to_its_parent():
    rows = (row(0, -1), row(1, 0), row(2, 1), row(3, 1), row(4, 0), row(5, 4))
    assert stems(rows) == ["", "├─", "│ ├─", "│ └─", "└─", "  └─"]


def test_the_deepest_running_node_is_default_selection():
    rows = (row(0, -1, "running"), row(1, 0, "running"), row(2, 1, "running"), row(3, 0, "running"))
    assert default_selection(rows) == 2


def test_when_nothing_runs_the_failure_that_failed_the_root_is_default_selection():
    rows = (
        row(0, -1, "failure"), row(1, 0, "success"), row(2, 1, "failure"),
        row(3, 0, "failure"), row(4, 3, "failure", "no way"),
    )  # fmt: skip
    assert default_selection(rows) == 4


class TreeApp(App):
    def compose(self):
        yield TreePane()


def lines_of(pane):
    return [pane.render_line(y).text for y in range(pane.size.height)]


async def test_a_long_tree_follows_what_runs_and_lets_the_operator_look_elsewhere():
    snapshot = SampleSource().poll()
    async with TreeApp().run_test(size=(40, 12)) as pilot:
        pane = pilot.app.query_one(TreePane)
        pane.show(snapshot)
        text = "\n".join(lines_of(pane))
        assert "go to lab" in text and "9.9 m left" in text and "turn once" not in text
        pane.choose(100)
        pane.show(snapshot)
        assert "say done" in "\n".join(lines_of(pane))
        pane.follow()
        assert "go to lab" in "\n".join(lines_of(pane))
        assert pane.top <= pane.chosen < pane.top + pane.list_height
        pane.choose(-100)
        assert "office patrol" in lines_of(pane)[0]


async def test_the_chosen_node_is_told_in_full():
    snapshot = SampleSource().poll()
    async with TreeApp().run_test(size=(40, 20)) as pilot:
        pane = pilot.app.query_one(TreePane)
        pane.show(snapshot)
        pane.choose(14 - pane.chosen)
        rule, *words = lines_of(pane)[-3:]
        assert "spin" in rule
        assert " ".join(" ".join(words).split()) == (
            "COLLISION_AHEAD: something stands 0.31 m ahead"
        )


@pytest.mark.parametrize("width", [8, 20, 60])
async def test_lines_are_as_wide_as_the_pane(width):
    rows = tuple(
        replace(r, name=r.name * 3, message="[b]é→" * 30) for r in SampleSource().poll().tree
    )
    snapshot = replace(SampleSource().poll(), tree=rows)
    async with TreeApp().run_test(size=(width, 14)) as pilot:
        pane = pilot.app.query_one(TreePane)
        pane.show(snapshot)
        widths = {pane.render_line(y).cell_length for y in range(pane.size.height)}
        assert widths == {pane.size.width}


async def test_a_run_without_a_tree_yet_says_what_it_waits_for():
    async with TreeApp().run_test(size=(40, 9)) as pilot:
        assert "waiting for the mission" in "\n".join(lines_of(pilot.app.query_one(TreePane)))

"""`treepilot show --svg`, with Graphviz where there is one, else with a stand-in that counts."""

import os
import re
import shutil
import stat
import subprocess
from pathlib import Path

import pytest

from missions.inspection.check import drawing
from missions.inspection.graphviz import save_svg, svg
from stack.errors import InputError

STAND_IN = """#!/bin/sh
test "$1" = -Tsvg || exit 3
echo '<svg>'
grep -o 'n[0-9]* .label' | sed 's/.*/<g class="node"\\/>/'
echo '</svg>'
"""


def put_on_path(folder, monkeypatch, script):
    file = folder / "dot"
    file.write_text(script)
    file.chmod(file.stat().st_mode | stat.S_IEXEC)
    monkeypatch.setenv("PATH", f"{folder}{os.pathsep}/usr/bin{os.pathsep}/bin")


def test_every_node_of_the_tree_is_drawn(tmp_path, monkeypatch):
    if shutil.which("dot") is None:
        put_on_path(tmp_path, monkeypatch, STAND_IN)
    save_svg("02_office_patrol", str(tmp_path / "tree.svg"))
    drawn = (tmp_path / "tree.svg").read_text("utf-8").count('class="node"')
    assert drawn == len(re.findall(r"\[label=", drawing("02_office_patrol", "dot", colours=False)))
    assert drawn > 10


def test_without_graphviz_it_says_what_to_install(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(InputError, match="apt install graphviz"):
        svg("02_office_patrol")


def test_a_graphviz_that_fails_is_quoted(monkeypatch, tmp_path):
    put_on_path(tmp_path, monkeypatch, "#!/bin/sh\necho out of ink >&2\nexit 1\n")
    with pytest.raises(InputError, match="could not draw the tree: out of ink"):
        svg("02_office_patrol")


def test_a_place_that_cannot_be_written_is_named(monkeypatch, tmp_path):
    put_on_path(tmp_path, monkeypatch, STAND_IN)
    nowhere = tmp_path / "nowhere" / "tree.svg"
    with pytest.raises(InputError, match=r"tree\.svg cannot be written"):
        save_svg("02_office_patrol", str(nowhere))
    assert not Path(nowhere).exists()


@pytest.mark.skipif(shutil.which("dot") is None, reason="Graphviz is not installed")
@pytest.mark.parametrize("mission", ["02_office_patrol", "07_shelf_patrol"])
def test_children_stand_from_left_to_right_as_they_are_ticked(mission):
    graph = drawing(mission, "dot", colours=False)
    done = subprocess.run(
        ["dot", "-Tplain"], input=graph, capture_output=True, text=True, check=True
    )
    lines = [line.split() for line in done.stdout.splitlines()]
    place = {line[1]: float(line[2]) for line in lines if line[0] == "node"}
    below: dict[str, list[str]] = {}
    for parent, child in re.findall(r"(n\d+) -> (n\d+)", graph):
        below.setdefault(parent, []).append(child)
    assert len(below) > 5
    for children in below.values():
        assert [place[child] for child in children] == sorted(place[child] for child in children)

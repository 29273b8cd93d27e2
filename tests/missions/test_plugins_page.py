"""docs/plugins.md and docs/editors.md say what is so."""

import re
from pathlib import Path

import pytest
import typer.main

from missions.cli.app import app
from missions.execution.prepare import RunOptions, prepare
from missions.inspection.scaffold import new_component

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "plugins.md").read_text("utf-8")


def test_the_mission_of_the_page_uses_what_the_commands_of_the_page_write(tmp_path):
    for kind, name in re.findall(r"^treepilot new (planner|controller) (\w+)", PAGE, re.MULTILINE):
        new_component(kind, name, tmp_path / "my_plugins")
    text = PAGE.split("```yaml\n")[1].split("```")[0]
    (tmp_path / "own_way.yaml").write_text(text)
    plan = prepare(tmp_path / "own_way.yaml", RunOptions())
    assert plan.mission.warnings == ()
    assert plan.choices["planner"].component.__name__ == "Beeline"
    assert plan.choices["controller"].component.__name__ == "NoseFirst"


@pytest.mark.parametrize("page", ["plugins", "editors", "behaviours"])
def test_every_command_on_a_page_exists(page):
    text = (DOCS / f"{page}.md").read_text("utf-8")
    commands = re.findall(r"^treepilot ([a-z]+)(?: ([a-z]+))?", text, re.MULTILINE)
    root = typer.main.get_command(app)
    for name, inner in commands:
        assert name in root.commands
        if name == "new":
            assert inner in root.commands[name].commands

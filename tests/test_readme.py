"""What README shows works as it stands."""

from __future__ import annotations

import re
from pathlib import Path

from missions.cli.app import app
from missions.inspection.check import check_files

README = (Path(__file__).parents[1] / "README.md").read_text("utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, flags=re.DOTALL)


def test_the_mission_and_the_behaviour_of_the_readme_check(tmp_path):
    (mission,) = blocks("yaml")
    behaviour = next(block for block in blocks("python") if "class Honk" in block)
    plugins = tmp_path / "my_behaviours"
    plugins.mkdir()
    (plugins / "honk.py").write_text(behaviour, "utf-8")
    text = mission.replace("world: office\n", "world: office\nplugins: [./my_behaviours]\n")
    path = tmp_path / "my_mission.yaml"
    path.write_text(f"{text}    - honk: {{times: 3}}\n", "utf-8")
    assert [line.text for line in check_files([str(path)])] == []


def test_every_command_of_the_readme_exists():
    commands = {command.name or command.callback.__name__ for command in app.registered_commands}
    groups = {group.name for group in app.registered_groups}
    used = set(re.findall(r"^treepilot ([a-z]+)", "\n".join(blocks("sh")), flags=re.MULTILINE))
    assert used
    assert used <= commands | groups


def test_every_link_leads_somewhere():
    for target in re.findall(r"\]\(([^)#]+)\)", README):
        assert (Path(__file__).parents[1] / target).exists(), target

"""An exception in a component of a plugin: file and line in the report, traceback in the log."""

from __future__ import annotations

from pathlib import Path

import pytest

from behaviours.scaffold import new_behaviour
from missions import run
from missions.inspection.component_scaffold import new_component
from stack.errors import InputError

MISSION = """mission: broken
robot: scout
world: office
start: dock
plugins: [./plugins]
{chosen}
run: {run}
"""
DRIVE = "{navigate_to_pose: {goal: [2.0, 1.0, 0]}}"

CASES = {
    "planner": ("navigation: {planner: faulty}", DRIVE, "    def plan("),
    "controller": ("navigation: {controller: faulty}", DRIVE, "    def step("),
    "layer": (
        "navigation: {costmap: {layers: [static, obstacle, faulty]}}", DRIVE, "    def paint(",
    ),
    "estimator": ("localisation: faulty", DRIVE, "    def update("),
    "behaviour": ("", "faulty", "    def update("),
}  # fmt: skip


def reason_of(mission: Path) -> str:
    try:
        report = run(mission, out=mission.parent / "run")
    except InputError as error:  # the layer paints before the first step
        return str(error)
    assert report.status in ("failure", "error")
    return report.reason


@pytest.mark.parametrize("kind", CASES)
def test_the_report_names_the_line_and_the_log_has_the_traceback(kind, tmp_path):
    chosen, node, method = CASES[kind]
    plugins = tmp_path / "plugins"
    if kind == "behaviour":
        file = new_behaviour("faulty", plugins)[0]
    else:
        file = new_component(kind, "faulty", plugins)[0]
    lines = file.read_text().splitlines()
    body = next(
        number
        for number, line in enumerate(lines)
        if '"""' in line and number > next(n for n, t in enumerate(lines) if t.startswith(method))
    )
    lines.insert(body, "        {}['key of the plugin']")
    file.write_text("\n".join(lines) + "\n")
    mission = tmp_path / "broken.yaml"
    mission.write_text(MISSION.format(chosen=chosen, run=node))
    assert f"KeyError: 'key of the plugin' (faulty.py:{body + 1})" in reason_of(mission)
    log = (tmp_path / "run" / "log.txt").read_text()
    assert f'faulty.py", line {body + 1}, in {method.split()[1].rstrip("(")}' in log
    assert "Traceback (most recent call last)" in log
    events = (tmp_path / "run" / "events.jsonl").read_text()
    assert "Traceback" not in events

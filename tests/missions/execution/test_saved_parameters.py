"""Parameters that were changed in a run and saved by the dashboard are accepted by `check`."""

from __future__ import annotations

from missions.inspection.check import check_files
from tests.missions.execution.live_run import HEAD
from tui.tuning import parameter_file, parsed, shown_value

CHANGES = {
    "controller.cruise_speed": "30 cm/s",
    "local_costmap.inflation_radius": "40 cm",
    "global_costmap.inflation_radius": "0.6",
    "goal_checker.heading_tolerance": "10 deg",
    "depth.stairs": "",
}


def findings(mission):
    return [line for line in check_files([str(mission)]) if line.finding is not None]


def test_a_saved_file_passes_the_check(tmp_path, live_run):
    run = live_run(tmp_path / "m", "run: {wait: 5 s}\n")
    run.steps(2)
    table = {item.name: item for item in run.snapshot.layers["parameters"].content.parameters}
    for name, text in CHANGES.items():
        if name in table:
            value = parsed(text, table[name].start)
            assert run.order("set_parameter", name=name, value=value).done, name
    now = run.snapshot.parameters
    changed = {
        name: now[name] for name, item in table.items()
        if shown_value(now[name], "") != shown_value(item.start, "")
    }  # fmt: skip
    assert len(changed) >= 3
    (tmp_path / "saved.yaml").write_text(parameter_file(changed, table))
    mission = tmp_path / "again.yaml"
    mission.write_text(HEAD + "parameters: [saved.yaml]\nrun: {wait: 1 s}\n")
    assert findings(mission) == []


def test_every_tunable_parameter_can_be_written_to_a_file(tmp_path, live_run):
    """All of them with their present values: names and components exist in files too."""
    run = live_run(tmp_path / "m", "run: {wait: 5 s}\n")
    table = {item.name: item for item in run.snapshot.layers["parameters"].content.parameters}
    (tmp_path / "all.yaml").write_text(parameter_file(run.snapshot.parameters, table))
    mission = tmp_path / "again.yaml"
    mission.write_text(HEAD + "parameters: [all.yaml]\nrun: {wait: 1 s}\n")
    assert findings(mission) == []

"""One mission explores, localises on its new map and drives on it; another one uses the map."""

from __future__ import annotations

import pytest

import missions
from missions.execution.prepare import RunOptions, prepare
from stack.errors import InputError

WORLD = """world: den
format: 1
bounds: [-0.5, -0.5, 3.9, 3.1]
start: [0.7, 0.7, 0]
places: {far: [2.8, 1.9, 90 deg]}
walls:
  - {points: [[0, 0], [3.4, 0], [3.4, 2.6], [0, 2.6]], closed: true}
boxes:
  - {name: shelf, at: [1.5, 2.35, 0 deg], size: [0.9, 0.4, 1.0]}
"""
HEAD = "mission: m\nrobot: scout\nworld: den.yaml\n"
MAP_AND_USE = """map: none
localisation: slam
run:
  sequence:
    - explore: {}
      timeout: 1 min
    - set_mapping: {enabled: false}
    - navigate_to_pose: {goal: $far}
      timeout: 30 s
    - save_map: {path: FOLDER}
"""
USE = """map: FOLDER
start: far
initial_pose: unknown
localisation: pose_graph
run:
  sequence:
    - wait_until: localisation.health > 0.5
      timeout: 2 s
    - navigate_to_pose: {goal: [1.5, 1.0, 0]}
      timeout: 30 s
    - load_map: {path: FOLDER}
    - set_mapping: {enabled: true}
    - navigate_to_pose: {goal: [0.8, 0.8, 0]}
      timeout: 30 s
"""


def written(folder, text):
    (folder / "den.yaml").write_text(WORLD)
    path = folder / "m.yaml"
    path.write_text(HEAD + text.replace("FOLDER", str(folder / "den")))
    return path


def test_explore_localise_drive_and_use_the_saved_graph_in_another_run(tmp_path):
    report = missions.run(written(tmp_path, MAP_AND_USE))
    assert report.status == "success", report.reason
    # odometry alone drifts; scans hold the pose within a cell of the map
    assert report.localisation_error["max"] < 0.05
    assert {"graph.json", "graph.npz", "map.yaml"} <= {f.name for f in (tmp_path / "den").iterdir()}
    again = missions.run(written(tmp_path, USE))
    assert again.status == "success", again.reason


def test_a_map_without_a_graph_is_an_error_of_the_mission(tmp_path):
    path = written(tmp_path, "localisation: pose_graph\nrun: {wait: 1 s}\n")
    with pytest.raises(InputError, match="needs a map that was saved with `localisation: slam`"):
        prepare(path, RunOptions())


def test_monte_carlo_localisation_draws_no_map(tmp_path):
    path = written(tmp_path, "run: {set_mapping: {enabled: true}}\n")
    report = missions.run(path)
    assert report.status == "failure" and "draws no map" in report.reason

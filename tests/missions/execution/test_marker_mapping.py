"""A survey while mapping: markers are part of the map that is saved, and of the next run's."""

from math import degrees, hypot

import pytest

import missions
from missions.execution.prepare import RunOptions, prepare
from stack.mapping.graph_files import read_graph
from stack.mapping.marker_maps import MARKERS_YAML, read_marker_map
from stack.types import wrap_angle

MISSION = """
mission: markers
robot: scout
world: small_room
markers: none
map: none
localisation: slam
navigation: {{markers: {{survey: true}}}}
run:
  sequence:
    - navigate_to_pose: {{goal: [3.5, 2.3, 0 deg]}}
    - save_map: {{path: {folder}}}
"""


def test_a_survey_with_slam_saves_the_landmarks_of_the_graph(tmp_path):
    """Within 10 cm and two deviations, which contain the errors of the map."""
    path = tmp_path / "mission.yaml"
    path.write_text(MISSION.format(folder=tmp_path / "saved"), "utf-8")
    truth = {one.number: one for one in prepare(path, RunOptions()).world.markers}
    report = missions.run(path, seed=1)
    assert report.status == "success"
    found = read_marker_map(tmp_path / "saved" / MARKERS_YAML)
    landmarks = read_graph(tmp_path / "saved").landmarks
    placed = [key for key, one in landmarks.items() if len(one.sightings) >= 3]
    assert sorted(placed) == [("DICT_4X4_50", one.number) for one in found]
    assert found, "the robot drove towards a marker"
    for one in found:
        right = truth[one.number]
        off = hypot(one.position[0] - right.position[0], one.position[1] - right.position[1])
        turned = abs(wrap_angle(one.heading - right.heading))
        assert off < 0.1 and off < 2.0 * one.position_deviation
        assert turned < 2.0 * one.heading_deviation < 2.0 * degrees(0.4)
        assert one.position[2] == pytest.approx(right.position[2], abs=0.02)

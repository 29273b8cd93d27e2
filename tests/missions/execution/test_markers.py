"""Markers in missions: which ones the robot knows, localisation while driving, survey, errors."""

from math import degrees, hypot

import pytest

import missions
from missions.execution.prepare import RunOptions, prepare
from missions.execution.run import Run
from stack.errors import InputError
from stack.mapping.marker_maps import MARKERS_YAML, read_marker_map
from stack.types import wrap_angle

MISSION = """
mission: markers
robot: scout
world: small_room
{keys}
run:
  sequence:
    - spin: {{angle: {angle} deg}}
    - save_map: {{path: {folder}}}
"""
ONE = "markers: [{id: 5, at: [1, 2], facing: 0}]"


@pytest.fixture
def mission(tmp_path):
    """Write the mission with further keys; return its path."""

    def written(keys: str = "", angle: int = 100):
        path = tmp_path / "mission.yaml"
        path.write_text(MISSION.format(keys=keys, angle=angle, folder=tmp_path / "saved"), "utf-8")
        return path

    return written


def known(path):
    return [marker.number for marker in prepare(path, RunOptions()).markers]


def test_the_markers_are_the_worlds_unless_the_mission_says_otherwise(mission, tmp_path):
    (tmp_path / "own.yaml").write_text(ONE, "utf-8")
    assert known(mission()) == [0, 1, 2, 3]
    assert known(mission("markers: from_world")) == [0, 1, 2, 3]
    assert known(mission("markers: none")) == []
    assert known(mission("markers: own.yaml")) == [5]
    plan = prepare(mission("markers: own.yaml"), RunOptions())
    assert [marker.number for marker in plan.world.markers] == [0, 1, 2, 3]  # what stands there


@pytest.mark.parametrize(
    "keys, code, sentence",
    [
        ("markers: nowhere.yaml", "E110", "nowhere.yaml"),
        ("navigation: {markers: {localise: true}}\nlocalisation: slam\nmap: none", "E111",
         "the estimator 'slam' does not use markers"),
        ("navigation: {markers: {surveyed_dictionary: DICT_4X4_5O}}", "E111", "DICT_4X4_50"),
        ("navigation: {markers: {rate: 0}}", "E111", "rate"),
    ],
)  # fmt: skip
def test_errors_have_code_and_position(mission, keys, code, sentence):
    with pytest.raises(InputError) as caught:
        prepare(mission(keys), RunOptions())
    assert [finding.code for finding in caught.value.findings] == [code]
    assert sentence in str(caught.value)
    assert caught.value.findings[0].mark.line >= 5


def test_a_robot_without_camera_cannot_use_markers(mission):
    with pytest.raises(InputError, match=r"E183.*the robot 'scout' has no camera"):
        prepare(mission("navigation: {markers: {survey: true}}"), RunOptions(camera="off"))


def test_without_the_setting_no_picture_is_taken(mission):
    run = Run(prepare(mission(), RunOptions(serve=False)), RunOptions(serve=False), [])
    try:
        for _ in range(40):
            run.step()
        parts = run.engine.runtime.parts
        assert parts.perceiver.markers.fixes == 0
        assert "camera" not in run.engine.runtime.perceived.measurements
    finally:
        run.close()


def test_pictures_correct_the_pose_only_after_motion(mission):
    """Turning by 100 degrees at 0.1 rad a picture shows markers 1 and 2: several corrections."""
    options = RunOptions(serve=False)
    run = Run(prepare(mission("navigation: {markers: {localise: true}}"), options), options, [])
    try:
        parts = run.engine.runtime.parts
        while not run.is_over:
            run.step()
        assert "camera" in run.engine.runtime.perceived.measurements
        assert 2 <= parts.perceiver.markers.fixes <= 18
        truth, pose = run.engine.simulation.truth.pose, parts.perceiver.estimator.estimate.pose
        assert pose.distance_to(truth) < 0.05
    finally:
        run.close()


def test_a_survey_is_saved_with_the_map_and_loaded_with_it(mission, tmp_path):
    """What a full turn sees twice: within 10 cm and 8 degrees of the world's."""
    keys = "markers: none\nnavigation: {markers: {survey: true, least_views: 2}}"
    report = missions.run(mission(keys, angle=360), seed=1)
    assert report.status == "success"
    found = read_marker_map(tmp_path / "saved" / MARKERS_YAML)
    truth = {one.number: one for one in prepare(mission(), RunOptions()).world.markers}
    assert found, "the robot turned past markers"
    for one in found:
        right = truth[one.number]
        off = hypot(one.position[0] - right.position[0], one.position[1] - right.position[1])
        assert off < 0.1
        assert degrees(abs(wrap_angle(one.heading - right.heading))) < 8.0
        assert one.position_deviation > 0.0
    assert known(mission("map: saved")) == [one.number for one in found]

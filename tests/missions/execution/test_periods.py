"""`every` is compared with the rate at which the tree is really ticked."""

import shutil

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missions.execution.fit.periods import period_findings
from missions.inspection.diagnosis import findings_of
from robots.load import find_robot
from stack.runtime.parameters import LoopParameters
from tests.missions.mission_fakes import read_text

RUN = "run:\n  reactive:\n    - take_photo: {}\n      every: 0.1 s\n    - wait: 3 s\n"


@settings(deadline=None, max_examples=60)
@given(
    rate=st.sampled_from([1.0, 2.0, 4.0, 5.0, 10.0, 20.0, 25.0, 50.0, 100.0]),
    ticks=st.sampled_from([0.1, 0.5, 0.99, 1.0, 1.01, 2.0, 10.0]),
)
def test_a_period_up_to_one_tick_has_no_effect(tmp_path_factory, rate, ticks):
    text = RUN.replace("0.1 s", f"{ticks / rate!r} s")
    mission = read_text(tmp_path_factory.mktemp("m"), text)
    found = list(period_findings(mission, LoopParameters(control_rate=100.0, tree_rate=rate)))
    assert [(item.code, item.mark.line) for item in found] == ([("W126", 4)] if ticks <= 1 else [])
    assert all(f"the tree ticks every {1 / rate:g} s" in item.sentence for item in found)


@pytest.mark.parametrize(
    ("of_mission", "of_robot", "expected"),
    [
        ("", "", ["W126"]),  # 10 Hz
        ("navigation: {loop: {tree_rate: 20}}\n", "", []),
        ("", "navigation: {loop: {tree_rate: 20}}\n", []),
        ("navigation: {loop: {tree_rate: 2}}\n", "navigation: {loop: {tree_rate: 20}}\n", ["W126"]),
    ],
)
def test_the_rate_is_that_of_the_mission_or_the_robot(tmp_path, of_mission, of_robot, expected):
    shutil.copytree(find_robot("scout", tmp_path).parent, tmp_path / "robot")
    with (tmp_path / "robot" / "robot.yaml").open("a") as file:
        file.write(of_robot)
    file = tmp_path / "mission.yaml"
    file.write_text(f"mission: a\nformat: 1\nworld: office\nrobot: ./robot\n{of_mission}{RUN}")
    assert [item.code for item in findings_of(file)] == expected

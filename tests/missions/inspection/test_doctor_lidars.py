"""`treepilot doctor ROBOT`: beams that see the robot itself, and the mask that leaves them out."""

from math import degrees

import pytest

from missions.inspection.doctor.lidars import diagnose_lidars, is_robot
from robots.load import read_robot
from tests.stack.sim.masted_robot import ROBOT, masted


def test_the_mask_of_a_lidar_upside_down_is_proposed_in_its_own_angles(tmp_path, monkeypatch):
    """The mast is on the left at atan2(0.1, 0.4) = 14 deg; the sensor sees it at -14 deg."""
    monkeypatch.chdir(tmp_path)
    masted(tmp_path, at="0.4 0.1 0")
    upside_down = ROBOT.replace("range_min: 5 cm", "range_min: 5 cm, roll: 180 deg")
    (tmp_path / "down.yaml").write_text(upside_down)
    found = diagnose_lidars("./down.yaml")
    assert found.lines[-1].strip() == "mask: [[-18.0 deg, -10.0 deg]]"
    masked = upside_down.replace("roll:", f"{found.lines[-1].strip()}, roll:")
    (tmp_path / "masked.yaml").write_text(masked)
    assert diagnose_lidars("./masked.yaml").closed == 0


def test_doctor_proposes_a_mask_that_is_enough(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    masted(tmp_path)
    assert is_robot("./robot.yaml") and is_robot("scout") and not is_robot("office")
    found = diagnose_lidars("./robot.yaml")
    assert found.closed == 1
    assert "7 beams from -3.0 to 3.0 deg see the robot itself" in found.lines[0]
    key = found.lines[-1].strip()
    assert key == "mask: [[-4.0 deg, 4.0 deg]]"
    masked = tmp_path / "masked.yaml"
    masked.write_text(ROBOT.replace("range_min: 5 cm", f"range_min: 5 cm, {key}"))
    assert diagnose_lidars("./masked.yaml").closed == 0
    (mask,) = read_robot(masked).lidar.mask
    assert [degrees(value) for value in mask] == pytest.approx([-4.0, 4.0])


def test_a_mast_behind_is_proposed_across_the_end_of_the_turn(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    masted(tmp_path, at="-0.4 0 0")
    found = diagnose_lidars("./robot.yaml")
    assert "7 beams from 177.0 to -177.0 deg" in found.lines[0]
    assert found.lines[-1].strip() == "mask: [[176.0 deg, -176.0 deg]]"


def test_a_mast_inside_the_footprint_needs_no_mask(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    masted(tmp_path, at="0.12 0 0")
    found = diagnose_lidars("./robot.yaml")
    assert found.closed == 0
    assert "not used" in found.lines[0]

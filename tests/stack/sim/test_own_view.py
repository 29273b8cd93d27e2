"""What a lidar sees of its robot: other links at its height, not the one it is in."""

from dataclasses import replace
from math import degrees

import numpy as np
import pytest

from missions.inspection.doctor_lidars import diagnose_lidars, is_robot
from robots.load import HERE, read_robot
from stack.sim.physics.pybullet_engine.own_view import own_ranges
from stack.types import Pose2D

ROBOT = """\
robot: masted
footprint: {radius: 20 cm}
height: 60 cm
urdf: masted.urdf
wheels: {left: [left], right: [right], radius: 8 cm, separation: 32 cm}
lidar: {height: 30 cm, range_min: 5 cm}
"""

LINK = """\
<link name="{name}">
  <inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/>
  </inertial>
  <collision><origin xyz="{at}"/><geometry>{shape}</geometry></collision>
</link>
"""
JOINT = """\
<joint name="{name}" type="{kind}"><parent link="base"/><child link="{child}"/>
  <origin xyz="{at}"/><axis xyz="0 1 0"/></joint>
"""


def masted(folder, *, at="0.4 0 0", radius=0.025, length=0.6, housing="0 0 0.3"):
    """A robot with a housing around its lidar, and a mast in a link of its own."""
    wheel = '<sphere radius="0.08"/>'
    parts = [
        LINK.format(name="base", at="0 0 0.12", shape='<box size="0.2 0.2 0.1"/>'),
        LINK.format(name="housing", at=housing, shape='<cylinder radius="0.04" length="0.06"/>'),
        LINK.format(
            name="mast", at="0 0 0.3", shape=f'<cylinder radius="{radius}" length="{length}"/>'
        ),
        JOINT.format(name="housing", kind="fixed", child="housing", at="0 0 0"),
        JOINT.format(name="mast", kind="fixed", child="mast", at=at),
    ]
    for side, y in (("left", 0.16), ("right", -0.16)):
        parts.append(LINK.format(name=f"{side}_link", at="0 0 0", shape=wheel))
        where = f"0 {y} 0.08"
        parts.append(JOINT.format(name=side, kind="continuous", child=f"{side}_link", at=where))
    (folder / "masted.urdf").write_text(f'<robot name="masted">{"".join(parts)}</robot>')
    (folder / "robot.yaml").write_text(ROBOT)
    return folder / "robot.yaml"


def test_a_mast_is_seen_and_the_housing_is_not(tmp_path):
    """Closed form: half the angle of a circle of 2.5 cm at 40 cm is asin(1/16) = 3.6 degrees."""
    robot = read_robot(masted(tmp_path))
    ranges = own_ranges(robot.model, robot.lidar)
    seen = np.degrees(robot.lidar.angles[np.isfinite(ranges)])
    assert seen == pytest.approx(np.arange(-3.0, 4.0), abs=1e-9)
    assert ranges.min() == pytest.approx(0.375, abs=0.003)


@pytest.mark.parametrize("height", [0.1, 0.7])
def test_what_is_below_or_above_the_plane_is_not_seen(tmp_path, height):
    """The mast ends at 0.6 m; at 0.1 m the lidar would be inside the base, which is left out."""
    robot = read_robot(masted(tmp_path, length=0.2))  # from 0.2 m to 0.4 m
    lidar = replace(robot.lidar, height=height, mount=Pose2D(0.0, 0.0))
    beams = np.degrees(lidar.angles[np.isfinite(own_ranges(robot.model, lidar))])
    assert not (np.abs(beams) < 10.0).any()


def test_the_robots_of_treepilot_do_not_see_themselves():
    for file in HERE.glob("*/robot.yaml"):
        robot = read_robot(file)
        for lidar in robot.real_lidars.values():
            assert np.isinf(own_ranges(robot.model, lidar)).all()


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

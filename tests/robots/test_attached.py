"""URDFs that are attached to another one, and arms on a base with wheels."""

from pathlib import Path

import numpy as np
import pybullet_data
import pytest

from robots.load import HERE, find_robot, read_robot
from stack.drivetrain.needs import lacking
from stack.errors import InputError
from stack.frames.links import RobotLinks

FETCHER = read_robot(find_robot("fetcher", Path()))
FILE = HERE / "fetcher" / "robot.yaml"


@pytest.fixture
def read(tmp_path):
    """read((old, new), …): the robot file of the fetcher with texts replaced."""

    def read(*replaced):
        text = FILE.read_text().replace("fetcher.urdf", str(HERE / "fetcher" / "fetcher.urdf"))
        for old, new in replaced:
            assert old in text
            text = text.replace(old, new)
        file = tmp_path / "robot.yaml"
        file.write_text(text)
        return read_robot(file)

    return read


def warnings(robot):
    return [finding.sentence for finding in robot.warnings]


def errors(read, *replaced):
    with pytest.raises(InputError) as caught:
        read(*replaced)
    return [str(finding) for finding in caught.value.findings]


def test_a_base_with_an_arm_has_all_that_behaviours_may_need():
    needs = ("base", "arm", "gripper", "lidar", "camera", "depth_camera")
    assert list(lacking(needs, FETCHER)) == []
    assert FETCHER.warnings == ()


def test_an_attached_urdf_stands_where_the_robot_file_says():
    links = RobotLinks(FETCHER.links, "base")
    assert links.pose("panda_link0", {})[:3, 3] == pytest.approx((0.12, 0.0, 0.36))
    # The first joint of the Panda is 0.333 m above its base.
    q = dict.fromkeys(FETCHER.arm.joints, 0.0)
    assert links.pose("panda_link1", q)[:3, 3] == pytest.approx((0.12, 0.0, 0.36 + 0.333))


def test_an_attached_urdf_is_turned(read):
    robot = read(("[12 cm, 0, 36 cm]}", "[12 cm, 0, 36 cm], yaw: 90 deg}"))
    pose = RobotLinks(robot.links, "base").pose("panda_link0", {})
    assert pose[:3, :3] == pytest.approx(np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]), abs=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("to: base,", "to: bas,", "the URDF has no link 'bas'"),
        ("to: base, ", "", "to"),
        ("pybullet_data/franka", "nowhere/franka", "the package 'nowhere' is not found"),
        ("    - {file:", "    {file:", "expected a list"),
        ("36 cm]}", "36 cm], height: 1}", "height"),
    ],
)
def test_what_is_wrong_with_an_attached_urdf_is_told_with_its_line(read, old, new, told):
    found = errors(read, (old, new))
    assert any(told in item and "robot.yaml:" in item for item in found), found


def test_an_attached_urdf_that_is_missing_is_told_where_it_is_named(read):
    text = FILE.read_text()
    line = next(n for n, it in enumerate(text.splitlines(), 1) if "{file: package:" in it)
    [found] = errors(read, ("package://pybullet_data/franka_panda/panda.urdf", "pandda.urdf"))
    assert f"robot.yaml:{line}:" in found
    assert "urdf: 'pandda.urdf': there is no such URDF" in found and "fetcher" not in found


def test_two_links_of_one_name_are_refused(read):
    found = errors(read, ("package://pybullet_data/franka_panda/panda.urdf",
                          str(HERE / "scout" / "scout.urdf")))  # fmt: skip
    assert any("two links are named" in item for item in found), found


def test_an_arm_that_leaves_the_footprint_at_home_is_told(read):
    home = "home: [0, -1.4, 0, -2.8, 0, 1.5, 0.785]"
    found = warnings(read((home, "home: [0, 0.8, 0, -0.8, 0, 1.5, 0.785]")))
    assert any("beyond the footprint" in item and "panda_hand" in item for item in found), found
    found = warnings(read((home, "home: [0, 0, 0, -0.1, 0, 1.5, 0.785]"), ("1.45 m", "1.0 m")))
    assert any("beyond the height" in item for item in found), found


def test_an_arm_that_tips_its_base_over_is_told(read, tmp_path):
    # The links of the stretched arm weigh 15.1 kg, on average 0.46 m before its first joint, which
    # is 0.30 m before the middle. All else weighs 15.7 kg: 15.1 * 0.76 m / 30.8 kg = 0.37 m, and
    # the base ends at 0.34 m.
    light = (HERE / "fetcher" / "fetcher.urdf").read_text().replace('value="58"', 'value="2"')
    (tmp_path / "light.urdf").write_text(light)
    files = str(HERE / "fetcher" / "fetcher.urdf"), str(tmp_path / "light.urdf")
    told = "stretched out, it may tip the base over"
    found = warnings(read(files, ("[12 cm, 0, 36 cm]", "[30 cm, 0, 36 cm]")))
    assert any(told in item for item in found), found
    assert not any(told in item for item in warnings(read(files)))
    # With a joint 4 that slides by 3.07 m, the links behind it are so much farther away.
    data = Path(pybullet_data.getDataPath()) / "franka_panda"
    panda = (data / "panda.urdf").read_text().replace("package://", f"{data}/")
    turns = '<joint name="panda_joint4" type="revolute">'
    assert turns in panda
    (tmp_path / "sliding.urdf").write_text(
        panda.replace(turns, turns.replace("revolute", "prismatic"))
    )
    slides = "package://pybullet_data/franka_panda/panda.urdf", str(tmp_path / "sliding.urdf")
    assert any(told in item for item in warnings(read(files, slides)))


def test_the_arm_counts_when_a_stop_tips_the_robot_over(read):
    # At home the arm of 18 kg is 0.74 m high, the rest of 73 kg 0.17 m: together 0.29 m, 0.36 m
    # behind the front. That bears 9.81 m/s² * 0.36 / 0.29 = 12.3 m/s².
    stop = ("linear_deceleration: 0.8 m/s²", "linear_deceleration: 13 m/s²")
    assert any("tips the robot over" in item for item in warnings(read(stop)))
    stop = ("linear_deceleration: 0.8 m/s²", "linear_deceleration: 11.5 m/s²")
    assert not any("tips the robot over" in item for item in warnings(read(stop)))

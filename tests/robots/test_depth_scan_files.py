"""Virtual scans in robot files."""

import pytest

from robots.load import find_robot, read_robot
from stack.errors import InputError


def with_scan(tmp_path, scan, more=""):
    """A copy of scout_depth with another scan."""
    original = find_robot("scout_depth", tmp_path)
    text = original.read_text("utf-8").replace("{low: 8 cm, high: 35 cm}", scan)
    text = text.replace("../scout/scout.urdf", str(original.parent.parent / "scout/scout.urdf"))
    file = tmp_path / "robot.yaml"
    file.write_text(text + more, "utf-8")
    return read_robot(file)


def test_the_band_is_read(tmp_path):
    robot = with_scan(tmp_path, "{low: 10 cm, high: 30 cm, least_pixels: 3}")
    scan = robot.depth_cameras["depth"].scan
    assert (scan.low, scan.high, scan.least_pixels) == (0.1, 0.3, 3)
    assert list(robot.all_lidars) == ["depth_scan"] and robot.main_lidar == "depth_scan"


@pytest.mark.parametrize(
    ("scan", "more", "message"),
    [
        ("{low: 40 cm, high: 30 cm}", "", "low: 0.4 must be below 0.3"),
        ("{lowest: 40 cm}", "", "`scan` has no key 'lowest'; did you mean 'low'"),
        (
            "{low: 10 cm}", "lidars: {depth_scan: {position: [0, 0]}}",
            "the name `depth_scan` is that of the scan of the depth camera `depth`",
        ),
    ],
)  # fmt: skip
def test_wrong_scans_are_refused(scan, more, message, tmp_path):
    with pytest.raises(InputError, match=message):
        with_scan(tmp_path, scan, more)

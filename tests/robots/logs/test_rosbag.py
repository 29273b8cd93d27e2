"""ROS bags as observations: topics, mounts, order of stamps, damaged files."""

from math import pi

import numpy as np
import pytest

from robots.logs.opening import open_log
from robots.logs.rosbag import Topics
from stack.errors import InputError
from stack.types import Imu, Pose2D, Scan
from tests.robots.logs.log_writers import BagWriter
from tests.stack.sim.sim_rover import ROVER

MOUNT = Pose2D(0.2, -0.05, 0.3)
RANGES = np.linspace(1.0, 5.0, 90)


@pytest.fixture(params=["mcap", "sqlite3"])
def bag(tmp_path, request):
    """A robot that drives 1 m/s for 2 s: odometry at 20 Hz, scans at 10 Hz, an IMU at 50 Hz."""
    writer = BagWriter(tmp_path / "bag", request.param)
    writer.static(99.9, "base_footprint", "base_link", Pose2D(0.0, 0.0))
    writer.static(99.9, "base_link", "laser", MOUNT)
    writer.static(99.9, "base_link", "imu_link", Pose2D(0.0, 0.0), roll=pi)
    for n in range(100):
        stamp = 100.0 + 0.02 * n
        writer.imu(stamp, 0.5, up=(0.0, 0.0, -1.0))
        if n % 5 == 2:
            ranges = RANGES.copy()
            ranges[:3] = 0.05, 10.0, np.nan
            writer.scan(stamp, ranges)
        if n % 2 == 0:
            writer.odometry(stamp, Pose2D(0.02 * n, 0.0, 0.0))
    writer.close()
    return tmp_path / "bag"


def test_a_rosbag2_gives_scans_odometry_and_inertial_samples(bag):
    found = open_log(bag)
    assert found.counts == {"lidar": 20, "wheels": 50, "imu": 100}
    assert found.notes == ()
    played = list(found.play())
    scans = [item.measurements["lidar"] for item in played if "lidar" in item.measurements]
    assert len(scans) == 20
    scan = scans[0]
    assert isinstance(scan, Scan)
    assert scan.stamp == pytest.approx(0.04)
    assert (scan.mount.x, scan.mount.y, scan.mount.heading) == pytest.approx((0.2, -0.05, 0.3))
    assert np.isnan(scan.ranges[[0, 2]]).all() and np.isinf(scan.ranges[1])
    assert all(item.wheels is not None for item in played)
    assert played[10].wheels.twist.linear == pytest.approx(1.0)
    samples = [item.measurements["imu"] for item in played if "imu" in item.measurements]
    turning = np.concatenate([item.angular_velocity for item in samples if isinstance(item, Imu)])
    assert turning[:, 2] == pytest.approx(np.full(len(turning), -0.5))  # it is mounted upside down
    assert (np.diff([item.time for item in played]) >= 0.0).all()
    robot = found.describe(ROVER)
    assert (robot.lidar.range_min, robot.lidar.range_max) == (pytest.approx(0.1), 10.0)
    assert robot.imu.rate == pytest.approx(50.0, rel=0.05)


def test_a_single_file_without_its_folder(bag):
    file = next(item for item in bag.iterdir() if item.suffix in (".mcap", ".db3"))
    assert open_log(file).counts["lidar"] == 20


def test_a_lidar_upside_down_is_turned_over(tmp_path):
    """Seen from above, beam 0 of a lidar on its head is at the other side."""
    writer = BagWriter(tmp_path / "bag")
    writer.static(1.0, "base_link", "laser", Pose2D(0.1, 0.0, 0.0), roll=pi)
    writer.odometry(1.0, Pose2D(0.0, 0.0), base="base_link")
    writer.scan(1.1, [1.0, 2.0, 3.0], angle_min=-0.5, angle_max=0.5, angle_increment=0.5)
    writer.odometry(1.2, Pose2D(0.0, 0.0), base="base_link")
    writer.close()
    scans = [s for item in open_log(tmp_path / "bag").play() for s in item.of(Scan).values()]
    assert scans[0].ranges.tolist() == [3.0, 2.0, 1.0]
    assert scans[0].angles == pytest.approx([-0.5, 0.0, 0.5])


def test_transforms_are_the_odometry_of_a_bag_without_odometry_topic(tmp_path):
    writer = BagWriter(tmp_path / "bag")
    for n in range(10):
        writer.static(1.0 + 0.1 * n, "odom", "base_link", Pose2D(0.1 * n, 0.0), topic="/tf")
        writer.scan(1.05 + 0.1 * n, RANGES, frame="base_link")
    writer.close()
    played = list(open_log(tmp_path / "bag").play())
    assert played[-1].wheels.pose.x == pytest.approx(0.9)
    assert sum("lidar" in item.measurements for item in played) == 10


def test_a_bag_with_scans_only_says_that_the_robot_seems_to_stand(tmp_path):
    writer = BagWriter(tmp_path / "bag")
    for n in range(3):
        writer.scan(1.0 + n, RANGES, frame="nowhere")
    writer.close()
    found = open_log(tmp_path / "bag")
    assert any("assumed at the base's origin" in note for note in found.notes)
    assert any("no odometry" in note for note in found.notes)
    assert len(list(found.play())) == 3


def test_topics_can_be_chosen(tmp_path):
    writer = BagWriter(tmp_path / "bag")
    writer.odometry(1.0, Pose2D(0.0, 0.0))
    writer.odometry(1.0, Pose2D(5.0, 0.0), topic="/visual")
    writer.scan(1.0, RANGES, topic="/front", frame="a")
    writer.scan(1.0, RANGES, topic="/back", frame="b")
    writer.close()
    found = open_log(tmp_path / "bag", Topics(("/front",), "/visual"))
    assert list(found.lidars) == ["lidar"]
    assert next(iter(found.play())).wheels.pose.x == 5.0
    both = open_log(tmp_path / "bag")
    assert list(both.lidars) == ["lidar", "front"]
    with pytest.raises(InputError, match="no such topic '/top'; it has: /back, /front"):
        open_log(tmp_path / "bag", Topics(("/top",)))


def test_wrong_bags_are_refused(tmp_path, bag):
    file = next(item for item in bag.iterdir() if item.suffix in (".mcap", ".db3"))
    cut = tmp_path / f"cut{file.suffix}"
    cut.write_bytes(file.read_bytes()[:3000])
    with pytest.raises(InputError, match=r"bag is damaged|not a ROS bag"):
        open_log(cut)
    named = tmp_path / "bag.txt"
    named.write_bytes(file.read_bytes())
    with pytest.raises(InputError, match=f"ends in {file.suffix}"):
        open_log(named)
    with pytest.raises(InputError, match="a rosbag2 folder contains"):
        open_log(tmp_path)


def test_a_bag_without_scans_and_odometry_names_its_topics(tmp_path):
    writer = BagWriter(tmp_path / "bag")
    writer.imu(1.0, 0.0)
    writer.close()
    with pytest.raises(InputError, match="no LaserScan and no Odometry messages; its topics: /imu"):
        open_log(tmp_path / "bag")

"""The arm of a simulated robot: follows, stops, grips, and tells what it touches."""

from dataclasses import astuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robots.load import HERE, read_robot
from robots.simulated import SimulatedBody
from stack.body import DEAD_MAN, BodyCommand
from stack.frames.links import RobotLinks
from stack.geometry.rotations import from_angles
from stack.sim.arm import targets_at
from stack.sim.simulation import Simulation
from stack.sim.worlds.world import Box
from stack.types import DepthImage, GripperState, Image, JointState, JointTrajectory, Pose2D, Twist
from tests.stack.sim.arm_world import (
    ARM,
    HOME,
    PANDA,
    PERIOD,
    TOP,
    bench,
    block,
    carry_out,
    grip,
    looking_down,
    motion,
    simulated,
    tool_at,
)

FETCHER = read_robot(HERE / "fetcher" / "robot.yaml")
TURNED = HOME + np.array([0.8, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0])


@pytest.fixture
def body():
    made = []

    def make(world, seed=1):
        made.append(simulated(world, seed))
        made[-1].sense()
        return made[-1]

    yield make
    for one in made:
        one.close()


def joints_of(observation):
    return observation.measurements["joints"]


@given(st.floats(-1.0, 5.0), st.floats(0.1, 3.0), st.integers(2, 6))
def test_a_trajectory_is_cubic_between_its_rows(time, seconds, rows):
    """A cubic is its own Hermite piece: positions and slopes are those of the polynomial."""
    times = np.linspace(0.0, seconds, rows)

    def at(t):
        return np.column_stack([t**3 - 2 * t, 0.5 - t**2])

    def slope(t):
        return np.column_stack([3 * t**2 - 2, -2 * t])

    found = targets_at(JointTrajectory(times, at(times), slope(times)), time)
    inside = np.clip([time], 0.0, seconds)
    assert found.positions == pytest.approx(at(inside)[0], abs=1e-9)
    if time >= seconds:
        assert not found.velocities.any()
    elif time > 0.0:
        assert found.velocities == pytest.approx(slope(inside)[0], abs=1e-9)


def test_an_arm_is_at_home_and_measures_its_joints(body):
    observation = body(bench()).sense()
    joints, gripper = joints_of(observation), observation.measurements["gripper"]
    assert isinstance(joints, JointState) and isinstance(gripper, GripperState)
    assert joints.positions == pytest.approx(HOME, abs=1e-6)
    assert (gripper.width, gripper.force, gripper.moving) == (pytest.approx(0.08), 0.0, False)
    assert observation.wheels is None


def test_an_arm_follows_a_trajectory_within_five_milliradians(body):
    robot, trajectory = body(bench()), motion(HOME, TURNED, seconds=1.5)
    seen = carry_out(robot, 2.0, trajectory=trajectory)
    for number, observation in enumerate(seen, 1):
        wanted = targets_at(trajectory, number * PERIOD).positions
        assert joints_of(observation).positions == pytest.approx(wanted, abs=5e-3)
    last = joints_of(seen[-1])
    assert last.positions == pytest.approx(TURNED, abs=1e-4)
    assert np.abs(last.velocities).max() < 1e-3
    # The motor of the fourth joint holds hand and forearm, 3 to 5 kg at 0.3 to 0.5 m.
    assert 9.0 < abs(last.efforts[3]) < 25.0


def test_a_held_arm_stops_on_its_way_and_goes_on(body):
    robot, trajectory = body(bench()), motion(HOME, TURNED)
    carry_out(robot, 1.0, trajectory=trajectory)
    held = carry_out(robot, 1.0, hold_arm=True)
    assert np.abs(joints_of(held[-1]).velocities).max() < 1e-3
    stopped = joints_of(held[-1]).positions
    share = (stopped - HOME)[[0, 3]] / (TURNED - HOME)[[0, 3]]
    assert share[0] == pytest.approx(share[1], abs=2e-3)  # still on the straight line
    assert 0.5 < share[0] < 0.95
    # From the limits: 2.175 rad/s / 4.35 rad/s² = 0.5 s to stop.
    speeds = [float(np.abs(joints_of(seen).velocities).max()) for seen in held]
    assert speeds[4] > 0.01 > speeds[10]
    after = carry_out(robot, 1.5)
    assert joints_of(after[-1]).positions == pytest.approx(TURNED, abs=1e-4)


@pytest.mark.parametrize("order", [{"stop_arm": True}, {"emergency_stop": True}])
def test_a_stopped_arm_forgets_its_trajectory(body, order):
    robot = body(bench())
    carry_out(robot, 1.0, trajectory=motion(HOME, TURNED))
    carry_out(robot, 1.0, **order)
    stopped = joints_of(carry_out(robot, 0.05)[-1]).positions
    assert joints_of(carry_out(robot, 1.0)[-1]).positions == pytest.approx(stopped, abs=1e-4)
    assert np.abs(stopped - TURNED).max() > 0.05


def test_an_emergency_stop_refuses_a_new_trajectory(body):
    robot = body(bench())
    seen = carry_out(robot, 1.0, trajectory=motion(HOME, TURNED), emergency_stop=True)
    assert joints_of(seen[-1]).positions == pytest.approx(HOME, abs=1e-4)


def test_an_arm_without_commands_stops_and_goes_on_with_the_next_one(body):
    robot = body(bench())
    robot.command(BodyCommand(trajectory=motion(HOME, TURNED)))
    robot.wait(DEAD_MAN + 0.6)
    standing = joints_of(robot.sense())
    assert np.abs(standing.velocities).max() < 1e-3
    robot.wait(1.0)
    assert joints_of(robot.sense()).positions == pytest.approx(standing.positions, abs=1e-4)
    assert joints_of(carry_out(robot, 2.0)[-1]).positions == pytest.approx(TURNED, abs=1e-4)


def test_a_grasped_block_stays_in_the_hand(body):
    robot = body(bench(block()))
    above = looking_down(0.5, 0.0, TOP + 0.15)
    there = looking_down(0.5, 0.0, TOP + 0.025, above)
    carry_out(robot, 2.2, trajectory=motion(HOME, above))
    carry_out(robot, 2.2, trajectory=motion(above, there))
    closed = grip(robot, 0.0).measurements["gripper"]
    assert closed.width == pytest.approx(0.05, abs=2e-3)  # the block is 5 cm wide
    assert closed.force == pytest.approx(40.0, abs=2.0)
    carry_out(robot, 2.2, trajectory=motion(there, above))
    carry_out(robot, 2.0)
    (x, y, z), _ = robot.blocks[0]
    assert (x, y, z) == pytest.approx((0.5, 0.0, TOP + 0.15), abs=2e-3)
    assert robot.take_events() == [] and robot.tally.by_robot == 0
    # Lifted by 12.5 cm, and drawn anew every 5 mm or once in a scene period.
    assert 10 <= robot.scene_changes <= 25
    opened = grip(robot, 0.08).measurements["gripper"]
    assert opened.width == pytest.approx(0.08, abs=1e-3) and opened.force == 0.0
    assert robot.blocks[0].position[2] == pytest.approx(TOP + 0.025, abs=3e-3)


def pose_of(robot):
    """Pose of the tool in the world."""
    q, (x, y, heading) = joints_of(robot.sense()).positions, astuple(robot.truth.pose)
    base = from_angles((x, y, 0.0), (0.0, 0.0, heading))
    links = RobotLinks(FETCHER.links, "base")
    return base @ links.pose("panda_grasptarget", dict(zip(FETCHER.arm.joints, q, strict=True)))


def finger_contacts(robot):
    """Directions of the contacts of the fingers, world frame."""
    body = robot._robot.physics
    points = body._bullet.getContactPoints(body.body, physicsClientId=body.client)
    fingers = body._arm.fingers
    return [np.array(point[7]) for point in points if point[3] in fingers]


def test_a_block_that_has_turned_with_the_robot_is_let_go():
    world, start = bench(block(x=0.4)), Pose2D(-0.25, 0.0)
    robot = SimulatedBody(FETCHER, world, start=start, seed=1)
    # The arm is 12 cm before the base, at a height of 36 cm instead of 60.
    above, there = (looking_down(0.4 + 0.13, 0.0, z + 0.24) for z in (TOP + 0.15, TOP + 0.025))
    home = FETCHER.arm.postures["home"]
    carry_out(robot, 3.2, trajectory=motion(home, above, 3.0))
    carry_out(robot, 2.2, trajectory=motion(above, there))
    grip(robot, 0.0)
    carry_out(robot, 2.2, trajectory=motion(there, above))
    for _ in range(60):  # 3 s
        robot.command(BodyCommand(Twist(0.0, 1.2)))
        robot.wait(PERIOD)
        robot.sense()
    carry_out(robot, 1.0)
    x, y = robot.truth.pose.transform(np.array([[0.65, 0.0]]))[0]
    assert robot.blocks[0].position == pytest.approx((x, y, TOP + 0.15), abs=6e-3)
    # Fingers press along their travel alone, wherever that points now.
    travel = pose_of(robot)[:3, 1]
    along = [abs(float(normal @ travel)) for normal in finger_contacts(robot)]
    assert len(along) >= 2 and min(along) > 0.98
    assert grip(robot, 0.066).measurements["gripper"].width == pytest.approx(0.066, abs=1e-3)
    assert robot.tally.by_robot == 0
    robot.close()


def test_a_contact_names_the_link_and_what_it_touches(body):
    post = Box(Pose2D(0.22, 0.22), (0.1, 0.1, 0.9), elevation=TOP, name="the post")
    robot = body(bench(walls=(post,)))
    aside = HOME + np.array([1.2, 0, 0, 0, 0, 0, 0])
    seen = carry_out(robot, 3.0, trajectory=motion(HOME, aside))
    contacts = [event for event in robot.take_events() if event.kind == "contact"]
    assert contacts and contacts[0].fields["by"].startswith("panda_link")
    assert contacts[0].fields["touched"] == "a static obstacle"
    assert robot.tally.by_robot == 1
    stopped = joints_of(seen[-1])
    assert "from where it should be" in stopped.problem
    assert np.abs(stopped.velocities).max() < 0.01
    # A new trajectory begins without the old problem.
    back = carry_out(robot, 3.0, trajectory=motion(stopped.positions, HOME))
    assert joints_of(back[-1]).problem == ""
    assert joints_of(back[-1]).positions == pytest.approx(HOME, abs=1e-3)


def test_a_run_of_an_arm_is_repeated_bit_for_bit():
    simulation = Simulation(bench(block()))
    try:
        robot = simulation.add_robot(PANDA, Pose2D(0.0, 0.0), 1)
        found = []
        for _ in range(2):
            simulation.begin()
            robot.arm.command(BodyCommand(trajectory=motion(HOME, TURNED)))
            for _ in range(20):
                robot.arm.command(BodyCommand())
                simulation.wait(robot, PERIOD)
            found.append(joints_of(robot.observation(simulation.time)))
            simulation.reset(1)
        assert found[0].positions.tobytes() == found[1].positions.tobytes()
        assert found[0].efforts.tobytes() == found[1].efforts.tobytes()
    finally:
        simulation.close()


@pytest.mark.slow
def test_a_camera_in_the_hand_is_where_the_hand_was_at_the_stamp(body):
    """Its centre ray meets the table where the kinematics say; the picture shows that distance."""
    robot = body(bench())
    robot.command(BodyCommand(trajectory=motion(HOME, TURNED), depth=True, capture=True))
    taken = {}
    for _ in range(40):
        robot.wait(PERIOD)
        observation = robot.sense()
        taken |= {(name, one.stamp): one for name, one in observation.of(DepthImage).items()}
        taken |= {(name, one.stamp): one for name, one in observation.of(Image).items()}
        robot.command(BodyCommand(depth=True, capture=True))
    hand = [one for (name, _), one in taken.items() if name == "hand"]
    assert len(hand) >= 5
    assert len({one.camera.position for one in hand}) >= 5  # it moved
    assert len({one.camera.position for (name, _), one in taken.items() if name != "hand"}) == 1
    for picture in hand:
        optical = picture.camera.base_from_optical()
        row, column = picture.depth.shape[0] // 2, picture.depth.shape[1] // 2
        near = picture.depth[row - 3 : row + 4, column - 3 : column + 4]
        depth = float(np.median(near[np.isfinite(near)]))
        height = float((optical @ [0.0, 0.0, depth, 1.0])[2])
        assert height == pytest.approx(TOP, abs=0.01)


def test_the_tool_of_home_is_before_the_base_and_looks_down():
    """Published for this posture: the flange at (0.307, 0, 0.59), the finger tips 0.1034 below."""
    pose = tool_at(HOME)
    assert pose[:3, 3] == pytest.approx((0.307, 0.0, 0.6 + 0.59 - 0.107), abs=0.02)
    assert pose[:3, 2] == pytest.approx((0.0, 0.0, -1.0), abs=2e-3)
    assert ARM.tool_link == "panda_grasptarget"

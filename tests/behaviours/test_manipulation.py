"""Behaviours of an arm: what they ask for, in which order, and how they fail."""

from dataclasses import replace
from itertools import islice
from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from py_trees.common import Status

from behaviours._arm.blocks import GAP, KnownBlock, free_places, is_on, standing
from behaviours._arm.poses import ToolPose
from behaviours.manipulation.close_gripper import CloseGripper
from behaviours.manipulation.detect_blocks import DetectBlocks
from behaviours.manipulation.home_arm import HomeArm
from behaviours.manipulation.look_at import LookAt, Point, looking_at
from behaviours.manipulation.move_arm import MoveArm
from behaviours.manipulation.open_gripper import OpenGripper
from behaviours.manipulation.pick import ELSEWHERE, LOOK, Pick
from behaviours.manipulation.place import PLACES, Place
from behaviours.testing import ScriptedRobot, halt, tick
from stack.errors import ParameterError
from stack.geometry.rotations import from_angles
from stack.types import Block, FailureCode, GraspPlan, GripperState, TaskStatus

TRAY = standing(0.55, 0.4, 0.01, 0.0), np.array([0.24, 0.20, 0.02])
BESIDE = standing(0.5, -0.1, 0.0, 0.0), np.array([0.7, 0.6, 0.02])


def block(x, y, z=0.025, colour="red", stamp=0.0, size=(0.05, 0.05, 0.05)):
    return Block(colour, standing(x, y, z, 0.0), np.array(size), np.zeros((4, 4)), stamp)


def grasp(name, at=0.0):
    pose = from_angles((0.5, -0.1, 0.02), (pi, 0.0, 0.0))
    return GraspPlan(name, np.full(7, at), pose, pose, 0.05, 0.08)


@pytest.fixture
def robot():
    robot = ScriptedRobot()
    robot.arm.boxes = {"the tray": TRAY, "the bench": BESIDE}
    robot.arm.tool_pose = from_angles((0.5, -0.1, 0.02), (pi, 0.0, 0.0))
    return robot


def fingers(robot, width, force):
    robot.gripper.state = GripperState(0.0, width, force, moving=False)


def answer(behaviour, robot, most=40):
    """Tick until the end; each task succeeds, and closing fingers hold 5 cm."""
    for _ in range(most):
        if tick(behaviour, robot) is not Status.RUNNING:
            return behaviour.status
        name, arguments = robot.calls[-1]
        if name == "move":
            is_closed = arguments["width"] == 0.0
            fingers(robot, 0.05 if is_closed else arguments["width"], 30.0 * is_closed)
        if robot.task.status is TaskStatus.RUNNING:
            robot.task.succeed()
    raise AssertionError(f"no end: {[name for name, _ in robot.calls]}")


def names(robot):
    return [name for name, _ in robot.calls]


class TestMotions:
    def test_a_posture_is_named(self, robot):
        assert answer(MoveArm(posture="home", speed=0.5), robot) is Status.SUCCESS
        assert robot.calls == [("move_to_posture", {"name": "home", "speed": 0.5})]

    def test_joints_are_passed_on(self, robot):
        tick(MoveArm(joints=[0.1] * 7), robot)
        [(name, arguments)] = robot.calls
        assert name == "move_joints" and arguments["positions"].tolist() == [0.1] * 7

    def test_a_pose_without_angles_looks_down(self, robot):
        tick(MoveArm(pose=ToolPose(x=0.5, z=0.2), straight=True), robot)
        [(name, arguments)] = robot.calls
        # roll of 180 degrees: z of the tool points along -z of the base link, y along -y
        wanted = [[1, 0, 0, 0.5], [0, -1, 0, 0], [0, 0, -1, 0.2], [0, 0, 0, 1]]
        assert name == "move_tool" and arguments["straight"]
        assert arguments["pose"] == pytest.approx(np.array(wanted), abs=1e-12)

    @given(st.tuples(*[st.floats(-3.0, 3.0)] * 3), st.tuples(*[st.floats(-1.0, 1.0)] * 3))
    def test_angles_are_those_of_urdf(self, angles, position):
        pose = ToolPose(*position, *angles)
        assert pose.matrix() == pytest.approx(from_angles(position, angles), abs=1e-12)

    @pytest.mark.parametrize("ports", [{}, {"posture": "home", "joints": [0.0] * 7}])
    def test_exactly_one_goal_is_needed(self, robot, ports):
        with pytest.raises(ParameterError, match="exactly one of posture, joints and pose"):
            tick(MoveArm(**ports), robot)

    def test_home_and_a_failure(self, robot):
        behaviour = HomeArm()
        tick(behaviour, robot)
        robot.task.fail(FailureCode.ARM_COLLISION, "panda_joint4: it is 0.20 from …")
        assert tick(behaviour, robot) is Status.FAILURE
        assert behaviour.failure.code == "ARM_COLLISION"

    def test_a_halt_cancels(self, robot):
        behaviour = HomeArm()
        tick(behaviour, robot)
        halt(behaviour)
        assert robot.task.status is TaskStatus.CANCELLED


class TestGripper:
    def test_opening_leaves_the_block(self, robot):
        robot.arm.held = block(0.5, 0.0)
        assert answer(OpenGripper(), robot) is Status.SUCCESS
        assert robot.calls == [("move", {"width": 0.08, "force": None})]
        assert robot.arm.held is None

    def test_closing_reports_the_width(self, robot):
        behaviour = CloseGripper(force=20.0)
        assert answer(behaviour, robot) is Status.SUCCESS
        assert robot.calls == [("move", {"width": 0.0, "force": 20.0})]
        assert behaviour.width == 0.05

    @pytest.mark.parametrize(("width", "force"), [(0.0005, 30.0), (0.05, 0.0)])
    def test_closing_on_nothing(self, robot, width, force):
        behaviour = CloseGripper()
        tick(behaviour, robot)
        fingers(robot, width, force)
        robot.task.succeed()
        assert tick(behaviour, robot) is Status.FAILURE
        assert behaviour.failure.code == FailureCode.MISSED


class TestDetection:
    def test_blocks_of_a_colour_are_counted_and_all_are_kept(self, robot):
        robot.seen_blocks = (block(0.6, 0), block(0.4, 0), block(0.5, 0.4, 0.045),
                             block(0.5, -0.3, colour="blue"))  # fmt: skip
        behaviour = DetectBlocks(colour="red", spare=["the tray"])
        assert tick(behaviour, robot) is Status.SUCCESS
        assert (behaviour.count, behaviour.colours) == (2, ["red", "red"])
        assert len(robot.arm.blocks) == 4

    def test_a_block_that_is_not_found_again_stays_known_until_its_place_is_empty(self, robot):
        hidden, lost = block(0.6, 0.0), block(0.5, 0.2)
        robot.arm.see([hidden, lost])
        robot.seen_blocks, robot.gone_blocks = (block(0.4, 0.0, colour="blue"),), (lost,)
        behaviour = DetectBlocks()
        assert tick(behaviour, robot) is Status.SUCCESS
        assert (behaviour.count, behaviour.colours) == (1, ["blue"])
        assert behaviour.feedback_message == "1 found: blue; 1 more known, but not seen now"
        assert [it.colour for it in robot.arm.blocks.values()] == ["red", "blue"]

    def test_a_block_on_a_box(self, robot):
        robot.seen_blocks = (block(0.6, 0), block(0.5, 0.4, 0.045, "green"))
        behaviour = DetectBlocks(on="the tray")
        assert tick(behaviour, robot) is Status.SUCCESS
        assert behaviour.colours == ["green"]
        behaviour = DetectBlocks(on="the tray", colour="red")
        assert tick(behaviour, robot) is Status.FAILURE
        assert behaviour.failure.sentence == "no red block on the tray is in sight"

    def test_old_pictures_do_not_count(self, robot):
        robot.seen_blocks = (block(0.6, 0, stamp=0.0),)
        robot.advance(1.0)
        behaviour = DetectBlocks(time=2.0)
        assert tick(behaviour, robot, 1.0) is Status.RUNNING
        robot.seen_blocks = (block(0.6, 0, stamp=robot.time),)
        assert tick(behaviour, robot) is Status.SUCCESS

    @pytest.mark.parametrize(("seen", "code"), [(None, "NO_IMAGE"), ((), "OBJECT_NOT_FOUND")])
    def test_without_pictures_or_blocks(self, robot, seen, code):
        robot.seen_blocks = seen
        behaviour = DetectBlocks(time=1.0)
        assert tick(behaviour, robot, 0.9) is Status.RUNNING
        assert tick(behaviour, robot, 0.3) is Status.FAILURE
        assert behaviour.failure.code == code


STEPS = ["plan_grasps", "move", "move_joints", "move_tool", "move", "move_tool"]
"""Of a pick: look for grasps, open, move before the block, approach, close, lift."""


class TestPick:
    def test_in_order(self, robot):
        near, far = block(0.5, -0.1), block(0.6, 0.0)
        robot.arm.see([far, near, block(0.3, 0.0, colour="blue")])
        robot.arm.grasps = (grasp("from above"),)
        behaviour = Pick(colour="red")
        assert answer(behaviour, robot) is Status.SUCCESS
        assert names(robot) == STEPS
        assert robot.calls[0][1]["block"] is near and robot.arm.held is near
        assert robot.calls[3][1]["touching"] == (near,)
        assert (behaviour.picked, behaviour.width) == ("red", 0.05)

    @pytest.mark.parametrize("off", [0.003, 0.03])
    def test_a_block_that_a_closer_look_finds_elsewhere_is_grasped_there(self, robot, off):
        shown, found = block(0.5, -0.1), block(0.5 + off, -0.1)
        robot.arm.see([shown])
        robot.arm.grasps = (grasp("from above"),)
        robot.hand_camera, robot.closer = "hand", found
        behaviour = Pick()
        tick(behaviour, robot)
        blocks = robot.arm.blocks.items()  # an arm makes new ones whenever it is asked
        robot.arm.blocks = {name: replace(known) for name, known in blocks}
        assert answer(behaviour, robot) is Status.SUCCESS
        again = ["plan_grasps", "move", "move_joints"] if off > ELSEWHERE else []
        assert names(robot) == [*again, *STEPS]
        planned = [given["block"] for name, given in robot.calls if name == "plan_grasps"]
        assert planned[-1] is (found if off > ELSEWHERE else shown)

    def test_a_block_with_a_neighbour_is_not_looked_at_again(self, robot):
        """The neighbour could be taken for it: the look does not tell colours."""
        robot.arm.see([block(0.5, -0.1), block(0.56, -0.1, colour="green")])
        robot.arm.grasps = (grasp("from above"),)
        robot.hand_camera, robot.closer = "hand", block(0.56, -0.1)
        assert answer(Pick(colour="red"), robot) is Status.SUCCESS
        assert names(robot) == STEPS

    def test_without_a_closer_picture_the_grasp_goes_on(self, robot):
        robot.arm.see([block(0.5, -0.1)])
        robot.arm.grasps = (grasp("from above"),)
        robot.hand_camera = "hand"
        behaviour = Pick()
        tick(behaviour, robot)
        for _ in range(2):
            robot.task.succeed()
            tick(behaviour, robot)
        assert behaviour.feedback_message == "looking closer"
        tick(behaviour, robot, LOOK + 0.1)
        assert names(robot)[-1] == "move_tool"

    def test_blocks_on_a_spared_box_are_left_alone(self, robot):
        robot.arm.see([block(0.55, 0.4, 0.045)])
        behaviour = Pick(spare=["the tray"])
        assert tick(behaviour, robot) is Status.FAILURE
        assert behaviour.failure.code == FailureCode.OBJECT_NOT_FOUND
        assert not robot.calls

    def test_at_a_known_place(self, robot):
        robot.arm.grasps = (grasp("from above"),)
        assert answer(Pick(at=KnownBlock(x=0.5, y=-0.1, z=0.025)), robot) is Status.SUCCESS
        assert robot.calls[0][1]["block"].pose[:3, 3].tolist() == [0.5, -0.1, 0.025]

    def test_the_next_grasp_is_tried_when_the_first_has_no_free_way(self, robot):
        robot.arm.grasps = (grasp("one", 0.1), grasp("two", 0.2))
        robot.arm.see([block(0.5, -0.1)])
        behaviour = Pick()
        tick(behaviour, robot)
        robot.task.succeed()  # the fingers are open
        tick(behaviour, robot)
        robot.task.fail(FailureCode.NO_MOTION_PLAN, "no path")
        assert answer(behaviour, robot) is Status.SUCCESS
        tried = [given["positions"][0] for name, given in robot.calls if name == "move_joints"]
        assert tried == [0.1, 0.2]

    def test_no_grasp_of_any_block(self, robot):
        robot.arm.see([block(0.5, -0.1), block(0.6, 0.0)])
        behaviour = Pick()
        assert answer(behaviour, robot) is Status.FAILURE
        assert behaviour.failure.code == FailureCode.NO_MOTION_PLAN
        assert names(robot) == ["plan_grasps", "plan_grasps"]

    def test_a_collision_ends_it(self, robot):
        robot.arm.see([block(0.5, -0.1)])
        robot.arm.grasps = (grasp("one"), grasp("two"))
        behaviour = Pick()
        tick(behaviour, robot)
        robot.task.succeed()
        tick(behaviour, robot)
        robot.task.fail(FailureCode.ARM_COLLISION, "stopped")
        assert tick(behaviour, robot) is Status.FAILURE
        assert behaviour.failure.code == "ARM_COLLISION"

    def carried_out(self, robot, steps):
        """A pick after so many of its steps, and the state of the fingers as after the last."""
        robot.arm.see([block(0.5, -0.1)])
        robot.arm.grasps = (grasp("one"),)
        behaviour = Pick()
        tick(behaviour, robot)
        for _ in range(steps):
            robot.task.succeed()
            tick(behaviour, robot)
        return behaviour

    def test_missed(self, robot):
        behaviour = self.carried_out(robot, 3)
        fingers(robot, 0.0, 40.0)
        robot.task.succeed()
        assert tick(behaviour, robot) is Status.FAILURE
        assert behaviour.failure.code == FailureCode.MISSED
        assert robot.arm.held is None and not robot.arm.blocks, "it is not there"

    def test_slipped(self, robot):
        behaviour = self.carried_out(robot, 3)
        fingers(robot, 0.05, 30.0)
        robot.task.succeed()
        assert tick(behaviour, robot) is Status.RUNNING
        assert robot.arm.held is not None
        fingers(robot, 0.0, 40.0)
        robot.task.succeed()
        assert tick(behaviour, robot) is Status.FAILURE
        assert behaviour.failure.code == FailureCode.SLIPPED
        assert robot.arm.held is None


PLACED = ["plan_place", "follow", "move_tool", "move", "move_tool"]
"""Steps of a place: look for one, above, down, open, up."""


class TestPlace:
    def test_on_a_box(self, robot):
        robot.arm.held = block(0.5, -0.1, 0.025)
        fingers(robot, 0.05, 30.0)
        assert answer(Place(on="the tray"), robot) is Status.SUCCESS
        assert names(robot) == PLACED
        down, up = (given for name, given in robot.calls if name == "move_tool")
        # The tool is 5 mm below the middle of the block; tray 2 cm, half a block, 4 mm of drop.
        assert down["pose"][:3, 3] == pytest.approx([0.55, 0.40, 0.02 + 0.025 + 0.004 - 0.005])
        assert up["pose"][2, 3] - down["pose"][2, 3] == pytest.approx(0.1)
        assert down["straight"] and up["straight"]
        wide = [robot.calls[step][1]["width"] for step in (0, 2, 3)]
        assert wide == pytest.approx([0.066] * 3)  # 8 mm more on each side
        assert robot.arm.held is None

    def test_on_a_block(self, robot):
        robot.arm.see([block(0.6, 0.1, 0.025, "green", size=(0.05, 0.05, 0.05))])
        robot.arm.held = block(0.5, -0.1, 0.025)
        fingers(robot, 0.05, 30.0)
        assert answer(Place(block="green"), robot) is Status.SUCCESS
        down = robot.calls[2][1]["pose"]
        assert down[:3, 3] == pytest.approx([0.6, 0.1, 0.05 + 0.025 + 0.004 - 0.005])

    def test_the_first_free_place_is_taken_and_other_turns_are_among_them(self, robot):
        robot.arm.held = block(0.5, -0.1)
        fingers(robot, 0.05, 30.0)
        robot.arm.free_place = 1
        assert answer(Place(on="the tray"), robot) is Status.SUCCESS
        first, second, *_ = robot.calls[0][1]["tools"]
        assert second[:3, :3] == pytest.approx(
            from_angles((0, 0, 0), (0, 0, pi / 2))[:3, :3] @ first[:3, :3], abs=1e-12
        )
        assert robot.calls[2][1]["pose"] is second and robot.arm.held is None

    def test_no_place_to_which_the_arm_comes(self, robot):
        robot.arm.held = block(0.5, -0.1)
        fingers(robot, 0.05, 30.0)
        robot.arm.free_place = PLACES
        behaviour = Place(on="the tray")
        assert answer(behaviour, robot) is Status.FAILURE
        assert behaviour.failure.code == FailureCode.NO_MOTION_PLAN
        assert names(robot) == ["plan_place"] and robot.arm.held is not None

    @pytest.mark.parametrize("steps", [1, 2])
    def test_a_block_that_is_lost_on_the_way(self, robot, steps):
        """After so many steps of a place: before it looks for one, and above it."""
        robot.arm.held = block(0.5, -0.1)
        fingers(robot, 0.05, 30.0 if steps > 1 else 0.0)
        behaviour = Place(on="the tray")
        tick(behaviour, robot)
        fingers(robot, 0.0, 40.0)
        if steps > 1:
            robot.task.succeed()
            tick(behaviour, robot)
        assert behaviour.failure.code == FailureCode.SLIPPED
        assert robot.arm.held is None

    def test_an_empty_hand(self, robot):
        behaviour = Place(on="the tray")
        assert tick(behaviour, robot) is Status.FAILURE
        assert behaviour.failure.code == FailureCode.MISSED

    def test_a_block_to_put_it_on_that_was_not_detected(self, robot):
        robot.arm.held = block(0.5, -0.1)
        behaviour = Place(block="green")
        assert tick(behaviour, robot) is Status.FAILURE
        assert behaviour.failure.code == FailureCode.OBJECT_NOT_FOUND

    def test_one_place_is_needed(self, robot):
        with pytest.raises(ParameterError, match="exactly one of on, block and pose"):
            tick(Place(), robot)


@settings(deadline=None, max_examples=30)
@given(
    st.floats(-pi, pi), st.floats(0.06, 0.4), st.floats(0.06, 0.4),
    st.lists(st.tuples(st.floats(0.2, 0.8), st.floats(-0.4, 0.4)), max_size=4),
)  # fmt: skip
def test_free_places_are_on_the_box_and_apart(yaw, length, width, others):
    box = standing(0.5, 0.0, 0.1, yaw), np.array([length, width, 0.02])
    placed = block(0.0, 0.0)
    standing_there = [block(x, y, 0.135) for x, y in others]
    for x, y, z, turned in islice(free_places(box, placed, standing_there), 20):
        assert z == pytest.approx(0.11)
        assert is_on(block(x, y, z + 0.025), box)
        assert (turned - yaw + pi / 4) % (pi / 2) == pytest.approx(pi / 4)
        for other in standing_there:
            # The sides of two blocks of 5 cm are apart, and so are their middles by 5 cm more.
            assert np.hypot(*(other.pose[:2, 3] - (x, y))) > 0.05 + GAP


def test_three_long_blocks_fit_side_by_side():
    """Blocks of 8 x 3 cm, 8 cm from middle to middle, need 19 cm; circles around them 31 cm."""
    box = standing(0.5, 0.0, 0.1, 0.3), np.array([0.12, 0.20, 0.02])
    placed, there = block(0.0, 0.0, size=(0.08, 0.03, 0.04)), []
    for _ in range(3):
        x, y, z, yaw = next(iter(free_places(box, placed, there)))
        pose = standing(x, y, z + 0.02, yaw)
        there.append(replace(placed, pose=pose))
    assert not list(free_places(box, placed, there))


def test_the_middle_is_taken_first():
    places = list(free_places(TRAY, block(0.0, 0.0), []))
    assert places[0] == pytest.approx((0.55, 0.4, 0.02, 0.0))
    apart = [np.hypot(x - 0.55, y - 0.4) for x, y, _, _ in places]
    assert np.diff(apart).min() > -1e-9


angles = st.floats(-3.0, 3.0)


@given(
    st.tuples(*[st.floats(-1.0, 1.0)] * 3), st.floats(0.1, 1.0), angles, st.floats(-1.5, 1.5),
    angles,
)  # fmt: skip
def test_the_point_is_in_the_middle_of_the_picture(target, distance, azimuth, elevation, roll):
    view = looking_at(np.array(target), distance, azimuth, elevation, roll)
    assert np.linalg.det(view[:3, :3]) == pytest.approx(1.0)
    seen = np.linalg.inv(view) @ np.array([*target, 1.0])
    assert seen[:3] == pytest.approx((0.0, 0.0, distance), abs=1e-9)
    upright = np.linalg.inv(looking_at(np.array(target), distance, azimuth, elevation, 0.0))
    x, y = (upright @ np.array([*target[:2], target[2] + 0.1, 1.0]))[:2]
    assert x == pytest.approx(0.0, abs=1e-9) and y <= 0.0, "what is higher is higher in it"


class TestLookAt:
    def test_at_a_block_with_a_camera_beside_the_tool(self, robot):
        robot.arm.camera_in_tool = from_angles((0.06, 0.0, -0.08), (0.0, 0.0, 0.0))
        robot.arm.see([block(0.5, -0.1)])
        assert answer(LookAt(block="red", distance=0.3, elevation=pi / 2), robot) is Status.SUCCESS
        [(name, given)] = robot.calls
        eye = given["pose"] @ robot.arm.camera_in_tool
        assert name == "move_tool" and not given["straight"]
        assert eye[:3, 3] == pytest.approx((0.5, -0.1, 0.025 + 0.3))
        assert eye[:3, 2] == pytest.approx((0.0, 0.0, -1.0))

    def test_the_camera_is_on_the_side_of_the_arm(self, robot):
        tick(LookAt(point=Point(x=1.0, z=0.3), distance=0.5, elevation=0.0), robot)
        [(_, given)] = robot.calls
        assert given["pose"][:3, 3] == pytest.approx((0.5, 0.0, 0.3))
        assert given["pose"][:3, 2] == pytest.approx((1.0, 0.0, 0.0))

    def test_other_turns_are_tried_unless_one_is_wanted(self, robot):
        for roll, tried in ((None, 4), (0.0, 1)):
            robot.calls.clear()
            behaviour = LookAt(point=Point(x=0.5), roll=roll)
            while tick(behaviour, robot) is Status.RUNNING:
                robot.task.fail(FailureCode.UNREACHABLE, "out of reach")
            assert behaviour.failure.code == FailureCode.UNREACHABLE
            assert len(robot.calls) == tried

    def test_without_a_block_or_a_camera(self, robot):
        behaviour = LookAt(block="red")
        assert tick(behaviour, robot) is Status.FAILURE
        assert behaviour.failure.code == FailureCode.OBJECT_NOT_FOUND
        robot.arm.camera_in_tool = None
        behaviour = LookAt(point=Point())
        assert tick(behaviour, robot) is Status.FAILURE
        assert behaviour.failure.code == FailureCode.UNSUPPORTED
        with pytest.raises(ParameterError, match="exactly one of point and block"):
            tick(LookAt(), robot)

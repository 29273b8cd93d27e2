"""The public interface: its names, what they cost and what type checkers see of them."""

from __future__ import annotations

import inspect
import subprocess
import sys
import typing
from pathlib import Path

import pytest

import treepilot
import treepilot.testing
from behaviours.scaffold import new_behaviour
from missions.inspection.component_scaffold import KINDS, new_component
from treepilot.shadowing import PACKAGES

ROOT = Path(__file__).parents[2]

NAMES = """
    Arm Assignments AsyncConnection Base Battery Behaviour Block Body BodyCommand BodyError
    BodyHealth BodyKind BodySetup Box CancelToken Canvas CommandRefused Connection ContactZone
    ControlState Controller CostGrid CostmapFrame CostmapLayer CoveragePlan
    DEFAULT_PLAN_OPTIONS DRIVE_FAILURES DepthImage Detection DriveState Estimator Event
    Expression FREE FREE_COST Failure FailureCode FloatArray FloorLines Footprint Frontier
    GoalChecker GoalTolerance Gripper GripperCommand GripperState INSCRIBED_COST Image Imu
    InputError
    JointState JointTrajectory LETHAL_COST Lack LayerUpdate
    Localisation Map Marker MarkerFix MarkerObservation MarkerSighting Match MissionState
    NO_BOX NavigationError OCCUPIED Observation OccupancyGrid Odometry OdometryFusion
    ParameterError Path PathSegment Perception PlaceSighting PlanOptions Planner PointCloud
    Pose2D PoseEstimate Posed ProgressChecker RangeReading Region Report RivalPose Robot
    RobotDescription RunInfo STANDSTILL Scan Snapshot SnapshotRecording StandingObject
    Status StopCriterion Task TaskStatus TelemetryError Timer Timers TrackedObject
    TransformBuffer TreepilotError Twist UNKNOWN UNKNOWN_COST View __api__ connect
    connect_async output parameter port run run_together stream wrap_angle
"""
"""A name that is removed or changes its meaning breaks plugins: count `__api__` up."""

NAMES_FOR_TESTS = """
    PathFollower ScriptedBody ScriptedRobot ScriptedTask choose_component describe_robot halt
    make_behaviour pause scans_of tick
"""

INTERNAL = {"PlannedFault", "Declaration", "RunHandle", "World"}
"""Of signatures; a plugin only passes them on."""


def test_the_names_are_frozen():
    assert treepilot.__api__ == 1
    assert sorted(treepilot.__all__) == NAMES.split()
    assert sorted(treepilot.testing.__all__) == NAMES_FOR_TESTS.split()
    assert dir(treepilot) == NAMES.split()


@pytest.mark.parametrize("module", [treepilot, treepilot.testing], ids=lambda it: it.__name__)
def test_each_name_is_the_one_of_its_module(module):
    for name in module.__all__:
        item = getattr(module, name)
        if inspect.isclass(item) or inspect.isfunction(item):
            assert getattr(sys.modules[item.__module__], item.__name__) is item


def test_plugins_with_the_old_imports_have_the_same_classes():
    from behaviours.base import RobotBehaviour, output, port
    from stack.costmap.layer import Frame, Layer

    assert (treepilot.Behaviour, treepilot.output, treepilot.port) == (RobotBehaviour, output, port)
    assert (treepilot.CostmapLayer, treepilot.CostmapFrame) == (Layer, Frame)


def test_an_unknown_name_is_an_error_with_a_hint():
    with pytest.raises(AttributeError, match="treepilot has no 'Pose'") as caught:
        treepilot.Pose  # noqa: B018
    assert (caught.value.name, caught.value.obj) == ("Pose", treepilot)  # Python adds the hint


def test_the_import_loads_nothing_until_a_name_is_used():
    code = (
        "import sys; before = {*sys.modules}; import treepilot; new = {*sys.modules} - before;"
        "print(*(name for name in new if name.partition('.')[0] not in sys.stdlib_module_names))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert set(done.stdout.split()) == {"treepilot", "treepilot.shadowing"}


def test_the_names_load_no_library_but_those_of_a_check():
    heavy = "numba cv2 pybullet gtsam rerun textual zmq msgpack typer trimesh pymavlink".split()
    code = (
        "import sys, treepilot, treepilot.testing; treepilot.run;"
        f"print(*({{*{heavy}}} & {{*sys.modules}}))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == []


def classes_in(hint: object) -> set[type]:
    """Our classes in a type hint."""
    inner = {found for part in typing.get_args(hint) for found in classes_in(part)}
    ours = isinstance(hint, type) and hint.__module__.partition(".")[0] in PACKAGES
    return {hint, *inner} if ours else inner


def signature_classes(cls: type) -> set[type]:
    """Our classes in the signatures of the public methods and properties of a class."""
    members = [
        member.fget if isinstance(member, property) else getattr(member, "__func__", member)
        for owner in cls.__mro__
        if owner.__module__.partition(".")[0] in PACKAGES
        for name, member in vars(owner).items()
        if not name.startswith("_") or name == "__init__"
    ]
    return {
        found
        for member in members
        if inspect.isfunction(member)
        for hint in typing.get_type_hints(member).values()
        for found in classes_in(hint)
    }


@pytest.mark.parametrize(
    "base",
    [
        "Behaviour", "Robot", "Base", "Localisation", "Map", "Perception", "Task", "Planner",
        "Controller", "GoalChecker", "ProgressChecker", "Estimator", "OdometryFusion",
        "CostmapLayer", "Body", "BodyKind", "BodySetup", "Connection",
    ],
)  # fmt: skip
def test_what_a_base_class_hands_out_can_be_imported_too(base):
    public = {id(getattr(treepilot, name)) for name in treepilot.__all__}
    missing = {
        cls.__name__ for cls in signature_classes(getattr(treepilot, base)) if id(cls) not in public
    }
    assert missing - INTERNAL == set()


TYPED = """
from treepilot import Behaviour, CostmapFrame, Pose2D, Status, port, run
from treepilot.testing import ScriptedRobot

class Wait(Behaviour):
    goal: Pose2D = port("where")

    def update(self) -> Status:
        reveal_type(self.robot.localisation.pose)
        return Status.SUCCESS

reveal_type(run("a").status)
reveal_type(ScriptedRobot().pose)
reveal_type(CostmapFrame((1, 1), 0.1, (0.0, 0.0)).cell_at(Pose2D(0.0, 0.0)))
Wait(goal=3)
"""


@pytest.mark.slow
def test_type_checkers_see_the_names_and_templates_are_typed(tmp_path):
    new_behaviour("my_own", tmp_path)
    for kind in KINDS:
        new_component(kind, f"my_{kind}", tmp_path)
    for test in tmp_path.glob("test_*"):
        test.unlink()
    (tmp_path / "typed.py").write_text(TYPED)
    (tmp_path / "unknown.py").write_text("from treepilot import Nothing\n")
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--follow-imports=silent", *tmp_path.iterdir()],
        cwd=tmp_path, capture_output=True, text=True, check=False, env={"MYPYPATH": str(ROOT)},
    )  # fmt: skip
    *lines, last = done.stdout.splitlines()
    pose = "stack.types.geometry.Pose2D"
    assert {
        f'note: Revealed type is "{pose}"',
        'note: Revealed type is "str"',
        'note: Revealed type is "tuple[int, int]"',
        'error: Argument "goal" to "Wait" has incompatible type "int"; expected "Pose2D"'
        "  [arg-type]",
        'error: Module "treepilot" has no attribute "Nothing"  [attr-defined]',
    } == {line.partition(": ")[2] for line in lines}
    assert last.startswith("Found 2 errors in 2 files")


def test_a_connection_has_the_members_of_the_asynchronous_one():
    waiting, blocking = (
        {name: member for name, member in vars(kind).items() if not name.startswith("_")}
        for kind in (treepilot.AsyncConnection, treepilot.Connection)
    )
    assert sorted(blocking) == sorted(waiting)
    for name, member in blocking.items():
        assert member.__doc__ == waiting[name].__doc__
        assert not inspect.iscoroutinefunction(member)

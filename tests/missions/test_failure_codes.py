"""Every failure code, reached by a whole mission in the simulation."""

from __future__ import annotations

from pathlib import Path

import pytest

from missions.execution.prepare import RunOptions
from missions.execution.running import run_mission
from stack.types import FailureCode

HEAD = "mission: a\nrobot: {robot}\nworld: {world}\n"
FAILING = """
from py_trees.behaviour import Behaviour
from py_trees.common import Status

class Refuses(Behaviour):
    def update(self):
        return Status.FAILURE
"""
BROKEN = """
from py_trees.common import Status
from behaviours.base import RobotBehaviour

class FallOver(RobotBehaviour):
    \"\"\"Break.\"\"\"
    def initialise(self) -> None:
        raise RuntimeError("its knees gave in")
    def update(self) -> Status:
        return Status.RUNNING
"""

TRUSTING = "localisation: {use: mcl, lost_health: 0, recover: false}\n"

COMPUTED = (
    "blackboard: {{goal: {{type: Pose, optional: true}}}}\n"
    "run: {{sequence: [{{set: {{goal: {goal}}}}}, {{navigate_to_pose: $goal}}]}}"
)
"""A drive to a goal that `check` does not know."""

CASES: dict[FailureCode, tuple[str, str]] = {
    FailureCode.NO_VALID_PATH: (
        "small_room",
        "navigation: {costmap: {layers: [static, obstacle, {use: keepout, inflated: false, zones: "
        "[[[4.0, 3.0], [4.3, 3.0], [4.3, 5.0], [4.0, 5.0]], [[4.0, 3.0], [6.0, 3.0], [6.0, 3.3], "
        "[4.0, 3.3]]]}]}}\n"
        "run: {navigate_to_pose: {goal: $window}}",
    ),
    FailureCode.START_OCCUPIED: (
        "small_room",
        TRUSTING + "initial_pose: [3.4, 1.2]\nrun: {navigate_to_pose: {goal: $window}}",
    ),
    FailureCode.GOAL_OCCUPIED: ("small_room", COMPUTED.format(goal="[3.4, 1.2]")),
    FailureCode.START_OUTSIDE_MAP: (
        "small_room", TRUSTING + "initial_pose: [30, 1]\nrun: {navigate_to_pose: {goal: $window}}",
    ),
    FailureCode.GOAL_OUTSIDE_MAP: ("small_room", COMPUTED.format(goal="[60, 1]")),
    FailureCode.NO_PROGRESS: (
        "small_room",
        "navigation: {safety: {top_speed: 0.005}}\nrun: {navigate_to_pose: {goal: $window}}",
    ),
    FailureCode.COLLISION_AHEAD: ("small_room", "run: {back_up: {distance: 2 m}}"),
    FailureCode.LOST: (
        "twin_rooms", "localisation: {use: mcl, recover: false}\n"
        "initial_pose: [4.0, 3.0, 90 deg]\nrun: {navigate_to_pose: {goal: [1, 1]}}",
    ),
    FailureCode.BLOCKED_BY_PERSON: (
        "passage.yaml", "navigation: {navigator: {person_patience: 4 s}}\n"
        "run: {navigate_to_pose: {goal: [11, 0.45]}}",
    ),
    FailureCode.TIMED_OUT: (
        "small_room", "run: {navigate_to_pose: {goal: $window}, timeout: 1 s}",
    ),
    FailureCode.AMBIGUOUS: ("twin_rooms", "initial_pose: unknown\nrun: localise_globally"),
    FailureCode.NO_WALL: (
        "hall.yaml", "run: {wall_follow: {side: left, distance: 0.4 m, until_travelled: 2 m}}",
    ),
    FailureCode.NO_LINE: ("small_room", "run: follow_line"),
    FailureCode.OBJECT_NOT_FOUND: ("block.yaml", "run: {find_object: {colour: green}}"),
    FailureCode.PERSON_LOST: (
        "small_room", "run: {follow_person: {patience: 2 s, until_time: 9 s}}",
    ),
    FailureCode.MARKER_NOT_FOUND: ("small_room", "run: {detect_markers: {wanted: [49]}}"),
    FailureCode.DOOR_CLOSED: (
        "small_room", "run: {wait_for_door: {door: [0, 2.5, 180 deg], patience: 2 s}}",
    ),
    FailureCode.BAD_IMAGE: (
        "small_room", "run: {inspect: {min_sharpness: 1.0, retakes: 1}}",
    ),
    FailureCode.DOCK_NOT_FOUND: (
        "hall.yaml", "run: {dock: {dock: [13.0, 15.0, 0 deg], tries: 1}}",
    ),
    FailureCode.NOT_CHARGING: (
        "block.yaml", "run: {dock: {dock: [0.25, 2.0, 0 deg], tries: 1}}",
    ),
    FailureCode.NO_IMAGE: ("small_room", "run: {take_photo: {}}"),
    FailureCode.CHECK_FAILED: ("small_room", "run: {check: battery.charge < 0.1}"),
    FailureCode.EXCEPTION: ("small_room", "plugins: [./plugins]\nrun: fall_over"),
    FailureCode.UNSUPPORTED: ("car_park", "run: {spin: {angle: 90 deg}}"),
    FailureCode.FAILED: ("small_room", "plugins: [refusing]\nrun: {refusing.Refuses: {}}"),
}  # fmt: skip
"""CANCELLED is missing: a mission's own tree never sees it, for what it cancels it has left."""

WORLDS = {
    "hall.yaml": "world: hall\nbounds: [-1, -1, 31, 31]\nstart: [15.0, 15.0, 0 deg]\n"
    "walls: [{points: [[0, 0], [30, 0], [30, 30], [0, 30]], closed: true}]\n",
    "block.yaml": "world: block\nbounds: [-1, -1, 5, 5]\nstart: [2.0, 2.0, 180 deg]\n"
    "walls: [{points: [[0, 0], [4, 0], [4, 4], [0, 4]], closed: true}]\n"
    "boxes: [{at: [0.1, 2.0], size: [0.1, 0.4, 0.4]}, {at: [0.2, 2.14], size: [0.1, 0.12, 0.4]},"
    " {at: [0.2, 1.86], size: [0.1, 0.12, 0.4]}]\n",
    "passage.yaml": "world: passage\nbounds: [-1, -1, 13, 2]\nstart: [1, 0.45, 0 deg]\n"
    "walls: [{points: [[0, 0], [12, 0], [12, 0.9], [0, 0.9]], closed: true}]\n"
    "people: [{name: Ada, waypoints: [[9, 0.45], [0.5, 0.45]], speed: 0.7 m/s}]\n",
}


def mission_for(code: FailureCode, folder: Path) -> Path:
    world, rest = CASES[code]
    for name, text in WORLDS.items():
        (folder / name).write_text(text, "utf-8")
    (folder / "plugins").mkdir()
    (folder / "plugins" / "fall_over.py").write_text(BROKEN, "utf-8")
    (folder / "refusing.py").write_text(FAILING, "utf-8")
    path = folder / "mission.yaml"
    robot = "buggy" if code is FailureCode.UNSUPPORTED else "scout"
    head = HEAD.format(robot=robot, world=world if "." not in world else f"./{world}")
    path.write_text(f"{head}{rest}\n", "utf-8")
    return path


@pytest.mark.parametrize("code", list(CASES), ids=str)
def test_the_code_is_reached_and_said(
    code: FailureCode, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(tmp_path))
    blind = code in (FailureCode.NO_IMAGE, FailureCode.AMBIGUOUS)
    options = RunOptions(serve=False, camera="off" if blind else "asked")
    report = run_mission(mission_for(code, tmp_path), options)
    assert report.status == "failure"
    assert f"{code}:" in report.reason or f"{code} " in report.reason, report.reason
    assert report.collisions == 0


VALUES = {
    FailureCode.NOT_SET, FailureCode.DIVISION_BY_ZERO, FailureCode.OVERFLOW,
    FailureCode.OUT_OF_RANGE,
}  # fmt: skip
"""Codes of expressions; they need no simulation (tests/missions/trees/test_port_expressions.py)."""


ARM = {
    FailureCode.UNREACHABLE, FailureCode.NO_MOTION_PLAN, FailureCode.ARM_COLLISION,
    FailureCode.MISSED, FailureCode.SLIPPED,
}  # fmt: skip
"""Of an arm: see tests/missions/execution/test_picking.py and test_manipulation.py."""


def test_no_code_is_forgotten() -> None:
    assert set(FailureCode) - set(CASES) == {FailureCode.CANCELLED, *VALUES, *ARM}

"""Missions in which an arm plans its motions, picks and places: the whole line, in simulation."""

import numpy as np
import pytest

import treepilot
from missions.execution.prepare import RunOptions, diagnose
from robots.load import HERE
from stack import optional_packages
from stack.telemetry.records import MissionState
from stack.types import JointState
from tests.stack.telemetry.rerun_recording import drawn, rows_by_entity

HEAD = "mission: arm\nrobot: panda_table\nworld: bench_top\n"
RED = "{x: 50 cm, y: -10 cm, z: 25 mm}"
"""Of the world file: at [0.50, -0.10], 5 cm high, on a table at the height of the arm's mount."""


@pytest.fixture
def live(tmp_path, live_run):
    return lambda text, head=HEAD: live_run(tmp_path, text, head=head)


def ended(run):
    run.until("mission_ended", within=2000)
    return run.runtime.state is MissionState.SUCCESS, run.runtime.reason


def joints(run):
    return run.runtime.perceived.newest("joints", JointState)


def test_a_block_is_picked_and_placed(live):
    run = live(f"run: {{sequence: [pick: {{at: {RED}}}, place: {{on: the tray}}]}}\n")
    assert ended(run) == (True, "")
    red, green, _ = run.engine.simulation.blocks
    # The middle of the tray, whose top is 2 cm above the bench of 60 cm; half a block on it.
    assert red.position == pytest.approx((0.55, 0.40, 0.645), abs=3e-3)
    assert green.position[:2] == pytest.approx((0.60, 0.12), abs=1e-3)
    assert run.snapshot.counters["collisions"] == 0
    [known] = run.runtime.parts.robot.arm.blocks.values()
    assert known.pose[:3, 3] == pytest.approx((0.55, 0.40, 0.045), abs=8e-3)


def test_displays_show_links_way_grasps_and_what_is_around(live, tmp_path):
    run = live(f"run: {{pick: {{at: {RED}}}}}\n")
    shown = []
    while not run.runtime.state.is_over:
        run.steps(1)
        shown.append(run.snapshot)
    arms = [snapshot.arm for snapshot in shown if snapshot.arm is not None]
    for arm in arms:
        assert arm.links[-1] == pytest.approx(arm.tool[:3, 3])
    # The arm stands on a column of 60 cm, as high as the bench.
    assert arms[0].links[0] == pytest.approx((0.0, 0.0, 0.6), abs=1e-6)
    first = next(number for number, arm in enumerate(arms) if len(arm.way))
    end = next(arm for arm in arms[first:] if not len(arm.way))  # at rest after the motion
    assert arms[first].way[-1] == pytest.approx(end.tool[:3, 3], abs=5e-3)
    grasped = next(number for number, arm in enumerate(arms) if arm.held is not None)
    assert not len(arms[grasped].grasps)
    best = next(arm.grasps[0] for arm in reversed(arms[:grasped]) if len(arm.grasps))
    assert best[:2, 3] == pytest.approx((0.50, -0.10), abs=5e-3)  # where the block is, base frame
    assert arms[-1].held.pose[:3, 3] == pytest.approx(arms[-1].tool[:3, 3], abs=0.03)
    boxes, *_ = (snapshot.layers["around_arm"].content for snapshot in shown)
    assert any(box.pose.x == pytest.approx(0.55) and box.lift > 0.5 for box in boxes)  # the tray
    rows = rows_by_entity(drawn(tmp_path / "drawn", run.telemetry.info, shown[::4]))
    assert rows["/world/joints/panda_joint1"] > 3 and rows["/world/joints/held"] > 3
    assert rows["/world/tool_way"] >= 3 and rows["/world/grasps"] >= 2
    assert rows["/world/around_arm/boxes"] >= 2 and rows["/plots/joints"] > 10


@pytest.mark.parametrize(
    ("leaf", "reason"),
    [
        ("pick: {at: {x: 45 cm, y: 5 cm, z: 25 mm}}", "MISSED the fingers closed on nothing"),
        (
            "pick: {at: {x: 50 cm, z: 45 mm, length: 9 cm, width: 9 cm, height: 9 cm}}",
            "NO_MOTION_PLAN no grasp of red block: 20 wider than the gripper opens (80 mm)",
        ),
        (
            "pick: {at: {x: 1.2 m, z: 25 mm}}",
            "NO_MOTION_PLAN no grasp of red block: 20 out of reach",
        ),
        ("move_arm: {pose: {x: 2 m, z: 20 cm}}", "UNREACHABLE the arm cannot reach (2.000, 0.000"),
        ("move_arm: {pose: {x: 50 cm, z: -1 cm}}", "GOAL_OCCUPIED at the goal: panda_"),
        ("place: {on: the tray}", "MISSED the hand holds no block"),
    ],
)
def test_what_fails_says_why(live, leaf, reason):
    done, found = ended(live(f"run: {{{leaf}}}\n"))
    assert not done and reason in found


@pytest.mark.parametrize(
    ("leaf", "sentence", "hint"),
    [
        ("move_arm: {posture: hom}", "posture: panda_table has no posture 'hom'", "'home'"),
        ("place: {on: a tray}", "on: the world bench_top has no box 'a tray'", "'the tray'"),
        (
            "move_arm: {joints: [0, 0]}", "joints: panda_table has 7 joints, got 2 positions",
            "panda_joint1",
        ),
        (
            "move_arm: {joints: [3, 0, 0, -1, 0, 1, 0]}",
            "joints: panda_joint1 would be at 3 rad", "-2.9671 and 2.9671",
        ),
        ("pick: {spare: [tray]}", "spare: the world bench_top has no box 'tray'", "'the tray'"),
        ("place: {}", "place needs exactly one of on, block, pose; it has 0", "place: {on: …}"),
        (
            "move_arm: {posture: home, joints: [0]}",
            "move_arm needs exactly one of posture, joints, pose; it has 2", "",
        ),
    ],
)  # fmt: skip
def test_names_and_goals_are_checked_before_anything_moves(tmp_path, leaf, sentence, hint):
    file = tmp_path / "m.yaml"
    file.write_text(f"{HEAD}run: {{{leaf}}}\n")
    [found] = diagnose(file, RunOptions()).findings
    assert (found.code, found.sentence) == ("E132", sentence)
    assert hint in found.hint


def test_parts_of_a_robot_that_are_not_shared_may_be_used_at_once(tmp_path):
    file = tmp_path / "m.yaml"
    for node in ("open_gripper", "spin", "detect_blocks"):
        file.write_text(f"{HEAD}run: {{parallel: [{{home_arm: {{}}}}, {{{node}: {{}}}}]}}\n")
        codes = {item.code for item in diagnose(file, RunOptions()).findings}
        assert not codes & {"E162", "W105"}
    file.write_text(f"{HEAD}run: {{parallel: [{{pick: {{}}}}, {{place: {{on: a}}}}]}}\n")
    [found] = [it for it in diagnose(file, RunOptions()).findings if it.code == "E162"]
    assert found.sentence == "place uses the arm and gripper at the same time as pick (line 4)"


def test_an_arm_without_its_packages_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(optional_packages.Package, "is_installed", property(lambda _: False))
    file = tmp_path / "m.yaml"
    file.write_text(f"{HEAD}run: {{home_arm: {{}}}}\n")
    sentences = [item.sentence for item in diagnose(file, RunOptions()).findings]
    wanted = "home_arm needs the Python package pinocchio, which is not installed"
    assert wanted in sentences


def test_a_plan_is_used_half_a_second_after_it_was_asked_for(live):
    run = live("run: {move_arm: {posture: folded}}\n")
    run.steps(2)
    still, begun = joints(run).positions, run.engine.body.time
    while np.abs(joints(run).positions - still).max() < 1e-3:
        run.steps(1)
        assert run.engine.body.time < begun + 2.0
    # LATENCY of stack/navigation/plans/arm_plans.py, a step of 0.05 s, and the start of the motion
    assert 0.4 < run.engine.body.time - begun < 0.9


def test_a_pause_while_planning_keeps_the_arm_where_it_is(live):
    run = live("run: {move_arm: {posture: folded}}\n")
    run.steps(3)
    assert run.order("pause").done
    run.steps(40)
    home = run.engine.runtime.parts.robot.arm.postures["home"]
    assert joints(run).positions == pytest.approx(home, abs=1e-3)
    assert run.order("resume").done
    assert ended(run) == (True, "")
    folded = run.engine.runtime.parts.robot.arm.postures["folded"]
    assert joints(run).positions == pytest.approx(folded, abs=1e-2)


def test_an_emergency_stop_while_planning_ends_the_motion(live):
    run = live("run: {move_arm: {posture: folded}}\n")
    run.steps(3)
    assert run.order("estop").done and run.order("release").done and run.order("resume").done
    done, reason = ended(run)
    assert not done and "CANCELLED" in reason
    home = run.engine.runtime.parts.robot.arm.postures["home"]
    assert joints(run).positions == pytest.approx(home, abs=1e-3)


@pytest.mark.slow
def test_a_run_is_repeated_bit_for_bit(tmp_path):
    file = tmp_path / "m.yaml"
    file.write_text(HEAD + "run: {sequence: [move_arm: {posture: folded}, detect_blocks: {}, "
                    "move_arm: {pose: {x: 50 cm, y: 30 cm, z: 30 cm}}]}\n")  # fmt: skip
    reports = [treepilot.run(file, seed=3) for _ in range(2)]
    assert [report.status for report in reports] == ["success", "success"]
    assert reports[0].log_sha256 == reports[1].log_sha256


HEAVY = """\
world: heavy
boxes:
  - {name: the bench, at: [0.60, 0], size: [0.70, 1.2, 0.04], elevation: 56 cm}
blocks:
  - {name: red block, at: [0.50, -0.10], size: [0.05, 0.05, 0.05], elevation: 60 cm,
     mass: 1 kg, friction: 0.1}
"""
"""Fingers of 40 N hold 2 * 0.1 * 40 N = 8 N by friction; the block weighs 9.8 N."""


def test_a_slippery_block_is_reported_as_slipped(live, tmp_path):
    (tmp_path / "heavy.yaml").write_text(HEAVY)
    head = HEAD.replace("bench_top", "./heavy.yaml")
    done, reason = ended(live(f"run: {{pick: {{at: {RED}}}}}\n", head))
    assert not done
    assert reason == "arm > pick: SLIPPED the red block was lost"


@pytest.mark.slow
def test_a_camera_that_is_mounted_beside_its_place_is_noticed_and_made_up_for(live, tmp_path):
    """Both cameras on the mast are described 3 cm too far to the right: y is 3 cm too small."""
    text = (HERE / "panda_table" / "robot.yaml").read_text()
    moved = text.replace("[1.20, 0, 1.50]", "[1.20, -0.03, 1.50]")
    assert moved.count("-0.03") == 2
    (tmp_path / "robot.yaml").write_text(f"actual: panda_table\n{moved}")
    head = HEAD.replace("panda_table", "./robot.yaml")
    picks = "".join(
        f"{{sequence: [move_arm: {{posture: folded}}, detect_blocks: {{spare: [the tray]}}, "
        f"pick: {{colour: {colour}, spare: [the tray]}}, place: {{on: the tray}}]}}, "
        for colour in ("red", "green", "blue")
    )
    run = live(f"run: {{sequence: [{picks}]}}\n", head)
    assert ended(run) == (True, "")
    [notice] = [event for event in run.kept.events if event.kind == "calibration"]
    red, green, blue = (block.position for block in run.engine.simulation.blocks)
    assert notice.level == "warning"
    assert notice.fields["offset"] == pytest.approx([0.0, 0.03, 0.0], abs=3e-3)
    assert "things are 3.0 cm beside where the camera shows them" in notice.text
    assert "3.0 cm left; mean of 3" in notice.text
    assert "calibrate the camera's mount" in notice.text
    for x, y, _ in (red, green, blue):
        assert abs(x - 0.55) < 0.12 and abs(y - 0.40) < 0.10

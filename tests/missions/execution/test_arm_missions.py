"""Missions of an arm on a column: its loop without a drive, pauses, stops, records."""

import shutil
from pathlib import Path

import numpy as np
import pytest

import treepilot
from missions.execution.prepare import RunOptions, diagnose
from missions.execution.warm_up import kernels_of
from missions.inspection.frames import frame_lines
from robots.scripted import ScriptedBody
from stack.telemetry.records import MissionState
from stack.telemetry.sensor_log import read_observations
from stack.types import GripperState, JointState
from tests.missions.execution.arm_leaves import STEP

HEAD = "mission: arm\nrobot: panda_table\nworld: bench_top\nplugins: [./arm_leaves.py]\n"
SWING = "run: {swing_arm: {}}\n"
HOME = np.array([0, -0.785, 0, -2.356, 0, 1.571, 0.785])


def scripted(setup):
    return ScriptedBody(setup.robot, start=setup.start)


@pytest.fixture
def folder(tmp_path):
    folder = tmp_path / "m"
    folder.mkdir()
    shutil.copy(Path(__file__).with_name("arm_leaves.py"), folder)
    return folder


@pytest.fixture
def live(folder, live_run):
    return lambda text, make_body=None: live_run(folder, text, head=HEAD, make_body=make_body)


def mission(folder, text, head=HEAD):
    file = folder / "mission.yaml"
    file.write_text(head + text)
    return file


def positions(run):
    return run.runtime.perceived.newest("joints", JointState).positions


@pytest.mark.parametrize("make_body", [None, scripted], ids=["simulated", "scripted"])
def test_an_arm_follows_and_its_mission_succeeds(live, make_body):
    run = live("run: {sequence: [say: a, swing_arm: {}, move_fingers: 3 cm]}\n", make_body)
    run.until("mission_ended")
    assert run.runtime.state is MissionState.SUCCESS, run.texts()
    assert positions(run) == pytest.approx(HOME + STEP, abs=5e-3)
    width = run.runtime.perceived.newest("gripper", GripperState).width
    assert width == pytest.approx(0.03, abs=1e-3)


def test_what_drives_is_not_there(live):
    run = live("run: {sequence: [wait: 1 s, drive_anyway: {}]}\n")
    run.steps(5)
    snapshot = run.snapshot
    assert set(snapshot.layers) == {"around_arm", "map", "parameters", "scene"}
    assert snapshot.scan is None and snapshot.path is None and snapshot.goal is None
    assert not {"controller", "safety", "localisation"} & {
        name.partition(".")[0] for name in snapshot.parameters
    }
    assert snapshot.pose == run.engine.simulation.truth.pose
    assert "wheels" not in run.runtime.perceived.measurements
    refused = run.order("set_goal", x=1.0, y=0.0, heading=0.0)
    assert not refused.done and refused.reason == "panda_table has no wheels"
    assert not run.order("teleop", linear=0.1, angular=0.0, lateral=0.0).done
    run.until("mission_ended")
    assert run.runtime.state is MissionState.FAILURE
    assert 'panda_table has no base; declare needs = ("base",)' in run.runtime.reason


def test_a_snapshot_shows_the_arm(live):
    run = live("run: {wait: 1 s}\n")
    run.steps(3)
    arm = run.snapshot.arm
    assert arm.joints[0] == "panda_joint1" and arm.positions == pytest.approx(HOME, abs=1e-3)
    assert arm.tool[:3, 3] == pytest.approx((0.307, 0.0, 1.083), abs=0.01)
    assert (arm.width, arm.width_max, arm.problem, arm.moving) == (
        pytest.approx(0.08), 0.08, "", False,
    )  # fmt: skip


def test_displays_get_the_blocks_where_they_are(live):
    run = live("run: {wait: 1 s}\n")
    run.steps(3)
    shapes = run.snapshot.layers["scene"].content
    [green] = [shape for shape in shapes if shape.colour == (0.1, 0.6, 0.2)]
    # World file: at [0.60, 0.12, 20 deg], 5 cm wide, its underside at 60 cm.
    assert (green.pose.x, green.pose.y) == pytest.approx((0.6, 0.12), abs=1e-3)
    assert green.pose.heading == pytest.approx(np.radians(20.0), abs=1e-3)
    assert (green.lift, green.size) == (pytest.approx(0.6, abs=1e-3), (0.05, 0.05, 0.05))


@pytest.mark.parametrize("make_body", [None, scripted], ids=["simulated", "scripted"])
def test_a_pause_holds_the_arm_on_its_way_and_its_time_does_not_count(live, make_body):
    run = live(SWING, make_body)
    run.steps(20)
    assert run.order("pause").done
    run.steps(20)
    stopped = positions(run)
    share = (stopped - HOME)[0] / STEP[0]
    assert 0.2 < share < 0.95
    if make_body is scripted:  # the time of a real body goes on
        run.steps(100)  # longer than the motion may be late
    assert positions(run) == pytest.approx(stopped, abs=1e-3)
    assert run.order("resume").done
    run.until("mission_ended")
    assert run.runtime.state is MissionState.SUCCESS, run.texts()
    assert positions(run) == pytest.approx(HOME + STEP, abs=5e-3)


def test_an_emergency_stop_ends_the_motion_and_a_reset_does_not_begin_it_again(live):
    run = live(SWING)
    run.steps(20)
    assert run.order("estop").done
    run.steps(20)
    assert np.abs(run.runtime.perceived.newest("joints", JointState).velocities).max() < 0.02
    stopped = positions(run)
    assert run.order("release").done
    run.steps(10)
    assert positions(run) == pytest.approx(stopped, abs=1e-3)
    assert run.order("resume").done
    run.steps(3)
    assert "CANCELLED" in run.runtime.reason or run.runtime.state is MissionState.FAILURE


def test_the_end_of_a_mission_stops_the_arm(live):
    run = live("run: {parallel: {succeed_on: one, do: [swing_arm: {}, wait: 1 s]}}\n")
    run.until("mission_ended")
    assert run.runtime.state is MissionState.SUCCESS
    run.runtime.step()
    moving = np.abs(run.runtime.perceived.newest("joints", JointState).velocities).max()
    assert moving > 0.1 and not run.runtime.is_standing
    for _ in range(20):
        run.runtime.step()
    assert run.runtime.is_standing
    assert np.abs(positions(run) - HOME - STEP).max() > 0.05


def test_a_motion_that_begins_elsewhere_or_leaves_the_limits_is_refused(live):
    run = live("run: {swing_arm: {share: 9.0}}\n")
    run.until("mission_ended")
    assert "panda_joint1 would go to" in run.runtime.reason
    assert "beyond its limits -2.9671 to 2.9671" in run.runtime.reason


def test_a_newer_motion_cancels_the_older_one_and_not_the_gripper(live):
    run = live("run: {wait: 9 s}\n", scripted)
    run.steps(3)
    from tests.missions.execution.arm_leaves import line

    arm, gripper = run.runtime.parts.robot.arm, run.runtime.parts.robot.gripper
    first, fingers = arm.follow(line(HOME, STEP, 2.0)), gripper.move(0.02)
    second = arm.follow(line(HOME, -STEP, 1.0))
    assert first.failure.code == "CANCELLED" and fingers.failure is None
    run.steps(30)
    assert (second.status.name, fingers.status.name) == ("SUCCEEDED", "SUCCEEDED")
    assert positions(run) == pytest.approx(HOME - STEP, abs=1e-3)


def test_joints_and_gripper_are_recorded_and_the_run_is_repeated(folder, tmp_path):
    file = mission(folder, SWING)
    reports = [
        treepilot.run(file, seed=3, out=tmp_path / f"r{number}", record=("sensors",))
        for number in range(2)
    ]
    assert [report.status for report in reports] == ["success", "success"]
    assert reports[0].log_sha256 == reports[1].log_sha256
    seen = list(read_observations(tmp_path / "r0" / "sensors.mcap"))
    assert all(isinstance(one.measurements["joints"], JointState) for one in seen)
    assert all(isinstance(one.measurements["gripper"], GripperState) for one in seen)
    assert seen[-1].measurements["joints"].positions == pytest.approx(HOME + STEP, abs=5e-3)
    lines = frame_lines(str(tmp_path / "r0"), tmp_path, tmp_path)
    assert lines[1].startswith("map") and lines[2].startswith("└─ base")
    [hand] = [line for line in lines if "panda_link7" in line]
    assert "revolute panda_joint7" in hand and " Hz " in hand
    assert "depth camera" in next(line for line in lines if "─ hand " in line)


def test_frames_of_a_robot_and_of_what_there_is_not(tmp_path):
    lines = frame_lines("scout", tmp_path, tmp_path)
    assert lines[1] == "base"
    assert any("lidar" in line and "robot file" in line for line in lines)
    with pytest.raises(treepilot.InputError, match=r"'nowhere' is neither a run .* nor a robot"):
        frame_lines("nowhere", tmp_path, tmp_path)


def test_components_that_drive_are_reported_as_without_effect(folder):
    text = "localisation: mcl\nnavigation: {controller: mppi}\nrun: {say: a}\n"
    found = diagnose(mission(folder, text), RunOptions()).findings
    assert {(item.code, item.mark.line) for item in found} == {("W151", 5), ("W151", 6)}
    assert min(found, key=str).sentence == "estimator: panda_table cannot drive: it has no effect"
    assert diagnose(mission(folder, "run: {say: a}\n"), RunOptions()).findings == ()


def test_an_arm_is_refused_on_a_rover(folder):
    head = HEAD.replace("panda_table", "scout").replace("bench_top", "small_room")
    text = "run: {sequence: [swing_arm: {}, move_fingers: 2 cm]}\n"
    found = diagnose(mission(folder, text, head), RunOptions()).findings
    assert [item.sentence for item in found] == [
        "swing_arm needs an arm, and scout has none",
        "move_fingers needs a gripper, and scout has none",
    ]
    assert "use a robot with an arm: fetcher, panda_eye, panda_table" in str(found[0])


def test_kernels_that_drive_are_not_compiled_for_an_arm(folder):
    plan = diagnose(mission(folder, "run: {say: a}\n"), RunOptions()).plan
    assert set(kernels_of(plan)) == {"sensors", "perception", "arm"}


PICK = "{pick: {colour: red}}"
SHARED = "trees:\n  look: {do: {detect_blocks: {}}}\n"


@pytest.mark.parametrize(
    ("run", "is_warned"),
    [
        (PICK, True),
        (f"{{sequence: [{PICK}, place: {{on: the tray}}]}}", True),
        ("{pick: {at: {x: 50 cm, z: 25 mm}}}", False),
        (f"{{sequence: [detect_blocks: {{}}, {PICK}]}}", False),
        (f"{{sequence: [use: look, {PICK}]}}\n{SHARED}", False),
        (f"{PICK}\nevents: [{{look: {{when: time > 1 s, do: {{detect_blocks: {{}}}}}}}}]", False),
        (f"{{sequence: [{PICK}, swing_arm: {{share: 1.0}}]}}\nplugins: [./arm_leaves.py]", False),
    ],
)  # fmt: skip
def test_a_pick_of_a_block_that_nothing_finds_is_reported(tmp_path, folder, run, is_warned):
    head = "mission: m\nrobot: panda_table\nworld: bench_top\n"
    found = diagnose(mission(folder, f"run: {run}\n", head), RunOptions()).findings
    warned = [item for item in found if item.code == "W152"]
    assert bool(warned) is is_warned, found
    if warned:
        assert warned[0].sentence == "pick knows no block: nothing in the mission finds any"
        assert warned[0].hint == "use detect_blocks before it, or `at`"

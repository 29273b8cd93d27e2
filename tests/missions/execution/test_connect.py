"""A robot commanded from code: a real engine in another process, and engines that misbehave."""

from __future__ import annotations

import asyncio
import os
import signal
import threading
from contextlib import contextmanager

import pytest
from typer.testing import CliRunner

import treepilot
from missions.cli.app import app
from missions.execution.supervision.launch import LaunchOptions
from missions.run_options import RunOptions
from tests.missions.execution.test_engine import supervised

MISSION = """
mission: lively
robot: scout
world: small_room
places: {desk: [2.0, 1.0, 0 deg]}
run: {wait: 10 h}
"""


@contextmanager
def engine(folder):
    """An engine at eight times real time: its process and the name of its run."""
    folder.mkdir()
    mission, out = folder / "lively.yaml", folder / f"live-{os.getpid()}"
    mission.write_text(MISSION)
    options = LaunchOptions((str(mission),), RunOptions(out=out), speed="8")
    with supervised(options) as (process, _):
        yield process, str(out)


@pytest.fixture(scope="module")
def live(tmp_path_factory):
    with engine(tmp_path_factory.mktemp("live") / "run") as (_, name):
        yield name


@pytest.fixture
def robot(live):
    with treepilot.connect(live) as robot:
        yield robot
        robot.resume() if robot.state == "paused" else None


pytestmark = pytest.mark.slow


def test_a_robot_drives_to_a_place_and_to_coordinates(robot):
    robot.goto("desk")
    assert (robot.pose.x, robot.pose.y) == pytest.approx((2.0, 1.0), abs=0.25)
    assert robot.state == "paused"  # until it is resumed
    robot.goto(1.2, 1.0, "180 deg")
    assert (robot.pose.x, robot.pose.y) == pytest.approx((1.2, 1.0), abs=0.25)
    assert abs(robot.pose.heading) == pytest.approx(3.14, abs=0.3)
    robot.resume()
    assert robot.state == "running"


def test_a_drive_that_fails_says_why(robot):
    with pytest.raises(treepilot.NavigationError) as caught:
        robot.goto(0.02, 0.02, 0.0)
    assert caught.value.failure.code in {"GOAL_OCCUPIED", "NO_VALID_PATH"}


def test_a_drive_can_go_on_while_the_program_watches(robot):
    robot.goto(5.0, 3.8, wait=False)
    start = next(poses := robot.poses())
    assert any(pose.distance_to(start) > 0.1 for pose in poses)
    robot.command("cancel_goal")
    ended = next(event for event in robot.events(timeout=10.0) if event.kind == "detour")
    assert ended.fields["status"] == "cancelled"


def test_a_behaviour_runs_with_its_ports(robot):
    before = robot.pose.heading
    robot.run_behaviour("spin", angle="90 deg")
    turned = (robot.pose.heading - before + 3.1416) % 6.2832 - 3.1416
    assert turned == pytest.approx(1.571, abs=0.2)
    with pytest.raises(treepilot.CommandRefused, match="did you mean 'spin'"):
        robot.run_behaviour("spni")
    with pytest.raises(treepilot.NavigationError, match="OWN_CODE: as asked"):
        robot.run_behaviour("fail", code="OWN_CODE", because="as asked")


def test_parameters_states_and_refusals(robot):
    robot.set_parameter("controller.cruise_speed", "30 cm/s")
    assert robot.parameters["controller.cruise_speed"] == pytest.approx(0.3)
    with pytest.raises(treepilot.CommandRefused, match="did you mean 'cruise_speed'"):
        robot.set_parameter("controller.cruise_sped", 0.3)
    robot.estop("a test")
    assert robot.state is treepilot.MissionState.EMERGENCY_STOP
    with pytest.raises(treepilot.CommandRefused, match="release it first"):
        robot.resume()
    robot.release()
    assert robot.state == "paused"
    robot.speed(8)
    robot.set_pose(robot.pose)
    assert robot.info.places["desk"] == treepilot.Pose2D(2.0, 1.0, 0.0)
    assert robot.snapshot.pose == robot.pose or robot.snapshot.time > 0.0


@pytest.mark.parametrize(
    ("goal", "message"),
    [
        (("dsek",), "no place 'dsek'; did you mean 'desk'"),
        (("1, 2, 3, 4",), "x,y,heading"),
        (("1, 2 kg",), "is in kg"),
        ((1.0,), "needs y"),
        ((1.0, 2.0, "soon"), "soon"),
        (("desk", 1.0), "leave out y"),
        ((300.0, 1.0, 0.0), "outside the map"),
    ],
)
def test_goals_that_mean_nothing_are_refused(robot, goal, message):
    with pytest.raises(treepilot.InputError, match=message):
        robot.goto(*goal)


def test_events_come_once_and_in_order_and_end_after_a_silence(robot):
    robot.pause()
    robot.resume()
    robot.pause()  # nothing happens while it is paused
    seen = list(robot.events(timeout=0.0)) + list(robot.events(timeout=0.5))
    commands = [event.fields["command"] for event in seen if event.kind == "command"]
    assert commands == ["pause", "resume", "pause"]
    assert [event.number for event in seen] == list(
        range(seen[0].number, seen[0].number + len(seen))
    )


def test_coroutines_do_the_same(live):
    async def drive():
        async with treepilot.connect_async(live) as robot:
            watched = asyncio.create_task(anext(robot.poses()))
            await asyncio.gather(robot.goto("desk"), watched)
            with pytest.raises(treepilot.CommandRefused):
                await robot.release()
            await robot.resume()
            return watched.result(), await robot.pose, await robot.state

    seen, pose, state = asyncio.run(drive())
    assert isinstance(seen, treepilot.Pose2D)
    assert (pose.x, pose.y, state) == (pytest.approx(2.0, abs=0.25), pytest.approx(1.0, abs=0.25),
                                       "running")  # fmt: skip


def test_coroutines_share_a_connection(live):
    async def commands():
        async with treepilot.connect_async(live) as robot:
            first = asyncio.gather(*(robot.pause() for _ in range(20)), robot.pose, robot.state)
            await asyncio.wait_for(first, 10.0)
            return [event.fields["command"] async for event in robot.events(timeout=0.5)
                    if event.kind == "command"]  # fmt: skip

    assert asyncio.run(commands()) == ["pause"] * 20


def test_a_notebook_blocks_in_its_own_event_loop(live):
    async def cell():
        with treepilot.connect(live) as robot:
            next(robot.poses())
            return robot.pose

    assert isinstance(asyncio.run(cell()), treepilot.Pose2D)


def test_nothing_is_left_over(live):
    before, handler = threading.active_count(), signal.getsignal(signal.SIGINT)
    files = len(os.listdir("/proc/self/fd"))
    for _ in range(3):
        with treepilot.connect(live) as robot:
            assert robot.pose
    assert threading.active_count() == before
    assert signal.getsignal(signal.SIGINT) is handler
    assert len(os.listdir("/proc/self/fd")) <= files


def told(*words):
    """Exit code and output of `treepilot tell`."""
    done = CliRunner().invoke(app, ["tell", *words])
    if isinstance(done.exception, treepilot.TreepilotError):  # as the command's main does
        return 2, str(done.exception)
    return done.exit_code, done.output


def test_tell_takes_goals_poses_parameters_and_behaviours(live):
    assert told(live, "goal", "desk", "--wait") == (0, "at the goal\n")
    assert told(live, "goal", "1.5,1.0,-90deg", "--wait") == (0, "at the goal\n")
    code, text = told(live, "goal", "0.02,0.02", "--wait")
    assert (code, text.split(":")[0] in {"GOAL_OCCUPIED", "NO_VALID_PATH"}) == (1, True)
    assert told(live, "goal", "-300,1")[0] == 1
    code, text = told(live, "goal", "dsek")
    assert (code, "did you mean 'desk'" in text) == (2, True)
    assert told(live, "behaviour", "spin", "angle=90deg", "--wait") == (0, "done\n")
    code, text = told(live, "behaviour", "spin", "angel=90deg")
    assert (code, "available: angle" in text or "did you mean 'angle'" in text) == (1, True)
    assert told(live, "behaviour", "spin", "angle")[0] == 2
    assert told(live, "set", "controller.cruise_speed=30cm/s") == (
        0, "controller.cruise_speed is 0.3\n",
    )  # fmt: skip
    code, text = told(live, "set", "controller.cruise_sped=1")
    assert (code, "did you mean 'cruise_speed'" in text) == (1, True)
    assert told(live, "set", "controller.cruise_speed")[0] == 2
    assert told(live, "speed", "8") == (0, "done\n")
    assert told(live, "speed", "-1")[0] != 0
    assert told(live, "pose", "2.0,1.0,0")[0] == 0
    assert told(live, "release") == (1, "release: the emergency stop is not engaged\n")
    assert told(live, "resume")[0] == 0


def test_tell_disturbs_a_simulation(live):
    """What the robot then perceives is that of tests/missions/execution/test_disturbances.py."""
    with treepilot.connect(live) as robot:
        assert told(live, "lift", "desk") == (0, "done\n")
        truth = robot.snapshot.truth
        assert (truth.x, truth.y) == pytest.approx((2.0, 1.0), abs=0.02)
        assert told(live, "push", "--left", "-10cm", "--turn", "30deg") == (0, "done\n")
        assert told(live, "set_charge", "30%") == (0, "done\n")
        assert robot.snapshot.battery.charge == pytest.approx(0.3, abs=0.01)
        assert told(live, "silence_sensor", "lidar") == (0, "done\n")
        assert told(live, "silence_sensor", "lidar", "--works") == (0, "done\n")
        code, text = told(live, "silence_sensor", "radar")
        assert (code, "available: lidar" in text) == (1, True)
        assert told(live, "drop_box", "3.5,1.5", "--length", "30cm") == (0, "done\n")
        code, text = told(live, "drop_box", "--height", "30 deg")
        assert (code, "height" in text) == (2, True)
        code, text = told(live, "move_door", "lab", "--close")
        assert (code, "door" in text) == (1, True)
        assert told(live, "goal", "desk")[0] == 0
        assert told(live, "cancel")[0] == 0
        ended = next(event for event in robot.events(timeout=10.0) if event.kind == "detour")
        assert ended.fields["status"] != "success"
        robot.drop_box(length="20 cm")
        robot.push(forward=0.05)
        with pytest.raises(treepilot.ParameterError, match="charge: 7 must be at most 1"):
            robot.set_charge(7.0)


def test_a_frozen_engine_a_dead_one_and_one_that_has_ended(tmp_path):
    with engine(tmp_path / "run") as (process, name):
        with treepilot.connect(name, timeout=1.0) as robot:
            process.send_signal(signal.SIGSTOP)
            with pytest.raises(treepilot.TelemetryError, match="not answered for 1 s"):
                robot.snapshot  # noqa: B018
            with pytest.raises(treepilot.TelemetryError, match="not answered for 1 s"):
                robot.pause()
            with pytest.raises(treepilot.TelemetryError, match="not answered for 1 s"):
                list(robot.events())
            process.send_signal(signal.SIGCONT)
            assert robot.state in ("running", "paused")  # the pause was late, not lost
            process.kill()
            process.wait()
            with pytest.raises(treepilot.TelemetryError, match="has died"):
                list(robot.poses())
    with pytest.raises(treepilot.TelemetryError, match=r"is live|is running"):
        treepilot.connect(name)


def test_the_end_of_a_run_ends_what_watches_it(tmp_path):
    with engine(tmp_path / "run") as (_, name), treepilot.connect(name) as robot:
        robot.abort("enough")
        assert "mission_ended" in [event.kind for event in robot.events()]
        assert list(robot.poses()) == []
        assert robot.state == "aborted"  # the last one
        with pytest.raises(treepilot.TelemetryError, match="the run is over"):
            robot.pause()


def test_an_engine_of_another_version_is_one_clear_error(live, monkeypatch):
    monkeypatch.setattr("stack.telemetry.codec.stamp", lambda: "another")
    with (
        pytest.raises(treepilot.TelemetryError, match="same treepilot version"),
        treepilot.connect(live),
    ):
        pass


def test_a_run_is_not_commanded_under_the_name_of_another(live):
    run = treepilot.connect(live)
    run.close()
    with pytest.raises(treepilot.TelemetryError, match="no run 'nobody' is live"):
        treepilot.connect("nobody")

"""The step loop as a whole: poses at stamps, robots with other sensors, a body that goes on."""

from __future__ import annotations

import re
from math import degrees
from pathlib import Path

import numpy as np
import pytest

from robots.scripted import ScriptedBody, scans_of
from robots.simulated import SimulatedBody
from stack.body import SimulatedWorld
from stack.telemetry.records import MissionState
from stack.telemetry.sensor_log import SensorLog
from stack.types import RangeReading, TaskStatus, wrap_angle
from tests.missions.execution.live_run import LiveRun

SCOUT = Path(__file__).parents[3] / "robots/scout"


@pytest.fixture
def live(tmp_path, live_run):
    def start(text: str, change=lambda robot: robot, **more) -> LiveRun:
        robot = change((SCOUT / "robot.yaml").read_text("utf-8"))
        (tmp_path / "robot.yaml").write_text(robot, "utf-8")
        (tmp_path / "scout.urdf").write_text((SCOUT / "scout.urdf").read_text("utf-8"), "utf-8")
        head = "mission: lively\nrobot: ../robot.yaml\nworld: small_room\n"
        return live_run(tmp_path / "m", text, head, **more)

    return start


def turning_error(run: LiveRun) -> float:
    """Mean error of the heading while the robot turns, degrees."""
    errors = []
    while not run.runtime.state.is_over:
        run.steps()
        if abs(run.runtime.perceived.motion.twist.angular) > 0.5:
            # the estimate was made before the physics of this step
            estimate = run.runtime.parts.perceiver.estimator.estimate.pose.heading
            errors.append(abs(wrap_angle(estimate - run.before)))
        run.before = run.runtime.parts.scorer.truth.heading
    assert len(errors) > 60
    return degrees(float(np.mean(errors)))


@pytest.mark.parametrize(
    ("rate", "rotation_time"),
    [("12.5 Hz", "0 ms"), ("10 Hz", "100 ms"), ("12.5 Hz", "80 ms")],
)
def test_the_heading_is_right_while_turning_at_any_rate_of_the_lidar(live, rate, rotation_time):
    """At 12.5 Hz half of the scans are 10 to 40 ms old: 0.73 degrees with the pose of the step.

    At 10 Hz, with no age, it is 0.06 degrees.
    """

    def change(robot: str) -> str:
        """Change the lidar; its rate is the first one in the file."""
        robot = robot.replace("rotation_time: 100 ms", f"rotation_time: {rotation_time}")
        return robot.replace("  rate: 10 Hz\n", f"  rate: {rate}\n", 1)

    run = live("run: {spin: {angle: 720 deg}}\n", change)
    run.before = run.runtime.parts.scorer.truth.heading
    assert turning_error(run) < 0.2
    assert run.runtime.state is MissionState.SUCCESS


def without_lidar(robot: str) -> str:
    return re.sub(r"lidar:\n(  .*\n)+", "", robot, count=1)


def test_a_robot_without_a_lidar_sees_by_its_sonars(live):
    """Its costmap rolls and has their marks, safety slows it down, nothing grows."""
    run = live("map: none\nrun: {drive_on_heading: {distance: 6 m, speed: 0.14}}\n", without_lidar)
    costmap = run.runtime.parts.perceiver.world_model.local_costmap
    begin = costmap.grid.origin
    run.until("mission_ended", within=1200)
    assert run.runtime.distance > 0.5
    assert np.hypot(*np.subtract(costmap.grid.origin, begin)) > 0.3
    assert costmap.layers == ("static", "range")
    assert run.runtime.parts.scorer.counters()["collisions"] == 0
    assert (costmap.grid.cells >= 253).any()
    # it stands before the wall that the sonars see
    points = run.runtime.perceived.obstacles.points
    assert 0.2 < np.hypot(*points.T).min() < 0.6


def test_a_lidar_of_any_name_serves_the_localisation(live):
    """The only lidar is called `rear` and looks back."""

    def renamed(robot: str) -> str:
        lidar = re.search(r"lidar:\n((  .*\n)+)", robot)
        section = "lidars:\n  rear:\n    yaw: 180 deg\n" + re.sub("^", "  ", lidar[1], flags=re.M)
        return robot.replace(lidar[0], section.rstrip() + "\n")

    run = live("run: {wait: {time: 5 s}}\n", renamed)
    run.steps(2)
    task, truth = run.runtime.parts.robot.localisation.relocalise(), run.runtime.parts.scorer.truth
    run.steps(20)
    assert task.status is TaskStatus.SUCCEEDED
    assert run.runtime.parts.perceiver.estimator.estimate.pose.distance_to(truth) < 0.05
    assert run.runtime.parts.perceiver.estimator.estimate.corrected_at > 0.5
    assert run.runtime.parts.robot.perception.scan.mount.heading == pytest.approx(np.pi)


def test_a_robot_without_a_lidar_escapes_by_its_sonars(live):
    run = live("map: none\nrun: {wait: {time: 5 s}}\n", without_lidar)
    run.steps(2)
    task = run.runtime.parts.robot.base.escape()
    run.steps(5)
    assert task.status is TaskStatus.SUCCEEDED
    assert task.feedback.startswith("clearance 0.15 m")


def test_a_robot_that_cannot_see_says_so_before_it_drives(live):
    def blind(robot: str) -> str:
        return re.sub(r"sonars:.*\n(  .*\n)+", "", without_lidar(robot))

    run = live("map: none\nrun: {drive_on_heading: {distance: 0.5 m, speed: 0.3}}\n", blind)
    warning = next(event for event in run.kept.events if event.kind == "safety")
    assert warning.text == (
        "scout has no lidar and no sonar: it does not see obstacles and drives at most 0.15 m/s"
    )
    assert warning.time == 0.0
    speeds = []
    while not run.runtime.state.is_over:
        run.steps()
        speeds.append(run.runtime.command.twist.linear)
    assert 0.149 < max(speeds) <= 0.15  # the outline enters unseen ground at 0.15 m/s


def test_holding_the_robot_does_not_stop_a_world_that_cannot_freeze(live):
    """Time, measurements and estimates go on; the mission's own time does not."""

    def make(setup):
        return ScriptedBody(
            setup.robot, scans_of(setup.robot, setup.world), start=setup.start,
        )  # fmt: skip

    run = live("run: {wait: {time: 2 s}}\n", make_body=make)
    assert not isinstance(run.engine.body, SimulatedWorld)
    run.steps(20)
    assert run.order("pause").done
    before = run.engine.body.time
    stamps = set()
    for _ in range(100):
        run.steps()
        stamps.add(run.runtime.perceived.newest("front", RangeReading).stamp)
    assert run.engine.body.time == pytest.approx(before + 5.0)
    assert len(stamps) == pytest.approx(50, abs=1)
    assert run.runtime.parts.perceiver.estimator.estimate.corrected_at > before + 4.8
    assert run.order("resume").done
    ended = run.until("mission_ended")
    assert run.runtime.state is MissionState.SUCCESS
    assert ended.time == pytest.approx(2.0 + 5.0, abs=0.25)


def test_a_robot_that_backs_into_a_speed_zone_brakes_before_it(live):
    run = live(
        "start: [2.6, 2.5, 0 deg]\n"
        "navigation:\n  speed_limits:\n"
        "    zones: [{corners: [[0, 2], [1.9, 2], [1.9, 3], [0, 3]], speed: 0.1 m/s}]\n"
        "run: {drive_on_heading: {distance: -1.2 m, speed: 0.3}}\n",
        lambda robot: robot.replace("linear_deceleration: 1.5", "linear_deceleration: 0.1"),
    )
    before, inside = [], []
    while not run.runtime.state.is_over:
        run.steps()
        truth = run.runtime.parts.scorer.truth
        (inside if truth.x < 1.9 else before).append(run.speed)
    assert run.runtime.state is MissionState.SUCCESS
    assert max(before) > 0.27
    # The zone is looked up every 10 cm, 9 mm are driven in a step, and the estimate is off by 1 cm:
    # it is entered at up to sqrt(0.1² + 2 · 0.1 · 0.119) = 0.184 m/s.
    assert max(inside) < 0.184


def test_a_fault_of_the_hardware_pauses_the_mission_and_says_so(live):
    def make(setup):
        return ScriptedBody(
            setup.robot, scans_of(setup.robot, setup.world), start=setup.start,
            problems=[(2.0, "motor 2 is hot"), (4.0, "")],
        )  # fmt: skip

    run = live("run: {drive_on_heading: {distance: 1.2 m, speed: 0.2}}\n", make_body=make)
    fault = run.until("body")
    assert (fault.level, fault.text) == ("error", "motor 2 is hot")
    assert (run.runtime.state, run.runtime.reason) == (MissionState.PAUSED, "motor 2 is hot")
    run.steps(30)
    assert run.speed < 0.02
    assert run.until("body").text == "the robot works again"
    assert run.runtime.state is MissionState.PAUSED
    assert run.order("resume").done
    run.until("mission_ended")
    assert run.runtime.state is MissionState.SUCCESS


def test_nothing_waits_for_slow_work_where_time_cannot_be_frozen(live):
    class Rover(SimulatedBody):
        @property
        def is_real_time(self):
            return True

    for body, waits in ((Rover, False), (SimulatedBody, True)):
        run = live(
            "run: {wait: {time: 1 s}}\n",
            make_body=lambda setup, body=body: body(
                setup.robot, setup.world, start=setup.start, seed=setup.seed
            ),
        )
        parts = run.runtime.parts
        assert parts.navigator.tools.planner_worker.deferral.waits is waits
        assert parts.perceiver.objects._waits is waits


def test_a_full_disk_ends_the_sensor_log_and_not_the_mission(live):
    run = live("run: {wait: {time: 1 s}}\n")
    log = run.runtime.parts.sensor_log = SensorLog(Path("/dev/full"), {})
    error = run.until("record")
    assert (error.level, error.text) == (
        "error", "the sensor log ends here: No space left on device",
    )  # fmt: skip
    run.until("mission_ended")
    assert run.runtime.state is MissionState.SUCCESS
    log.close()

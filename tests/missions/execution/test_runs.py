"""Whole missions: each shipped one, and what a run must keep to."""

from __future__ import annotations

import json
import subprocess
import sys
from contextlib import ExitStack
from dataclasses import asdict
from pathlib import Path

import pytest

import missions
from missions.execution.prepare import RunOptions, prepare
from missions.execution.resources import mission_files
from missions.execution.run import Run
from missions.execution.running import rare_collections, run_mission
from stack.telemetry.records import MissionState
from tests.benchmarks.missions import Trace
from tests.missions.shipped import ARGUMENTS, check_safe, check_success

NAMES = sorted(file.stem for file in mission_files())

TOGETHER = ("23_courier", "24_second_courier")
"""Missions of two robots in one world."""

ELSEWHERE = ("04_wall_follow", "44_ground_station")
"""Missions that test_wall_runs.py and test_ground_stations.py drive."""


FIRST_SECONDS = 20.0
"""Simulated seconds. `make wheel-test` runs all missions to their ends, as a user installs them."""

SHORT = (
    "01_drive_to_a_point", "06_your_own_behaviour", "13_tight_garage", "14_any_angle",
    "15_turn_on_the_spot", "21_hotel_corridor", "50_pick_the_red_block",
)  # fmt: skip
"""Missions that end within half a minute."""


@pytest.fixture
def begun():
    """begun(name, seconds): a run of a shipped mission, stepped so far or to its end."""
    with ExitStack() as runs:
        runs.enter_context(rare_collections())

        def begin(name: str, seconds: float) -> Run:
            options = RunOptions(seed=1, serve=False, arguments=ARGUMENTS.get(name))
            run = Run(prepare(name, options), options)
            runs.callback(run.close)
            while not run.is_over and run.engine.body.time < seconds:
                run.step()
            return run

        yield begin


def cancel(run: Run) -> None:
    """A cancelled goal must never be driven to (nav2#3090), wherever the tree was."""
    engine, runtime = run.engine, run.engine.runtime
    runtime.end(MissionState.ABORTED, "somebody changed their mind")
    assert runtime.parts.navigator.goal is None
    assert not any(row.status == "running" for row in engine.tree.rows())
    while not run.is_over:  # 3 s at most
        run.step()
    if engine.replay is not None:
        return  # a replayed robot is not driven
    where = engine.body.truth.pose
    for _ in range(20):
        runtime.step()
    slides = 0.03 if "slippery" in run.draft().mission else 0.005  # on ice, with wheels at rest
    assert engine.body.truth.pose.distance_to(where) < slides
    assert engine.body.tally.by_robot == 0


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in NAMES if name not in (*TOGETHER, *ELSEWHERE)])
def test_every_shipped_mission_succeeds_or_drives_without_a_collision_until_cancelled(begun, name):
    run = begun(name, 60.0 if name in SHORT else FIRST_SECONDS)
    report = asdict(run.draft())
    if name in SHORT or run.is_over:
        check_success(name, report)
    else:
        check_safe(name, report)
        assert report["distance_m"] is None or report["distance_m"] > 0.5
        cancel(run)


@pytest.mark.pain("n3090")
@pytest.mark.slow
@pytest.mark.parametrize("name", [*SHORT, *TOGETHER, *ELSEWHERE])
def test_a_mission_that_is_cancelled_early_lets_go_of_its_goal_and_stands(begun, name):
    run = begun(name, 4.5)
    assert not run.is_over
    cancel(run)


@pytest.mark.slow
def test_both_couriers_deliver_in_one_room_without_a_collision():
    reports = missions.run_together(list(TOGETHER), seed=1)
    assert [report.status for report in reports] == ["success", "success"]
    assert [report.collisions for report in reports] == [0, 0]
    assert all(report.simulated_seconds < 240.0 for report in reports)
    assert all((report.localisation_error or {"max": 9.0})["max"] < 0.3 for report in reports)


def without_recovery(tmp_path: Path) -> Path:
    """Mission 03 with its `recover` and all below it taken out."""
    source = next(file for file in mission_files() if file.stem == "03_blocked_corridor")
    text = source.read_text("utf-8")
    lines = text[: text.index("  recover:")]
    path = tmp_path / "no_recovery.yaml"
    path.write_text(lines, "utf-8")
    return path


@pytest.mark.slow
def test_the_blocked_corridor_needs_its_recovery(tmp_path):
    report = missions.run(without_recovery(tmp_path), seed=1)
    assert report.status == "failure"
    assert "NO_VALID_PATH" in report.reason


@pytest.mark.pain("s334", "s769", "s285", "s771")
@pytest.mark.slow
def test_without_a_camera_the_kidnapped_robot_does_not_guess():
    trace = Trace()
    options = RunOptions(seed=1, camera="off", serve=False)
    report = run_mission("05_kidnapped", options, [trace])
    assert report.relocalised_by != "marker"
    lifted = next(event.time for event in trace.events if event.kind == "lifted")
    settled = [sample for sample in trace.errors if sample[0] > lifted + 5.0]
    # Until then the estimate is one of two rivals, and no goal is driven to.
    resolved = [e.time for e in trace.events if e.text.startswith("disambiguate succeeded")]
    sure = [sample for sample in settled if resolved and sample[0] > resolved[-1]]
    confidently_wrong = [sample for sample in sure if sample[1] > 0.5 and sample[2] > 0.5]
    assert not confidently_wrong
    # It gives up, or has driven to where the two rooms differ and found out by lidar alone.
    if report.status == "success":
        assert report.relocalised_by == "lidar"
        assert settled[-1][1] < 0.1
    else:
        assert "LOST" in report.reason or "AMBIGUOUS" in report.reason


def run_in_a_process(tmp_path: Path, *options: str) -> dict[str, object]:
    done = subprocess.run(
        [sys.executable, "-m", "missions.cli.app", "run", "01_drive_to_a_point", "--json", *options,
         "--out", str(tmp_path)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return dict(json.loads(done.stdout))


@pytest.mark.pain("n3746", "n3352", "n4349", "n1733", "n1509", "n2797")
@pytest.mark.slow
def test_equal_seeds_give_equal_logs_whatever_the_speed_and_the_recording(tmp_path):
    fast = missions.run("01_drive_to_a_point", seed=5, out=tmp_path / "fast")
    paced = run_in_a_process(tmp_path / "paced", "--seed", "5", "--speed", "4")
    other = missions.run("01_drive_to_a_point", seed=6)
    assert fast.log_sha256 == paced["log_sha256"]
    assert fast.final_pose == paced["final_pose"]  # bit for bit: JSON keeps every digit
    assert fast.log_sha256 != other.log_sha256

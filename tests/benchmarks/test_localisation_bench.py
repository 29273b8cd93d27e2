"""The localisation bench: its cases, its monitor, its statistics, and one real run."""

import json
from dataclasses import asdict, replace
from math import pi, radians

import numpy as np
import pytest

from missions.bench.bench import Options, wilson
from stack.errors import InputError
from stack.sim.worlds.world_file import read_world
from stack.types import Pose2D, PoseEstimate, RivalPose
from tests.benchmarks.benches.localisation import (
    LOCALISATION,
    bins_of,
    calibration_error,
    cause_of,
    table_of,
)
from tests.benchmarks.experiment_monitor import LocalisationMonitor, Sample
from tests.benchmarks.experiments import (
    EXPERIMENTS,
    LocalisationEntry,
    entries_of,
    make_case,
    push_of,
)
from tests.benchmarks.reliability import draw_reliability

HERE = Pose2D(1.0, 2.0, 0.5)


def sample(time, error=0.0, health=0.9, *, turn=0.0, rivals=(), disturbed=False, deviation=0.02):
    covariance = np.diag([deviation**2, deviation**2, 1e-4])
    pose = Pose2D(HERE.x + error, HERE.y, HERE.heading + turn)
    estimate = PoseEstimate(pose, covariance, health, rivals=rivals)
    return Sample(time, estimate, HERE, 0.3, disturbed)


def watched(name, *phases):
    """Feed phases (until, settings of samples), 20 samples a second."""
    monitor, step = LocalisationMonitor(EXPERIMENTS[name]), 0
    for until, settings in phases:
        while step * 0.05 < until and not monitor.is_done:
            monitor.update(sample(step * 0.05, **settings), 0.05)
            step += 1
    return monitor


def test_a_kidnap_is_noticed_when_lost_and_corrected_when_right_for_a_second():
    monitor = watched(
        "kidnapped",
        (8.01, {}),
        (10.0, {"error": 3.0}),
        (12.0, {"error": 3.0, "health": 0.1}),
        (12.5, {"error": 0.05}),  # right by chance for half a second
        (14.0, {"error": 0.5}),
        (30.0, {"error": 0.05}),
    )
    assert monitor.noticed == pytest.approx(2.0, abs=0.051)
    assert monitor.corrected == pytest.approx(6.0, abs=0.051)


def test_a_disturbed_odometry_counts_as_noticed_and_never_is_never():
    monitor = watched("pushed", (8.2, {}), (30.0, {"error": 0.3, "disturbed": True}))
    assert monitor.noticed == pytest.approx(0.2, abs=0.051)
    assert monitor.corrected == np.inf
    assert not monitor.is_done


def test_only_a_right_pose_can_be_lost_falsely():
    right = watched("people", (1.0, {}), (2.0, {"health": 0.2}), (3.0, {}), (4.0, {"health": 0.1}))
    wrong = watched("people", (1.0, {}), (2.0, {"health": 0.2, "error": 0.4}))
    turned = watched("people", (1.0, {}), (2.0, {"health": 0.2, "turn": radians(11)}))
    rivals = (RivalPose(Pose2D(9.0, 2.0), 0.5),)
    ambiguous = watched("people", (1.0, {}), (2.0, {"health": 0.2, "rivals": rivals}))
    assert (right.lost_falsely, wrong.lost_falsely, turned.lost_falsely) == (2, 0, 0)
    assert ambiguous.lost_falsely == 0


def test_errors_inside_the_ellipse_of_95_per_cent_are_contained():
    # sqrt(5.991) = 2.448 standard deviations
    assert sample(0.0, 0.0489, deviation=0.02).is_contained
    assert not sample(0.0, 0.0491, deviation=0.02).is_contained


def test_a_good_health_without_rivals_at_a_wrong_pose_is_a_wrong_claim():
    rival = (RivalPose(HERE, 0.4),)
    sure = watched("twin", (2.0, {"error": 5.0}))
    open_ = watched("twin", (2.0, {"error": 5.0, "rivals": rival}))
    assert sure.wrong_claims == pytest.approx(2.0, abs=0.11)
    assert open_.wrong_claims == 0.0
    assert open_.ambiguous == pytest.approx(2.0, abs=0.11)


def test_the_calibration_error_is_the_weighted_gap():
    bins = np.zeros((10, 3))
    bins[9] = 80, 80 * 0.95, 72  # 0.95 against 0.9
    bins[2] = 20, 20 * 0.25, 9  # 0.25 against 0.45
    assert calibration_error(bins) == pytest.approx(0.8 * 0.05 + 0.2 * 0.2)
    assert calibration_error(np.zeros((10, 3))) == 0.0


def test_the_interval_of_a_rate_is_wilsons():
    # Wilson 1927 by hand for 98 of 100: (0.98 + 0.019208 -+ 0.033195) / 1.038415
    low, high = wilson(98, 100)
    assert (low, high) == pytest.approx((0.93000, 0.99450), abs=2e-4)
    assert wilson(0, 0) == (0.0, 1.0)
    assert wilson(10, 10)[1] == pytest.approx(1.0)


def test_pushes_and_kidnaps_are_in_the_world_file(tmp_path):
    for seed in (0, 3):  # flats
        entry = LocalisationEntry("pushed", seed, Options(tmp_path))
        (event,) = read_world(make_case(entry).file).timeline
        by, over = push_of(entry)
        assert event.push.by.distance_to(by) < 1e-9 and event.push.over == over
        assert 0.09 < np.hypot(by.x, by.y) < 2.01 and abs(by.heading) <= pi / 3 + 1e-3
    world = read_world(make_case(LocalisationEntry("kidnapped", 3, Options(tmp_path))).file)
    assert world.timeline[0].move_robot.distance_to(world.start) > 0.0
    assert world.timeline[0].trigger.time == 8.0


def test_without_names_all_experiments_are_run_and_names_are_checked(tmp_path):
    assert len(entries_of(Options(tmp_path, seeds=range(2)))) == 2 * len(EXPERIMENTS)
    with pytest.raises(InputError, match="no experiment 'flut'"):
        entries_of(Options(tmp_path, names=("flut",)))


def test_one_run_from_an_unknown_start_becomes_a_row_that_can_be_read_again(tmp_path):
    row = LOCALISATION.row(LocalisationEntry("unknown", 0, Options(tmp_path)), tmp_path)
    assert row.success and row.driving <= 10.0
    assert sum(bin_[0] for bin_ in row.bins) == pytest.approx(row.time / 0.1, abs=3)
    assert type(row).read(json.loads(json.dumps(asdict(row)))) == row
    figures, _ = table_of([row])
    assert (figures["experiment"], figures["passed"]) == ("unknown", "1/1")
    assert figures["95 % interval"] == "21% to 100%"
    draw_reliability(tmp_path / "reliability.png", bins_of([row]), 0.1)
    assert (tmp_path / "reliability.png").stat().st_size > 1000
    late = replace(row, experiment="pushed", noticed=1.0, corrected=16.0)
    assert cause_of(late, is_near=True) == "not within 10 cm in 15 s, but after 16.0 s"
    goals = replace(row, goals=3, false_goals=1)
    assert cause_of(goals, is_near=True) == "1 of 3 goals reported as reached were not"

"""BARN's metric: by hand, from the organisers' definition."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from missions.bench.goal_runs import TrialRow
from missions.bench.trial import GoalMonitor, TrialState
from stack.types import Pose2D
from tests.benchmarks.benches.barn import BARN, RULES, score, table_of

RUN = TrialRow(
    setup="barn", world="7", trial=0, status="success", cause="", time=12.0,
    path_length=12.0, driven=11.0, clearance=0.1, recoveries=0, replans=1, end=(0.0, 9.0, 1.5),
    wall_seconds=1.0,
)  # fmt: skip


@pytest.mark.parametrize(
    ("seconds", "k", "expected"),
    [  # optimal time of 12 m at 2 m/s: 6 s
        (6.0, 2.0, 0.5),  # faster than 2 x 6 s earns no more
        (12.0, 2.0, 0.5),
        (24.0, 2.0, 0.25),
        (24.0, 4.0, 0.25),
        (12.0, 4.0, 0.25),
        (48.0, 2.0, 0.125),
        (90.0, 2.0, 0.125),  # slower than 8 x 6 s costs no more
    ],
)
def test_the_score(seconds, k, expected):
    assert score(True, seconds, 12.0, k) == pytest.approx(expected)
    assert score(False, seconds, 12.0, k) == 0.0


@given(st.floats(0.1, 100.0), st.floats(5.0, 20.0))
def test_the_score_never_rises_with_time(seconds, length):
    assert score(True, seconds, length, 2.0) >= score(True, seconds + 1.0, length, 2.0)


def looked(monitor, *places, period=1.0):
    for n, place in enumerate(places):
        monitor.update(TrialState(n * period, Pose2D(*place)))
    return monitor


def test_the_clock_starts_after_a_tenth_of_a_metre():
    monitor = looked(
        GoalMonitor(Pose2D(0.0, 10.0), RULES), (0, 0), (0, 0.05), (0, 0.2), (0, 1), (0, 2)
    )
    assert monitor.started == 2.0 and monitor.time == 2.0
    assert monitor.driven == pytest.approx(2.0)
    assert monitor.status == ""


def test_a_metre_from_the_goal_is_there():
    monitor = looked(GoalMonitor(Pose2D(0.0, 10.0), RULES), (0, 0), (0, 8.99))
    assert monitor.status == ""
    assert looked(monitor, (0, 9.0)).status == "success"


def test_a_contact_fails_even_at_the_goal():
    monitor = GoalMonitor(Pose2D(0.0, 0.0), RULES)
    monitor.update(TrialState(1.0, Pose2D(0.0, 0.0), contact=True))
    assert monitor.status == "contact"


def test_time_is_up_a_hundred_seconds_after_the_start_or_without_one():
    moving = looked(GoalMonitor(Pose2D(0.0, 50.0), RULES), (0, 0), (0, 1), period=20.0)
    moving.update(TrialState(119.9, Pose2D(0.0, 2.0)))
    assert moving.status == ""
    moving.update(TrialState(120.0, Pose2D(0.0, 2.0)))
    assert moving.status == "timeout"
    standing = looked(GoalMonitor(Pose2D(0.0, 50.0), RULES), (0, 0), (0, 0), period=100.0)
    assert standing.status == "timeout"


def test_a_mission_that_ends_elsewhere_gave_up():
    monitor = GoalMonitor(Pose2D(0.0, 50.0), RULES)
    monitor.update(TrialState(1.0, Pose2D(0.0, 0.0), outcome="success"))
    assert monitor.status == "gave_up"


def test_failures_count_as_zeros():
    failed = replace(RUN, trial=1, status="contact", cause="touched at (1, 2)")
    (row,) = table_of([RUN, failed])
    assert (row["worlds"], row["success"], row["success %"], row["contact"]) == (1, "1/2", 50.0, 1)
    assert (row["score k=2"], row["score k=4"]) == (0.25, 0.125)
    assert BARN.report([RUN, failed])[-1] == "  barn, 7 trial 1: contact: touched at (1, 2)"


def test_a_run_whose_process_ended_counts_as_a_zero():
    """It has neither a time nor a path length."""
    crashed = TrialRow.crashed(("barn", "7", 1), "exit code 3")
    assert table_of([RUN, crashed])[0]["score k=2"] == 0.25
    assert table_of([crashed])[0]["score k=2"] == 0.0

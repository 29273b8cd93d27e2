"""The bench of following: its table and its recorder."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from missions.bench.bench import Options
from stack.telemetry.records import Event, MissionState, Snapshot
from stack.types import Battery, Pose2D
from tests.benchmarks.benches.follow import FOLLOW, FollowRow, GapRecorder, entries_of, table_of

ROW = FollowRow(
    "scout", 0, status="passed", cause="", drove_into=0, struck=0, things=0, least_distance=0.3,
    intimate=2.0, personal=20.0, mean_gap=1.4, largest_gap=3.0, lost=1, time=40.0, driven=12.0,
    wall_seconds=9.0,
)  # fmt: skip


def test_the_table_sums_contacts_and_averages_gaps_of_what_passed():
    lost = replace(
        ROW, seed=1, status="failed", cause="PERSON_LOST", struck=1, least_distance=0.0,
        mean_gap=9.0, intimate=4.0,
    )  # fmt: skip
    (row,) = table_of([ROW, lost])
    assert (row["success"], row["drove into"], row["struck"]) == ("1/2", 0, 1)
    assert (row["mean gap"], row["intimate"]) == ("1.40 m", "3.0 s")
    assert (row["least distance"], row["lost"]) == ("0.00 m", "1.0")
    lines = FOLLOW.report([ROW, lost])
    assert len(lines) == 3 and "PERSON_LOST" in lines[2]


def test_a_crash_is_a_row(tmp_path):
    (entry,) = entries_of(Options(tmp_path, seeds=range(7, 8), robots=("scout",)))
    row = FollowRow.crashed(entry.key, "out of memory")
    assert (row.key, row.success) == (("scout", 7), False)


def snapshot(time, pose, people):
    return Snapshot(
        time,
        0,
        MissionState.RUNNING,
        "",
        (),
        pose,
        np.eye(3),
        1.0,
        Battery(1.0),
        truth=pose,
        people=np.array(people),
    )


def test_the_gap_is_between_the_outlines_and_a_step_counts_once():
    recorder = GapRecorder(0.22)
    recorder.snapshot(snapshot(1.0, Pose2D(0.0, 0.0), [(3.0, 4.0, 0.2), (0.5, 0.0, 0.2)]))
    recorder.snapshot(snapshot(1.0, Pose2D(0.0, 0.0), [(9.0, 0.0, 0.2), (0.5, 0.0, 0.2)]))
    assert recorder.gaps == [pytest.approx(5.0 - 0.2 - 0.22)]  # a triangle of 3, 4 and 5 m
    assert recorder.time == 1.0


def test_contacts_with_people_are_not_contacts_with_things():
    recorder = GapRecorder(0.22)
    for touched, is_person in (("guide", True), ("a bench for one person", False)):
        text = f"contact with {touched} at (1.00, 2.00)"
        fields = {"touched": touched, "is_person": is_person, "at": [1.0, 2.0]}
        recorder.event(Event(0, 0, 1.0, "info", "simulation", "contact", text, fields))
    assert recorder.things == 1

"""What a report of a shipped mission says; for the suite and for the wheel test."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

RELOCALISED_BY = {  # in 07 a marker may or may not be in view when the scans first fit again
    "05_kidnapped": {"marker"}, "07_shelf_patrol": {"lidar", "marker"},
    "21_hotel_corridor": {"lidar"}, "26_use_the_map": {"lidar"},
    "34_visual_kidnap": {"appearance"},
}  # fmt: skip
"""Missions whose estimate is off by metres until it notices, or until it knows its start."""

ARGUMENTS = {"44_ground_station": {"shift": "20s"}}
"""Of missions that would wait for hours."""

A_LOG = "27_map_a_log"
"""There is no truth to compare a log with."""


def check_success(name: str, report: Mapping[str, Any]) -> None:
    """Check the report of a whole run."""
    assert (report["status"], report["reason"]) == ("success", ""), name
    check_safe(name, report)
    if name == "03_blocked_corridor":
        assert report["recoveries"] >= 1
    assert report["relocalised_by"] in RELOCALISED_BY.get(name, {""}), name
    assert report["simulated_seconds"] < 240.0, name  # "in under 4 minutes of simulated time"


def check_safe(name: str, report: Mapping[str, Any]) -> None:
    """Check what holds at any time of a run."""
    if name == A_LOG:
        assert (report["collisions"], report["localisation_error"]) == (None, None)
        return
    assert report["collisions"] == 0, name
    if report["distance_m"] is None:  # it has no wheels
        assert report["localisation_error"] is None, name
        return
    assert report["localisation_error"] is not None, name
    if name not in RELOCALISED_BY:
        assert report["localisation_error"]["max"] < 0.3, name

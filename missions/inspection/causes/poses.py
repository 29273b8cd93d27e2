"""Causes in the pose: wrong, unknown, or turning on the spot."""

from __future__ import annotations

from math import degrees, pi

import numpy as np

from missions.inspection.causes.cause import SYMPTOM, Cause, Fact, share
from missions.inspection.causes.evidence import Evidence, pose_error
from stack.types import FailureCode, wrap_angle
from stack.types.limitations import LOST

TURNED = 4.0 * pi
"""Radians turned at one place that explain a failure wholly: two full turns."""

HELD_UP = frozenset({FailureCode.LOST, FailureCode.AMBIGUOUS})


def pose_wrong(evidence: Evidence) -> Cause | None:
    """The estimate was confident, and elsewhere than the robot."""
    shot = evidence.last
    error = pose_error(shot)
    if error < 1.0 or shot.health < shot.health_thresholds.lost or shot.truth is None:
        return None
    first = next(item for item in evidence.shots if pose_error(item) >= 1.0)
    away = shot.pose.distance_to(shot.truth)
    turned = abs(wrap_angle(shot.pose.heading - shot.truth.heading))
    moved = evidence.told("lifted")
    facts = (
        Fact(f"the estimate is {away:.2f} m and {degrees(turned):.0f} deg from the truth "
             f"({shot.truth.x:.2f}, {shot.truth.y:.2f}), with a health of {shot.health:.2f}",
             shot.time, (shot.pose.x, shot.pose.y)),
        Fact("the pose was wrong", first.time, (first.pose.x, first.pose.y)),
        *(Fact(event.text, event.time) for event in moved[-1:]),
    )  # fmt: skip
    return Cause(
        "pose wrong", SYMPTOM * share(error, 2.0),
        "the robot was sure of a pose that is not where it was", facts,
        "check `initial_pose` and the map; relocalise before the drive, and add markers or "
        "posters where places look alike",
    )  # fmt: skip


def lost(evidence: Evidence) -> Cause | None:
    """The robot did not know where it was."""
    held = evidence.held_share(LOST)
    certain = evidence.code in HELD_UP
    if not certain and not held:
        return None
    doubts = evidence.told("doubt")[-2:]
    shot, rivals = evidence.before, len(evidence.last.rivals)
    facts = (
        Fact(f"health {evidence.last.health:.2f}, lost below "
             f"{evidence.last.health_thresholds.lost:g}", evidence.end,
             (shot.pose.x, shot.pose.y)),
        *(Fact(event.text, event.time) for event in doubts),
        *([Fact(f"{rivals + 1} places explain the scans about as well")] if rivals else []),
        *(Fact(event.text, event.time) for event in evidence.told("lifted")[-1:]),
    )  # fmt: skip
    return Cause(
        "lost", SYMPTOM if certain else SYMPTOM * held,
        "the robot did not know where it was", facts,
        "run `relocalise` or `disambiguate` first, for example in an event on "
        "`localisation.health`",
    )  # fmt: skip


def spinning(evidence: Evidence) -> Cause | None:
    """The robot turned on the spot."""
    shots = evidence.shots[-evidence.stalled :]
    headings = np.unwrap([shot.odometry.heading for shot in shots])
    turned = float(np.abs(np.diff(headings)).sum())
    if turned < TURNED / 2.0:
        return None
    pose = shots[-1].pose
    facts = (
        Fact(f"it turned by {turned / (2 * pi):.1f} turns in {shots[-1].time - shots[0].time:.1f} s"
             " without leaving its place", shots[0].time, (pose.x, pose.y)),
    )  # fmt: skip
    return Cause(
        "spinning", SYMPTOM * share(turned, TURNED), "the robot turned on the spot", facts,
        "look at the path and the local plan with `treepilot replay`: two nodes or recoveries that "
        "turn it to and fro, a heading tolerance that it cannot meet, or a heading that is wrong",
    )  # fmt: skip


CAUSES = (pose_wrong, lost, spinning)

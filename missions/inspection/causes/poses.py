"""Causes in the pose: moved by hand, wrong, unknown, or turning on the spot."""

from __future__ import annotations

from math import degrees, pi

import numpy as np

from missions.inspection.causes.cause import BELIEVED, CERTAIN, SYMPTOM, TRULY, Cause, Fact, share
from missions.inspection.causes.evidence import Evidence, pose_error
from missions.inspection.causes.motion import jump_of
from stack.types import FailureCode, wrap_angle
from stack.types.limitations import LOST

TURNED = 4.0 * pi
"""Radians turned at one place that explain a failure wholly: two full turns."""

HELD_UP = frozenset({FailureCode.LOST, FailureCode.AMBIGUOUS})


def moved_by_hand(evidence: Evidence) -> Cause | None:
    """Somebody carried the robot: it is elsewhere, and its wheels did not drive it there.

    Without a truth, a jump of the estimate after doubt says so too, but less surely: the pose may
    have been wrong before.
    """
    confused = 1.0 if _is_confused(evidence) else evidence.held_share(LOST)
    lifted = evidence.told("lifted", evidence.shots[0].time)[-1:]
    jumped = jump_of(evidence.shots)
    if not confused or not (lifted or jumped):
        return None
    is_seen = bool(lifted) or evidence.last.truth is not None
    if not is_seen and not evidence.told("doubt", evidence.shots[0].time):
        return None
    facts = [Fact(event.text, event.time) for event in lifted]
    if jumped is not None:
        what = "robot" if is_seen else "estimate"
        facts.append(
            Fact(f"the {what} moved by {jumped.distance:.2f} m, its wheels by "
                 f"{jumped.wheels:.2f} m", jumped.time, jumped.at,
                 TRULY if evidence.last.truth else BELIEVED)
        )  # fmt: skip
    return Cause(
        "moved by hand", confused * (CERTAIN if is_seen else SYMPTOM),
        "the robot was carried to another place, and did not know where it was", tuple(facts),
        "run `relocalise` after a move, for example in an event on `localisation.health`; or tell "
        "the robot its pose (`i` in the dashboard, `treepilot tell RUN pose POSE`)",
    )  # fmt: skip


def _is_confused(evidence: Evidence) -> bool:
    return evidence.code in HELD_UP or pose_error(evidence.last) >= 1.0


def pose_wrong(evidence: Evidence) -> Cause | None:
    """The estimate was confident, and elsewhere than the robot."""
    shot = evidence.last
    error = pose_error(shot)
    if error < 1.0 or shot.health < shot.health_thresholds.lost or shot.truth is None:
        return None
    if moved_by_hand(evidence) is not None:
        return None
    first = next(item for item in evidence.shots if pose_error(item) >= 1.0)
    away = shot.pose.distance_to(shot.truth)
    turned = abs(wrap_angle(shot.pose.heading - shot.truth.heading))
    facts = (
        Fact(f"the estimate is {away:.2f} m and {degrees(turned):.0f} deg from the truth "
             f"({shot.truth.x:.2f}, {shot.truth.y:.2f}), with a health of {shot.health:.2f}",
             shot.time, (shot.pose.x, shot.pose.y), BELIEVED),
        Fact("the pose was wrong", first.time, (first.pose.x, first.pose.y), BELIEVED),
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
    shot, rivals = evidence.last, len(evidence.last.rivals)
    worst = min(evidence.shots, key=lambda item: item.health)
    facts = (
        Fact(f"health {worst.health:.2f}, lost below {worst.health_thresholds.lost:g}",
             worst.time, (worst.pose.x, worst.pose.y), BELIEVED),
        *([Fact(f"health {shot.health:.2f} at the failure", shot.time)]
          if shot.health >= shot.health_thresholds.lost else []),
        *(Fact(event.text, event.time) for event in doubts),
        *([Fact(f"{rivals + 1} places explain the scans about as well")] if rivals else []),
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


CAUSES = (moved_by_hand, pose_wrong, lost, spinning)

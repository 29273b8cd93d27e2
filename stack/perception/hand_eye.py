"""Mount of a camera on an arm's hand, or beside the arm, from views of a marker.

In each view the arm is at another pose. With a camera in the hand the marker stands still; with a
camera on a mast the hand holds the marker. Either way two transforms stay the same and are unknown,
the mount X and where the marker is, Y: A X B = Y, where the arm measures A and the picture B.

A closed form (F. Park, B. Martin, "Robot Sensor Calibration: Solving AX = XB on the Euclidean
Group", IEEE Transactions on Robotics and Automation 10, 1994) begins. Least squares over both
transforms at once follow, so that errors of turns do not add up in the position.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, degrees, radians

import cv2
import numpy as np

from stack.errors import InputError
from stack.frames.tree import inverse
from stack.types import FloatArray

LEAST_VIEWS = 5
"""Views that are needed: three would do without noise, and none of them would check the others."""

ENOUGH_VIEWS = 15
"""Views below which the result says so."""

LEAST_TURN = radians(6.0)
"""Smallest turn of the hand about a second axis between the views, RMS."""

LARGEST_RESIDUAL = 0.05
"""RMS distance beyond which arm, marker and camera do not fit together, metres."""

OUTLIER = 3.0
"""Residual in RMS of the others, or in the noise, beyond which a view is named as doubtful."""

TURN_NOISE, MOVE_NOISE = radians(0.2), 0.001
"""Usual deviations of the turn and the position of a marker in a picture, radians and metres; their
ratio weights the residuals."""

_STEPS, _HALF_TURN = 20, radians(170.0)


@dataclass(frozen=True, eq=False, slots=True)
class HandEyeView:
    """The arm and the marker in one picture.

    Attributes:
        base_from_tool: (4, 4) pose of the tool, or of the link that carries camera or marker.
        camera_from_marker: (4, 4) pose of the marker in the optical frame.
    """

    base_from_tool: FloatArray
    camera_from_marker: FloatArray


@dataclass(frozen=True, eq=False, slots=True)
class HandEye:
    """Result of a calibration.

    Attributes:
        mount: (4, 4) pose of the optical frame: in the tool for a camera in the hand, else in the
            base frame.
        marker: (4, 4) pose of the marker: in the base frame for a camera in the hand, else in the
            tool.
        deviations: (6,) standard deviations of the mount: position, metres, and turn about its
            axes, radians.
        moves: (n,) distance of the marker in each view from where it should be, metres.
        turns: (n,) the same of its turn, radians.
    """

    mount: FloatArray
    marker: FloatArray
    deviations: FloatArray
    moves: FloatArray
    turns: FloatArray

    @property
    def rms(self) -> tuple[float, float]:
        """RMS of distances, metres, and of turns, radians."""
        move, turn = (float(np.sqrt(np.mean(np.square(one)))) for one in (self.moves, self.turns))
        return move, turn

    @property
    def doubtful(self) -> tuple[int, ...]:
        """Views that do not fit to the others, by their index."""
        found: list[int] = []
        for number in range(len(self.moves)):
            for off, noise in ((self.moves, MOVE_NOISE), (self.turns, TURN_NOISE)):
                rest = float(np.sqrt(np.mean(np.square(np.delete(off, number)))))
                if off[number] > OUTLIER * max(rest, noise) and number not in found:
                    found.append(number)
        return tuple(found)


def calibrate_hand_eye(views: Sequence[HandEyeView], *, in_hand: bool) -> HandEye:
    """Return the mount of a camera with the smallest residuals.

    Args:
        views: of one marker; the hand turned about two axes at least between them.
        in_hand: whether the hand carries the camera; else it carries the marker.

    Raises:
        InputError: there are too few views, they do not determine the mount, or they do not fit.
    """
    if len(views) < LEAST_VIEWS:
        raise InputError(
            f"{len(views)} views show the marker, at least {LEAST_VIEWS} are needed "
            f"({ENOUGH_VIEWS} are better), with the hand turned to different sides"
        )
    arm = np.array([view.base_from_tool for view in views])
    if not in_hand:
        arm = np.array([inverse(pose) for pose in arm])
    seen = np.array([view.camera_from_marker for view in views])
    _require_turns(arm)
    mount = _closed_form(arm, seen)
    marker = _mean(arm @ mount @ seen)
    mount, marker, normal = _refined(arm, seen, mount, marker)
    off = _residuals(arm, seen, mount, marker)
    result = HandEye(
        mount, marker, _deviations(off, normal), np.linalg.norm(off[:, 3:], axis=1) * MOVE_NOISE,
        np.linalg.norm(off[:, :3], axis=1) * TURN_NOISE,
    )  # fmt: skip
    if not result.rms[0] <= LARGEST_RESIDUAL:  # also NaN
        raise InputError(
            f"poses of the arm and of the marker do not fit together: {100 * result.rms[0]:.0f} cm "
            f"RMS remain, at most {100 * LARGEST_RESIDUAL:g} cm are accepted; check which of "
            "camera and marker is in the hand, the side of the marker, and that it did not slip"
        )
    return result


def _require_turns(arm: FloatArray) -> None:
    """Raise InputError unless the hand turns about two axes."""
    turns = np.array([_turn_vector(arm[0, :3, :3].T @ pose[:3, :3]) for pose in arm])
    spread = np.linalg.svd(turns - turns.mean(axis=0), compute_uv=False) / np.sqrt(len(arm))
    if spread[1] < LEAST_TURN:
        raise InputError(
            f"the hand turns by {degrees(spread[0]):.0f} deg about one axis and by "
            f"{degrees(spread[1]):.1f} deg about a second one (RMS, at least "
            f"{degrees(LEAST_TURN):.0f} deg are needed), so the views do not determine the mount; "
            "tilt the hand to the left, right, front and back by 20 to 40 deg, and turn it"
        )


def _closed_form(arm: FloatArray, seen: FloatArray) -> FloatArray:
    """Return X of A X B = Y: by the motions between all pairs of views, A' X = X B'."""
    pairs = [(i, j) for j in range(len(arm)) for i in range(j)]
    by_arm = np.array([inverse(arm[j]) @ arm[i] for i, j in pairs])
    by_camera = np.array([seen[j] @ inverse(seen[i]) for i, j in pairs])
    turns = np.array([_turn_vector(one[:3, :3]) for one in by_arm])
    same = np.array([_turn_vector(one[:3, :3]) for one in by_camera])
    clear = np.linalg.norm(turns, axis=1) < _HALF_TURN  # else the sign of the axis is open
    mount = np.eye(4)
    mount[:3, :3] = _nearest_turn(turns[clear].T @ same[clear])
    normal = (by_arm[:, :3, :3] - np.eye(3)).reshape(-1, 3)
    wanted = (by_camera[:, :3, 3] @ mount[:3, :3].T - by_arm[:, :3, 3]).ravel()
    mount[:3, 3] = np.linalg.lstsq(normal, wanted, rcond=None)[0]
    return mount


def _nearest_turn(matrix: FloatArray) -> FloatArray:
    """Return the rotation (3, 3) nearest to a matrix, by the sum of squares."""
    u, _, vt = np.linalg.svd(matrix)
    found: FloatArray = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    return found


def _mean(poses: FloatArray) -> FloatArray:
    found = np.eye(4)
    found[:3, :3] = _nearest_turn(poses[:, :3, :3].sum(axis=0))
    found[:3, 3] = poses[:, :3, 3].mean(axis=0)
    return found


def _refined(
    arm: FloatArray, seen: FloatArray, mount: FloatArray, marker: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return X and Y with the least squares (Gauss-Newton), and the normal matrix (12, 12)."""
    difference = 1e-6
    for _ in range(_STEPS):
        off: FloatArray = _residuals(arm, seen, mount, marker).ravel()
        moved = [
            _residuals(arm, seen, mount @ _small(one[:6]), marker @ _small(one[6:])).ravel()
            for one in difference * np.eye(12)
        ]
        jacobian: FloatArray = (np.array(moved) - off).T / difference
        normal: FloatArray = jacobian.T @ jacobian
        step = np.asarray(np.linalg.solve(normal, -(jacobian.T @ off)), np.float64)
        mount, marker = mount @ _small(step[:6]), marker @ _small(step[6:])
        if np.abs(step).max() < 1e-9:
            break
    return mount, marker, normal


def _residuals(
    arm: FloatArray, seen: FloatArray, mount: FloatArray, marker: FloatArray
) -> FloatArray:
    """Return (n, 6) turns and moves of the marker in the camera, in deviations of the noise."""
    expected = np.linalg.inv(arm @ mount) @ marker
    off = np.linalg.inv(expected) @ seen
    turns = np.array([_turn_vector(one[:3, :3]) for one in off])
    return np.column_stack([turns / TURN_NOISE, off[:, :3, 3] / MOVE_NOISE])


def _turn_vector(turn: FloatArray) -> FloatArray:
    """Return (3,) axis times angle of a rotation (3, 3) by less than half a turn."""
    skew = 0.5 * (turn - turn.T)
    axis = np.array([skew[2, 1], skew[0, 2], skew[1, 0]])
    sine = float(np.linalg.norm(axis))
    angle = atan2(sine, 0.5 * (float(np.trace(turn)) - 1.0))
    return axis * (angle / sine if sine > 0.0 else 1.0)


def _small(step: FloatArray) -> FloatArray:
    """Return the transform (4, 4) of a turn (3,) and a move (3,)."""
    found = np.eye(4)
    found[:3, :3], found[:3, 3] = cv2.Rodrigues(step[:3])[0], step[3:]
    return found


def _deviations(off: FloatArray, normal: FloatArray) -> FloatArray:
    variance = float(np.square(off).sum()) / max(1, off.size - 12)
    spread = np.sqrt(variance * np.diagonal(np.linalg.inv(normal))[:6])
    return np.concatenate([spread[3:], spread[:3]])

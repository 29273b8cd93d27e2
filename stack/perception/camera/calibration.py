"""Intrinsics of a camera from views of a flat board.

Least squares of the reprojection errors of all corners over intrinsics, distortion and the pose of
the board in each view (Z. Zhang, "A Flexible New Technique for Camera Calibration", PAMI 22, 2000;
OpenCV's calibrateCamera). Views of parallel planes give the same two equations of the intrinsics
again and again, so the board must be tilted differently in the pictures: with too little tilt the
focal length and the distances cannot be told apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import acos, degrees, radians
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from stack.errors import InputError
from stack.perception.camera.board import BoardView
from stack.types import DISTORTION, CameraModel, FloatArray

LEAST_VIEWS = 4
"""Views that are needed: two would do without noise, and none of them would check the others."""

ENOUGH_VIEWS = 10
"""Views below which the result says so."""

LEAST_TILT = radians(12.0)
"""Smallest largest angle between the board in two views."""

LARGEST_DEVIATION = 0.03
"""Largest standard deviation of the focal lengths as a share of them."""

GRID = (6, 8)
"""Rows and columns of the grid of the picture in which corners are counted."""

TERMS = {
    0: cv2.CALIB_FIX_K1 | cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST,
    1: cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST,
    2: cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST,
    4: cv2.CALIB_FIX_K3,
    5: 0,
}
"""Number of distortion coefficients that are estimated -> flags: none, k1, k1 k2, k1 k2 p1 p2,
all."""


@dataclass(frozen=True, slots=True)
class Calibration:
    """Result of a calibration.

    Attributes:
        camera: intrinsics; the mount is that of a camera at the base's origin.
        rms: root mean square reprojection error, pixels.
        view_errors: (n,) the same of each view, pixels.
        deviations: standard deviation of fx, fy, cx, cy, k1, k2, p1, p2, k3 by name; 0 where not
            estimated.
        tilt: largest angle between the board in two views, radians.
        counts: (GRID) corners in each part of the picture.
        reach: largest distance of a corner from the principal point, as a share of that of the
            picture's farthest corner.
        residuals: for each view (n, 2), seen minus expected, pixels.
    """

    camera: CameraModel
    rms: float
    view_errors: FloatArray
    deviations: dict[str, float]
    tilt: float
    counts: NDArray[np.int64]
    reach: float
    residuals: tuple[FloatArray, ...]

    @property
    def coverage(self) -> float:
        """Share of the parts of the picture that hold a corner."""
        return float((self.counts > 0).mean())


def calibrate(views: Sequence[BoardView], size: tuple[int, int], terms: int = 5) -> Calibration:
    """Return the intrinsics with the smallest reprojection error.

    Args:
        views: usable views of one board by one camera with fixed focus and zoom.
        size: width and height of the pictures, pixels.
        terms: number of distortion coefficients, a key of TERMS.

    Raises:
        InputError: there are too few views, or they do not determine the focal length.
    """
    if len(views) < LEAST_VIEWS:
        raise InputError(
            f"{len(views)} of the pictures can be used, at least {LEAST_VIEWS} are needed "
            f"({ENOUGH_VIEWS} to 20 are better), with the board tilted to different sides"
        )
    corners = [view.corners.astype(np.float32) for view in views]
    points = [view.points.astype(np.float32) for view in views]
    start = np.array([[max(size), 0, size[0] / 2], [0, max(size), size[1] / 2], [0, 0, 1.0]])
    rms, intrinsics, found, turns, moves, spread, _, errors = cv2.calibrateCameraExtended(
        points, corners, size, start, np.zeros(5),
        flags=TERMS[terms] | cv2.CALIB_USE_INTRINSIC_GUESS,
        criteria=(cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 200, 1e-10),
    )  # fmt: skip
    matrix = np.asarray(intrinsics, dtype=np.float64)
    names = ("fx", "fy", "cx", "cy", *DISTORTION)
    deviations = dict(zip(names, np.ravel(spread)[: len(names)].tolist(), strict=True))
    tilt = _largest_tilt(turns)
    _require_determined(tilt, deviations, matrix)
    fx, fy, cx, cy = (float(matrix[at]) for at in ((0, 0), (1, 1), (0, 2), (1, 2)))
    camera = CameraModel(
        *size, fx, (0.0, 0.0, 0.0), focal_length_y=fy, principal_point=(cx, cy),
        distortion=tuple(np.ravel(found)[: len(DISTORTION)].tolist()),
    )  # fmt: skip
    if not camera.is_invertible():
        raise InputError(
            "the distortion found folds the border of the picture, where there are no corners: "
            "take pictures with the board there, or estimate fewer coefficients, e.g. --terms 2"
        )
    seen = np.concatenate([view.corners for view in views])
    return Calibration(
        camera, float(rms), np.ravel(errors), deviations, tilt, _counts(seen, size),
        _reach(seen, camera), _residuals(views, matrix, found, turns, moves),
    )  # fmt: skip


def _largest_tilt(turns: Sequence[Any]) -> float:
    normals = np.array([cv2.Rodrigues(turn)[0][:, 2] for turn in turns])
    return acos(float(np.clip((normals @ normals.T).min(), -1.0, 1.0)))


def _require_determined(tilt: float, deviations: dict[str, float], matrix: FloatArray) -> None:
    """Raise InputError if the views do not determine the focal length."""
    advice = "take pictures with the board tilted by 20 to 45 deg, to the left, right, up and down"
    if tilt < LEAST_TILT:
        raise InputError(
            "all pictures show the board from nearly the same angle (within "
            f"{degrees(tilt):.1f} deg, at least {degrees(LEAST_TILT):.0f} deg are needed), so they "
            f"do not determine the focal length; {advice}"
        )
    share = max(deviations["fx"] / matrix[0, 0], deviations["fy"] / matrix[1, 1])
    if not share <= LARGEST_DEVIATION:
        raise InputError(
            f"the pictures determine the focal length to {100 * share:.1f} % only (at most "
            f"{100 * LARGEST_DEVIATION:g} % is accepted); {advice}"
        )


def _counts(seen: FloatArray, size: tuple[int, int]) -> NDArray[np.int64]:
    rows = np.clip(seen[:, 1] / size[1] * GRID[0], 0, GRID[0] - 1).astype(int)
    columns = np.clip(seen[:, 0] / size[0] * GRID[1], 0, GRID[1] - 1).astype(int)
    counts = np.zeros(GRID, dtype=np.int64)
    np.add.at(counts, (rows, columns), 1)
    return counts


def _reach(seen: FloatArray, camera: CameraModel) -> float:
    centre = np.array([camera.cx, camera.cy])
    ends = np.array([[x, y] for x in (0, camera.width) for y in (0, camera.height)])
    farthest = np.linalg.norm(ends - centre, axis=1).max()
    return float(np.linalg.norm(seen - centre, axis=1).max() / farthest)


def _residuals(
    views: Sequence[BoardView], matrix: FloatArray, distortion: Any,
    turns: Sequence[Any], moves: Sequence[Any],
) -> tuple[FloatArray, ...]:  # fmt: skip
    found = []
    for view, turn, move in zip(views, turns, moves, strict=True):
        expected, _ = cv2.projectPoints(view.points, turn, move, matrix, distortion)
        found.append(view.corners - np.reshape(expected, (-1, 2)))
    return tuple(found)

"""Survey: the poses of unknown markers from views with known robot poses.

Each marker is upright; its x, y, height and heading follow from the corners in all its views by
robust least squares on the reprojection errors (Huber weights; P. Huber, "Robust Estimation of a
Location Parameter", 1964). A single view has two solutions; each solution of several views is a
start, and the one that explains all views best wins, so views from different directions resolve the
ambiguity. The errors of the robot's poses in one run are alike, since they come from one map: they
do not average out, and are added to the covariance as a whole.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from math import atan2, hypot

import numpy as np

from stack.frames.tree import inverse, lifted
from stack.perception.markers.detector import MarkerDetection
from stack.perception.markers.parameters import MarkerParameters
from stack.perception.markers.square_pose import corners_in_map, mean_side, square_solutions
from stack.types import CameraModel, FloatArray, Image, Marker, Pose2D, wrap_angle

_SPACING, _TURN = 0.15, 0.15
"""Metres and radians by which views of a marker differ at least."""

_MOST_VIEWS = 80
"""Views of a marker that are kept; then those in which it is smallest are dropped."""

LEAST_SIDE = 14.0
"""Pixels; smaller markers are left out: their corners are biased."""

_INDEPENDENT = 10.0
"""Views whose errors of the corners are independent at most; those from one direction are alike."""

_HUBER = 2.0
"""Deviations of the pixel noise from which on a corner's weight falls."""

_STARTS = 4
"""Views, those in which the marker is largest, whose solutions are starts."""

Corrected = Callable[[float, Pose2D], Pose2D | None]

_ITERATIONS = 20
_STEP = 1e-5
_NEAREST = 0.05
"""Metres in front of the camera; points that are nearer have no image."""


@dataclass(frozen=True, slots=True)
class MarkerView:
    """A marker seen from one pose of the robot.

    Attributes:
        stamp: of the picture, seconds.
        base: pose, map frame.
        odometry: pose, odom frame.
        covariance: (3, 3) of the pose.
        camera: model and mount.
        corners: (4, 2) pixels.
    """

    stamp: float
    base: Pose2D
    odometry: Pose2D
    covariance: FloatArray
    camera: CameraModel
    corners: FloatArray

    @property
    def side(self) -> float:
        """Mean length of the marker's sides, pixels."""
        return mean_side(self.corners)


class MarkerSurvey:
    """Collects views of unknown markers and estimates the markers' poses."""

    def __init__(self, parameters: MarkerParameters) -> None:
        self.parameters = parameters
        self.views: dict[tuple[str, int], list[MarkerView]] = {}

    def configure(self, parameters: MarkerParameters) -> None:
        """Apply new parameters; the views stay."""
        self.parameters = parameters

    def add(
        self, found: MarkerDetection, image: Image, base: Pose2D, covariance: FloatArray,
        odometry: Pose2D,
    ) -> None:  # fmt: skip
        """Add a view of a marker, unless there is one from about the same place.

        Args:
            found: the marker in the image.
            image: stamp and camera.
            base: pose at the image's stamp, map frame.
            covariance: (3, 3) of it.
            odometry: likewise, odom frame.
        """
        if found.dictionary != self.parameters.surveyed_dictionary:
            return
        view = MarkerView(image.stamp, base, odometry, covariance, image.camera, found.corners)
        kept = self.views.setdefault((found.dictionary, found.number), [])
        if view.side < LEAST_SIDE or any(_is_same_place(view.base, one.base) for one in kept):
            return
        kept.append(view)
        if len(kept) > _MOST_VIEWS:
            kept.remove(min(kept, key=lambda one: one.side))

    def markers(self, corrected: Corrected, mapped: Sequence[Marker] = ()) -> tuple[Marker, ...]:
        """Return the markers that have enough views, with standard deviations, in order.

        Args:
            corrected: returns the base's pose at a stamp and odometry pose as it is known now, or
                None if it is still the one that the view has.
            mapped: markers that the estimator has measured. They are returned with the errors that
                all pictures share, instead of what their views give.
        """
        found: list[Marker | None] = [
            _with_shared_errors(marker, self.parameters) for marker in mapped
        ]
        known = {(marker.dictionary, marker.number) for marker in mapped}
        for key, views in sorted(self.views.items()):
            if key not in known and len(views) >= self.parameters.least_views:
                poses = [corrected(view.stamp, view.odometry) or view.base for view in views]
                placed = [replace(view, base=pose) for view, pose in zip(views, poses, strict=True)]
                found.append(surveyed(key, placed, self.parameters))
        surveyed_ones = [marker for marker in found if marker is not None]
        return tuple(sorted(surveyed_ones, key=lambda one: (one.dictionary, one.number)))


def _with_shared_errors(marker: Marker, p: MarkerParameters) -> Marker:
    return replace(
        marker, position_deviation=hypot(marker.position_deviation, p.mount_deviation),
        heading_deviation=hypot(marker.heading_deviation, p.mount_angle_deviation),
    )  # fmt: skip


def surveyed(
    key: tuple[str, int], views: list[MarkerView], parameters: MarkerParameters
) -> Marker | None:
    """Return the marker (dictionary, number) that explains its views best; None if none does."""
    largest = sorted(views, key=lambda view: -view.side)[:_STARTS]
    starts = [start for view in largest for start in _solutions(view, parameters.surveyed_size)]
    marker = Marker(key[1], parameters.surveyed_size, (0.0, 0.0, 0.0), 0.0, key[0])
    views_of_it = _Views(views)
    found = [
        solved
        for start in starts
        if (solved := _refined(start, marker, views_of_it, parameters.pixel_noise)) is not None
    ]
    if not found:
        return None
    _, unknowns, covariance = min(found, key=lambda one: one[0])
    mount, turn = parameters.mount_deviation, parameters.mount_angle_deviation
    common = np.square([mount, mount, 0.0, turn])
    covariance = covariance * max(1.0, len(views) / _INDEPENDENT)
    total = covariance + _of_poses(unknowns, views) + np.diag(common)
    position = float(np.sqrt(np.linalg.eigvalsh(total[:2, :2])[-1]))
    return replace(
        _placed(marker, unknowns), position_deviation=position,
        heading_deviation=float(np.sqrt(total[3, 3])),
    )  # fmt: skip


def _is_same_place(one: Pose2D, other: Pose2D) -> bool:
    turned = abs(wrap_angle(one.heading - other.heading))
    return one.distance_to(other) < _SPACING and turned < _TURN


def _placed(marker: Marker, unknowns: FloatArray) -> Marker:
    x, y, height, heading = (float(value) for value in unknowns)
    return replace(marker, position=(x, y, height), heading=wrap_angle(heading))


def _solutions(view: MarkerView, size: float) -> Iterable[FloatArray]:
    """Yield x, y, height and heading of a marker for each pose that explains a single view."""
    for solution in square_solutions(size, view.camera, view.corners):
        base_from_marker = view.camera.base_from_optical() @ solution.optical_from_marker
        map_from_marker = lifted(view.base) @ base_from_marker
        out = map_from_marker[:3, 2]
        yield np.array([*map_from_marker[:3, 3], atan2(out[1], out[0])])


class _Views:
    """Views of a marker as arrays.

    Attributes:
        optical_from_map: (n, 3, 4).
        focal: (n, 1, 2) pixels. centre: (n, 1, 2) principal points, pixels.
        seen: (n, 4, 2) corners, pixels.
    """

    def __init__(self, views: list[MarkerView]) -> None:
        self.optical_from_map = np.array([
            inverse(lifted(view.base) @ view.camera.base_from_optical())[:3] for view in views
        ])  # fmt: skip
        cameras = [view.camera for view in views]
        self.focal = np.array([(camera.fx, camera.fy) for camera in cameras])[:, None, :]
        self.centre = np.array([(camera.cx, camera.cy) for camera in cameras])[:, None, :]
        self.seen = np.array([view.corners for view in views])

    def residuals(self, unknowns: FloatArray, marker: Marker) -> FloatArray | None:
        """Return (n, 8) reprojection errors, pixels; None if a view has the marker behind it."""
        corners = np.column_stack([corners_in_map(_placed(marker, unknowns)), np.ones(4)])
        points = np.einsum("nij,kj->nki", self.optical_from_map, corners)
        if (points[..., 2] < _NEAREST).any():
            return None
        expected = self.focal * points[..., :2] / points[..., 2:] + self.centre
        off: FloatArray = (self.seen - expected).reshape(len(self.seen), -1)
        return off


def _refined(
    start: FloatArray, marker: Marker, views: _Views, noise: float
) -> tuple[float, FloatArray, FloatArray] | None:
    """Return robust cost, unknowns and their covariance (4, 4) by damped Gauss-Newton steps."""
    unknowns, damping = start, 1e-3
    residuals = views.residuals(unknowns, marker)
    if residuals is None:
        return None
    cost = _cost(residuals, noise)
    normal = np.eye(4)
    for _ in range(_ITERATIONS):
        jacobian = _jacobian(unknowns, residuals, marker, views)
        if jacobian is None:
            return None
        weights = _weights(residuals, noise)
        weighted = jacobian * weights[:, :, None]
        normal = np.einsum("nka,nkb->ab", weighted, jacobian) / noise**2
        slope = np.einsum("nka,nk->a", weighted, residuals) / noise**2
        step = np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-9), slope)
        tried = views.residuals(unknowns + step, marker)
        if tried is None or _cost(tried, noise) > cost:
            damping *= 10.0
            continue
        unknowns, residuals, cost = unknowns + step, tried, _cost(tried, noise)
        damping = max(0.1 * damping, 1e-6)
        if np.abs(step).max() < 1e-6:
            break
    if not np.isfinite(normal).all() or np.linalg.cond(normal) > 1e14:
        return None
    return cost, unknowns, np.asarray(np.linalg.inv(normal), dtype=np.float64)


def _jacobian(
    unknowns: FloatArray, residuals: FloatArray, marker: Marker, views: _Views
) -> FloatArray | None:
    """Return (n, 8, 4) derivatives of the expected pixels, by differences."""
    columns = []
    for column in range(4):
        moved = unknowns.copy()
        moved[column] += _STEP
        changed = views.residuals(moved, marker)
        if changed is None:
            return None
        columns.append((residuals - changed) / _STEP)
    return np.stack(columns, axis=2)


def _weights(residuals: FloatArray, noise: float) -> FloatArray:
    """Return (n, 8) Huber weights, the same for all corners of a view."""
    size = np.sqrt((residuals**2).mean(axis=1)) / noise
    weights = np.minimum(1.0, _HUBER / np.maximum(size, 1e-9))
    return np.repeat(weights[:, None], residuals.shape[1], axis=1)


def _cost(residuals: FloatArray, noise: float) -> float:
    """Return the Huber cost of the views."""
    size = np.sqrt((residuals**2).mean(axis=1)) / noise
    inside = size <= _HUBER
    costs = np.where(inside, 0.5 * size**2, _HUBER * (size - 0.5 * _HUBER))
    return float(residuals.shape[1] * costs.sum())


def _of_poses(unknowns: FloatArray, views: list[MarkerView]) -> FloatArray:
    """Return the mean covariance (4, 4) that the robot's poses give to the marker."""
    total = np.zeros((4, 4))
    for view in views:
        off = unknowns[:2] - (view.base.x, view.base.y)
        lever = np.zeros((4, 3))
        lever[0], lever[1], lever[3] = [1.0, 0.0, -off[1]], [0.0, 1.0, off[0]], [0.0, 0.0, 1.0]
        total += lever @ view.covariance @ lever.T
    return total / len(views)

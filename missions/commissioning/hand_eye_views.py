"""Views of a marker in a recording of an arm, for the calibration of its camera's mount."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import radians

import numpy as np

from stack.drivetrain.description import BASE, RobotDescription
from stack.errors import FrameError, InputError
from stack.frames.joint_history import JointHistory
from stack.frames.links import RobotLinks
from stack.frames.tree import inverse
from stack.perception.hand_eye import HandEye, HandEyeView
from stack.perception.markers.detector import MarkerDetector
from stack.perception.markers.square_pose import square_solutions
from stack.types import CameraModel, FloatArray, Image, JointState, Observation

STILL, AROUND = radians(0.1), 0.1
"""Radians by which a joint may move within so many seconds before and after a picture."""

NEW_POSE = radians(3.0)
"""Radians by which a joint differs from those of all other views."""

CLEAR = 1.5
"""Ratio of the reprojection errors of the two poses that a square may have in a picture."""

LARGEST_ERROR = 1.0
"""Reprojection error of a marker that is used, pixels."""


@dataclass(frozen=True, slots=True)
class FoundViews:
    """What a recording shows of a marker.

    Attributes:
        views: usable ones, of different poses of the arm.
        stamps: of their pictures, seconds.
        unclear: number of pictures left out because the marker may be tilted to either side.
        moving: number of pictures left out because the arm moved.
    """

    views: tuple[HandEyeView, ...]
    stamps: tuple[float, ...]
    unclear: int
    moving: int


def views_in(
    seen: Iterable[Observation], robot: RobotDescription, number: int, size: float, dictionary: str
) -> FoundViews:
    """Return the views of a marker by the camera of a robot while its arm stands.

    Args:
        seen: a recording with the camera's pictures and the states of the joints.
        robot: with an arm and a camera, in the hand or elsewhere.
        number: of the marker in its dictionary.
        size: side of its black square, metres.
        dictionary: of OpenCV.

    Raises:
        InputError: the robot has no arm or no camera.
    """
    if robot.arm is None or robot.camera is None:
        lacks = "arm" if robot.arm is None else "camera"
        raise InputError(f"{robot.name} has no {lacks}, so there is no mount to calibrate")
    link = robot.camera.link or robot.arm.tool_link
    images, history = list[Image](), JointHistory(robot.arm.joints, np.inf)
    for observation in seen:
        images += observation.of(Image).values()
        for state in observation.of(JointState).values():
            history.add(state)
    links, detector = RobotLinks(robot.links, BASE), MarkerDetector((), None, (dictionary,))
    views, stamps, used = [], [], list[FloatArray]()
    unclear = moving = 0
    for image in images:
        positions = _standing(history, image.stamp)
        if positions is None:
            moving += 1
            continue
        if any(np.abs(positions - one).max() < NEW_POSE for one in used):
            continue
        for found in detector.detections(image):
            if found.number != number:
                continue
            pose = _marker_pose(size, image.camera, found.corners)
            if pose is None:
                unclear += 1
                continue
            at = dict(zip(robot.arm.joints, positions.tolist(), strict=True))
            views.append(HandEyeView(links.pose(link, at), pose))
            stamps.append(image.stamp)
            used.append(positions)
    return FoundViews(tuple(views), tuple(stamps), unclear, moving)


def _standing(history: JointHistory, stamp: float) -> FloatArray | None:
    """Return the positions of the joints at a stamp; None if they move, or are not known."""
    try:
        rows = [list(history.at(time).values()) for time in (stamp - AROUND, stamp, stamp + AROUND)]
    except FrameError:
        return None
    positions = np.array(rows)
    return positions[1] if float(np.ptp(positions, axis=0).max()) <= STILL else None


def _marker_pose(size: float, camera: CameraModel, corners: FloatArray) -> FloatArray | None:
    """Return optical <- marker (4, 4); None if a mirrored pose explains the corners as well."""
    best, *others = square_solutions(size, camera, corners)
    if best.error > LARGEST_ERROR or any(other.error < CLEAR * best.error for other in others):
        return None
    return best.optical_from_marker


def mounted(camera: CameraModel, result: HandEye) -> CameraModel:
    """Return a camera with the calibrated mount, in the base frame or in that of its link."""
    level = replace(camera, position=(0.0, 0.0, 0.0), pitch=0.0, yaw=0.0, roll=0.0)
    return level.mounted_on(result.mount @ inverse(level.base_from_optical()))

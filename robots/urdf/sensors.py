"""Finds the sensors of a URDF: Gazebo's, else links by their names."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from robots.declared import URDF
from robots.urdf.model import RobotModel
from stack.documents import Findings
from stack.documents.xml_file import Element
from stack.sim.sdf.frames import read_pose
from stack.types import FloatArray

GAZEBO_TYPES = {
    "ray": "lidar", "gpu_ray": "lidar", "gpu_lidar": "lidar", "lidar": "lidar",
    "camera": "camera", "wideanglecamera": "camera",
    "depth": "depth", "depth_camera": "depth", "rgbd": "depth", "rgbd_camera": "depth",
    "imu": "imu", "sonar": "sonar",
}  # fmt: skip
"""Kind of sensor by the type of a sensor in Gazebo."""

WORDS = {
    "lidar": re.compile(r"(^|_)(base_)?(lidar|laser|scan|rplidar|hokuyo|lds)(_|\d|$)"),
    "camera": re.compile(r"(^|_)(camera|cam|rgb)(_|\d|$)"),
    "imu": re.compile(r"(^|_)imu(_|\d|$)"),
}
"""Names of links of a kind of sensor."""

LEAST_SAMPLES, LEAST_RANGE = 30, 1.5
"""Beams, and metres, of a lidar."""

OTHER_PARTS = re.compile(r"(^|_)(mount|base|bracket|optical|bottom_screw|support|tower|arch)(_|$)")
"""Words of links that hold a sensor, or are other frames of it."""


@dataclass(frozen=True)
class ModelledSensor:
    """A sensor of a URDF.

    Attributes:
        link: that holds it.
        pose: (4, 4) of the sensor in the root's frame, with all joints at 0.
        element: Gazebo's <sensor>; None if the link's name says that there is one.
    """

    link: str
    pose: FloatArray
    element: Element | None = None


def sensors_of(model: RobotModel) -> dict[str, list[ModelledSensor]]:
    """The sensors by kind: lidar, camera, depth, imu, sonar, range.

    Gazebo's sensors of a kind come alone, of several at one pose the first; without any, links are
    taken by name.

    Raises:
        InputError: the pose of a sensor is damaged.
    """
    found: dict[str, list[ModelledSensor]] = {}
    for sensor in _gazebo_sensors(model):
        assert sensor.element is not None
        kind = GAZEBO_TYPES.get(sensor.element.attributes.get("type", "").lower(), "")
        if kind == "lidar" and _is_single_beam(sensor.element):
            kind = "range"
        others = found.setdefault(kind, []) if kind else []
        if kind and not any(np.allclose(sensor.pose, other.pose) for other in others):
            others.append(sensor)
    for kind, word in WORDS.items():
        if kind in found or (kind == "camera" and "depth" in found):
            continue
        named = [name for name in model.links if word.search(name.lower())]
        frames = [name for name in named if not OTHER_PARTS.search(word.sub("", name.lower()))]
        if frames or named:
            link = (frames or named)[0]
            found[kind] = [ModelledSensor(link, model.poses[link])]
    return found


def _gazebo_sensors(model: RobotModel) -> Iterator[ModelledSensor]:
    """The <sensor> elements for Gazebo; each has a pose in the frame of its link."""
    findings = Findings()
    for gazebo in model.element.all("gazebo"):
        link = gazebo.attributes.get("reference", "")
        if link in model.links:
            for sensor in gazebo.all("sensor"):
                element = sensor.first("pose")
                own = np.eye(4) if element is None else read_pose(findings, element, URDF)
                if own is not None:
                    yield ModelledSensor(link, model.poses[link] @ own, sensor)
    findings.raise_errors()


def _is_single_beam(sensor: Element) -> bool:
    """Whether a ray sensor measures one distance: an infrared or ultrasonic sensor."""
    values = numbers_of(sensor)
    few = values.get("samples", LEAST_SAMPLES) < LEAST_SAMPLES
    return few or values.get("max", LEAST_RANGE) < LEAST_RANGE


def numbers_of(sensor: Element | None) -> dict[str, float]:
    """The numbers in the elements of a sensor by their tags; of several the first counts."""
    found: dict[str, float] = {}
    for element in sensor.within() if sensor is not None else ():
        try:
            found.setdefault(element.tag, float(element.text))
        except ValueError:
            continue
    return found

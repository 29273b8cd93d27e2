"""Finds the links of a URDF that hold sensors: by Gazebo's sensors, else by their names."""

from __future__ import annotations

import re
from collections.abc import Iterator

from robots.urdf.model import RobotModel
from stack.documents.xml_file import Element

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


def sensor_links(model: RobotModel) -> dict[str, list[str]]:
    """Names of the links with sensors by kind: lidar, camera, depth, imu, sonar, range.

    Links that Gazebo's sensors name come alone; without any of a kind, links are taken by name.
    """
    found: dict[str, list[str]] = {}
    for link, sensor in gazebo_sensors(model):
        kind = GAZEBO_TYPES.get(sensor.attributes.get("type", "").lower(), "")
        if kind == "lidar" and _is_single_beam(sensor):
            kind = "range"
        if kind and link not in found.setdefault(kind, []):
            found[kind].append(link)
    for kind, word in WORDS.items():
        if kind in found or (kind == "camera" and "depth" in found):
            continue
        named = [name for name in model.links if word.search(name.lower())]
        frames = [name for name in named if not OTHER_PARTS.search(word.sub("", name.lower()))]
        if frames or named:
            found[kind] = (frames or named)[:1]
    return found


def _is_single_beam(sensor: Element) -> bool:
    """Whether a ray sensor measures one distance: an infrared or ultrasonic sensor."""
    ranges = [e for e in sensor.within() if e.tag == "max" and e.text]
    samples = [e for e in sensor.within() if e.tag == "samples" and e.text]
    few = bool(samples) and float(samples[0].text) < LEAST_SAMPLES
    return few or (bool(ranges) and float(ranges[0].text) < LEAST_RANGE)


def gazebo_sensors(model: RobotModel) -> Iterator[tuple[str, Element]]:
    """The <sensor> elements for Gazebo, each with the link that it is on."""
    for gazebo in model.element.all("gazebo"):
        link = gazebo.attributes.get("reference", "")
        if link in model.links:
            yield from ((link, sensor) for sensor in gazebo.all("sensor"))

"""Exposure of simulated pictures: motion blur and the automatic gain.

A shutter that is open for the exposure time T adds up the light from T/2 before to T/2 after the
stamp. The picture is the mean of renderings along the motion of the camera, as many as it moves
pixels. Grey levels are averaged as they are, without the curve of a sensor. Only the motion of the
robot counts: people and other robots stand still for that long.
"""

from __future__ import annotations

from dataclasses import replace
from math import ceil, cos, hypot, sin

import numpy as np
from numpy.typing import NDArray

from stack.drivetrain.description import CameraDescription
from stack.sim.sensors.requests import Quaternion, RenderRequest

MOST_RENDERINGS = 16
"""Renderings of one picture; a larger motion leaves steps of more than a pixel."""

NEAR_SCENE = 1.0
"""Metres; distance of the scene by which a sideways motion is converted to pixels."""

MIDDLE_GREY = 110.0
"""Mean grey level that the automatic exposure aims at."""

Colours = NDArray[np.uint8] | NDArray[np.float32]


def moments(request: RenderRequest, camera: CameraDescription) -> list[RenderRequest]:
    """Return the requests whose pictures a long exposure averages; one if nothing moves."""
    turned, moved = (hypot(*rate) * camera.exposure for rate in (request.spin, request.velocity))
    pixels = camera.model.fx * (turned + moved / NEAR_SCENE)
    count = min(MOST_RENDERINGS, max(1, ceil(pixels)))
    times = [((n + 0.5) / count - 0.5) * camera.exposure for n in range(count)]
    return [request] if count == 1 else [_later(request, time) for time in times]


def mean_picture(pictures: list[NDArray[np.uint8]]) -> Colours:
    """Return the mean of pictures; a single one as it is."""
    if len(pictures) == 1:
        return pictures[0]
    total = np.zeros(pictures[0].shape, dtype=np.uint32)
    for picture in pictures:
        total += picture
    mean: NDArray[np.float32] = total.astype(np.float32) / np.float32(len(pictures))
    return mean


def automatic_gain(colours: Colours, light: float, camera: CameraDescription) -> float:
    """Return the factor by which the camera brightens or darkens a picture.

    It is that of a camera that has had the time to adapt: it depends on this picture alone.

    Args:
        colours: (height, width, 3) grey levels in normal light.
        light: brightness of the world.
        camera: with the largest gain; the smallest one is its inverse.
    """
    if camera.max_gain == 1.0:
        return 1.0
    # A sum of whole numbers is the same on every processor.
    brightness = light * float(np.rint(colours).sum(dtype=np.float64)) / colours.size
    wanted = MIDDLE_GREY / max(brightness, 1e-3)
    return min(camera.max_gain, max(1.0 / camera.max_gain, wanted))


def _later(request: RenderRequest, time: float) -> RenderRequest:
    """Return a request after a time in seconds, at constant velocity."""
    x, y, z = (
        at + time * rate for at, rate in zip(request.position, request.velocity, strict=True)
    )
    angle = time * hypot(*request.spin)
    if angle == 0.0:
        return replace(request, position=(x, y, z))
    share = sin(angle / 2.0) * time / angle
    i, j, k = (share * rate for rate in request.spin)
    turned = _product((i, j, k, cos(angle / 2.0)), request.orientation)
    return replace(request, position=(x, y, z), orientation=turned)


def _product(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return the rotation b and then a."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )

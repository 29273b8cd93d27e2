"""Fiducial boards and posters: textured rectangles, because boxes have no texture coordinates.

The image comes from OpenCV's dictionary. A white margin makes the board 1.25 times the marker's
size; detectors need a light margin around a marker (Garrido-Jurado et al., 2014).
"""

from __future__ import annotations

from math import cos, sin
from pathlib import Path as FilePath

import numpy as np

from stack.errors import BodyError
from stack.sim.physics.meshes import file_name
from stack.sim.worlds.world import Poster
from stack.types import Marker
from stack.types.marker_dictionaries import marker_dictionaries

BOARD_RATIO = 1.25
PIXELS_PER_MARKER = 320
STAND_OFF = 0.002
"""Distance between board and wall, metres; prevents z-fighting in the renderer."""


def board_texture(marker: Marker, folder: FilePath) -> FilePath:
    """Write a marker's image with its white margin as a PNG file and return the path.

    Raises:
        BodyError: unknown dictionary, or a marker number that it does not contain.
    """
    import cv2

    number = marker_dictionaries().get(marker.dictionary)
    if number is None:
        raise BodyError(f"OpenCV has no marker dictionary {marker.dictionary!r}")
    dictionary = cv2.aruco.getPredefinedDictionary(number)
    size = len(dictionary.bytesList)
    if not 0 <= marker.number < size:
        raise BodyError(f"{marker.dictionary} has the markers 0 to {size - 1}, got {marker.number}")
    margin = round(PIXELS_PER_MARKER * (BOARD_RATIO - 1.0) / 2.0)
    inner = cv2.aruco.generateImageMarker(dictionary, marker.number, PIXELS_PER_MARKER)
    picture = np.pad(inner, margin, constant_values=255)
    png = cv2.imencode(".png", cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR))[1].tobytes()
    path = folder / file_name(png, "png")
    path.write_bytes(png)
    return path


def board_quad(marker: Marker, folder: FilePath) -> FilePath:
    """Write a marker's board in world coordinates as an OBJ file with texture coordinates."""
    side = marker.size * BOARD_RATIO
    return _quad(marker.position, marker.heading, (side, side), folder)


def poster_quad(poster: Poster, folder: FilePath) -> FilePath:
    """Write a poster in world coordinates as an OBJ file with texture coordinates."""
    return _quad(poster.position, poster.heading, poster.size, folder)


def _quad(
    position: tuple[float, float, float], heading: float, size: tuple[float, float],
    folder: FilePath,
) -> FilePath:  # fmt: skip
    """Write an upright rectangle that faces a heading; size: width and height, metres."""
    half = size[0] / 2.0, size[1] / 2.0
    forward = np.array([cos(heading), sin(heading), 0.0])
    right = np.array([-sin(heading), cos(heading), 0.0])  # as seen from in front of the board
    up = np.array([0.0, 0.0, 1.0])
    middle = np.array(position) + STAND_OFF * forward
    corners = [middle + half[0] * u * right + half[1] * v * up for u, v in _CORNERS]
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in corners]
    lines += [f"vt {(u + 1) / 2:.1f} {(v + 1) / 2:.1f}" for u, v in _CORNERS]
    lines += ["vn {:.6f} {:.6f} {:.6f}".format(*forward)]
    lines += ["f 1/1/1 2/2/1 3/3/1", "f 1/1/1 3/3/1 4/4/1"]
    text = "\n".join(lines) + "\n"
    path = folder / file_name(text, "obj")
    path.write_text(text)
    return path


_CORNERS = ((-1, -1), (1, -1), (1, 1), (-1, 1))

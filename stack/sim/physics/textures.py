"""Generated pictures: boards of markers, posters by number, and textures that repeat.

The renderer takes the nearest pixel of a texture, without mipmaps. The pictures are therefore
coarse and smooth: finer detail would flicker between two views of the same place.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stack.errors import BodyError
from stack.streams import stream
from stack.types import FloatArray, Marker
from stack.types.marker_dictionaries import marker_dictionaries

Picture = NDArray[np.uint8]
"""(height, width, 3) RGB."""

TILE_SIDES = {"wallpaper": 0.5, "wood": 1.2, "brick": 0.6, "carpet": 1.5, "tiles": 0.8}
"""Metres after which a texture repeats."""

POSTER_PIXELS, TILE_PIXELS = 160, 128
"""Pixels per metre of a poster, and along a side of a texture."""

SHAPES = 26

BOARD_RATIO, PIXELS_PER_MARKER = 1.25, 320


def png_of(picture: Picture) -> bytes:
    """Return a picture as a PNG file."""
    import cv2

    return bytes(cv2.imencode(".png", cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))[1].tobytes())


def board_picture(marker: Marker) -> Picture:
    """Return the picture of a marker's board, by OpenCV's dictionary.

    A white margin makes the board BOARD_RATIO times the marker's size; detectors need a light
    margin around a marker (Garrido-Jurado et al., 2014).

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
    shades: NDArray[np.uint8] = np.pad(inner, margin, constant_values=255)
    return np.repeat(shades[:, :, None], 3, axis=2)


def poster_picture(number: int, size: tuple[float, float]) -> Picture:
    """Return the picture of a poster: shapes, bars and letters in random places and colours.

    Args:
        number: of the poster; the same number and size give the same picture.
        size: (width, height), metres.
    """
    import cv2

    random = stream(number, "poster")
    width, height = (max(8, round(POSTER_PIXELS * side)) for side in size)
    canvas = np.empty((height, width, 3), dtype=np.uint8)
    canvas[:] = random.integers(60, 256, 3)
    for _ in range(SHAPES):
        colour = tuple(int(value) for value in random.integers(0, 256, 3))
        x, y = int(random.integers(0, width)), int(random.integers(0, height))
        reach = int(random.integers(max(2, height // 24), max(3, height // 5)))
        kind = int(random.integers(4))
        if kind == 0:
            cv2.circle(canvas, (x, y), reach, colour, -1)
        elif kind == 1:
            other = (x + int(random.integers(2, 2 * reach + 3)), y + reach)
            cv2.rectangle(canvas, (x, y), other, colour, -1)
        elif kind == 2:
            ends = random.integers(-2 * reach, 2 * reach + 1, (3, 2)) + np.array([x, y])
            cv2.fillPoly(canvas, [ends.astype(np.int32)], colour)
        else:
            letter = chr(int(random.integers(ord("A"), ord("Z") + 1)))
            scale = reach / 12.0
            font = cv2.FONT_HERSHEY_SIMPLEX
            cv2.putText(canvas, letter, (x, y), font, scale, colour, max(1, reach // 6))
    edge = max(1, height // 40)
    canvas[:edge] = canvas[-edge:] = 30
    canvas[:, :edge] = canvas[:, -edge:] = 30
    return np.asarray(cv2.GaussianBlur(canvas, (3, 3), 0), dtype=np.uint8)


def texture_picture(name: str) -> Picture:
    """Return one tile of a texture of TILE_SIDES; its opposite edges fit together."""
    random = stream(0, f"texture {name}")
    makers = {
        "wallpaper": _wallpaper, "wood": _wood, "brick": _brick, "carpet": _carpet,
        "tiles": _tiles,
    }  # fmt: skip
    tile = makers[name](random)
    picture: Picture = np.clip(np.rint(tile), 0, 255).astype(np.uint8)
    return picture


def _grain(random: np.random.Generator, along: int, across: int) -> FloatArray:
    """Return smooth noise (n, n) that wraps around, between about -1 and 1.

    It is a sum of waves with up to `along` periods in a row and `across` in a column.
    """
    where = 2.0 * np.pi * np.arange(TILE_PIXELS) / TILE_PIXELS
    total = np.zeros((TILE_PIXELS, TILE_PIXELS))
    for _ in range(24):
        row, column = int(random.integers(0, along + 1)), int(random.integers(0, across + 1))
        phase = random.uniform(0.0, 2.0 * np.pi)
        total += np.cos(row * where[None, :] + column * where[:, None] + phase)
    return total / 6.0


def _coloured(shade: FloatArray, colour: tuple[int, int, int]) -> FloatArray:
    return shade[:, :, None] * np.array(colour, dtype=np.float64)


def _wallpaper(random: np.random.Generator) -> FloatArray:
    """Return stripes with a row of diamonds."""
    rows, columns = np.mgrid[:TILE_PIXELS, :TILE_PIXELS] / TILE_PIXELS
    shade = 0.9 + 0.06 * np.cos(4.0 * np.pi * columns) + 0.01 * _grain(random, 8, 8)
    tile = _coloured(shade, (214, 205, 178))
    diamond = np.abs(columns - 0.5) + np.abs(rows - 0.5) < 0.16
    tile[diamond] = (150, 98, 84)
    return tile


def _wood(random: np.random.Generator) -> FloatArray:
    """Return four planks with their grain along the rows."""
    shade = 0.85 + 0.12 * _grain(random, 2, 20)
    planks = np.arange(TILE_PIXELS) * 4 // TILE_PIXELS
    shade *= np.array([1.0, 0.9, 0.97, 0.86])[planks][:, None]
    shade[:: TILE_PIXELS // 4] *= 0.6
    return _coloured(shade, (176, 128, 84))


def _brick(random: np.random.Generator) -> FloatArray:
    """Return four courses of bricks with light joints, every second one shifted by half."""
    rows, columns = np.mgrid[:TILE_PIXELS, :TILE_PIXELS]
    course = rows * 4 // TILE_PIXELS
    along = (columns + course % 2 * (TILE_PIXELS // 4)) % TILE_PIXELS
    tones = 0.8 + 0.2 * random.random((4, 2))
    shade = tones[course, along * 2 // TILE_PIXELS] + 0.03 * _grain(random, 20, 20)
    tile = _coloured(shade, (168, 92, 72))
    joint = (rows % (TILE_PIXELS // 4) < 4) | (along % (TILE_PIXELS // 2) < 4)
    tile[joint] = (196, 190, 180)
    return tile


def _carpet(random: np.random.Generator) -> FloatArray:
    """Return a dark, speckled pile."""
    speckle = random.standard_normal((TILE_PIXELS, TILE_PIXELS))
    for axis in (0, 1):
        speckle = (np.roll(speckle, 1, axis) + 2.0 * speckle + np.roll(speckle, -1, axis)) / 4.0
    shade = 0.8 + 0.35 * speckle + 0.06 * _grain(random, 4, 4)
    return _coloured(shade, (92, 104, 122))


def _tiles(random: np.random.Generator) -> FloatArray:
    """Return four square tiles with dark joints, two of them darker."""
    rows, columns = np.mgrid[:TILE_PIXELS, :TILE_PIXELS]
    half = TILE_PIXELS // 2
    dark = (rows // half + columns // half) % 2
    tile = _coloured(0.92 - 0.22 * dark + 0.02 * _grain(random, 10, 10), (205, 205, 198))
    tile[(rows % half < 2) | (columns % half < 2)] = (96, 96, 92)
    return tile

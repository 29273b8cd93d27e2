"""Reader and writer of ROS map_server files: a YAML file and an image.

Thresholds, rounding and transparency are those of nav2_map_server's map_io.cpp (ROS 2 Foxy to
Jazzy). Codes: E401 keys and values · W401 unknown keys · E402 image.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import pi
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stack.documents import Finding, Findings, Mark, Node, Section, read_file
from stack.errors import InputError, ParameterError
from stack.mapping.limits import LEAST_RESOLUTION, MAX_CELLS
from stack.mapping.pictures import Picture, is_image, pgm, read_picture
from stack.parameters import Declaration, suggestion
from stack.types import FREE, OCCUPIED, UNKNOWN, FloatArray, OccupancyGrid, Pose2D

SHAPE, UNKNOWN_KEY = "E401", "W401"
PICTURE = "E402"

SHADES = {OCCUPIED: 0, FREE: 254, UNKNOWN: 205}
"""Grey values that map_saver writes, with these thresholds:"""
OCCUPIED_THRESHOLD, FREE_THRESHOLD = 0.65, 0.196
UNKNOWN_RAW = 255

EXACT = 1e-9
"""Radians from a quarter turn, and parts of a cell, that are rounding errors."""

IMAGE = Declaration("image", str, "image file, relative to this file")
RESOLUTION = Declaration(
    "resolution", float, "side of a cell", "m", at_least=LEAST_RESOLUTION, at_most=10.0
)
ORIGIN = (
    Declaration("x", float, "of the lower left corner", "m", at_least=-1e6, at_most=1e6),
    Declaration("y", float, "of the lower left corner", "m", at_least=-1e6, at_most=1e6),
    Declaration("yaw", float, "of the image, anticlockwise", "rad", at_least=-1e3, at_most=1e3),
)
OCCUPIED_FROM = Declaration(
    "occupied_thresh", float, "cells with a higher occupancy are occupied",
    at_least=0.0, at_most=1.0,
)  # fmt: skip
FREE_BELOW = Declaration(
    "free_thresh", float, "cells with a lower occupancy are free", at_least=0.0, at_most=1.0
)
MODE = Declaration(
    "mode", str, "conversion of shades to occupancy", default="trinary",
    one_of=("trinary", "scale", "raw"),
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Shading:
    """Conversion of shades to occupancies; fields as in the YAML file."""

    mode: str
    negate: bool
    occupied_thresh: float
    free_thresh: float


def read_ros_map(path: Path, findings: Findings | None = None) -> OccupancyGrid:
    """Read the occupancy grid of a map.yaml and its image.

    Maps in mode `trinary` have the values FREE, OCCUPIED and UNKNOWN, those in `scale` and `raw`
    also values between. In mode `raw`, `occupied_thresh` is the grid's `occupied_from`. A map whose
    origin has a yaw is turned into the axes of the map frame.

    Args:
        path: of the YAML file, or of an image that a YAML file in its folder names.
        findings: receives the warnings.

    Raises:
        InputError: all errors, each with its position.
    """
    findings = Findings() if findings is None else findings
    path = described(path)
    top = Section(
        read_file(path, "map file", ("image", "resolution", "origin")),
        findings,
        "a map file",
        SHAPE,
    )
    image = top.node_of("image", required=True)
    named = None if image is None else top.read(IMAGE, image)
    resolution = top.value(RESOLUTION)
    x, y, yaw = _origin(top)
    shading = _shading(top)
    for key in top.unread():
        sentence = f"a map file has no key {key.words()}: it is ignored"
        findings.add(UNKNOWN_KEY, key.mark, sentence)
    findings.raise_errors()
    assert image is not None and named is not None
    picture = _picture(path.parent / named, image, findings)
    cells = occupancies(picture, shading)
    # The image's first row is its top, the grid's first row the smallest y.
    cells = np.ascontiguousarray(cells[::-1])
    if shading.mode != "raw":  # the other modes have applied the file's threshold
        grid = OccupancyGrid(cells, resolution, (x, y))
    else:
        occupied_from = max(1, round(100 * shading.occupied_thresh))
        grid = OccupancyGrid(cells, resolution, (x, y), occupied_from)
    try:
        return turned(grid, yaw)
    except ParameterError as error:
        node = top.node.get("origin") or top.node
        raise InputError(
            [Finding(node.mark, SHAPE, f"origin: {error.sentence}", error.hint)]
        ) from None


def described(path: Path) -> Path:
    """Return the YAML file of a map image; the path itself if it is no image.

    It is NAME.yaml beside NAME.pgm, or the one YAML file in the folder that names the image.

    Raises:
        InputError: an image without such a file.
    """
    if not is_image(path) or not path.is_file():
        return path
    files = [path.with_suffix(ending) for ending in (".yaml", ".yml")]
    files += sorted(file for ending in ("yaml", "yml") for file in path.parent.glob(f"*.{ending}"))
    for file in files:
        if file.is_file() and _names(file, path):
            return file
    sentence = "an image has no scale: there is no map.yaml beside it that names it"
    hint = "write one with the keys image, resolution, origin, negate, occupied_thresh, free_thresh"
    raise InputError([Finding(Mark(str(path)), SHAPE, sentence, hint)])


def _names(file: Path, image: Path) -> bool:
    """Whether a YAML file has the key `image` with this image."""
    try:
        named = read_file(file, "map file").get("image")
    except InputError:
        return False
    return named is not None and file.parent / str(named.value) == image


def turned(grid: OccupancyGrid, yaw: float) -> OccupancyGrid:
    """Return a grid whose cells lie along the axes of the map frame.

    Quarter turns are exact. Otherwise a cell has the value of the given cell at its middle, so
    that walls keep their place and width to half a cell; outside the given grid it is UNKNOWN.

    Args:
        grid: turned about its origin, the lower left corner.
        yaw: radians anticlockwise.

    Raises:
        ParameterError: the grid would have too many cells.
    """
    quarters = round(yaw / (pi / 2))
    if abs(yaw - quarters * pi / 2) < EXACT:
        yaw = quarters * pi / 2
    frame = Pose2D(*grid.origin, yaw)
    rows, columns = grid.cells.shape
    side = grid.resolution
    corners = frame.transform(side * np.array([[0, 0], [columns, 0], [0, rows], [columns, rows]]))
    least = corners.min(axis=0)
    across, up = np.ceil(np.ptp(corners, axis=0) / side - EXACT).astype(int).tolist()
    if across * up > MAX_CELLS:
        sentence = f"turned by a yaw of {yaw:g} rad the map has {across} x {up} cells, at most"
        raise ParameterError("yaw", f"{sentence} {MAX_CELLS} are possible", "crop the image")
    origin = (float(least[0]), float(least[1]))
    if quarters * pi / 2 == yaw:
        cells = np.ascontiguousarray(np.rot90(grid.cells, -quarters))
        return replace(grid, cells=cells, origin=origin)
    cells = np.full((up, across), UNKNOWN, np.int8)
    xs = least[0] + (np.arange(across) + 0.5) * side
    for row in range(up):
        middles = np.column_stack([xs, np.full(across, least[1] + (row + 0.5) * side)])
        column_of, row_of = np.floor(frame.inverse().transform(middles) / side).astype(int).T
        inside = (column_of >= 0) & (column_of < columns) & (row_of >= 0) & (row_of < rows)
        cells[row, inside] = grid.cells[row_of[inside], column_of[inside]]
    return replace(grid, cells=cells, origin=origin)


def occupancies(picture: Picture, shading: Shading) -> NDArray[np.int8]:
    """Return the (rows, columns) occupancy of each pixel, in the image's order of rows.

    Source: nav2_map_server, map_io.cpp. A shade is the mean of the colours in [0, 1], white is 1;
    occ = 1 - shade, or the shade itself with `negate`. occ > occupied_thresh is OCCUPIED,
    occ < free_thresh is FREE. Between them `trinary` gives UNKNOWN, and `scale` the linear
    interpolation from 0 at free_thresh to 100 at occupied_thresh. Alpha counts as one more colour
    in `trinary`; pixels that are not opaque are UNKNOWN in `scale`. `raw` uses the shade's byte up
    to 100 as occupancy.
    """
    shade = picture.colours.mean(axis=2)
    if shading.mode == "raw":
        percent: FloatArray = np.floor(shade * 255 + 0.5)
        return np.where(percent <= OCCUPIED, percent, UNKNOWN).astype(np.int8)
    if shading.mode == "trinary" and picture.alpha is not None:
        count = picture.colours.shape[2]
        shade = (shade * count + picture.alpha) / (count + 1)
    occupied = shade if shading.negate else 1.0 - shade
    cells = np.full(shade.shape, UNKNOWN, np.int8)
    if shading.mode == "scale":
        span = shading.occupied_thresh - shading.free_thresh
        share = np.clip((occupied - shading.free_thresh) / span, 0.0, 1.0)
        cells = np.rint(share * 100).astype(np.int8)
    cells[occupied > shading.occupied_thresh] = OCCUPIED
    cells[occupied < shading.free_thresh] = FREE
    if shading.mode == "scale" and picture.alpha is not None:
        cells[picture.alpha < 1.0] = UNKNOWN
    return cells


def map_files(grid: OccupancyGrid, name: str, picture: str) -> dict[str, bytes]:
    """Return the contents of the image and the YAML file of a map, by file name.

    A grid of FREE, OCCUPIED and UNKNOWN is written in mode `trinary`, with the shades of
    nav2_map_server's map saver: occupied 0, free 254, unknown 205. Another one is written in mode
    `raw`: the percentage itself, unknown 255. Reading them returns the same grid.

    Args:
        grid: the map.
        name: of the YAML file.
        picture: name of the image, a PGM.
    """
    mode, occupied_from, free_below = "trinary", OCCUPIED_THRESHOLD, FREE_THRESHOLD
    pixels = np.full(grid.cells.shape, SHADES[UNKNOWN], np.uint8)
    pixels[grid.free], pixels[grid.occupied] = SHADES[FREE], SHADES[OCCUPIED]
    if not np.isin(grid.cells, list(SHADES)).all():
        mode, occupied_from = "raw", grid.occupied_from / 100
        free_below = min(FREE_THRESHOLD, occupied_from / 2)
        known = (grid.cells >= FREE) & (grid.cells <= OCCUPIED)
        pixels = np.where(known, grid.cells, UNKNOWN_RAW).astype(np.uint8)
    x, y = float(grid.origin[0]), float(grid.origin[1])
    text = (
        f"image: {_quoted(picture)}\nmode: {mode}\n"
        f"resolution: {float(grid.resolution)!r}\norigin: [{x!r}, {y!r}, 0]\nnegate: 0\n"
        f"occupied_thresh: {occupied_from}\nfree_thresh: {free_below}\n"
    )
    return {picture: pgm(pixels[::-1]), name: text.encode()}


def _origin(top: Section) -> tuple[float, float, float]:
    node = top.node_of("origin", required=True)
    values = None if node is None else top.parts("origin", node, ORIGIN)
    if values is None:
        return 0.0, 0.0, 0.0
    x, y, yaw = values
    return x, y, yaw


def _shading(top: Section) -> Shading:
    mode = top.value(MODE)
    occupied, free = top.value(OCCUPIED_FROM), top.value(FREE_BELOW)
    if occupied is not None and free is not None and free >= occupied:
        node = top.node.get("free_thresh") or top.node
        sentence = f"free_thresh: {free:g} must be below occupied_thresh {occupied:g}"
        top.findings.add(SHAPE, node.mark, sentence)
    negate = top.node_of("negate", required=True)
    if negate is not None and negate.value not in (0, 1):
        sentence = f"negate: expected 0 or 1, got {negate.words()}"
        top.findings.add(SHAPE, negate.mark, sentence)
    return Shading(mode, negate is not None and negate.value == 1, occupied or 0.0, free or 0.0)


def _picture(file: Path, named: Node, findings: Findings) -> Picture:
    """Read the image; raise InputError at the position of its name."""
    try:
        return read_picture(file)
    except FileNotFoundError:
        near = [item.name for item in sorted(file.parent.glob("*")) if is_image(item)]
        sentence = f"image: there is no file {named.value!r} in the folder of this file"
        findings.add(PICTURE, named.mark, sentence, suggestion(file.name, near))
    except OSError as error:
        sentence = f"image: {named.value!r} cannot be read: {error.strerror}"
        findings.add(PICTURE, named.mark, sentence)
    except ParameterError as error:
        findings.add(PICTURE, named.mark, f"image: {named.value!r} {error.sentence}", error.hint)
    raise InputError(findings.errors)


def _quoted(name: str) -> str:
    return "'" + name.replace("'", "''") + "'"

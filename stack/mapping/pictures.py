"""Reader and writer of map images: PGM (plain and binary) and PNG."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stack.documents.files import IMAGE_BYTES, TooLargeError, read_bytes
from stack.errors import ParameterError
from stack.mapping.limits import MAX_SIDE
from stack.types import FloatArray

PNG = b"\x89PNG\r\n\x1a\n"
# Magic number, width, height and largest value, with comments between, then one whitespace byte.
_PGM = re.compile(rb"P([25])" + 3 * rb"(?:\s+(?:#[^\n]*\n\s*)*)(\d{1,9})" + rb"\s")


@dataclass(frozen=True, slots=True)
class Picture:
    """Image with values scaled to [0, 1].

    Attributes:
        colours: (rows, columns, n) in [0, 1], n = 1 or 3; the first row is the top.
        alpha: (rows, columns), 1 is opaque; None without an alpha channel.
    """

    colours: FloatArray
    alpha: FloatArray | None = None


def read_picture(path: Path) -> Picture:
    """Read a PGM or PNG file.

    Raises:
        OSError: the file cannot be read.
        ParameterError: not a PGM or PNG image, damaged, or over 8192 pixels wide or high.
    """
    try:
        raw = read_bytes(path, IMAGE_BYTES)
    except TooLargeError as error:
        raise ParameterError("", f"has {error.strerror} of a map image") from None
    if raw.startswith(PNG):
        return _png(raw)
    header = _PGM.match(raw)
    if header is None:
        raise ParameterError("", "is not a PGM or PNG image" if raw else "is empty")
    return _pgm(raw[header.end() :], *(int(group) for group in header.groups()))


def encoded(
    pixels: NDArray[np.uint8], suffix: str, transparent: NDArray[np.bool_] | None = None
) -> bytes:
    """Return the content of an image file.

    Args:
        pixels: (rows, columns) shades; the first row is the top.
        suffix: `.pgm` or `.png`.
        transparent: (rows, columns) pixels that are transparent; PNG only.

    Raises:
        ParameterError: another suffix, or transparent pixels in a PGM.
    """
    hidden = transparent is not None and bool(transparent.any())
    if suffix == ".pgm":
        if hidden:
            sentence = "a PGM cannot have the transparent pixels of unknown cells"
            raise ParameterError("image", sentence, "use a .png, or mode `raw`")
        rows, columns = pixels.shape
        return f"P5\n{columns} {rows}\n255\n".encode() + np.ascontiguousarray(pixels).tobytes()
    if suffix != ".png":
        raise ParameterError("image", f"expected .pgm or .png, got {suffix!r}")
    import cv2

    image: NDArray[np.uint8] = np.ascontiguousarray(pixels)
    if hidden and transparent is not None:
        alpha = np.where(transparent, 0, 255).astype(np.uint8)
        image = np.ascontiguousarray(np.dstack([image, image, image, alpha]))
    return bytes(cv2.imencode(".png", image)[1].tobytes())


def _check_side(width: int, height: int) -> None:
    if not (1 <= width <= MAX_SIDE and 1 <= height <= MAX_SIDE):
        sentence = f"has {width} x {height} pixels; a map image has 1 to {MAX_SIDE} per side"
        raise ParameterError("", sentence, "crop or scale it")


def _pgm(body: bytes, kind: int, width: int, height: int, brightest: int) -> Picture:
    _check_side(width, height)
    if not 1 <= brightest <= 65535:
        raise ParameterError("", f"is a damaged PGM: its largest value is {brightest}")
    count = width * height
    values: NDArray[Any]
    if kind == 5:
        values = np.frombuffer(body[: count * (1 + (brightest > 255))], "u1")
        values = values.view(">u2") if brightest > 255 and values.size % 2 == 0 else values
    else:
        words = re.sub(rb"#[^\n]*", b"", body).split(None, count)[:count]
        if not all(word.isdigit() and len(word) <= 9 for word in words):
            raise ParameterError("", "is a damaged PGM: not all of its values are numbers")
        values = np.array([int(word) for word in words], dtype=np.float64)
    if values.size != count:
        raise ParameterError("", f"is a damaged PGM: it has {values.size} of {count} pixels")
    if values.size and values.max() > brightest:
        sentence = f"is a damaged PGM: pixel {values.max():g} exceeds its maximum {brightest}"
        raise ParameterError("", sentence)
    return Picture(values.reshape(height, width, 1) / float(brightest))


def _png(raw: bytes) -> Picture:
    import cv2

    if len(raw) < 33 or raw[12:16] != b"IHDR":
        raise ParameterError("", "is a damaged PNG: its header is incomplete")
    _check_side(int.from_bytes(raw[16:20], "big"), int.from_bytes(raw[20:24], "big"))
    if not raw.rstrip(b"\0").endswith(b"IEND\xaeB`\x82"):
        raise ParameterError("", "is a damaged PNG: its end is missing")
    pixels = cv2.imdecode(np.frombuffer(raw, np.uint8), cv2.IMREAD_UNCHANGED)
    if pixels is None:
        raise ParameterError("", "is a damaged PNG")
    brightest = 65535.0 if pixels.dtype == np.uint16 else 255.0
    shares: FloatArray = np.atleast_3d(np.asarray(pixels, dtype=np.float64)) / brightest
    if shares.shape[2] in (2, 4):
        return Picture(shares[:, :, :-1], shares[:, :, -1])
    return Picture(shares)

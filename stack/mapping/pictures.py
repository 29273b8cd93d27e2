"""Map images: reads PGM and PPM (plain and binary), PNG, BMP and JPEG; writes PGM."""

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

IMAGES = (".pgm", ".ppm", ".pnm", ".png", ".bmp", ".jpg", ".jpeg")
PNG = b"\x89PNG\r\n\x1a\n"
BMP = b"BM"
JPEG = b"\xff\xd8\xff"
# Magic number, width, height and largest value, with comments between, then one whitespace byte.
_PNM = re.compile(rb"P([2356])" + 3 * rb"(?:\s+(?:#[^\n]*\n\s*)*)(\d{1,9})" + rb"\s")


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
    """Read an image, whatever its suffix.

    Raises:
        OSError: the file cannot be read.
        ParameterError: of another kind, damaged, or over 8192 pixels wide or high.
    """
    try:
        raw = read_bytes(path, IMAGE_BYTES)
    except TooLargeError as error:
        raise ParameterError("", f"has {error.strerror} of a map image") from None
    if raw.startswith(PNG):
        return _png(raw)
    if raw.startswith(BMP):
        return _bmp(raw)
    if raw.startswith(JPEG):
        return _jpeg(raw)
    header = _PNM.match(raw)
    if header is None:
        known = "is not a PGM, PPM, PNG, BMP or JPEG image"
        raise ParameterError("", known if raw else "is empty")
    return _pnm(raw[header.end() :], *(int(group) for group in header.groups()))


def is_image(path: Path) -> bool:
    """Tell whether a path has the suffix of an image that can be read."""
    return path.suffix.lower() in IMAGES


def pgm(pixels: NDArray[np.uint8]) -> bytes:
    """Return the content of a PGM of shades (rows, columns); the first row is the top."""
    rows, columns = pixels.shape
    return f"P5\n{columns} {rows}\n255\n".encode() + np.ascontiguousarray(pixels).tobytes()


def _check_side(width: int, height: int) -> None:
    if not (1 <= width <= MAX_SIDE and 1 <= height <= MAX_SIDE):
        sentence = f"has {width} x {height} pixels; a map image has 1 to {MAX_SIDE} per side"
        raise ParameterError("", sentence, "crop or scale it")


def _pnm(body: bytes, kind: int, width: int, height: int, brightest: int) -> Picture:
    """Read a PGM (kinds 2 and 5) or PPM (3 and 6) after its header."""
    name, colours = ("PGM", 1) if kind in (2, 5) else ("PPM", 3)
    _check_side(width, height)
    if not 1 <= brightest <= 65535:
        raise ParameterError("", f"is a damaged {name}: its largest value is {brightest}")
    count = width * height * colours
    values: NDArray[Any]
    if kind >= 5:
        values = np.frombuffer(body[: count * (1 + (brightest > 255))], "u1")
        values = values.view(">u2") if brightest > 255 and values.size % 2 == 0 else values
    else:
        words = re.sub(rb"#[^\n]*", b"", body).split(None, count)[:count]
        if not all(word.isdigit() and len(word) <= 9 for word in words):
            raise ParameterError("", f"is a damaged {name}: not all of its values are numbers")
        values = np.array([int(word) for word in words], dtype=np.float64)
    if values.size != count:
        have = values.size // colours
        raise ParameterError("", f"is a damaged {name}: it has {have} of {width * height} pixels")
    if values.size and values.max() > brightest:
        sentence = f"is a damaged {name}: pixel {values.max():g} exceeds its maximum {brightest}"
        raise ParameterError("", sentence)
    return Picture(values.reshape(height, width, colours) / float(brightest))


def _bmp(raw: bytes) -> Picture:
    if len(raw) < 54 or int.from_bytes(raw[10:14], "little") >= len(raw):
        raise ParameterError("", "is a damaged BMP: its header is incomplete")
    width, height = (int.from_bytes(raw[n : n + 4], "little", signed=True) for n in (18, 22))
    _check_side(width, abs(height))
    return _decoded(raw, "BMP")


def _jpeg(raw: bytes) -> Picture:
    """Read a JPEG; the size stands in its frame header (ITU-T T.81, B.2.2)."""
    at = 2
    while raw[at : at + 1] == b"\xff" and len(raw) >= at + 9:
        marker = raw[at + 1]
        if 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):
            height, width = (int.from_bytes(raw[n : n + 2], "big") for n in (at + 5, at + 7))
            _check_side(width, height)
            if b"\xff\xd9" not in raw[-64:]:
                raise ParameterError("", "is a damaged JPEG: its end is missing")
            return _decoded(raw, "JPEG")
        at += 1 if marker == 0xFF else 2 + int.from_bytes(raw[at + 2 : at + 4], "big")
    raise ParameterError("", "is a damaged JPEG: its header is incomplete")


def _png(raw: bytes) -> Picture:
    if len(raw) < 33 or raw[12:16] != b"IHDR":
        raise ParameterError("", "is a damaged PNG: its header is incomplete")
    _check_side(int.from_bytes(raw[16:20], "big"), int.from_bytes(raw[20:24], "big"))
    if not raw.rstrip(b"\0").endswith(b"IEND\xaeB`\x82"):
        raise ParameterError("", "is a damaged PNG: its end is missing")
    return _decoded(raw, "PNG")


def _decoded(raw: bytes, kind: str) -> Picture:
    import cv2

    pixels = cv2.imdecode(np.frombuffer(raw, np.uint8), cv2.IMREAD_UNCHANGED)
    if pixels is None:
        raise ParameterError("", f"is a damaged {kind}")
    brightest = 65535.0 if pixels.dtype == np.uint16 else 255.0
    shares: FloatArray = np.atleast_3d(np.asarray(pixels, dtype=np.float64)) / brightest
    if shares.shape[2] in (2, 4):
        return Picture(shares[:, :, :-1], shares[:, :, -1])
    return Picture(shares)

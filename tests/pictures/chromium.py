"""PNG files of SVG and HTML files, by a headless Chromium."""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from math import ceil
from pathlib import Path

from PIL import Image, ImageChops

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
FONTS = re.compile(r',\s*url\("https?://[^)]*\) format\("[^"]*"\)')
SIZE = re.compile(r'viewBox="0 0 ([\d.]+) ([\d.]+)"')
STYLE = (
    '<!doctype html><meta charset="utf-8"><style>body { margin: 0 } svg { display: block }</style>'
)
NO_DITHER = Image.Dither.NONE
LONGEST = 16_000
"""Height of a window in which any page fits, pixels."""

PATIENCE = 60.0
"""Wall seconds for one page."""


class NoChromium(Exception):
    """No Chromium is installed."""


def chromium() -> str:
    """Return the path of Chromium.

    Raises:
        NoChromium: there is none.
    """
    for name in NAMES:
        if found := shutil.which(name):
            return found
    raise NoChromium(
        f"pictures need Chromium (one of {', '.join(NAMES)}): "
        "apt install chromium fonts-firacode fonts-dejavu"
    )


def svgs_to_pngs(pictures: Sequence[tuple[str, Path]]) -> None:
    """Draw SVGs in their own size, several in one window; fonts are those of this machine."""
    at, page, boxes = 0, [STYLE], []
    for svg, file in pictures:
        width, height = (ceil(float(number)) for number in SIZE.search(svg).groups())  # type: ignore[union-attr]
        page.append(f'<div style="width: {width}px; height: {height}px">{FONTS.sub("", svg)}</div>')
        boxes.append((file, (0, at, width, at + height)))
        at += height
    if not boxes:
        return
    with tempfile.TemporaryDirectory() as folder:
        html, png = Path(folder, "page.html"), Path(folder, "page.png")
        html.write_text("".join(page), "utf-8")
        _shoot(html, png, max(box[2] for _, box in boxes), at)
        with Image.open(png) as all_of_them:
            for file, box in boxes:
                _write(all_of_them.crop(box), file)


def html_to_png(html: Path, png: Path, width: int, dark: bool) -> None:
    """Draw a page in a window of a width, as long as it is, in its dark or light colours."""
    scheme = f"--blink-settings=preferredColorScheme={0 if dark else 1}"
    with tempfile.TemporaryDirectory() as folder:
        whole = Path(folder, "page.png")
        _shoot(html, whole, width, LONGEST, scheme)
        with Image.open(whole) as picture:
            _write(picture.crop((0, 0, width, _end(picture))), png)


def shrink(png: Path) -> None:
    """Write a picture again with 256 colours."""
    with Image.open(png) as picture:
        picture.load()
    _write(picture, png)


def _end(picture: Image.Image) -> int:
    """Rows of a page down to the last one that is not empty paper, and a margin."""
    corner = (picture.width - 2, picture.height - 2)
    blank = Image.new(picture.mode, picture.size, picture.getpixel(corner))
    box = ImageChops.difference(picture, blank).convert("RGB").getbbox()
    return picture.height if box is None else min(picture.height, box[3] + 16)


def _shoot(page: Path, png: Path, width: int, height: int, *options: str) -> None:
    """Let Chromium draw a local page; nothing is fetched."""
    subprocess.run(
        [chromium(), "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars",
         "--force-device-scale-factor=1", f"--window-size={width},{height}", *options,
         f"--screenshot={png.resolve()}", page.resolve().as_uri()],
        check=True, timeout=PATIENCE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip


def _write(picture: Image.Image, png: Path) -> None:
    """Write a picture with 256 colours; the text on it stays as it is."""
    png.parent.mkdir(parents=True, exist_ok=True)
    small = picture.convert("RGB").quantize(256, Image.Quantize.FASTOCTREE, dither=NO_DITHER)
    small.save(png, optimize=True)

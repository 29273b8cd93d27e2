"""Draw the pictures of README and docs again: `python -m tests.pictures`, or `make pictures`.

It runs some missions, shows them in the dashboard, in `treepilot report` and in rerun, and lists
what `treepilot export` writes. The chosen pictures go to docs/pictures, the list to docs/runs.md.
With `--all FOLDER`, every screen in every size and theme goes to FOLDER, to be looked at, and the
documentation stays as it is.

The same version gives the same pictures, apart from compute times, memory and speed of simulation.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from tests.benchmarks.origin import ROOT
from tests.pictures.chromium import NoChromium, chromium, html_to_png, shrink, svgs_to_pngs
from tests.pictures.exported import write_topics
from tests.pictures.runs import run_folder
from tests.pictures.screens import VISITS, drawn

DOCS = ROOT / "docs" / "pictures"
SIZES = ((80, 24), (120, 40), (200, 60))
IN_ONE_PAGE = 8
PAGES = ((1400, True), (1400, False), (400, True), (400, False))

CHOSEN = {
    "main-dark-120x40": "dashboard", "main-light-120x40": "dashboard_light",
    "health-dark-120x40": "health", "plots-dark-120x40": "plots",
    "camera-dark-80x24": "camera", "placing-dark-80x24": "placing",
    "replay-dark-120x40": "replay", "report-light-1400": "report", "rerun": "rerun",
    "rerun-arm": "rerun_arm", "arm-dark-120x40": "arm",
}  # fmt: skip
"""Names of pictures that the documentation shows -> their names there."""


RERUN = {"rerun": ("kidnapped", 5.2), "rerun-arm": ("arm", 2.4)}
"""Names of pictures of rerun's viewer -> run and robot time, seconds."""


class Gallery:
    """Where pictures go: all into a folder, or the chosen ones to the documentation.

    Args:
        folder: for all pictures; None: the documentation.
        only: part of the names of the pictures that are drawn.
    """

    def __init__(self, folder: Path | None, only: str) -> None:
        self._folder, self._only = folder, only

    def wants(self, name: str) -> bool:
        """Whether a picture is drawn."""
        return self._only in name and (self._folder is not None or name in CHOSEN)

    def file(self, name: str) -> Path:
        """The file of a picture."""
        found = self._folder / f"{name}.png" if self._folder else DOCS / f"{CHOSEN[name]}.png"
        print(found, flush=True)
        return found


async def draw_screens(gallery: Gallery, runs: Path) -> None:
    """Draw the dashboard live and in replay."""
    for visit in VISITS:
        folder = run_folder(visit.run, runs)
        for size in SIZES:
            found = [one async for one in drawn(visit, folder, size, gallery.wants)]
            pictures = [(svg, gallery.file(name)) for name, svg in found]
            for first in range(0, len(pictures), IN_ONE_PAGE):
                svgs_to_pngs(pictures[first : first + IN_ONE_PAGE])


def draw_report(gallery: Gallery, runs: Path) -> None:
    """Draw the page of `treepilot report`."""
    from missions.inspection.page.page import page_of
    from missions.inspection.page.story import read_story

    page = runs / "report.html"
    page.write_text(page_of([read_story(run_folder("corridor", runs))]), "utf-8")
    for width, dark in PAGES:
        name = f"report-{'dark' if dark else 'light'}-{width}"
        if gallery.wants(name):
            html_to_png(page, gallery.file(name), width, dark)


def draw_rerun(gallery: Gallery, runs: Path) -> None:
    """Draw rerun's viewer."""
    for name, (run, at) in RERUN.items():
        if not gallery.wants(name):
            continue
        file = gallery.file(name)
        subprocess.run(
            [sys.executable, "-m", "tests.pictures.rerun_picture", str(run_folder(run, runs)),
             str(file), "--at", str(at)],
            cwd=ROOT, check=True,
        )  # fmt: skip
        shrink(file)


def main() -> int:
    """Draw; return the exit code."""
    parser = argparse.ArgumentParser(
        "python -m tests.pictures",
        description=__doc__,
        formatter_class=argparse.RawTextHelpFormatter,
    )
    parser.add_argument("--all", type=Path, metavar="FOLDER", help="every picture, to this folder")
    parser.add_argument("--only", default="", metavar="WORD", help="pictures with this in the name")
    parser.add_argument("--runs", type=Path, metavar="FOLDER", help="keep the runs in this folder")
    options = parser.parse_args()
    try:
        chromium()
    except NoChromium as error:
        print(error, file=sys.stderr)
        return 2
    os.environ["TERM"] = "xterm-256color"  # with any other, the screens might be ASCII
    gallery = Gallery(options.all, options.only)
    with tempfile.TemporaryDirectory() as passing:
        runs = options.runs or Path(passing)
        runs.mkdir(parents=True, exist_ok=True)
        asyncio.run(draw_screens(gallery, runs))
        draw_report(gallery, runs)
        draw_rerun(gallery, runs)
        if options.all is None and not options.only:
            write_topics(run_folder("office", runs))
    return 0


if __name__ == "__main__":
    sys.exit(main())

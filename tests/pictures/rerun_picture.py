"""Take a picture of a run as rerun's viewer shows it, without a display.

    python -m tests.pictures.rerun_picture RUN OUT.png --at 42

Needs a software Vulkan driver (Debian's mesa-vulkan-drivers). The interface is experimental in
rerun. Complaints of the views (missing transforms and the like) are listed and the exit code is 1.
While it runs, the viewer listens on that port of every network interface; rerun offers no other.
"""

import argparse
import subprocess
import sys
import time
from pathlib import Path

from rerun.experimental import ViewerClient

from missions.inspection.exchange.rerun_viewer import drawn, viewer_program

SETTLE = 0.5
"""Seconds between looks at whether the recording is loaded."""

REQUESTS = 8


def wait_until_loaded(viewer, seconds):
    """The views once there are some and none is loading; None when it takes too long."""
    for _ in range(int(seconds / SETTLE)):
        views = viewer.get_state().views
        if views:
            return views
        time.sleep(SETTLE)  # noqa: TID251 - waits for another program
    return None


def save(viewer, picture):
    """Save what the viewer shows; on a busy machine it paints longer than one request waits."""
    for _ in range(REQUESTS):
        try:
            return viewer.save_screenshot(str(picture))
        except TimeoutError:
            continue
    sys.exit(f"the viewer has not painted after {REQUESTS} requests of 15 s")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", type=Path, help="its folder")
    parser.add_argument("picture", type=Path)
    parser.add_argument("--at", type=float, default=5.2, help="robot time, seconds")
    parser.add_argument("--port", type=int, default=19880)
    options = parser.parse_args()
    recording = drawn(options.run)
    rerun = viewer_program()
    subprocess.run([rerun, "analytics", "disable"], check=True, capture_output=True)
    with ViewerClient.spawn(
        headless=True, port=options.port, hide_welcome_screen=True, executable_path=rerun
    ) as viewer:
        viewer.open(str(recording.resolve()))
        views = wait_until_loaded(viewer, 30.0)
        if views is None:
            sys.exit("the viewer did not load the recording within 30 s")
        viewer.set_time("mission_time", duration=options.at, play_state="paused")
        for _ in range(4):  # views load what they show only once the time is set
            time.sleep(SETTLE)  # noqa: TID251
        save(viewer, options.picture.resolve())
        complaints = [report for view in viewer.get_state().views for report in view.reports]
    for complaint in complaints:
        print(complaint)
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main())

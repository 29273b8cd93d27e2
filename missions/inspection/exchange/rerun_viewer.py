"""Shows a run in rerun's viewer."""

from __future__ import annotations

import sys
from pathlib import Path

from stack.errors import InputError
from stack.telemetry.recorder import RunFolder


def drawn(folder: Path) -> Path:
    """Return the recording of a run for rerun; draw it if the run's snapshots are newer.

    The progress is shown on stderr if that is a terminal.

    Raises:
        InputError: the run has no snapshots, or the recording cannot be written.
    """
    from stack.telemetry.rerun.recorded import draw_recorded, is_current

    file = RunFolder(folder).recording
    if is_current(folder, file):
        return file
    try:
        draw_recorded(folder, file, _show_progress if sys.stderr.isatty() else _ignore)
    except OSError as error:
        raise InputError(f"cannot write {file}: {error.strerror}") from None
    print(f"{file}: drawn from the run's snapshots", file=sys.stderr)
    return file


def _show_progress(share: float) -> None:
    end = "\r\x1b[K" if share >= 1.0 else ""
    print(f"\rdrawing the recording: {share:4.0%}{end}", end="", file=sys.stderr, flush=True)


def _ignore(share: float) -> None:
    """Show no progress: nobody watches."""

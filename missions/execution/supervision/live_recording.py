"""rerun's viewer on a recording that is still being written."""

from __future__ import annotations

import subprocess
import sysconfig
from collections.abc import Sequence
from pathlib import Path
from subprocess import DEVNULL, PIPE

from stack.errors import InputError


class LiveRecording:
    """A viewer that gets what is written to a recording, from its begin on.

    Args:
        file: of the recording; it need not exist yet.
        words: further options of rerun.

    Raises:
        InputError: the viewer or `tail` cannot be started.
    """

    def __init__(self, file: Path, words: Sequence[str] = ()) -> None:
        viewer = str(Path(sysconfig.get_path("scripts")) / "rerun")
        # The viewer opens a growing file up to its present end only, and a stream to the end.
        reader = ["tail", "-c", "+1", "-F", str(file)]
        try:
            self._reader = subprocess.Popen(reader, stdout=PIPE, stderr=DEVNULL, stdin=DEVNULL)
            self._viewer = subprocess.Popen(
                [viewer, "--bind", "127.0.0.1", *words, "-"], stdin=self._reader.stdout,
                stdout=DEVNULL, stderr=DEVNULL, start_new_session=True,
            )  # fmt: skip
        except OSError as error:
            raise InputError(
                f"cannot open the viewer: {error.filename}: {error.strerror}"
            ) from None

    @property
    def is_open(self) -> bool:
        """Whether the viewer still runs."""
        return self._viewer.poll() is None

    def close(self) -> None:
        """End the stream; a window of the viewer stays open, with what it has."""
        self._reader.terminate()
        self._reader.wait()

"""Watch files for changes by polling: many editors replace a file instead of writing to it.

A poll takes a few microseconds per file; a library with its own thread would make the time of a
change less predictable. A change is operator input: the step at which it takes effect is logged, so
that a run stays repeatable although a wall clock decides when a file is polled.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from time import monotonic  # noqa: TID251 - editors write files in wall time

POLL_PERIOD = 0.1
"""Wall seconds between two polls."""

SETTLED_AFTER = 0.25
"""Wall seconds without a change after which a file counts as completely written."""

Signature = tuple[int, int, int] | None


class FileWatch:
    """Polls files for changes and reports a change once the file has settled."""

    def __init__(self, files: Iterable[Path], clock: Callable[[], float] = monotonic) -> None:
        self._clock, self._next = clock, clock()
        self._reported: dict[Path, Signature] = {}
        self._seen: dict[Path, tuple[Signature, float]] = {}
        self.watch(files)

    def watch(self, files: Iterable[Path]) -> None:
        """Replace the set of watched files; files that stay in it keep their state."""
        wanted = dict.fromkeys(files)
        self._reported = {
            file: self._reported[file] if file in self._reported else signature(file)
            for file in wanted
        }
        self._seen = {file: seen for file, seen in self._seen.items() if file in self._reported}

    def changed(self) -> list[Path]:
        """Return the files that changed since they were last returned, once all have settled."""
        now = self._clock()
        if now < self._next:
            return []
        self._next = now + POLL_PERIOD
        changed, all_settled = [], True
        for file, reported in self._reported.items():
            found = signature(file)
            before, since = self._seen.get(file, (reported, now))
            if found != before:
                since = now
            self._seen[file] = found, since
            if found != reported:
                changed.append(file)
                all_settled &= now - since >= SETTLED_AFTER
        if not all_settled:
            return []
        for file in changed:
            self._reported[file] = self._seen[file][0]
        return changed


def signature(file: Path) -> Signature:
    """Return inode, size and modification time, which differ after every save; None if missing."""
    try:
        found = file.stat()
    except OSError:
        return None
    return found.st_ino, found.st_size, found.st_mtime_ns

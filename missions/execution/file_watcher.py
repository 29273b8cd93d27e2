"""Notices that files were saved, by looking at them: editors replace files as often as write them.

Looking is a few microseconds a file; a library with a thread of its own would only add a moment at
which something happens. What is noticed is operator input: when it takes effect is logged with the
step, so wall time never decides anything that a run could not repeat.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from time import monotonic  # noqa: TID251 - how long an editor has been done is wall time

LOOK_EVERY = 0.1
"""Wall seconds between two looks."""

SETTLED_AFTER = 0.25
"""Wall seconds for which a file must have stayed as it is: one half written is not yet saved."""

Signature = tuple[int, int, int] | None


class FileWatch:
    """Watches files for changes that have come to rest."""

    def __init__(self, files: Iterable[Path], clock: Callable[[], float] = monotonic) -> None:
        self._clock, self._next = clock, clock()
        self._taken: dict[Path, Signature] = {}
        self._seen: dict[Path, tuple[Signature, float]] = {}
        self.watch(files)

    def watch(self, files: Iterable[Path]) -> None:
        """Watch these from now on, and no others; those watched before keep their state."""
        wanted = dict.fromkeys(files)
        self._taken = {
            file: self._taken[file] if file in self._taken else signature(file) for file in wanted
        }
        self._seen = {file: seen for file, seen in self._seen.items() if file in self._taken}

    def changed(self) -> list[Path]:
        """The files that were changed since they were last returned, once all are at rest."""
        now = self._clock()
        if now < self._next:
            return []
        self._next = now + LOOK_EVERY
        changed, all_settled = [], True
        for file, taken in self._taken.items():
            found = signature(file)
            before, since = self._seen.get(file, (taken, now))
            if found != before:
                since = now
            self._seen[file] = found, since
            if found != taken:
                changed.append(file)
                all_settled &= now - since >= SETTLED_AFTER
        if not all_settled:
            return []
        for file in changed:
            self._taken[file] = self._seen[file][0]
        return changed


def signature(file: Path) -> Signature:
    """What differs after every save: inode, size and time of change; None where there is none."""
    try:
        found = file.stat()
    except OSError:
        return None
    return found.st_ino, found.st_size, found.st_mtime_ns

"""Default folders of runs: `runs/<mission>-<date>-<time>`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path

from stack.errors import InputError

RUNS = Path("runs")


@contextmanager
def reserved_suffix(stems: Sequence[str], parent: Path = RUNS) -> Iterator[str]:
    """Create empty folders `<parent>/<stem><suffix>`; those that stay empty are removed at the end.

    The suffix is `-<date>-<time>`, and numbered if a folder of that name exists: of runs that begin
    in the same second, each gets its own folders.

    Raises:
        InputError: the folders cannot be created.
    """
    stamp, count = datetime.now().strftime("-%Y%m%d-%H%M%S"), 1
    suffix = stamp
    while not _created(folders := [parent / (stem + suffix) for stem in dict.fromkeys(stems)]):
        count += 1
        suffix = f"{stamp}-{count}"
    try:
        yield suffix
    finally:
        for folder in folders:
            with suppress(OSError):  # it is not empty, or gone
                folder.rmdir()


def _created(folders: Sequence[Path]) -> bool:
    """Create all folders, or none if one of them exists."""
    done: list[Path] = []
    try:
        for folder in folders:
            folder.parent.mkdir(parents=True, exist_ok=True)
            folder.mkdir()
            done.append(folder)
    except FileExistsError:
        for folder in done:
            folder.rmdir()
        if not folders[0].parent.is_dir():
            raise InputError(
                f"{folders[0].parent} is not a folder; choose another one with --out"
            ) from None
        return False
    except OSError as error:
        raise InputError(f"cannot create the run folder {folders[0]}: {error.strerror}") from None
    return True


def default_name(stem: str) -> str:
    """Return `<mission>-<date>-<time>`, the name of a run without a folder, for `watch`."""
    return f"{stem}-{datetime.now():%Y%m%d-%H%M%S}"

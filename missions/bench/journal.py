"""Journals: files of JSON lines, to which a line is appended as soon as a run is over."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from stack.documents import Finding, Mark
from stack.documents.files import read_bytes, read_input
from stack.errors import InputError
from stack.telemetry.codec import MalformedError

T = TypeVar("T")


def read_journal(file: Path, what: str, limit: int, read: Callable[[Any], T]) -> list[T]:
    """Read the rows of a journal, without a last line that an interruption cut off.

    Args:
        file: the journal; there may be none.
        what: its rows, for errors: `row of a sweep`.
        limit: largest size, bytes.
        read: makes a row of what JSON has; raises LookupError, TypeError or MalformedError.

    Raises:
        InputError: a line is not a row.
    """
    if not file.exists():
        return []
    content, rows = read_input(file, "journal", limit), []
    for number, line in enumerate(content.split(b"\n")[:-1], start=1):
        try:
            rows.append(read(json.loads(line)))
        except (ValueError, LookupError, TypeError, MalformedError) as error:
            hint = "remove this line: the command makes its run again"
            finding = Finding(Mark(str(file), number), "E004", f"not a {what}: {error}", hint)
            raise InputError([finding]) from None
    return rows


def cut_journal(file: Path, limit: int) -> None:
    """Remove a last line that an interruption cut off."""
    content = read_bytes(file, limit)
    os.truncate(file, content.rfind(b"\n") + 1)

"""Reads foreign files: regular files only, and no more than a limit.

A device or a FIFO could block forever or never end. Opening does not wait for a writer, and the
kind of file is checked on the open file, so that it cannot be replaced in between. LIMITS are
listed in docs/worlds.md. Codes: E001 the file · E002 too large · E003 not text · E005 empty ·
E007 of another kind.
"""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import BinaryIO

from stack.documents.foreign_kinds import BEGINNING, BINARY, recognised, recognised_folder
from stack.errors import Finding, InputError, Mark
from stack.parameters import did_you_mean, nearest

YAML_BYTES = 1_000_000
"""Of a mission, world, robot, map or parameter file, and of a route graph."""

URDF_BYTES = 5_000_000
XML_BYTES = 50_000_000
"""Of a Gazebo world."""

MESH_BYTES = 50_000_000
IMAGE_BYTES = 1 << 28
JSON_BYTES = 50_000_000
"""Of a report, and of other tables that treepilot has written itself."""

RECORD_BYTES = 1 << 26
"""Of one message of a recording, or one line of an event log."""

_KINDS = (
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISSOCK, "a socket"),
)


DOCUMENTS = (
    "mission", "world file", "robot file", "map file", "parameter file", "Nav2 parameter file",
    "file of trees", "map of markers", "route graph", "URDF", "Gazebo world file", "map",
)  # fmt: skip
"""Kinds of files that people write or export. Other programs' files are often given for them."""


_INPUTS: ContextVar[dict[Path, None] | None] = ContextVar("inputs", default=None)


@contextmanager
def noting_inputs() -> Iterator[dict[Path, None]]:
    """Collect the files that are read for a run: absolute paths, in order, each once.

    Yields:
        The files so far. What another library opens is added by `note_input`.
    """
    inputs: dict[Path, None] = {}
    token = _INPUTS.set(inputs)
    try:
        yield inputs
    finally:
        _INPUTS.reset(token)


def note_input(path: Path) -> None:
    """Say that a file is read for the run, if somebody collects them."""
    inputs = _INPUTS.get()
    if inputs is not None:
        inputs[path.absolute()] = None


class TooLargeError(OSError):
    """The file is larger than the limit."""


def open_regular(path: Path) -> BinaryIO:
    """Open a regular file for reading; never waits for it.

    Raises:
        FileNotFoundError: it does not exist.
        IsADirectoryError: it is a folder.
        OSError: it is something else, or cannot be opened; `strerror` is a sentence.
    """
    try:
        number = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC)
    except ValueError:  # a null character in the name
        raise OSError(errno.EINVAL, "the name has a null character") from None
    try:
        mode = os.fstat(number).st_mode
        if stat.S_ISDIR(mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        if not stat.S_ISREG(mode):
            kind = next((word for check, word in _KINDS if check(mode)), "something else")
            raise OSError(errno.EINVAL, f"not a regular file but {kind}")
        note_input(path)
        return os.fdopen(number, "rb")
    except BaseException:
        os.close(number)
        raise


def read_bytes(path: Path, limit: int) -> bytes:
    """Content of a regular file of at most `limit` bytes.

    Raises:
        TooLargeError: it is larger; not more than the limit is read.
        OSError: as `open_regular`.
    """
    with open_regular(path) as file:
        size = os.fstat(file.fileno()).st_size
        # The size may be wrong: of a file that grows, or of one that the kernel makes up.
        content = file.read(limit + 1) if size <= limit else b""
    size = max(size, len(content or b""))
    if size > limit:
        raise TooLargeError(errno.EFBIG, f"{size} bytes or more; at most {limit} are read")
    if content is None:
        raise OSError(errno.EAGAIN, "it has no content yet")
    return content


def read_input(path: Path, what: str, limit: int = YAML_BYTES) -> bytes:
    """Content of a file that the user has named.

    Args:
        path: of the file.
        what: kind of file for messages, such as "world file".
        limit: bytes.

    Raises:
        InputError: missing (with the most similar name), a folder, a device, too large or
            unreadable.
    """
    code, hint = "E001", ""
    try:
        content = read_bytes(path, limit)
        if what in DOCUMENTS:
            refuse_foreign(content[:BEGINNING], path, what)
        return content
    except FileNotFoundError:
        hint, sentence = near_file(path), f"there is no such {what}"
        if path.is_symlink():
            sentence = f"this is a broken link: there is no {str(path.readlink())!r}"
    except IsADirectoryError:
        folder, hint = recognised_folder(path) or ("a folder", "")
        sentence = f"this is {folder}, not a {what}"
    except TooLargeError as error:
        if what in DOCUMENTS:
            _refuse_large(path, what)
        code, sentence = "E002", f"{error.strerror} of a {what}"
    except OSError as error:
        sentence = f"cannot be read: {error.strerror}"
    raise InputError([Finding(Mark(str(path)), code, sentence, hint)])


def refuse_foreign(beginning: bytes, path: Path, what: str) -> None:
    """Check that a file is not of another program, nor empty.

    Raises:
        InputError: it is; the finding says what it is, and what to do with it.
    """
    where = Mark(str(path))
    if not beginning.strip():
        raise InputError([Finding(where, "E005", f"the {what} is empty")])
    kind = recognised(beginning, path.name)
    if kind is not None and what not in kind.read_as:
        sentence = f"this is {kind.name}, not a {what}"
        raise InputError([Finding(where, "E007", sentence, kind.advice)])


def _refuse_large(path: Path, what: str) -> None:
    """Check that a file is not too large because it is of another program.

    Raises:
        InputError: it is of another program.
    """
    with open_regular(path) as file:
        beginning = file.read(BEGINNING)
    if recognised(beginning, path.name) is not BINARY:
        refuse_foreign(beginning, path, what)


def near_file(path: Path) -> str:
    """Hint with the most similar file of the same folder; empty if none is similar."""
    if not path.parent.is_dir():
        return f"there is no folder {str(path.parent)!r}"
    beside = [item for item in path.parent.glob(f"*{path.suffix}") if item.is_file()]
    stems = {item.stem: item.name for item in beside}  # equal suffixes are no similarity
    close = nearest(path.stem, sorted(stems))
    return "" if close is None else did_you_mean(stems[close])


def decoded(raw: bytes, path: Path) -> str:
    """The text of a file.

    Raises:
        InputError: it is not UTF-8.
    """
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError as error:
        line = raw[: error.start].count(b"\n") + 1
        column = error.start - raw.rfind(b"\n", 0, error.start)
        where = Mark(str(path), line, column)
        sentence = f"not a text file: byte 0x{raw[error.start]:02x} is not UTF-8"
        raise InputError([Finding(where, "E003", sentence, "save it as UTF-8")]) from None

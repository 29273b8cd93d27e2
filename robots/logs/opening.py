"""Opens logs of other programs: the format is recognised by the content of the file."""

from __future__ import annotations

from pathlib import Path

from robots.logs.recording import NOT_A_LOG, Recording, refuse
from robots.logs.rosbag import Topics
from stack.documents.files import near_file, open_regular
from stack.documents.foreign_kinds import BEGINNING, recognised
from stack.errors import InputError

MCAP = b"\x89MCAP0\r\n"
SQLITE = b"SQLite format 3\0"
ROSBAG1 = b"#ROSBAG V"
LFS_POINTER = b"version https://git-lfs.github.com/spec/"
LFS_BYTES = 1024
LOG = "log"
SUFFIXES = {MCAP: ".mcap", SQLITE: ".db3", ROSBAG1: ".bag"}


def open_log(path: Path, topics: Topics = Topics()) -> Recording:
    """Open a CARMEN log or a ROS bag.

    Args:
        path: file, or folder of a rosbag2.
        topics: of a ROS bag; a CARMEN log has none.

    Raises:
        InputError: missing, of another kind, or damaged.
    """
    from robots.logs.carmen import read_carmen_log
    from robots.logs.rosbag import read_bag

    if path.is_dir():
        if not (path / "metadata.yaml").exists():
            hint = "a rosbag2 folder contains metadata.yaml"
            raise refuse(path, NOT_A_LOG, "this is a folder, not a log", hint)
        for file in sorted(path.iterdir()):
            if file.suffix in SUFFIXES.values() and file.is_file():
                beginning(file)
        return read_bag(path, topics)
    begin = beginning(path)
    if not begin:
        raise refuse(path, NOT_A_LOG, "the log is empty")
    for magic, suffix in SUFFIXES.items():
        if begin.startswith(magic):
            if path.suffix != suffix:
                hint = f"rename it to {path.stem}{suffix}"
                raise refuse(path, NOT_A_LOG, f"a ROS bag of this kind ends in {suffix}", hint)
            return read_bag(path, topics)
    _refuse_other(path)
    if topics != Topics():
        raise refuse(path, NOT_A_LOG, "topics are of ROS bags; this is not one", "remove them")
    return read_carmen_log(path)


def beginning(path: Path) -> bytes:
    """Return the first bytes of a log.

    Raises:
        InputError: the file cannot be read, or is the pointer that Git LFS keeps in its place.
    """
    try:
        with open_regular(path) as file:
            begin = file.read(len(LFS_POINTER))
            if begin == LFS_POINTER:
                raise _refuse_pointer(path, file.read(LFS_BYTES))
            return begin
    except FileNotFoundError:
        raise refuse(path, "E001", "there is no such log", near_file(path)) from None
    except OSError as error:
        raise refuse(path, "E001", f"cannot be read: {error.strerror}") from None


def _refuse_other(path: Path) -> None:
    """Raise InputError for a file of which is known that it is no log."""
    with open_regular(path) as file:
        kind = recognised(file.read(BEGINNING), path.name)
    if kind is not None and LOG not in kind.read_as:
        raise refuse(path, NOT_A_LOG, f"this is {kind.name}, not a log", kind.advice)


def _refuse_pointer(path: Path, rest: bytes) -> InputError:
    sizes = [line.split()[1] for line in rest.splitlines() if line.startswith(b"size ")]
    size = f" of {int(sizes[0])} bytes" if sizes and sizes[0].isdigit() else ""
    sentence = f"this is a pointer of Git LFS; the log itself{size} was not downloaded"
    return refuse(path, NOT_A_LOG, sentence, f"run: git lfs pull --include {path.name}")

"""Opens logs of other programs: the format is recognised by the content of the file."""

from __future__ import annotations

from pathlib import Path

from robots.logs.recording import NOT_A_LOG, Recording, refuse
from robots.logs.rosbag import Topics
from stack.documents.files import near_file, open_regular

MCAP = b"\x89MCAP0\r\n"
SQLITE = b"SQLite format 3\0"
ROSBAG1 = b"#ROSBAG V"
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
    if topics != Topics():
        raise refuse(path, NOT_A_LOG, "topics are of ROS bags; this is not one", "remove them")
    return read_carmen_log(path)


def beginning(path: Path) -> bytes:
    """Return the first bytes of a log.

    Raises:
        InputError: the file cannot be read.
    """
    try:
        with open_regular(path) as file:
            return file.read(16)
    except FileNotFoundError:
        raise refuse(path, "E001", "there is no such log", near_file(path)) from None
    except OSError as error:
        raise refuse(path, "E001", f"cannot be read: {error.strerror}") from None

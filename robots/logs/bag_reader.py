"""Reader of the messages of a ROS bag, of standard types alone.

The reader of `rosbags` for all kinds of bags registers every type that a bag defines, and refuses
the bag if it knows one of them not, such as the events of a service. Types that are not read need
no definition here.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path
from types import TracebackType
from typing import Any

from robots.logs.recording import DAMAGED_LOG, NOT_A_LOG, refuse
from stack.errors import InputError
from stack.optional_packages import MISSING_PACKAGE, ROSBAGS


class BagReader:
    """A bag as a context manager.

    Args:
        path: folder of a rosbag2, or an .mcap, .db3 or .bag file.

    Raises:
        InputError: `rosbags` is not installed, or this is not a bag.
    """

    def __init__(self, path: Path) -> None:
        if not ROSBAGS.is_installed:
            raise refuse(path, MISSING_PACKAGE, f"ROS bags need {ROSBAGS.absence}", ROSBAGS.hint)
        from rosbags import rosbag1, rosbag2
        from rosbags.typesys import Stores, get_typestore

        self._is_ros1 = path.suffix == ".bag" and not path.is_dir()
        self._store = get_typestore(Stores.ROS1_NOETIC if self._is_ros1 else Stores.ROS2_HUMBLE)
        try:
            self._reader: Any = rosbag1.Reader(path) if self._is_ros1 else rosbag2.Reader(path)
        except Exception as error:
            raise refuse(path, NOT_A_LOG, f"this is not a ROS bag: {words_of(error)}") from None

    def __enter__(self) -> BagReader:
        self._reader.open()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:  # fmt: skip
        self._reader.close()

    @property
    def topics(self) -> dict[str, tuple[str, int]]:
        """Message type and number of messages of each topic."""
        found: dict[str, tuple[str, int]] = {}
        for item in self._reader.connections:
            count = found[item.topic][1] if item.topic in found else 0
            found[item.topic] = item.msgtype, count + item.msgcount
        return found

    @property
    def end_time(self) -> float:
        """Time after the last message, seconds."""
        return float(self._reader.end_time * 1e-9)

    def messages(self, topics: Collection[str]) -> Iterator[tuple[str, float, Any]]:
        """Yield the messages of some topics of standard types: topic, time in seconds, message."""
        connections = [item for item in self._reader.connections if item.topic in topics]
        store = self._store
        read = store.deserialize_ros1 if self._is_ros1 else store.deserialize_cdr
        if connections:  # the library reads all messages for none
            for connection, logged, raw in self._reader.messages(connections):
                yield connection.topic, logged * 1e-9, read(raw, connection.msgtype)


def damaged(path: Path, error: Exception, after: str = "") -> InputError:
    """Return the error to raise about a bag that a library cannot read."""
    return refuse(path, DAMAGED_LOG, f"the bag is damaged{after}: {words_of(error)}")


def words_of(error: Exception) -> str:
    """Return the reason that a library gives, without the words of Python itself."""
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    own = type(error).__module__.partition(".")[0] in ("rosbags", "robots")
    text = " ".join(str(error).split())[:200]
    return text if own and text else "its content is not readable"

"""Reader of the messages of a ROS bag, of standard types alone.

The reader of `rosbags` for all kinds of bags registers every type that a bag defines, and refuses
the bag if it knows one of them not, such as the events of a service. Types that are not read need
no definition here.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

from robots.logs.recording import DAMAGED_LOG, NOT_A_LOG, refuse
from stack.errors import InputError
from stack.optional_packages import MISSING_PACKAGE, ROSBAGS

if TYPE_CHECKING:
    from rosbags.interfaces import Connection


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
    def connections(self) -> list[Connection]:
        """The connections; each has a topic, a message type and a number of messages."""
        found: list[Connection] = self._reader.connections
        return found

    @property
    def start_time(self) -> int:
        """Time of the first message, nanoseconds."""
        return int(self._reader.start_time)

    @property
    def end_time(self) -> int:
        """Time after the last message, nanoseconds."""
        return int(self._reader.end_time)

    def messages(
        self, connections: Collection[Connection]
    ) -> Iterator[tuple[Connection, int, bytes]]:
        """Yield the messages of some connections: connection, time in nanoseconds, content."""
        if connections:  # the library reads all messages for none
            yield from self._reader.messages(connections)

    def deserialize(self, raw: bytes, kind: str) -> Any:
        """Return a message of a standard type."""
        if self._is_ros1:
            return self._store.deserialize_ros1(raw, kind)
        return self._store.deserialize_cdr(raw, kind)


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

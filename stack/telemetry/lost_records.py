"""What is missing in a run folder: a record that has reached its size, or could not be written."""

from __future__ import annotations

from dataclasses import dataclass

from stack.errors import TelemetryError


class RecordFull(TelemetryError):
    """A record has reached its size limit. It is complete up to there, and ends.

    Args:
        record: name of the file.
        limit: bytes.
    """

    def __init__(self, record: str, limit: float) -> None:
        super().__init__(
            f"{record} reached its limit of {limit / 1e6:g} MB; the recording ends here"
            " (recording.size_limit sets the limit)"
        )


@dataclass(frozen=True, slots=True)
class LostRecord:
    """A file of the run folder that could not be written.

    Attributes:
        record: path of the file relative to the run folder.
        time: robot time from which on it is missing, seconds.
        reason: why, e.g. No space left on device.
        event: number of the first missing event, of events.jsonl only.
    """

    record: str
    time: float
    reason: str
    event: int | None = None

    @property
    def text(self) -> str:
        """What is lost, as in: events.jsonl from event 12 on (No space left on device)."""
        since = f"{self.time:.1f} s" if self.event is None else f"event {self.event}"
        return f"{self.record} from {since} on ({self.reason})"

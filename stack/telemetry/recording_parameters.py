"""Parameters of snapshots.mcap; imports nothing heavy."""

from __future__ import annotations

from dataclasses import dataclass

from stack.parameters import parameter


@dataclass(frozen=True)
class RecordingParameters:
    """Rate and size of snapshots.mcap; what did not change is not repeated."""

    rate: float = parameter(
        5.0, "Hz", above=0.0, at_most=100.0, public=True,
        help="pose, plots, states, people and tracks; besides, one snapshot after each event",
    )  # fmt: skip
    size_limit: float = parameter(
        2000.0, at_least=1.0, public=True, help="megabytes at which the recording stops"
    )

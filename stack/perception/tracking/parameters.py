"""Parameters of the tracker of moving objects."""

from __future__ import annotations

from dataclasses import dataclass

from stack.parameters import parameter


@dataclass(frozen=True)
class TrackerParameters:
    """Parameters of the detection and tracking of moving objects."""

    range: float = parameter(12.0, "m", above=0.0, help="largest range of a return")
    confirm: int = parameter(3, at_least=2, help="number of detections that confirm a track")
    forget: float = parameter(1.0, "s", above=0.0, help="a track not seen for this time is removed")

"""Parameters of the recordings of a run, mission.rrd and snapshots.mcap; imports nothing heavy."""

from __future__ import annotations

from dataclasses import dataclass

from stack.parameters import parameter


@dataclass(frozen=True)
class RecordingParameters:
    """Rates and sizes of mission.rrd and snapshots.mcap; what did not change is not repeated."""

    rate: float = parameter(
        5.0, "Hz", above=0.0, at_most=100.0, public=True,
        help="of both: pose, plots, states, people and tracks; no other rate can be higher",
    )  # fmt: skip
    particle_rate: float = parameter(
        2.0, "Hz", above=0.0, at_most=100.0, help="particles of the localisation, in mission.rrd"
    )
    local_costmap_rate: float = parameter(
        1.0, "Hz", above=0.0, at_most=100.0, help="local costmap, if it changed"
    )
    global_costmap_rate: float = parameter(
        0.5, "Hz", above=0.0, at_most=100.0, help="changed parts of the global costmap"
    )
    size_limit: float = parameter(
        2000.0, at_least=1.0, public=True, help="megabytes at which each recording stops"
    )

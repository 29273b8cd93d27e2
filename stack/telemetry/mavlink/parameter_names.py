"""Short names of parameters for MAVLink, which has room for 16 characters.

controller.cruise_speed is CTL_CRUISE_SPEED, localisation.initial_position_deviation is
LOC_INIT_POS_DEV: a code of the component, then the words of the name, the longest cut until all
fits. A name depends on nothing but the full name. docs/rovers.md lists them.
"""

from __future__ import annotations

from collections.abc import Iterable
from zlib import crc32

LENGTH = 16

CODES = {
    "controller": "CTL", "goal_checker": "GOAL", "progress_checker": "PROG", "planner": "PLAN",
    "smoother": "SMTH", "navigator": "NAV", "evasion": "EVA", "safety": "SAFE", "failsafe": "FS",
    "local_costmap": "LCM", "global_costmap": "GCM", "localisation": "LOC", "odometry": "ODO",
    "depth": "DEP", "cameras": "CAM", "object_detector": "OBJ", "markers": "MRK",
    "place_recognition": "PLC", "tracker": "TRK", "obstacle_memory": "OBST", "loop": "LOOP",
    "recording": "REC", "speed_limits": "LIM", "coloured_objects": "COL",
}  # fmt: skip
"""Code by component; those of plugins are their first four letters."""


def short_name(name: str) -> str:
    """The MAVLink name of `component.parameter`."""
    component, _, own = name.partition(".")
    code = CODES.get(component, component.replace("_", "")[:4].upper())
    words = [word for word in own.upper().replace(".", "_").split("_") if word]
    while len("_".join([code, *words])) > LENGTH:
        longest = max(range(len(words)), key=lambda n: (len(words[n]), n))
        if len(words[longest]) == 1:
            words.pop()
        else:
            words[longest] = words[longest][:-1]
    return "_".join([code, *words])


def short_names(names: Iterable[str]) -> dict[str, str]:
    """Full name by short name. Two that would be the same end in a checksum of the full name."""
    found: dict[str, str] = {}
    for name in names:
        short = short_name(name)
        if short in found:
            short = f"{short[: LENGTH - 5]}_{crc32(name.encode()) & 0xFFFF:04X}"
        found[short] = name
    return found

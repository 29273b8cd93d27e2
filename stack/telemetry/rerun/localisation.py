"""Draws what the localisation uses and assumes in rerun: scan, particles, rival poses."""

from __future__ import annotations

from math import cos, sin
from typing import Any

import numpy as np
import rerun as rr

from stack.telemetry.beams import LONG, MATCHED, SHORT, beam_classes
from stack.telemetry.outlines import at_height
from stack.telemetry.rerun.recording import Recording
from stack.types import FloatArray, OccupancyGrid, Pose2D, RivalPose, Scan

PARTICLE_COLOUR, PARTICLE_LENGTH = (196, 170, 255, 130), 0.12
SCAN_COLOUR, SHORT_COLOUR, LONG_COLOUR = (255, 116, 92), (255, 210, 77), (77, 225, 255)
RIVAL_COLOUR = (255, 107, 214)

ENTITIES = {MATCHED: "world/scan", SHORT: "world/scan_short", LONG: "world/scan_long"}
"""Entity of each class of beams."""


def localisation_constants() -> dict[str, Any]:
    """Return the sizes and colours of the entities, by their names below `world`."""
    points, arrows = rr.Points3D.from_fields, rr.Arrows3D.from_fields
    return {
        "scan": points(radii=0.025, colors=SCAN_COLOUR),
        "scan_short": points(radii=0.03, colors=SHORT_COLOUR),
        "scan_long": points(radii=0.03, colors=LONG_COLOUR),
        "particles": arrows(radii=0.006, colors=PARTICLE_COLOUR),
        "rivals": arrows(radii=0.04, colors=RIVAL_COLOUR),
    }


def draw_scan(recording: Recording, scan: Scan, pose: Pose2D, grid: OccupancyGrid | None) -> None:
    """Draw the end points of a scan; with a map, short and long beams in their own colours.

    Args:
        recording: to draw in.
        scan: to draw.
        pose: of the base at its stamp, map frame.
        grid: the map; None without one.
    """
    if grid is None:
        points = pose.transform(scan.points())
        classes = np.full(len(points), MATCHED, np.uint8)
    else:
        points, classes = beam_classes(scan, pose, grid)
    for number, entity in ENTITIES.items():
        ends = at_height(points[classes == number], 0.2).astype(np.float32)
        if len(ends):
            recording.show_row(entity, rr.Points3D, positions=ends)
        else:
            recording.hide(entity)


def draw_particles(recording: Recording, particles: FloatArray) -> None:
    """Draw particles, (n, 3) of x, y and heading, as arrows."""
    x, y, heading = np.asarray(particles, np.float32).T
    flat = np.zeros_like(x)
    recording.show_row(
        "world/particles",
        rr.Arrows3D,
        origins=np.column_stack([x, y, flat + 0.04]),
        vectors=np.column_stack([np.cos(heading), np.sin(heading), flat]) * PARTICLE_LENGTH,
    )


def draw_rivals(recording: Recording, rivals: tuple[RivalPose, ...]) -> None:
    """Draw rival poses as arrows with their shares; hide them if there are none."""
    if not rivals:
        recording.hide("world/rivals")
        return
    poses = [rival.pose for rival in rivals]
    arrows = rr.Arrows3D.from_fields(
        origins=[(pose.x, pose.y, 0.3) for pose in poses],
        vectors=[(0.5 * cos(pose.heading), 0.5 * sin(pose.heading), 0.0) for pose in poses],
        labels=[f"{rival.share:.0%}" for rival in rivals],
    )
    recording.show("world/rivals", arrows)

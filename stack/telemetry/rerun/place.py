"""Static parts of a rerun recording: robot model, marker boards, places, scene, maps."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import rerun as rr
from rerun.urdf import UrdfTree

from stack.telemetry.records import AROUND_ARM, RunInfo, SceneShape
from stack.telemetry.rerun.recording import BASE, UP, Recording
from stack.types import Marker

MODEL_COLOUR = (94, 200, 255)
MARKER_COLOUR = (186, 192, 200)
PLACE_COLOUR = (120, 136, 160)
WIRE = 0.003
"""Thickness of the edges of what an arm knows, metres."""

DIMMED = 0.62
"""Factor on the brightness of scene shapes, so that data stay visible."""


def draw_robot_model(recording: Recording, info: RunInfo) -> UrdfTree | None:
    """Draw the URDF's visual shapes in the frames of its links; without a URDF, a box.

    Returns:
        The URDF; None without one.
    """
    if not info.urdf:
        _draw_robot_box(recording, info)
        return None
    robot = ElementTree.fromstring(info.urdf)
    for link in robot.iter("link"):
        for collision in link.findall("collision"):
            link.remove(collision)  # collision shapes would hide the visual shapes
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "robot.urdf"
        file.write_bytes(ElementTree.tostring(robot))
        tree = UrdfTree.from_file_path(
            file, entity_path_prefix="world", static_transform_entity_path="world/joints"
        )
        tree.log_urdf_to_recording(recording.stream)
    root = rr.Transform3D(parent_frame=BASE, child_frame=tree.root_link().name)
    recording.stream.log("world/robot_root", root, static=True)
    return tree


def _draw_robot_box(recording: Recording, info: RunInfo) -> None:
    corners = info.footprint.points
    low, high = corners.min(axis=0), corners.max(axis=0)
    middle, half = (low + high) / 2.0, (high - low) / 2.0
    box = rr.Boxes3D(
        centers=[(*middle, 0.12)],
        half_sizes=[(*half, 0.1)],
        colors=MODEL_COLOUR,
        fill_mode="solid",
    )
    recording.stream.log("world/robot_box", box, rr.CoordinateFrame(BASE), static=True)


def draw_markers(recording: Recording, markers: tuple[Marker, ...]) -> None:
    """Draw the fiducial boards; a board is 1.25 times as wide as its marker."""
    if markers:
        boards = rr.Boxes3D(
            centers=[marker.position for marker in markers],
            sizes=[(0.01, 1.25 * marker.size, 1.25 * marker.size) for marker in markers],
            rotation_axis_angles=[rr.RotationAxisAngle(UP, marker.heading) for marker in markers],
            colors=MARKER_COLOUR,
            fill_mode="solid",
            labels=[f"#{marker.number}" for marker in markers],
            show_labels=False,
        )
        recording.fix("world/markers", boards)


def draw_places(recording: Recording, info: RunInfo) -> None:
    """Draw the named places as labelled dots."""
    if info.places:
        dots = rr.Points3D(
            [(place.x, place.y, 0.03) for place in info.places.values()],
            radii=0.06,
            colors=PLACE_COLOUR,
            labels=list(info.places),
            show_labels=True,
        )
        recording.fix("world/places", dots)


def draw_scene(recording: Recording, name: str, shapes: tuple[SceneShape, ...]) -> None:
    """Draw the shapes of a scene; those that an arm knows as wires, over the true ones."""
    if name == AROUND_ARM:
        path, wires = f"world/{name}/boxes", {"fill_mode": "majorwireframe", "radii": WIRE}
        sizes = [shape.size for shape in shapes]
        recording.show(path, rr.Boxes3D(sizes=sizes, **(_common_attributes([*shapes]) | wires)))
        return
    _draw_boxes(recording, f"world/{name}/boxes", shapes)
    _draw_cylinders(recording, f"world/{name}/cylinders", shapes)


def hide_scene(recording: Recording, name: str) -> None:
    """Remove a scene from the view."""
    for path in (f"world/{name}/boxes", f"world/{name}/cylinders"):
        recording.hide(path)


def _draw_boxes(recording: Recording, path: str, shapes: tuple[SceneShape, ...]) -> None:
    boxes = [shape for shape in shapes if shape.kind == "box"]
    if boxes:
        sizes = [shape.size for shape in boxes]
        recording.show(path, rr.Boxes3D(sizes=sizes, **_common_attributes(boxes)))
    else:
        recording.hide(path)


def _draw_cylinders(recording: Recording, path: str, shapes: tuple[SceneShape, ...]) -> None:
    cylinders = [shape for shape in shapes if shape.kind == "cylinder"]
    if cylinders:
        lengths = [shape.size[2] for shape in cylinders]
        radii = [shape.size[0] / 2.0 for shape in cylinders]
        drawn = rr.Cylinders3D(lengths=lengths, radii=radii, **_common_attributes(cylinders))
        recording.show(path, drawn)
    else:
        recording.hide(path)


def _common_attributes(shapes: list[SceneShape]) -> dict[str, Any]:
    """Attributes that boxes and cylinders share."""
    return {
        "centers": [
            (shape.pose.x, shape.pose.y, shape.lift + shape.size[2] / 2.0) for shape in shapes
        ],
        "rotation_axis_angles": [rr.RotationAxisAngle(UP, shape.pose.heading) for shape in shapes],
        "colors": [tuple(round(255 * DIMMED * part) for part in shape.colour) for shape in shapes],
        "fill_mode": "solid",
    }

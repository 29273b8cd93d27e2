"""Shapes of the 3-D scene: the place, people, tracks, objects, goal and outlines."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from math import atan2
from typing import Any

from foxglove.messages import (
    ArrowPrimitive,
    Color,
    CubePrimitive,
    CylinderPrimitive,
    LinePrimitive,
    LinePrimitiveLineType,
    Point3,
    Pose,
    SceneEntity,
    SceneEntityDeletion,
    SceneEntityDeletionType,
    SceneUpdate,
    SpherePrimitive,
    TextPrimitive,
    Vector3,
)

from stack.telemetry.foxglove.messages import pose_at, pose_of, stamp_of, vector
from stack.telemetry.foxglove.urdf_links import BASE, MAP, UNROTATED, LinkShape
from stack.telemetry.outlines import outline, uncertainty_ellipse
from stack.telemetry.records import RunInfo, SceneShape, Snapshot
from stack.types import FloatArray, Footprint, Limitation, Pose2D, TrackedObject

Colour = tuple[float, float, float]

ROBOT: Colour = (0.37, 0.78, 1.0)
TRUTH: Colour = (0.59, 0.62, 0.67)
GOAL: Colour = (1.0, 0.47, 0.75)
PERSON: Colour = (0.94, 0.69, 0.47)
TRACK: Colour = (1.0, 0.8, 0.24)
OBJECT: Colour = (0.78, 0.9, 0.3)
LIMITATION: Colour = (0.93, 0.3, 0.3)
PLACE: Colour = (0.47, 0.53, 0.63)
MARKER: Colour = (0.73, 0.75, 0.78)

PERSON_HEIGHT, BOX_HEIGHT = 1.7, 0.2
"""Of people, and of a robot whose shapes are not known, metres."""

LINE, TEXT_SIZE, DOT = 0.025, 0.2, 0.12
"""Thickness of lines, height of texts, diameter of dots, metres."""

_NOWHERE = Pose2D(0.0, 0.0)


def surroundings(shapes: Iterable[SceneShape], time: float) -> SceneUpdate:
    """The shapes of the world; they replace those before."""
    solids: dict[str, list[Any]] = {"cubes": [], "cylinders": []}
    for shape in shapes:
        name, make = _SOLIDS[shape.kind]
        pose = pose_of(shape.pose, shape.lift + shape.size[2] / 2.0)
        solids[name].append(make(pose, vector(shape.size), shape.colour))
    return _update(time, _entity(time, "world", MAP, **solids))


def places(info: RunInfo, time: float) -> SceneUpdate:
    """The named places and the fiducial markers."""
    texts = [_text(name, place, 0.15, PLACE) for name, place in info.places.items()]
    dots = [_dot(place, PLACE) for place in info.places.values()]
    boards = [
        _cube(
            pose_of(Pose2D(*marker.position[:2], marker.heading), marker.position[2]),
            vector((0.01, marker.size, marker.size)),
            MARKER,
        )
        for marker in info.markers
    ]
    return _update(time, _entity(time, "places", texts=texts, spheres=dots, cubes=boards))


def robot_model(shapes: Sequence[LinkShape], footprint: Footprint, time: float) -> SceneUpdate:
    """The robot's shapes in the frames of its links; without any, a box on its footprint."""
    if not shapes:
        low, high = footprint.points.min(axis=0), footprint.points.max(axis=0)
        (x, y), (length, width) = ((low + high) / 2.0).tolist(), (high - low).tolist()
        size = length, width, BOX_HEIGHT
        shapes = [LinkShape(BASE, "box", size, (x, y, BOX_HEIGHT / 2.0), UNROTATED, ROBOT)]
    frames = dict.fromkeys(shape.frame for shape in shapes)
    return _update(time, *(_link(frame, shapes, time) for frame in frames))


def _link(frame: str, shapes: Iterable[LinkShape], time: float) -> SceneEntity:
    """Those of the shapes that are in a frame."""
    solids: dict[str, list[Any]] = {"cubes": [], "cylinders": [], "spheres": []}
    for shape in shapes:
        if shape.frame == frame:
            name, make = _SOLIDS[shape.kind]
            pose = pose_at(shape.position, shape.rotation)
            solids[name].append(make(pose, vector(shape.size), shape.colour))
    return _entity(time, frame, frame, **solids)


def moving(snapshot: Snapshot, footprint: Footprint) -> SceneUpdate:
    """All that moves; it replaces what was shown before."""
    time, corners = snapshot.time, footprint.points
    entities = [
        _entity(time, "robot", frame=BASE, lines=[_loop(outline(_NOWHERE, corners), ROBOT)]),
        _entity(time, "uncertainty", lines=[_loop(_ellipse(snapshot), ROBOT)]),
    ]
    if snapshot.truth is not None:
        lines = [_loop(outline(snapshot.truth, corners), TRUTH)]
        entities.append(_entity(time, "truth", lines=lines))
    if snapshot.goal is not None:
        entities.append(_entity(time, "goal", arrows=[_arrow(snapshot.goal, 0.45, GOAL)]))
    if snapshot.people is not None and len(snapshot.people):
        entities.append(_entity(time, "people", cylinders=_people(snapshot.people)))
    if snapshot.rivals:
        lines = [_loop(outline(rival.pose, corners), TRUTH) for rival in snapshot.rivals]
        entities.append(_entity(time, "rivals", lines=lines))
    entities += [_track(track, time) for track in snapshot.tracks]
    entities += [_limit(item, number, time) for number, item in enumerate(snapshot.limitations)]
    if snapshot.detections:
        found = [(item.label, Pose2D(*item.position)) for item in snapshot.detections]
        texts = [_text(label, place, 0.4, OBJECT) for label, place in found]
        spheres = [_dot(place, OBJECT) for _, place in found]
        entities.append(_entity(time, "detections", texts=texts, spheres=spheres))
    return _update(time, *entities)


def _people(people: FloatArray) -> list[CylinderPrimitive]:
    return [
        _cylinder(
            pose_of(Pose2D(float(x), float(y)), PERSON_HEIGHT / 2.0),
            vector((2.0 * float(radius), 2.0 * float(radius), PERSON_HEIGHT)),
            PERSON,
        )
        for x, y, radius in people
    ]


def _track(track: TrackedObject, time: float) -> SceneEntity:
    """The outline of a track, and where it will be in a second."""
    heading = atan2(track.velocity[1], track.velocity[0])
    at = Pose2D(*track.position, heading)
    arrows = [_arrow(at, track.speed, TRACK)] if track.speed > 0.0 else []
    lines = [_loop(outline(at, Footprint.circle(track.radius).points), TRACK)]
    return _entity(time, f"track {track.id}", lines=lines, arrows=arrows)


def _limit(item: Limitation, number: int, time: float) -> SceneEntity:
    """Why the velocity is limited, at the cause; above the robot if that is nowhere."""
    at = _NOWHERE if item.at is None else Pose2D(*item.at)
    spheres = [] if item.at is None else [_dot(at, LIMITATION)]
    texts = [_text(item.text, at, 0.6, LIMITATION)]
    return _entity(time, f"limitation {number}", frame=BASE, texts=texts, spheres=spheres)


def _ellipse(snapshot: Snapshot) -> FloatArray:
    return uncertainty_ellipse(snapshot.pose, snapshot.covariance)


def _update(time: float, *entities: SceneEntity) -> SceneUpdate:
    everything = SceneEntityDeletion(timestamp=stamp_of(time), type=SceneEntityDeletionType.All)
    return SceneUpdate(deletions=[everything], entities=list(entities))


def _entity(time: float, name: str, frame: str = MAP, **primitives: Any) -> SceneEntity:
    return SceneEntity(
        timestamp=stamp_of(time), frame_id=frame, id=name, frame_locked=True, **primitives
    )


def _loop(points: FloatArray, colour: Colour) -> LinePrimitive:
    """A closed line; the last point (n, 3) is the first one."""
    return LinePrimitive(
        type=LinePrimitiveLineType.LineLoop,
        pose=pose_of(_NOWHERE),
        thickness=LINE,
        points=[Point3(x=float(x), y=float(y), z=float(z)) for x, y, z in points[:-1]],
        color=_colour(colour),
    )


def _arrow(pose: Pose2D, length: float, colour: Colour) -> ArrowPrimitive:
    return ArrowPrimitive(
        pose=pose_of(pose, 0.06),
        shaft_length=0.7 * length,
        shaft_diameter=0.05,
        head_length=0.3 * length,
        head_diameter=0.12,
        color=_colour(colour),
    )


def _cube(pose: Pose, size: Vector3, colour: Colour) -> CubePrimitive:
    return CubePrimitive(pose=pose, size=size, color=_colour(colour))


def _cylinder(pose: Pose, size: Vector3, colour: Colour) -> CylinderPrimitive:
    return CylinderPrimitive(
        pose=pose, size=size, bottom_scale=1.0, top_scale=1.0, color=_colour(colour)
    )


def _sphere(pose: Pose, size: Vector3, colour: Colour) -> SpherePrimitive:
    return SpherePrimitive(pose=pose, size=size, color=_colour(colour))


def _dot(place: Pose2D, colour: Colour) -> SpherePrimitive:
    return _sphere(pose_of(place), vector((DOT, DOT, DOT)), colour)


def _text(text: str, place: Pose2D, height: float, colour: Colour) -> TextPrimitive:
    pose = pose_of(Pose2D(place.x, place.y), height)
    return TextPrimitive(
        pose=pose, billboard=True, font_size=TEXT_SIZE, color=_colour(colour), text=text
    )


def _colour(colour: Colour) -> Color:
    red, green, blue = colour
    return Color(r=red, g=green, b=blue, a=1.0)


_SOLIDS: dict[str, tuple[str, Callable[[Pose, Vector3, Colour], Any]]] = {
    "box": ("cubes", _cube),
    "cylinder": ("cylinders", _cylinder),
    "sphere": ("spheres", _sphere),
}
"""Kind of a shape: the field of an entity that holds it, and how it is made."""

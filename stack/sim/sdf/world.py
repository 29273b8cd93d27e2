"""Reader of Gazebo world files (SDFormat, .world and .sdf).

It reads models (also nested ones and included ones), the collision shapes of their links, poses,
`static`, and the poses of a saved state, which take precedence as in Gazebo. Heights count from the
surface that the robot stands on at its start. Every shape is extended down to the ground. Lights,
physics and visuals are ignored. An unsupported element that affects driving is ignored with a
warning in `World.warnings`.

Format: sdformat.org/spec, versions 1.4 to 1.11. Codes: E201 shape and values · E205 too many ·
E206 empty · E207 not XML · W208 ignored or replaced.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from stack.documents import Finding, Findings, Mark
from stack.documents.xml_file import read_xml
from stack.errors import InputError
from stack.mapping.limits import FARTHEST, MAX_SHAPES
from stack.sim.sdf.ground import ground_height
from stack.sim.sdf.mesh_boxes import boxes_of
from stack.sim.sdf.reader import Found, PlacedMesh, Reader
from stack.sim.sdf.shapes import Solid, Upright
from stack.sim.worlds.free_place import free_place
from stack.sim.worlds.outlines import outlines
from stack.sim.worlds.rasterise import covered_cells, map_problem
from stack.sim.worlds.values import EMPTY, SHAPE, TOO_MANY
from stack.sim.worlds.world import Box, Cylinder, World
from stack.sim.worlds.world_file import MARGIN, bounds_around
from stack.types import FREE, OCCUPIED, OccupancyGrid, Pose2D

HEADROOM = 1.0
"""Height of the underside above the ground, metres, from which every robot passes below."""

FLUSH = 0.01
"""Height of the top above the ground, metres, up to which a shape counts as part of the ground."""

ORIGIN = Pose2D(0.0, 0.0)
COARSE = 0.1
"""Side of a cell in which a free place is looked for, metres."""


def read_sdf_world(path: Path, start: Pose2D | None = None) -> World:
    """Read the first world of a file.

    Args:
        path: of the file.
        start: of the robot; what it stands on there is the ground. None: the origin, or the
            nearest free place.

    Raises:
        InputError: all findings, each with its position.
    """
    if start is not None:
        return _read(path, start)
    world = _read(path, ORIGIN)
    free = _free_start(world)
    return world if free == ORIGIN else _read(path, free)


def _free_start(world: World) -> Pose2D:
    """Return the origin if a robot can stand there, else the nearest place where it can."""
    if map_problem(world, COARSE):
        return ORIGIN
    covered = covered_cells(world, COARSE)
    cells = np.where(covered, OCCUPIED, FREE).astype(np.int8)
    place = free_place(OccupancyGrid(cells, COARSE, world.bounds[:2]))
    return ORIGIN if place.distance_to(ORIGIN) < COARSE else place


def _read(path: Path, start: Pose2D) -> World:
    root = read_xml(path, "Gazebo world file")
    findings = Findings()
    world = root.first("world") if root.tag == "sdf" else None
    if world is None:
        sentence = f"expected <sdf> with a <world> inside, got <{root.tag}>"
        raise InputError([Finding(root.mark, SHAPE, sentence)])
    reader = Reader(findings, {model.name: model for model in root.all("model")})
    reader.read_world(world)
    findings.raise_errors()
    solids = _solids(reader, start, world.mark)
    findings.raise_errors()
    if not solids:
        sentence = "this world is empty: a lidar would measure nothing"
        raise InputError([Finding(world.mark, EMPTY, sentence), *reader.warnings.findings()])
    built = World(
        name=world.name or path.stem,
        bounds=(0.0, 0.0, 0.0, 0.0),
        boxes=tuple(solid for solid in solids if isinstance(solid, Box)),
        cylinders=tuple(solid for solid in solids if isinstance(solid, Cylinder)),
        start=start,
        source=path,
        warnings=tuple(reader.warnings.findings()),
    )
    return replace(built, bounds=bounds_around(built, outlines(built), MARGIN))


def _solids(reader: Reader, start: Pose2D, mark: Mark) -> list[Solid]:
    """Return the solids that stand on the ground; report those that are left out or changed."""
    ground = _ground(reader, start, mark)
    solids: list[Solid] = []
    for found in reader.found:
        solids += _standing(reader, found, ground, start)
        if len(solids) > MAX_SHAPES:
            sentence = f"more than {MAX_SHAPES} shapes; a world may have at most {MAX_SHAPES}"
            raise InputError([Finding(found.mark, TOO_MANY, sentence)])
    return solids


def _ground(reader: Reader, start: Pose2D, mark: Mark) -> float:
    """Return the height of the ground, metres; a note tells if it is not that of the origin."""
    solids = [item.shape for item in reader.found if isinstance(item.shape, Upright)]
    meshes = [item.shape for item in reader.found if isinstance(item.shape, PlacedMesh)]
    surfaces = (mesh.triangles() for mesh in meshes)
    ground = ground_height((start.x, start.y), reader.planes, solids, surfaces)
    if abs(ground) <= FLUSH:
        return 0.0
    kind = "heights count from the surface below the start"
    reader.warnings.add(mark, kind, f"{ground:.2f} m above the origin")
    return ground


def _standing(reader: Reader, found: Found, ground: float, start: Pose2D) -> Sequence[Solid]:
    """Return the solids of a shape; none if it is flush with the ground or above every robot."""
    warn = reader.warnings.add
    if isinstance(found.shape, PlacedMesh):
        triangles = found.shape.triangles() - (0.0, 0.0, ground)
        lowest, highest = float(triangles[:, :, 2].min()), float(triangles[:, :, 2].max())
        reach = float(abs(triangles[:, :, :2]).max())
    else:
        upright = found.shape.above(ground)
        lowest, highest = upright.bottom, upright.top
        solid = upright.solid
        x, y = (solid.pose.x, solid.pose.y) if isinstance(solid, Box) else (solid.x, solid.y)
        reach = max(abs(x), abs(y))
    if highest <= FLUSH:
        return ()
    if lowest >= HEADROOM:
        kind = f"shapes {HEADROOM:g} m or more above the floor are ignored"
        warn(found.mark, kind, found.name)
        return ()
    if reach > FARTHEST:
        sentence = f"{found.name!r} reaches {reach:g} m from the origin, more than {FARTHEST:g} m"
        reader.findings.add(SHAPE, found.mark, sentence)
        return ()
    if isinstance(found.shape, PlacedMesh):
        return boxes_of(triangles, FLUSH, HEADROOM, found.name, (start.x, start.y))
    if not upright.exact:
        warn(found.mark, "tilted shapes are replaced by upright boxes", found.name)
    return (solid,)

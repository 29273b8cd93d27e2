"""Reader of Gazebo world files (SDFormat, .world and .sdf).

It reads models (also nested ones), the collision shapes of their links, poses, `static`, includes
of models that the same file defines, and the poses of a saved state, which take precedence as in
Gazebo. Every shape is extended down to the floor. Lights, physics and visuals are ignored. An
unsupported element that affects driving is ignored with a warning in `World.warnings`.

Format: sdformat.org/spec, versions 1.4 to 1.11. Codes: E201 shape and values · E205 too many ·
E206 empty · E207 not XML · E208 ignored or replaced (warnings).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from stack.documents import Finding, Findings, Mark
from stack.documents.xml_file import Element, read_xml
from stack.errors import InputError
from stack.mapping.limits import FARTHEST, MAX_SHAPES
from stack.sim.sdf import shapes
from stack.sim.sdf.frames import Frames, UnknownFrame, numbers
from stack.sim.sdf.mesh_parts import convex_parts
from stack.sim.worlds.outlines import outlines
from stack.sim.worlds.values import EMPTY, SHAPE, TOO_MANY
from stack.sim.worlds.world import Box, Cylinder, World
from stack.sim.worlds.world_file import MARGIN, bounds_around
from stack.types import FloatArray

IGNORED = "E208"
HEADROOM = 1.0
"""Height of the underside above the floor, metres, from which every robot passes below."""

FLUSH = 0.01
"""Height of the top above the floor, metres, up to which a shape counts as part of the floor."""

STANDARD = frozenset({"ground_plane", "sun"})
"""Gazebo's own models of floor and light."""

IDENTITY = np.eye(4)

IGNORED_SHAPES = frozenset({"empty"})


def read_sdf_world(path: Path) -> World:
    """Read the first world of a file.

    Raises:
        InputError: all findings, each with its position.
    """
    root = read_xml(path, "Gazebo world file")
    findings = Findings()
    world = root.first("world") if root.tag == "sdf" else None
    if world is None:
        sentence = f"expected <sdf> with a <world> inside, got <{root.tag}>"
        raise InputError([Finding(root.mark, SHAPE, sentence)])
    models = {model.name: model for model in root.all("model")}
    reader = _Reader(findings, models, path.parent)
    reader.read_world(world)
    findings.raise_errors()
    if not reader.solids:
        sentence = "this world is empty: a lidar would measure nothing"
        findings.error(EMPTY, world.mark, sentence)
        findings.raise_errors()
    built = World(
        name=world.name or path.stem,
        bounds=(0.0, 0.0, 0.0, 0.0),
        boxes=tuple(solid for solid in reader.solids if isinstance(solid, Box)),
        cylinders=tuple(solid for solid in reader.solids if isinstance(solid, Cylinder)),
        source=path,
        warnings=tuple(reader.warnings()),
    )
    return replace(built, bounds=bounds_around(built, outlines(built), MARGIN))


@dataclass
class _Reader:
    """Collects the solids of a world.

    Attributes:
        findings: errors so far.
        models: models that the file defines, by name, for includes.
        folder: the folder of the file.
        solids: the solids found so far.
    """

    findings: Findings
    models: dict[str, Element]
    folder: Path
    solids: list[shapes.Solid] = field(default_factory=list)
    _warnings: dict[str, list[Finding]] = field(default_factory=dict)
    _including: list[str] = field(default_factory=list)

    def read_world(self, world: Element) -> None:
        """Collect the solids of all models and includes."""
        states = {model.name: model for state in world.all("state") for model in state.all("model")}
        local = {model.name: model for model in world.all("model")}
        self.models = {**local, **self.models}
        frames = Frames(self.findings, world.children)
        for element in world.children:
            if element.tag == "model":
                self._model(element, self._placed(frames, element, states), static=False)
            elif element.tag == "include":
                self._include(element, frames, IDENTITY)
            elif element.tag in ("actor", "population", "road"):
                self._warn(element.mark, f"<{element.tag}> is ignored", element.name or "unnamed")

    def warnings(self) -> list[Finding]:
        """One warning for each kind of ignored element, at the position of its first case."""
        found = []
        for kind, cases in self._warnings.items():
            names = list(dict.fromkeys(case.sentence for case in cases))
            shown = ", ".join(names[:5]) + (f" and {len(names) - 5} more" if names[5:] else "")
            found.append(Finding(cases[0].mark, IGNORED, f"{kind}: {shown}", "", "warning"))
        return found

    def _warn(self, mark: Mark, kind: str, name: str) -> None:
        self._warnings.setdefault(kind, []).append(Finding(mark, IGNORED, name))

    def _placed(
        self, frames: Frames, model: Element, states: dict[str, Element]
    ) -> FloatArray | None:
        """Pose (4, 4) of a model in the world: from the saved state if it has one, else its own."""
        state = states.get(model.name)
        if state is not None and state.first("pose") is not None:
            return self._pose(frames, state, model.name)
        return self._pose(frames, model, model.name)

    def _model(self, model: Element, placed: FloatArray | None, *, static: bool) -> None:
        """Add the solids of a model at its pose (4, 4) in the world."""
        if placed is None:
            return
        static = static or model.text_of("static") in ("1", "true")
        if not static and any(model.all("link")):
            self._warn(model.mark, "not static in Gazebo, static here", model.name)
        frames = Frames(self.findings, model.children)
        for link in model.all("link"):
            at = self._pose(frames, link, model.name)
            if at is not None:
                self._link(link, frames, (placed, at), model.name)
        for inner in model.all("model"):
            at = self._pose(frames, inner, inner.name)
            self._model(inner, None if at is None else placed @ at, static=static)
        for include in model.all("include"):
            self._include(include, frames, placed)

    def _include(self, include: Element, frames: Frames, outer: FloatArray) -> None:
        uri = include.text_of("uri")
        name = uri.removeprefix("model://").strip("/")
        if name in STANDARD:
            return
        if name not in self.models or name in self._including:
            kind = "<include> of a model that this file does not define is ignored"
            self._warn(include.mark, kind, uri or "no uri")
            return
        model = self.models[name]
        posed = include if include.first("pose") is not None else model
        at = self._pose(frames, posed, include.text_of("name") or name)
        static = include.text_of("static") in ("1", "true")
        self._including.append(name)
        self._model(model, None if at is None else outer @ at, static=static)
        self._including.pop()

    def _link(
        self, link: Element, frames: Frames, placed: tuple[FloatArray, FloatArray], name: str
    ) -> None:
        """Add the collision shapes of a link.

        placed: poses (4, 4) of its model in the world and of the link in the model.
        """
        model, own = placed
        collisions = list(link.all("collision"))
        if not collisions and any(link.all("visual")):
            self._warn(link.mark, "links without collision shapes are ignored", name)
        for collision in collisions:
            at = self._pose(frames, collision, name, own)
            geometry = collision.first("geometry")
            if geometry is None or not geometry.children:
                sentence = f"the collision {collision.name!r} of {name!r} has no geometry"
                self.findings.error(SHAPE, collision.mark, sentence)
            elif at is not None:
                self._shape(geometry.children[0], model @ at, name)

    def _shape(self, shape: Element, at: FloatArray, name: str) -> None:
        """Add one collision shape at its pose (4, 4) in the world."""
        if shape.tag == "plane":
            self._plane(shape, at, name)
        elif shape.tag in ("box", "cylinder", "sphere", "capsule"):
            found = self._solid(shape, at, name)
            if found is not None:
                self._keep(shape, name, *found)
        elif shape.tag == "mesh":
            self._mesh(shape, at, name)
        elif shape.tag not in IGNORED_SHAPES:
            uri = shape.text_of("uri")
            kind = f"<{shape.tag}> shapes are not supported and are ignored"
            self._warn(shape.mark, kind, f"{name} ({uri})" if uri else name)

    def _mesh(self, shape: Element, at: FloatArray, name: str) -> None:
        """Add the convex parts of a mesh, each as an upright box."""
        uri = shape.text_of("uri")
        scale = numbers(self.findings, shape.first("scale"), 3)
        file = self._file_of(uri)
        if file is None:
            kind = "<mesh> shapes are ignored: file not found in the world's folder"
            self._warn(shape.mark, kind, f"{name} ({uri})")
            return
        try:
            parts = convex_parts(file)
        except InputError as error:
            self._warn(shape.mark, "<mesh> shapes are ignored: unusable file", str(error))
            return
        self._warn(shape.mark, "<mesh> shapes are replaced by boxes", file.name)
        for corners in parts:
            scaled = corners if scale is None else corners * scale
            self._keep(shape, name, *shapes.part(scaled @ at[:3, :3].T + at[:3, 3], name))

    def _file_of(self, uri: str) -> Path | None:
        """The file of a mesh: relative to the world's folder, or in a model's folder there."""
        if uri.startswith(("http:", "https:")):
            return None
        relative = uri.removeprefix("model://").removeprefix("file://").lstrip("/")
        file = self.folder / relative
        return file if relative and file.is_file() else None

    def _solid(
        self, shape: Element, at: FloatArray, name: str
    ) -> tuple[shapes.Solid, float, bool] | None:
        if shape.tag == "box":
            size = self._sizes(shape, "size", 3)
            return None if size is None else shapes.box(at, size, name)
        radius = self._sizes(shape, "radius", 1)
        if radius is None:
            return None
        if shape.tag == "sphere":
            return shapes.sphere(at, float(radius[0]), name)
        length = self._sizes(shape, "length", 1)
        if length is None:
            return None
        caps = 2.0 * float(radius[0]) if shape.tag == "capsule" else 0.0
        return shapes.cylinder(at, float(radius[0]), float(length[0]) + caps, name)

    def _keep(
        self, shape: Element, name: str, solid: shapes.Solid, bottom: float, exact: bool
    ) -> None:
        """Add a solid unless it is flush with the floor or above every robot."""
        top = solid.size[2] if isinstance(solid, Box) else solid.height
        if top <= FLUSH:
            return
        if bottom >= HEADROOM:
            kind = f"shapes {HEADROOM:g} m or more above the floor are ignored"
            self._warn(shape.mark, kind, name)
            return
        if not exact:
            self._warn(shape.mark, "tilted shapes are replaced by upright boxes", name)
        x, y = (solid.pose.x, solid.pose.y) if isinstance(solid, Box) else (solid.x, solid.y)
        if max(abs(x), abs(y)) > FARTHEST:
            sentence = f"{name!r} at ({x:g}, {y:g}) is more than {FARTHEST:g} m from the origin"
            self.findings.error(SHAPE, shape.mark, sentence)
            return
        self.solids.append(solid)
        if len(self.solids) > MAX_SHAPES:
            sentence = f"more than {MAX_SHAPES} shapes; a world may have at most {MAX_SHAPES}"
            raise InputError([Finding(shape.mark, TOO_MANY, sentence)])

    def _plane(self, shape: Element, at: FloatArray, name: str) -> None:
        normal = numbers(self.findings, shape.first("normal"), 3)
        upward = at[:3, :3] @ (np.array([0.0, 0.0, 1.0]) if normal is None else normal)
        length = float(np.linalg.norm(upward))
        if length > 0.0 and abs(float(upward[2])) / length < shapes.UPRIGHT:
            self._warn(shape.mark, "<plane> shapes that are not horizontal are ignored", name)

    def _sizes(self, shape: Element, tag: str, count: int) -> FloatArray | None:
        """Lengths above 0, in metres; None if they are wrong, which is reported."""
        element = shape.first(tag)
        if element is None:
            self.findings.error(SHAPE, shape.mark, f"<{shape.tag}> needs <{tag}>")
            return None
        values = numbers(self.findings, element, count)
        if values is not None and not ((values > 0.0) & (values <= FARTHEST)).all():
            sentence = f"<{tag}> {element.text!r}: expected metres above 0, up to {FARTHEST:g}"
            self.findings.error(SHAPE, element.mark, sentence)
            return None
        return values

    def _pose(
        self, frames: Frames, element: Element, name: str, default: FloatArray = IDENTITY
    ) -> FloatArray | None:
        """Pose (4, 4) of an element in its model or world; None if unknown, which is reported."""
        try:
            return frames.pose(element, default)
        except UnknownFrame as error:
            mark = element.mark
            self._warn(
                mark, f"elements relative to the unknown frame {str(error)!r} are ignored", name
            )
            return None

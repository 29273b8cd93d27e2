"""Gazebo's world files (SDFormat, .world and .sdf) as worlds to drive in.

Read are models (nested ones, too), their links' collision shapes, poses, `static`, includes of
models that the same file defines, and the poses of a saved state, which count as in Gazebo. What
stands is taken to rise from the floor. Lights, physics, looks and the like do not matter here; what
would matter and is not understood is left out with a warning in `World.warnings`.

Format: sdformat.org/spec, versions 1.4 to 1.11. Codes: E201 shape and values · E205 too many ·
E206 empty · E207 not XML · E208 left out or replaced (warnings).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from stack.documents import Finding, Findings, Mark
from stack.errors import InputError
from stack.sim.sdf import shapes
from stack.sim.sdf.frames import Frames, UnknownFrame, numbers
from stack.sim.sdf.mesh_parts import convex_parts
from stack.sim.sdf.xml_file import Element, read_xml
from stack.sim.worlds.outlines import outlines
from stack.sim.worlds.values import EMPTY, FARTHEST, SHAPE, TOO_MANY
from stack.sim.worlds.world import Box, Cylinder, World
from stack.sim.worlds.world_file import MARGIN, bounds_round
from stack.types import FloatArray

LEFT_OUT = "E208"
MAX_SHAPES = 20_000
HEADROOM = 1.0
"""Metres over the floor from which something is taken to hang over any robot."""

SUNK = 0.01
"""Metres over the floor below which something is part of it."""

STANDARD = frozenset({"ground_plane", "sun"})
"""Gazebo's own models that are floor and light."""

IDENTITY = np.eye(4)

IGNORED_SHAPES = frozenset({"empty"})


def read_sdf_world(path: Path) -> World:
    """The first world in a file.

    Raises:
        InputError: every finding, each with its position.
    """
    root = read_xml(path, "Gazebo world file")
    findings = Findings()
    world = root.first("world") if root.tag == "sdf" else None
    if world is None:
        sentence = f"a Gazebo world file is <sdf> with a <world> in it, got <{root.tag}>"
        raise InputError([Finding(root.mark, SHAPE, sentence)])
    models = {model.name: model for model in root.all("model")}
    reader = _Reader(findings, models, path.parent)
    reader.read_world(world)
    findings.raise_errors()
    if not reader.solids:
        sentence = "nothing stands in this world, a lidar would see nothing"
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
    return replace(built, bounds=bounds_round(built, outlines(built), MARGIN))


@dataclass
class _Reader:
    """Collects what stands in a world.

    Attributes:
        models: those that the file defines beside its worlds, for includes.
        folder: where the file lies.
        solids: what was found.
    """

    findings: Findings
    models: dict[str, Element]
    folder: Path
    solids: list[shapes.Solid] = field(default_factory=list)
    _left_out: dict[str, list[Finding]] = field(default_factory=dict)
    _including: list[str] = field(default_factory=list)

    def read_world(self, world: Element) -> None:
        """Everything that stands in it."""
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
                self._leave_out(
                    element.mark, f"<{element.tag}> is left out", element.name or "unnamed"
                )

    def warnings(self) -> list[Finding]:
        """One for each kind of thing left out, at the first of its kind."""
        found = []
        for kind, cases in self._left_out.items():
            names = list(dict.fromkeys(case.sentence for case in cases))
            shown = ", ".join(names[:5]) + (f" and {len(names) - 5} more" if names[5:] else "")
            found.append(Finding(cases[0].mark, LEFT_OUT, f"{kind}: {shown}", "", "warning"))
        return found

    def _leave_out(self, mark: Mark, kind: str, name: str) -> None:
        self._left_out.setdefault(kind, []).append(Finding(mark, LEFT_OUT, name))

    def _placed(
        self, frames: Frames, model: Element, states: dict[str, Element]
    ) -> FloatArray | None:
        """(4, 4) of a model in the world: the saved state's pose, else its own."""
        state = states.get(model.name)
        if state is not None and state.first("pose") is not None:
            return self._pose(frames, state, model.name)
        return self._pose(frames, model, model.name)

    def _model(self, model: Element, placed: FloatArray | None, *, static: bool) -> None:
        """What a model consists of, at its (4, 4) in the world."""
        if placed is None:
            return
        static = static or model.text_of("static") in ("1", "true")
        if not static and any(model.all("link")):
            self._leave_out(model.mark, "not static in Gazebo, stands still here", model.name)
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
            kind = "includes of models from elsewhere are not followed"
            self._leave_out(include.mark, kind, uri or "no uri")
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
        """What a link can be touched at; placed: its model in the world, and it in the model."""
        model, own = placed
        collisions = list(link.all("collision"))
        if not collisions and any(link.all("visual")):
            self._leave_out(link.mark, "can be seen but not touched, left out", name)
        for collision in collisions:
            at = self._pose(frames, collision, name, own)
            geometry = collision.first("geometry")
            if geometry is None or not geometry.children:
                sentence = f"the collision {collision.name!r} of {name!r} has no geometry"
                self.findings.error(SHAPE, collision.mark, sentence)
            elif at is not None:
                self._shape(geometry.children[0], model @ at, name)

    def _shape(self, shape: Element, at: FloatArray, name: str) -> None:
        """One collision shape, at its (4, 4) in the world."""
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
            kind = f"<{shape.tag}> shapes are not read, left out"
            self._leave_out(shape.mark, kind, f"{name} ({uri})" if uri else name)

    def _mesh(self, shape: Element, at: FloatArray, name: str) -> None:
        """A mesh by its convex parts, each in an upright box, if its file lies near the world's."""
        uri = shape.text_of("uri")
        scale = numbers(self.findings, shape.first("scale"), 3)
        file = self._file_of(uri)
        if file is None:
            kind = "<mesh> shapes whose file is not found beside the world, left out"
            self._leave_out(shape.mark, kind, f"{name} ({uri})")
            return
        try:
            parts = convex_parts(file)
        except InputError as error:
            self._leave_out(shape.mark, "<mesh> shapes that cannot be used, left out", str(error))
            return
        self._leave_out(shape.mark, "<mesh> shapes stand as boxes round their parts", file.name)
        for corners in parts:
            scaled = corners if scale is None else corners * scale
            self._keep(shape, name, *shapes.part(scaled @ at[:3, :3].T + at[:3, 3], name))

    def _file_of(self, uri: str) -> Path | None:
        """A mesh's file: relative to the world's folder, or in a model's folder beside it."""
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
        """Take in a solid, unless no robot on the floor can meet it."""
        top = solid.size[2] if isinstance(solid, Box) else solid.height
        if top <= SUNK:
            return
        if bottom >= HEADROOM:
            kind = f"begins {HEADROOM:g} m or more over the floor, left out"
            self._leave_out(shape.mark, kind, name)
            return
        if not exact:
            self._leave_out(shape.mark, "tilted, an upright box round it stands for it", name)
        x, y = (solid.pose.x, solid.pose.y) if isinstance(solid, Box) else (solid.x, solid.y)
        if max(abs(x), abs(y)) > FARTHEST:
            sentence = f"{name!r} at ({x:g}, {y:g}) is more than {FARTHEST:g} m away"
            self.findings.error(SHAPE, shape.mark, sentence)
            return
        self.solids.append(solid)
        if len(self.solids) > MAX_SHAPES:
            sentence = f"more than {MAX_SHAPES} shapes; a world may have that many"
            raise InputError([Finding(shape.mark, TOO_MANY, sentence)])

    def _plane(self, shape: Element, at: FloatArray, name: str) -> None:
        normal = numbers(self.findings, shape.first("normal"), 3)
        upward = at[:3, :3] @ (np.array([0.0, 0.0, 1.0]) if normal is None else normal)
        length = float(np.linalg.norm(upward))
        if length > 0.0 and abs(float(upward[2])) / length < shapes.UPRIGHT:
            self._leave_out(shape.mark, "a plane that is not the floor, left out", name)

    def _sizes(self, shape: Element, tag: str, count: int) -> FloatArray | None:
        """Lengths above 0, in metres; None, with everything noted, when they are wrong."""
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
        """(4, 4) of an element in its model or world; None, with a note, when it cannot be said."""
        try:
            return frames.pose(element, default)
        except UnknownFrame as error:
            mark = element.mark
            self._leave_out(mark, f"placed relative to {str(error)!r}, left out", name)
            return None

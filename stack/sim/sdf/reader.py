"""Collects the collision shapes of a Gazebo world, with those of the models that it includes."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from stack.documents import Finding, Findings, Mark
from stack.documents.xml_file import Element, read_xml
from stack.errors import InputError
from stack.mapping.limits import FARTHEST, MAX_SHAPES
from stack.sim.sdf import shapes
from stack.sim.sdf.frames import Frames, UnknownFrame, numbers
from stack.sim.sdf.mesh_files import read_triangles
from stack.sim.sdf.model_path import description_of, find_model, model_folders, name_of
from stack.sim.worlds.values import SHAPE, TOO_MANY
from stack.types import FloatArray

IGNORED = "W208"
STANDARD = frozenset({"ground_plane", "sun"})
"""Gazebo's own models of floor and light."""

IDENTITY = np.eye(4)

IGNORED_SHAPES = frozenset({"empty"})
PRIMITIVES = frozenset({"box", "cylinder", "sphere", "capsule"})

SET_PATH = (
    "put the folders of the models into models/ beside the world, or list the folders that contain"
    " them in GZ_SIM_RESOURCE_PATH or GAZEBO_MODEL_PATH"
)


@dataclass(frozen=True)
class PlacedMesh:
    """A mesh of a world.

    Attributes:
        corners: triangles (n, 3, 3) of the file, metres.
        pose: (4, 4) with the scale, to the world frame.
    """

    corners: FloatArray
    pose: FloatArray

    def triangles(self) -> FloatArray:
        """The triangles (n, 3, 3) in the world frame, metres."""
        placed: FloatArray = self.corners @ self.pose[:3, :3].T + self.pose[:3, 3]
        return placed


@dataclass(frozen=True)
class Found:
    """A collision shape with the position and the name of its model."""

    mark: Mark
    name: str
    shape: shapes.Upright | PlacedMesh


@dataclass
class Warnings:
    """Elements that were ignored or replaced, by kind."""

    _cases: dict[tuple[str, str], list[Finding]] = field(default_factory=dict)

    def add(self, mark: Mark, kind: str, name: str, hint: str = "") -> None:
        """Note a case of a kind."""
        self._cases.setdefault((kind, hint), []).append(Finding(mark, IGNORED, name))

    def findings(self) -> list[Finding]:
        """One warning for each kind, at the position of its first case, in the order of these."""
        found = []
        files = list(dict.fromkeys(c.mark.file for cases in self._cases.values() for c in cases))
        for (kind, hint), cases in self._cases.items():
            names = list(dict.fromkeys(case.sentence for case in cases))
            shown = ", ".join(names[:5]) + (f" and {len(names) - 5} more" if names[5:] else "")
            found.append(Finding(cases[0].mark, IGNORED, f"{kind}: {shown}", hint))
        return sorted(found, key=lambda item: (files.index(item.mark.file), item.mark))


@dataclass
class Reader:
    """Collects the shapes of a world.

    Attributes:
        findings: errors so far.
        models: models that the file defines beside its world, by name, for includes.
        warnings: elements that were ignored or replaced so far.
        found: the shapes so far.
        planes: heights of the horizontal planes so far, metres.
    """

    findings: Findings
    models: dict[str, Element]
    warnings: Warnings = field(default_factory=Warnings)
    found: list[Found] = field(default_factory=list)
    planes: list[float] = field(default_factory=list)
    _states: dict[str, Element] = field(default_factory=dict)
    _including: list[str] = field(default_factory=list)
    _descriptions: dict[Path, Element | None] = field(default_factory=dict)
    _places: dict[tuple[Path, str], Path | None] = field(default_factory=dict)
    _models_read: int = 0

    def read_world(self, world: Element) -> None:
        """Collect the shapes of all models and includes."""
        self._states = {
            model.name: model for state in world.all("state") for model in state.all("model")
        }
        self.models = {**{model.name: model for model in world.all("model")}, **self.models}
        frames = Frames(self.findings, world.children)
        for element in world.children:
            if element.tag == "model":
                at = self._pose(frames, self._state_of(element.name) or element, element.name)
                self._model(element, at, static=False)
            elif element.tag == "include":
                self._include(element, frames, IDENTITY)
            elif element.tag in ("actor", "population", "road"):
                kind = f"<{element.tag}> is ignored"
                self.warnings.add(element.mark, kind, element.name or "unnamed")

    def _model(
        self, model: Element, placed: FloatArray | None, *, static: bool, frame: str = ""
    ) -> None:
        """Add the shapes of a model at its pose (4, 4) in the world.

        frame: the frame of the model that has this pose; empty: as the model says, or its own.
        """
        self._models_read += 1
        if self._models_read > MAX_SHAPES:
            sentence = f"more than {MAX_SHAPES} models with those that they include"
            raise InputError([Finding(model.mark, TOO_MANY, sentence)])
        if placed is None:
            return
        static = static or model.text_of("static") in ("1", "true")
        if not static and any(model.all("link")):
            self.warnings.add(model.mark, "not static in Gazebo, static here", model.name)
        frames = Frames(self.findings, model.children)
        placing = frame or model.attributes.get("placement_frame", "")
        if placing:
            inner_frame = self._frame(frames, placing, model)
            if inner_frame is None:
                return
            placed = placed @ np.linalg.inv(inner_frame)
        for link in model.all("link"):
            at = self._pose(frames, link, model.name)
            if at is not None:
                self._link(link, frames, (placed, at), model.name)
        for inner in model.all("model"):
            at = self._pose(frames, inner, inner.name)
            self._model(inner, None if at is None else placed @ at, static=static)
        for include in model.all("include"):
            self._include(include, frames, placed, static=static)

    def _include(
        self, include: Element, frames: Frames, outer: FloatArray, *, static: bool = False
    ) -> None:
        uri = include.text_of("uri")
        if name_of(uri) in STANDARD:
            if name_of(uri) == "ground_plane":
                at = self._pose(frames, include, uri)
                self.planes += [] if at is None else [float((outer @ at)[2, 3])]
            return
        model = self._model_of(include, uri)
        if model is None:
            return
        key = f"{model.mark.file} {model.name}"
        if key in self._including:
            names = [item.split(" ", 1)[1] for item in self._including]
            way = " -> ".join([*names[self._including.index(key) :], model.name])
            sentence = f"the model {model.name!r} includes itself: {way}"
            self.findings.add(SHAPE, include.mark, sentence, "remove one of the includes")
            return
        name = include.text_of("name") or model.name
        posed = include if include.first("pose") is not None else model
        at = self._pose(frames, self._state_of(name) or posed, name)
        static = static or include.text_of("static") in ("1", "true")
        frame = include.text_of("placement_frame")
        self._including.append(key)
        self._model(model, None if at is None else outer @ at, static=static, frame=frame)
        self._including.pop()

    def _state_of(self, name: str) -> Element | None:
        """The saved state of a model of the world that has a pose."""
        state = None if self._including else self._states.get(name)
        return None if state is None or state.first("pose") is None else state

    def _model_of(self, include: Element, uri: str) -> Element | None:
        """The model of an include: of this file, or of another one; None if it is reported."""
        folder = Path(include.mark.file).parent
        found = self._place_of(folder, uri)
        if found is None and name_of(uri) in self.models:
            return self.models[name_of(uri)]
        if found is None:
            kind = "<include> of models that are not found is ignored"
            self.warnings.add(include.mark, kind, uri or "no uri", _looked_in(folder))
            return None
        root = self._description(found)
        if root is None:
            return None
        model = root.first("model") if root.tag == "sdf" else None
        if model is None:
            sentence = f"expected <sdf> with a <model> inside, got <{root.tag}>"
            self.findings.add(SHAPE, root.mark, sentence)
        return model

    def _place_of(self, folder: Path, uri: str) -> Path | None:
        """The file or folder that a file in this folder names; None if there is none."""
        if (folder, uri) not in self._places:
            self._places[folder, uri] = find_model(uri, folder)
        return self._places[folder, uri]

    def _description(self, found: Path) -> Element | None:
        """The root of the SDF file of a model; None if it cannot be read, which is reported."""
        if found not in self._descriptions:
            self._descriptions[found] = self._read_description(found)
        return self._descriptions[found]

    def _read_description(self, found: Path) -> Element | None:
        try:
            file = description_of(found)
        except InputError as error:
            file = found / "model.sdf"
            kind = "model.config is ignored, model.sdf is read: it is not readable"
            self.warnings.add(error.findings[0].mark, kind, found.name)
        try:
            return read_xml(file, "model file")
        except InputError as error:
            for finding in error.findings:
                self.findings.add(finding.code, finding.mark, finding.sentence, finding.hint)
            return None

    def _link(
        self, link: Element, frames: Frames, placed: tuple[FloatArray, FloatArray], name: str
    ) -> None:
        """Add the collision shapes of a link.

        placed: poses (4, 4) of its model in the world and of the link in the model.
        """
        model, own = placed
        collisions = list(link.all("collision"))
        if not collisions and any(link.all("visual")):
            self.warnings.add(link.mark, "links without collision shapes are ignored", name)
        for collision in collisions:
            at = self._pose(frames, collision, name, own)
            geometry = collision.first("geometry")
            if geometry is None or not geometry.children:
                sentence = f"the collision {collision.name!r} of {name!r} has no geometry"
                self.findings.add(SHAPE, collision.mark, sentence)
            elif at is not None:
                self._shape(geometry.children[0], model @ at, name)

    def _shape(self, shape: Element, at: FloatArray, name: str) -> None:
        """Add one collision shape at its pose (4, 4) in the world."""
        if shape.tag == "plane":
            self._plane(shape, at, name)
        elif shape.tag in PRIMITIVES:
            self._keep(shape, name, self._solid(shape, at, name))
        elif shape.tag == "mesh":
            self._keep(shape, name, self._mesh(shape, at, name))
        elif shape.tag not in IGNORED_SHAPES:
            uri = shape.text_of("uri")
            kind = f"<{shape.tag}> shapes are not supported and are ignored"
            self.warnings.add(shape.mark, kind, f"{name} ({uri})" if uri else name)

    def _keep(self, shape: Element, name: str, found: shapes.Upright | PlacedMesh | None) -> None:
        if found is not None:
            self.found.append(Found(shape.mark, name, found))
        if len(self.found) > MAX_SHAPES:
            sentence = f"more than {MAX_SHAPES} shapes; a world may have at most {MAX_SHAPES}"
            raise InputError([Finding(shape.mark, TOO_MANY, sentence)])

    def _mesh(self, shape: Element, at: FloatArray, name: str) -> PlacedMesh | None:
        uri = shape.text_of("uri")
        scale = numbers(self.findings, shape.first("scale"), 3)
        folder = Path(shape.mark.file).parent
        file = self._place_of(folder, uri)
        if file is None:
            kind = "<mesh> shapes whose files are not found are ignored"
            self.warnings.add(shape.mark, kind, f"{name} ({uri})", _looked_in(folder))
            return None
        try:
            corners = read_triangles(file)
        except InputError as error:
            self.warnings.add(shape.mark, "<mesh> shapes are ignored: unusable file", str(error))
            return None
        part = shape.first("submesh")
        if part is not None:
            kind = "<submesh> is ignored: the whole mesh is read"
            self.warnings.add(part.mark, kind, f"{part.text_of('name')} of {file.name}")
        self.warnings.add(shape.mark, "<mesh> shapes are replaced by boxes", file.name)
        size = np.append(np.ones(3) if scale is None else scale, 1.0)
        return PlacedMesh(corners, at @ np.diag(size))

    def _solid(self, shape: Element, at: FloatArray, name: str) -> shapes.Upright | None:
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

    def _plane(self, shape: Element, at: FloatArray, name: str) -> None:
        normal = numbers(self.findings, shape.first("normal"), 3)
        upward = at[:3, :3] @ (np.array([0.0, 0.0, 1.0]) if normal is None else normal)
        length = float(np.linalg.norm(upward))
        if length > 0.0 and abs(float(upward[2])) / length < shapes.UPRIGHT:
            kind = "<plane> shapes that are not horizontal are ignored"
            self.warnings.add(shape.mark, kind, name)
        else:
            self.planes.append(float(at[2, 3]))

    def _sizes(self, shape: Element, tag: str, count: int) -> FloatArray | None:
        """Lengths above 0, in metres; None if they are wrong, which is reported."""
        element = shape.first(tag)
        if element is None:
            self.findings.add(SHAPE, shape.mark, f"<{shape.tag}> needs <{tag}>")
            return None
        values = numbers(self.findings, element, count)
        if values is not None and not ((values > 0.0) & (values <= FARTHEST)).all():
            sentence = f"<{tag}> {element.text!r}: expected metres above 0, up to {FARTHEST:g}"
            self.findings.add(SHAPE, element.mark, sentence)
            return None
        return values

    def _frame(self, frames: Frames, frame: str, model: Element) -> FloatArray | None:
        """Pose (4, 4) of a named frame in its model; None if unknown, which is reported."""
        try:
            return frames.of(frame)
        except UnknownFrame:
            kind = f"elements relative to the unknown frame {frame!r} are ignored"
            self.warnings.add(model.mark, kind, model.name)
            return None

    def _pose(
        self, frames: Frames, element: Element, name: str, default: FloatArray = IDENTITY
    ) -> FloatArray | None:
        """Pose (4, 4) of an element in its model or world; None if unknown, which is reported."""
        try:
            return frames.pose(element, default)
        except UnknownFrame as error:
            kind = f"elements relative to the unknown frame {str(error)!r} are ignored"
            self.warnings.add(element.mark, kind, name)
            return None


def _looked_in(folder: Path) -> str:
    return f"looked in {', '.join(map(str, model_folders(folder)))}; {SET_PATH}"

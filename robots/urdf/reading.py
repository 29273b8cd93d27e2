"""Reads a URDF or xacro file and checks what the physics cannot: numbers, names, mesh files.

Codes: E302 · W302 a shape that is left out.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path

from robots.declared import LEFT_OUT, URDF
from robots.urdf.model import RobotModel
from robots.urdf.packages import PackageSearch
from robots.urdf.xacro_file import expand, is_xacro, package_hint
from stack.documents import Finding, Findings, Mark
from stack.documents.files import MESH_BYTES, URDF_BYTES, note_input, open_regular, read_input
from stack.documents.xml_file import Element, parse_xml
from stack.parameters import suggestion

MAX_LINKS = 200
SMALLEST, FARTHEST = 1e-6, 100.0
"""Smallest size, and largest size and coordinate, metres."""

HEAVIEST, MAX_INERTIA = 1e5, 1e6
"""kg and kg m²."""

MESHES = (".stl", ".obj", ".dae")
"""Endings of the mesh files that the simulation reads."""

SHAPES = ("box", "sphere", "cylinder", "capsule", "mesh")

_RANGES = {
    "mass": {"value": (0.0, HEAVIEST)},
    "inertia": {
        **dict.fromkeys(("ixx", "iyy", "izz"), (0.0, MAX_INERTIA)),
        **dict.fromkeys(("ixy", "ixz", "iyz"), (-MAX_INERTIA, MAX_INERTIA)),
    },
    "origin": dict.fromkeys(("xyz", "rpy"), (-FARTHEST, FARTHEST)),
    "axis": {"xyz": (-FARTHEST, FARTHEST)},
    "box": {"size": (SMALLEST, FARTHEST)},
    "sphere": {"radius": (SMALLEST, FARTHEST)},
    "cylinder": dict.fromkeys(("radius", "length"), (SMALLEST, FARTHEST)),
    "capsule": dict.fromkeys(("radius", "length"), (SMALLEST, FARTHEST)),
    "mesh": {"scale": (-FARTHEST, FARTHEST)},
}
"""Range of the numbers in an attribute, by element and attribute."""

_COUNTS = {"xyz": 3, "rpy": 3, "size": 3, "scale": 3}
"""How many numbers an attribute has; others have one."""

_REQUIRED = {
    "mass": ("value",), "box": ("size",), "sphere": ("radius",), "cylinder": ("radius", "length"),
    "capsule": ("radius", "length"), "mesh": ("filename",),
    "inertia": ("ixx", "iyy", "izz"),
}  # fmt: skip


@dataclass(frozen=True)
class UrdfSource:
    """A URDF as the robot file names it.

    Attributes:
        path: of the file.
        packages: folders in which its packages are searched for, besides those near the file.
        arguments: of a xacro file.
        attached: further URDFs that are part of the robot.
    mark: where the robot file names it; None without one.
    """

    path: Path
    packages: tuple[Path, ...] = ()
    arguments: Mapping[str, str] = field(default_factory=dict)
    attached: tuple[Attachment, ...] = ()
    mark: Mark | None = field(default=None, compare=False)


@dataclass(frozen=True)
class Attachment:
    """A URDF that is fixed to a link of another one, such as an arm on a base.

    Attributes:
        source: of the URDF.
        to: link that carries it.
        position: of its root in the frame of this link, metres.
        angles: roll, pitch and yaw of its root, radians.
        mark: where the robot file names the link.
    """

    source: UrdfSource
    to: str
    position: Sequence[float]
    angles: Sequence[float]
    mark: Mark


def read_urdf(source: UrdfSource) -> tuple[Element, list[Finding]]:
    """Read a URDF, or expand a xacro file, with all that is attached to it.

    Returns:
        The element `robot`, and the warnings. Names of meshes are absolute paths; shapes that
        cannot be drawn are left out.

    Raises:
        InputError: it cannot be read, is not XML, or has values that the physics cannot compute
            with; all findings, each with its line. Lines of a xacro file are those of the URDF that
            it expands to.
    """
    path, search = source.path, PackageSearch(source.path, source.packages)
    raw, name = read_input(path, "URDF", URDF_BYTES), str(path)
    if is_xacro(raw):
        raw, name = expand(path, source.arguments, search), f"{path} (expanded)"
    root = parse_xml(raw, name, URDF)
    findings = Findings()
    if root.tag != "robot":
        findings.add(URDF, root.mark, "not a URDF: expected the element <robot>")
        findings.raise_errors()
    links = list(root.all("link"))
    if len(links) > MAX_LINKS:
        sentence = f"{len(links)} links; at most {MAX_LINKS} are supported"
        findings.add(URDF, links[MAX_LINKS].mark, sentence)
    for part in (*links, *root.all("joint")):
        for element in part.within():
            _check_numbers(element, findings)
    for link in links:
        _check_shapes(link, search, findings)
    findings.raise_errors()
    for attachment in source.attached:
        attached, warnings = read_urdf(attachment.source)
        findings.items += warnings
        _attach(root, attached, attachment)
    return root, findings.items


def _attach(root: Element, attached: Element, attachment: Attachment) -> None:
    """Add the links and joints of a URDF to those of another one, and a fixed joint between them.

    Raises:
        InputError: there is no such link to carry it, or the attached links form no tree.
    """
    links = [link.name for link in root.all("link")]
    if attachment.to not in links:
        findings, sentence = Findings(), f"attach: to: the URDF has no link {attachment.to!r}"
        findings.add(URDF, attachment.mark, sentence, suggestion(attachment.to, links))
        findings.raise_errors()
    top, mark = RobotModel(attached).root, attachment.mark
    places = {"xyz": attachment.position, "rpy": attachment.angles}
    origin = {name: " ".join(map(repr, numbers)) for name, numbers in places.items()}
    joint = {"name": f"{attachment.to}_to_{top}", "type": "fixed"}
    ends = {"parent": {"link": attachment.to}, "child": {"link": top}, "origin": origin}
    children = [Element(tag, attributes, mark) for tag, attributes in ends.items()]
    root.children += [*attached.children, Element("joint", joint, mark, "", children)]


def _check_numbers(element: Element, findings: Findings) -> None:
    """Check the numbers in the attributes of an element; one finding at most."""
    for name in _REQUIRED.get(element.tag, ()):
        if name not in element.attributes:
            findings.add(URDF, element.mark, f"<{element.tag}> needs the attribute {name!r}")
            return
    for name, (least, most) in _RANGES.get(element.tag, {}).items():
        if name not in element.attributes:
            continue
        got = repr(element.attributes[name][:60])
        found = list(_numbers(element.attributes[name]))
        if any(number is None or not least <= number <= most for number in found):
            sentence = f"<{element.tag}>: {name}: expected {least:g} to {most:g}, got {got}"
        elif len(found) != (count := _COUNTS.get(name, 1)):
            word = "number" if count == 1 else "numbers"
            sentence = f"<{element.tag}>: {name}: expected {count} {word}, got {got}"
        else:
            continue
        findings.add(URDF, element.mark, sentence)
        return


def _numbers(text: str) -> Iterator[float | None]:
    """The numbers in a text; None for a word that is not a finite number."""
    for word in text.split():
        try:
            number = float(word)
        except ValueError:
            yield None
        else:
            yield number if isfinite(number) else None


def _check_shapes(link: Element, search: PackageSearch, findings: Findings) -> None:
    """Check the shapes of a link: one to collide with must be usable, others are left out."""
    for part in list(link.children):
        if part.tag not in ("visual", "collision"):
            continue
        problem = _problem_of(part, search)
        if problem is None:
            continue
        mark, sentence, hint = problem
        where = f"<{part.tag}> of the link {link.name!r}: {sentence}"
        if part.tag == "collision":
            findings.add(URDF, mark, where, hint or "correct it, or use a box, sphere or cylinder")
        else:
            link.children.remove(part)
            findings.add(LEFT_OUT, mark, f"{where}; the link is drawn without it", hint)


def _problem_of(part: Element, search: PackageSearch) -> tuple[Mark, str, str] | None:
    """Why a shape cannot be used: mark, sentence, hint. Makes the name of its mesh a path."""
    geometry = part.first("geometry")
    shapes = [] if geometry is None else [c for c in geometry.children if c.tag in SHAPES]
    if len(shapes) != 1:
        return part.mark, f"expected one shape of {', '.join(SHAPES)}", ""
    (shape,) = shapes
    if shape.tag != "mesh":
        return None
    named = shape.attributes["filename"]
    file = search.resolve(named, search.file.parent)
    if file is None:
        package = named.partition("://")[2].partition("/")[0]
        return shape.mark, f"{named}: the package {package!r} is not found", package_hint(search)
    problem = _mesh_problem(file)
    if problem:
        return shape.mark, f"<mesh>: {problem[0]}", problem[1]
    note_input(file)
    shape.attributes["filename"] = os.path.normpath(file.absolute())
    return None


def _mesh_problem(file: Path) -> tuple[str, str] | None:
    """Why a mesh cannot be used, and what to do."""
    try:
        with open_regular(file) as mesh:
            head = mesh.read(84)
            size = mesh.seek(0, 2)
    except FileNotFoundError:
        return f"there is no file {str(file)!r}", ""
    except OSError as error:
        return f"{file.name} cannot be read: {error.strerror}", ""
    ending = file.suffix.lower()
    if ending not in MESHES:
        return f"{file.name}: the simulation reads {', '.join(MESHES)}", "convert it"
    if size > MESH_BYTES:
        return f"{file.name} has {size} bytes; a mesh has at most {MESH_BYTES}", ""
    if ending == ".stl" and size != 84 + 50 * int.from_bytes(head[80:84], "little"):
        return f"{file.name} is not a binary STL file", "save it as binary STL"
    return None

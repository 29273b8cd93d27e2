"""Reader of the key `urdf` of robot.yaml: a file, its packages and arguments, what is attached.

Codes: E301 shape and values · E302, W302 the URDF.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import pi
from pathlib import Path

from robots.declared import PACKAGES, SHAPE, URDF, URDF_FILE, X, Y, Z
from robots.urdf.model import RobotModel
from robots.urdf.packages import PackageSearch
from robots.urdf.reading import Attachment, UrdfSource, read_urdf
from stack.documents import Finding, Node, Section
from stack.errors import InputError
from stack.parameters import Declaration, suggestion

CARRIER = Declaration("to", str, "link that carries it")
ANGLES = tuple(
    Declaration(name, float, "of its root", "rad", 0.0, at_least=-2 * pi, at_most=2 * pi)
    for name in ("roll", "pitch", "yaw")
)


def read_source(top: Section, path: Path) -> UrdfSource | None:
    """Read `urdf`: a file name, or a mapping with the file, packages and arguments of xacro."""
    node = top.node_of("urdf", required=True)
    if node is None:
        return None
    if not node.is_mapping:
        if isinstance(node.value, str):
            return UrdfSource(_file(top, node, node.value, path), mark=node.mark)
        top.findings.add(SHAPE, node.mark, f"urdf: expected a file name, got {node.words()}")
        return None
    section = top.part("urdf", node)
    file, packages = section.value(URDF_FILE), section.value(PACKAGES)
    arguments = section.section("arguments")
    entries = arguments.node.entries if arguments is not None else ()
    attached = section.node_of("attach")
    section.done()
    if file is None or packages is None:
        return None
    given = {f"{key.value}": _argument(value.value) for key, value in entries}
    folders = tuple(path.parent / Path(folder).expanduser() for folder in packages)
    at = section.node.get(URDF_FILE.name) or node
    parts = () if attached is None else _attached(top, attached, path, folders)
    named = _file(top, at, file, path, folders)
    return UrdfSource(named, folders, given, tuple(parts), at.mark)


def _attached(
    top: Section, node: Node, path: Path, folders: tuple[Path, ...]
) -> Iterator[Attachment]:
    """Read `attach`: further URDFs, each with the link that carries it, and where."""
    if not node.is_sequence:
        sentence = f"attach: expected a list of {{file, to, position}}, got {node.words()}"
        top.findings.add(SHAPE, node.mark, sentence)
    for number, item in enumerate(node.items if node.is_sequence else ()):
        section = top.part(f"attach[{number}]", item)
        file, to = section.value(URDF_FILE), section.value(CARRIER)
        position = section.node_of("position")
        place = (0.0, 0.0, 0.0)
        if position is not None:
            place = section.parts("position", position, (X, Y, Z)) or place
        angles = tuple(section.value(it) for it in ANGLES)
        section.done()
        if file is None or to is None:
            continue
        at = section.node_of(URDF_FILE.name) or item
        source = UrdfSource(_file(top, at, file, path, folders), folders, mark=at.mark)
        yield Attachment(source, to, place, angles, (section.node.get(CARRIER.name) or item).mark)


def _file(
    top: Section, node: Node, named: str, path: Path, packages: tuple[Path, ...] = ()
) -> Path:
    """The URDF that a robot file names: a path beside it, or `package://NAME/path`."""
    found = PackageSearch(path, packages).resolve(named, path.parent)
    if found is None:
        package = named.partition("://")[2].partition("/")[0]
        sentence = f"urdf: {named}: the package {package!r} is not found"
        hint = "install the Python or ROS package, or list its folder: urdf: {file, packages}"
        top.findings.add(URDF, node.mark, sentence, hint)
    return found or path.parent / named


def _argument(value: object) -> str:
    """An argument as xacro has it: true and false in lower case."""
    return str(value).lower() if isinstance(value, bool) else str(value)


def read_model(top: Section, source: UrdfSource) -> RobotModel | None:
    """The links and joints of the URDF; its findings are added to those of the robot file."""
    try:
        root, warnings = read_urdf(source)
        top.findings.items += warnings
        return RobotModel(root)
    except InputError as error:
        top.findings.items += _at(source, error)
        return None


def _at(source: UrdfSource, error: InputError) -> Iterator[Finding]:
    """Yield the findings of a URDF; of a file that cannot be opened, where robot.yaml names it."""
    marks = {it.path: it.mark for it in (source, *(part.source for part in source.attached))}
    for item in error.findings:
        path = Path(item.mark.file)
        mark = marks.get(path) if item.code in ("E001", "E002") else None
        if mark is None:
            yield item
            continue
        near = [file.name for file in path.parent.glob("*.urdf")]
        hint = item.hint or suggestion(path.name, near)
        yield Finding(mark, URDF, f"urdf: {path.name!r}: {item.sentence}", hint)

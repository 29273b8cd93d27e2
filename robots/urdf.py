"""Reads a URDF and checks what the physics cannot: finite masses and sizes, ordinary mesh files.

Codes: E302.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite
from pathlib import Path

from robots.declared import URDF
from stack.documents import Findings
from stack.documents.files import MESH_BYTES, URDF_BYTES, open_regular, read_input
from stack.documents.xml_file import Element, parse_xml

MAX_LINKS = 200
SMALLEST, FARTHEST = 1e-6, 100.0
"""Smallest size, and largest size and coordinate, metres."""

HEAVIEST, MAX_INERTIA = 1e5, 1e6
"""kg and kg m²."""

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
    "mesh": {"scale": (-FARTHEST, FARTHEST)},
}
"""Range of the numbers in an attribute, by element and attribute."""


def read_urdf(path: Path) -> Element:
    """The root element of a URDF.

    Raises:
        InputError: it cannot be read, is not XML, or has values that the physics cannot compute
            with; all findings, each with its line.
    """
    root = parse_xml(read_input(path, "URDF", URDF_BYTES), str(path), URDF)
    findings = Findings()
    if root.tag != "robot":
        findings.error(URDF, root.mark, "not a URDF: expected the element <robot>")
        findings.raise_errors()
    links = list(root.all("link"))
    if len(links) > MAX_LINKS:
        sentence = f"{len(links)} links; at most {MAX_LINKS} are supported"
        findings.error(URDF, links[MAX_LINKS].mark, sentence)
    for element in root.within():
        for name, (least, most) in _RANGES.get(element.tag, {}).items():
            _check_numbers(element, name, least, most, findings)
        if element.tag == "mesh":
            _check_mesh(element, path, findings)
    findings.raise_errors()
    return root


def _check_numbers(
    element: Element, name: str, least: float, most: float, findings: Findings
) -> None:
    """Check the numbers of an attribute; an absent one is left to the physics."""
    for number in _numbers(element.attributes.get(name, "")):
        if number is None or not least <= number <= most:
            got = repr(element.attributes[name][:60])
            sentence = f"<{element.tag}>: {name}: expected {least:g} to {most:g}, got {got}"
            findings.error(URDF, element.mark, sentence)
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


def _check_mesh(element: Element, path: Path, findings: Findings) -> None:
    """Check that a mesh beside the URDF can be read; PyBullet looks for others itself."""
    file = path.parent / element.attributes.get("filename", "")
    try:
        with open_regular(file) as mesh:
            size = mesh.seek(0, 2)
    except FileNotFoundError:
        return
    except OSError as error:
        findings.error(URDF, element.mark, f"<mesh>: {file.name} cannot be read: {error.strerror}")
        return
    if size > MESH_BYTES:
        sentence = f"<mesh>: {file.name} has {size} bytes; a mesh has at most {MESH_BYTES}"
        findings.error(URDF, element.mark, sentence)

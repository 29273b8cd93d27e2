"""Maps of markers: YAML files with the poses of fiducial markers, read and written.

    format: 1
    markers:
      - {id: 7, at: [3.2, 5.94], height: 0.42, facing: -90 deg, position_deviation: 1 cm}
    boards:
      - {id: 20, at: [8, 0], height: 1, facing: 90 deg, columns: 3, rows: 2, size: 8 cm, gap: 3 cm}

A world file says which markers stand there; a map of markers says what the robot believes. Codes:
E405 keys and values · E406 ids.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import cos, degrees, sin
from pathlib import Path

from stack.documents import Findings, Mark, Section, read_document
from stack.documents.file_kinds import MARKERS
from stack.mapping.limits import FARTHEST
from stack.parameters import Declaration
from stack.types import MARKER_DICTIONARIES, Marker, wrap_angle

MARKERS_YAML = "markers.yaml"
"""Name of the map of markers in the folder of a saved map."""

SHAPE, IDS = "E405", "E406"

KEYS = ("markers", "boards", "format", "doc")

Take = Callable[[str, int, Mark], None]
"""Notes that a number of a dictionary is used at a position of the file."""


def _length(name: str, help: str, default: float | None, most: float) -> Declaration:
    return Declaration(name, float, help, "m", default, above=0.0, at_most=most)


_AT = tuple(
    Declaration(name, float, "map frame", "m", at_least=-FARTHEST, at_most=FARTHEST)
    for name in ("x", "y")
)
_ID = Declaration("id", int, "marker id in its dictionary", at_least=0)
_HEIGHT = _length("height", "height of its centre above the floor", 0.4, 5.0)
_FACING = Declaration("facing", float, "direction it faces", "rad")
_SIZE = _length("size", "side of the black square", 0.2, 2.0)
_DICTIONARY = Declaration(
    "dictionary", str, "OpenCV's name of its dictionary", default="DICT_4X4_50",
    one_of=tuple(MARKER_DICTIONARIES),
)  # fmt: skip
_DEVIATIONS = (
    Declaration(
        "position_deviation", float, "standard deviation of its position", "m", 0.0,
        at_least=0.0, at_most=10.0,
    ),
    Declaration(
        "heading_deviation", float, "standard deviation of its heading", "rad", 0.0,
        at_least=0.0, at_most=3.2,
    ),
)  # fmt: skip
_COLUMNS = Declaration("columns", int, "markers side by side", at_least=1, at_most=50)
_ROWS = Declaration("rows", int, "markers above each other", at_least=1, at_most=50)
_GAP = Declaration("gap", float, "between two markers", "m", at_least=0.0, at_most=2.0)


def read_marker(section: Section, take: Take, code: str) -> Marker | None:
    """Read the keys of a marker that world files and maps of markers share.

    Args:
        section: the mapping of the marker.
        take: called with dictionary, number and position in the file.
        code: of the finding for an id that the dictionary does not have.
    """
    number, at = section.value(_ID), section.node_of("at", required=True)
    place = None if at is None else section.parts("at", at, _AT)
    height, facing, size = (section.value(item) for item in (_HEIGHT, _FACING, _SIZE))
    dictionary = section.value(_DICTIONARY)
    identified = section.node.get("id")
    if number is not None and identified is not None:
        take(dictionary, number, identified.mark)
        _check_number(section.findings, dictionary, number, identified.mark, code)
    if number is None or place is None or facing is None:
        return None
    return Marker(number, size, (place[0], place[1], height), wrap_angle(facing), dictionary)


def read_marker_map(path: Path, text: str | None = None) -> tuple[Marker, ...]:
    """Read a map of markers; the markers of boards are among the others.

    Args:
        path: the file.
        text: read instead of the file's.

    Raises:
        InputError: all findings, each with its position.
    """
    findings = Findings()
    top = Section(read_document(path, MARKERS, text, KEYS), findings, "a map of markers", SHAPE)
    top.value(Declaration("format", int, "version of the format", default=1, at_least=1, at_most=1))
    top.value(Declaration("doc", str, "description", default=""))
    taken: dict[tuple[str, int], Mark] = {}

    def take(dictionary: str, number: int, mark: Mark) -> None:
        first = taken.setdefault((dictionary, number), mark)
        if first is not mark:
            sentence = f"duplicate {dictionary} marker {number}"
            findings.add(IDS, mark, sentence, f"the first is in line {first.line}")

    found: list[Marker] = []
    for node in top.sequence("markers"):
        section = Section(node, findings, "a marker", SHAPE)
        if node.is_mapping and (marker := marker_entry(section, take)) is not None:
            found.append(marker)
    for node in top.sequence("boards"):
        section = Section(node, findings, "a board", SHAPE)
        if node.is_mapping:
            found += board_entries(section, take)
    top.done()
    findings.raise_errors()
    return tuple(found)


def marker_map_text(markers: Sequence[Marker], doc: str) -> str:
    """Return the YAML text of a map of markers; numbers are rounded to 0.1 mm and 0.01 degrees.

    Args:
        markers: map frame.
        doc: description, one line.
    """
    lines = ["format: 1", f"doc: {doc}", "markers:" if markers else "markers: []"]
    for marker in markers:
        x, y, z = (round(value, 4) + 0.0 for value in marker.position)
        line = (
            f"{{id: {marker.number}, at: [{x:.4f}, {y:.4f}], height: {z:.4f}, "
            f"facing: {degrees(marker.heading):.2f} deg, size: {marker.size:g}, "
            f"dictionary: {marker.dictionary}"
        )
        if marker.position_deviation or marker.heading_deviation:
            line += (
                f", position_deviation: {marker.position_deviation:.4f}, "
                f"heading_deviation: {degrees(marker.heading_deviation):.2f} deg"
            )
        lines.append(f"  - {line}}}")
    return "\n".join(lines) + "\n"


def marker_entry(section: Section, take: Take) -> Marker | None:
    """Read a marker of a map of markers, with its standard deviations."""
    marker = read_marker(section, take, IDS)
    position, heading = (section.value(item) for item in _DEVIATIONS)
    section.done()
    if marker is None:
        return None
    return Marker(
        marker.number, marker.size, marker.position, marker.heading, marker.dictionary,
        position, heading,
    )  # fmt: skip


def board_entries(section: Section, take: Take) -> list[Marker]:
    """Read a board: a grid of markers, numbered row by row from its top left one."""

    def nothing(dictionary: str, number: int, mark: Mark) -> None:
        """Ids are taken below, one for each marker."""

    first = read_marker(section, nothing, IDS)
    columns, rows, gap = (section.value(item) for item in (_COLUMNS, _ROWS, _GAP))
    position, heading = (section.value(item) for item in _DEVIATIONS)
    section.done()
    if first is None or columns is None or rows is None or gap is None:
        return []
    pitch, (x, y, z) = first.size + gap, first.position
    found, identified = [], section.node.get("id")
    assert identified is not None, "a board without id has no first marker"
    for row in range(rows):
        for column in range(columns):
            number = first.number + row * columns + column
            take(first.dictionary, number, identified.mark)
            right = pitch * (column - 0.5 * (columns - 1))
            # seen from the front, right is to the left of the direction it faces
            at = (
                x - right * sin(first.heading), y + right * cos(first.heading),
                z + pitch * (0.5 * (rows - 1) - row),
            )  # fmt: skip
            found.append(
                Marker(number, first.size, at, first.heading, first.dictionary, position, heading)
            )
    _check_number(section.findings, first.dictionary, found[-1].number, identified.mark, IDS)
    return found


def _check_number(findings: Findings, dictionary: str, number: int, mark: Mark, code: str) -> None:
    if number >= MARKER_DICTIONARIES[dictionary]:
        sentence = f"{dictionary} has no marker {number}"
        hint = f"its ids are 0 to {MARKER_DICTIONARIES[dictionary] - 1}"
        findings.add(code, mark, sentence, hint)

"""Findings of a file of any kind, saved or in an editor."""

from __future__ import annotations

import re
from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path

from missions.execution.fit.faults import read_fault_file
from missions.execution.prepare import RunOptions, diagnose
from missions.execution.resources import catalogue_of
from missions.language.keys import TREE_FILE
from missions.language.reading.trees import read_trees
from missions.language.reading.words import Draft
from robots.load import read_robot
from stack.documents import Finding, Findings, Mark
from stack.documents.files import XML_BYTES, read_bytes
from stack.errors import InputError
from stack.mapping.pictures import is_image
from stack.sim.import_world import GAZEBO, read_any_world
from stack.sim.worlds.world_file import read_world


class FileKind(StrEnum):
    """Kind of a file."""

    MISSION = "mission"
    WORLD = "world"
    GAZEBO = "Gazebo world"
    MAP = "map"
    ROBOT = "robot"
    TREES = "trees"
    FAULTS = "faults"
    OTHER = "other"


def file_kind(path: Path, text: str) -> FileKind:
    """Return the kind of a file by its suffix and its top-level keys; editors send any YAML."""
    if path.suffix in GAZEBO:
        return FileKind.GAZEBO
    if is_image(path):
        return FileKind.MAP
    keys = set(re.findall(r"^([a-z_]+)[ \t]*:", text, re.MULTILINE))
    if "mission" in keys or {"run", "robot"} <= keys or {"run", "world"} <= keys:
        return FileKind.MISSION
    if "image" in keys and "world" not in keys:
        return FileKind.MAP
    of_world = {"walls", "boxes", "places", "bounds", "format"}
    if "world" in keys and (len(keys) == 1 or keys & of_world):
        return FileKind.WORLD
    if "robot" in keys and keys & {"wheels", "urdf", "footprint"}:
        return FileKind.ROBOT
    if "faults" in keys and not keys & {"run", "robot", "world", "trees", *of_world}:
        return FileKind.FAULTS
    of_trees = "trees" in keys or ("places" in keys and keys <= TREE_FILE.keys())
    return FileKind.TREES if of_trees else FileKind.OTHER


def kind_of(path: Path) -> FileKind:
    """Return the kind of a saved file; `OTHER` if it cannot be read."""
    return file_kind(path, text_of(path))


def findings_of(
    path: Path, draft: Draft | None = None, arguments: Mapping[str, str] | None = None
) -> tuple[Finding, ...]:
    """Return the findings of a file; a file of no known kind is read as a mission.

    Args:
        path: the file, which need not exist if there is a text.
        draft: text to read instead of the file's, and a recorder of its words.
        arguments: values of a mission's arguments, as text.
    """
    draft = draft or Draft()
    text = draft.text
    kind = kind_of(path) if text is None else file_kind(path, text)
    try:
        if kind in (FileKind.GAZEBO, FileKind.MAP) or (kind is FileKind.WORLD and text is None):
            return tuple(read_any_world(path).warnings)
        if kind is FileKind.WORLD:
            return tuple(read_world(path, text).warnings)
        if kind is FileKind.ROBOT:
            return read_robot(path, text).warnings
        if kind is FileKind.FAULTS:
            read_fault_file(path, None, text)
            return ()
        if kind is FileKind.TREES:
            return read_trees(path, catalogue_of([], path.parent, Findings()), draft)
        return diagnose(path, RunOptions(arguments=dict(arguments or {})), draft).findings
    except InputError as error:
        return tuple(error.findings) or (Finding(Mark(str(path)), "E110", str(error)),)


def text_of(path: Path) -> str:
    """Return the text of a file; empty if it cannot be read."""
    try:
        return read_bytes(path, XML_BYTES).decode("utf-8", errors="replace")
    except OSError:
        return ""  # the reader reports it

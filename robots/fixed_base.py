"""Robots without wheels: where their URDF stands, and what of the robot file follows from it."""

from __future__ import annotations

import numpy as np

from robots.agreement import Placement
from robots.declared import length
from robots.urdf.extent import points_of
from robots.urdf.model import RobotModel
from stack.documents import Section
from stack.documents.xml_file import Element
from stack.parameters import Declaration
from stack.types import Footprint

LEAST_RADIUS = 0.05
"""Of the outline of a base without a shape that can be measured, metres."""

COLUMN_RADIUS = 0.1
"""Of the column on which a raised base stands, metres."""

MOUNT_HEIGHT = Declaration(
    "height", float, "of the root of the URDF above the floor, on a column", "m", 0.0,
    at_least=0.0, at_most=10.0,
)  # fmt: skip
HEIGHT = Declaration(
    "height", float | None, "height of the base above the floor; default: measured", "m", None,
    above=0.0, at_most=10.0,
)  # fmt: skip


def is_fixed(top: Section) -> bool:
    """Whether a robot file describes an arm and no wheels."""
    return top.node.get("wheels") is None and top.node.get("arm") is not None


def read_mount(top: Section, *, fixed: bool) -> float:
    """Read `mount`: the height of the root of the URDF above the floor, metres."""
    if not fixed:
        return 0.0
    section = top.section("mount")
    if section is None:
        return 0.0
    height: float = section.value(MOUNT_HEIGHT)
    section.done()
    return height


def read_height(top: Section, *, fixed: bool) -> float | None:
    """Read `height`; only that of a fixed base can be left out."""
    read: float | None = top.value(HEIGHT if fixed else length("height", "height of the robot"))
    return read


def standing(mount: float) -> Placement:
    """Return how a URDF without wheels stands at a height above the floor, metres."""
    return Placement(np.array([0.0, 0.0, -mount]), {}, {})


def on_column(model: RobotModel, mount: float) -> RobotModel:
    """Return the model with a column from the floor to its root, of a height in metres."""
    if mount == 0.0:
        return model
    root = model.element
    column = _column(model, mount)
    children = [
        Element("link", child.attributes, child.mark, child.text, [*child.children, *column])
        if child.tag == "link" and child.name == model.root
        else child
        for child in root.children
    ]
    return RobotModel(Element("robot", root.attributes, root.mark, "", children))


def _column(model: RobotModel, mount: float) -> list[Element]:
    """The shapes of the column, in the frame of the root link."""
    mark = model.element.mark
    size = {"radius": f"{COLUMN_RADIUS}", "length": f"{mount}"}
    geometry = Element("geometry", {}, mark, "", [Element("cylinder", size, mark, "", [])])
    origin = Element("origin", {"xyz": f"0 0 {-mount / 2.0}", "rpy": "0 0 0"}, mark, "", [])
    grey = Element("color", {"rgba": "0.35 0.36 0.38 1"}, mark, "", [])
    material = Element("material", {"name": "column"}, mark, "", [grey])
    return [
        Element("visual", {}, mark, "", [origin, geometry, material]),
        Element("collision", {}, mark, "", [origin, geometry]),
    ]


def measured_footprint(model: RobotModel) -> Footprint:
    """Return the circle around the shapes of the root link."""
    points = points_of(model, model.root, "collision", meshes=True)
    reach = float(np.hypot(points[:, 0], points[:, 1]).max(initial=LEAST_RADIUS))
    return Footprint.circle(round(reach, 3))


def measured_height(model: RobotModel, mount: float) -> float:
    """Return the height of the top of the root link above the floor, metres."""
    points = points_of(model, model.root, "collision", meshes=True)
    return round(mount + float(points[:, 2].max(initial=LEAST_RADIUS)), 3)

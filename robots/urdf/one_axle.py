"""Puts the wheels of each side of a skid-steered robot on one axle, for the simulation.

Four wheels that skid in rigid-body contacts make the robot hop. So one wheel on each side, in the
middle of that side, carries and drives the simulated robot; where the real ones stand it has
casters without friction. The real wheels are drawn where they are and do not turn.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from robots.urdf.extent import points_of
from robots.urdf.model import RobotModel
from stack.documents.xml_file import Element
from stack.types import FloatArray

CASTER = 0.3
"""Radius of a caster, as a share of the wheel's."""

LIFTED = 0.9
"""Share of a wheel's radius that stays as a shape to collide with, off the floor."""

INMOST = 0.3
"""Share of its distance from the middle to which a wheel may be moved inwards."""


def on_one_axle(model: RobotModel, sides: Iterable[Sequence[str]], radius: float) -> RobotModel:
    """The model with one driven wheel for each side, whose joint has the name of the first one.

    Args:
        model: of the robot.
        sides: the joints of each side; one with a single joint is kept.
        radius: of the wheels, metres.
    """
    sides = tuple(sides)
    several = [side for side in sides if len(side) > 1]
    if not several:
        return model
    root = model.element
    aside = [np.mean([model.poses[model.joints[name].child][1, 3] for name in side])
             for side in sides]  # fmt: skip
    middle = float(np.mean(aside))
    fixed = {name for side in several for name in side}
    wheels = {model.joints[name].child for name in fixed}
    massless = {model.joints[side[0]].child for side in several}
    children = []
    for child in root.children:
        if child.tag == "joint" and child.name in fixed:
            child = _changed(child, name=f"{child.name}_of_wheel", type="fixed")
        elif child.tag == "link" and child.name in wheels:
            kept = [part for part in child.children if part.tag != "collision"]
            if child.name in massless:  # its mass is that of the simulated wheel
                kept = [part for part in kept if part.tag != "inertial"]
            child = Element("link", child.attributes, child.mark, "", [*kept, *_lifted(child)])
        children.append(child)
    for side in several:
        children += _axle(model, side, radius, middle)
        children += [part for name in side for part in _caster(model, name, radius)]
    return RobotModel(Element("robot", root.attributes, root.mark, "", children))


def _lifted(link: Element) -> Iterable[Element]:
    """The cylinders of a wheel, a little smaller, so that they do not touch the floor."""
    for part in link.all("collision"):
        cylinder = part.first("geometry", "cylinder")
        if cylinder is not None:
            smaller = _changed(cylinder, radius=f"{LIFTED * float(cylinder.attributes['radius'])}")
            geometry = Element("geometry", {}, part.mark, "", [smaller])
            yield Element("collision", {}, part.mark, "", [*part.all("origin"), geometry])


def _changed(element: Element, **attributes: str) -> Element:
    merged = {**element.attributes, **attributes}
    return Element(element.tag, merged, element.mark, element.text, element.children)


def _axle(model: RobotModel, side: Sequence[str], radius: float, middle: float) -> list[Element]:
    """The driven wheel of a side: between its real ones, no further out than they reach.

    Args:
        model: of the robot.
        side: its joints.
        radius: of the wheels, metres.
        middle: y of the middle between the sides in the root's frame, metres.
    """
    links = [model.joints[name].child for name in side]
    centre = np.mean([model.poses[link][:3, 3] for link in links], axis=0)
    points = points_of(model, links[0], "collision", meshes=False)
    width = float(np.ptp(points[:, 1])) / 2 if len(points) else 0.0
    aside = centre[1] - middle
    inwards = min(max(radius - width, 0.0), (1.0 - INMOST) * abs(aside))
    centre[1] -= np.copysign(inwards, aside)
    inertial = list(model.links[links[0]].all("inertial"))
    return _ball(model, side[0], f"{side[0]}_axle", centre, radius, inertial)


def _caster(model: RobotModel, name: str, radius: float) -> list[Element]:
    """A caster where a real wheel touches the floor."""
    centre = model.poses[model.joints[name].child][:3, 3] - (0.0, 0.0, (1 - CASTER) * radius)
    return _ball(model, f"{name}_contact", f"{name}_caster", centre, CASTER * radius)


def _ball(  # noqa: PLR0913 - a joint and a link
    model: RobotModel, joint: str, link: str, at: FloatArray, radius: float,
    inertial: Sequence[Element] = (),
) -> list[Element]:  # fmt: skip
    def element(tag: str, *children: Element, **attributes: str) -> Element:
        return Element(tag, attributes, model.element.mark, "", list(children))

    shape = element("geometry", element("sphere", radius=f"{radius}"))
    parts = (
        element("parent", link=model.root),
        element("child", link=link),
        element("origin", xyz=" ".join(f"{float(value)!r}" for value in at)),
        element("axis", xyz="0 1 0"),
    )
    return [
        element("link", *inertial, element("collision", shape), name=link),
        element("joint", *parts, name=joint, type="continuous" if inertial else "fixed"),
    ]

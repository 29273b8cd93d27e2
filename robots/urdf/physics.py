"""Writes the URDF that the simulation loads from the model of a robot.

PyBullet gives a link without <inertial> 1 kg and 1 kg m², sets impossible inertias to 0 and holds a
root without mass in the air. Here links on fixed joints are lumped into one, as in Gazebo, so a
link without mass adds none. Two kinds of joints that PyBullet would leave loose are fixed: those
with limits that the drive does not name, and those that carry no mass.

The root of the result is the base frame: on the floor, where the wheels say.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from math import atan2, hypot
from xml.sax.saxutils import quoteattr

import numpy as np

from robots.declared import LEFT_OUT, URDF
from robots.urdf.model import Inertial, Joint, RobotModel, combined, inertial_of, origin_of
from stack.documents import Findings
from stack.documents.xml_file import Element
from stack.types import FloatArray

INERTIA_MARGIN = 1e-6
"""Share by which the two smaller principal moments must exceed the largest; PyBullet sets the
inertia to 0 where rounding makes their sum the smaller one."""

SLOPPY = 0.01
"""Share of a violation of this rule that is corrected without a warning: rounded numbers."""


@dataclass(frozen=True)
class Body:
    """Links that are rigidly connected, as one link.

    Attributes:
        name: of the uppermost link, whose frame is that of the body.
        parts: pose of each link in the body, uppermost first.
        joints: joints to other bodies.
    """

    name: str
    parts: Mapping[str, FloatArray]
    joints: tuple[Joint, ...]


def physics_urdf(  # noqa: PLR0913 - what the text depends on
    model: RobotModel, base: FloatArray, turned: Mapping[str, bool], findings: Findings,
    driven: Collection[str] = (), *, fixed: bool = False,
) -> str:  # fmt: skip
    """The URDF for the simulation.

    Args:
        model: of the robot.
        base: (3,) origin of the base frame in the root's frame.
        turned: the joints that the drive names -> whether its axis is reversed.
        findings: errors where a moving part has no mass or an impossible inertia.
        driven: the joints of an arm and its gripper.
        fixed: whether nothing can move the base: it needs no mass.
    """
    frame = np.eye(4)
    frame[:3, 3] = -base
    writer = _Writer(model, {**dict.fromkeys(driven, False), **turned}, findings, fixed=fixed)
    lines = list(writer.lines(model.root, frame))
    return (
        f"<robot name={quoteattr(model.element.name or 'robot')}>\n"
        + "\n".join(lines)
        + ("\n</robot>\n")
    )


def is_caster(link: Element) -> bool:
    """Whether a link touches with spheres only: casters stay links, which have no friction."""
    touching = list(link.all("collision"))
    return bool(touching) and all(part.first("geometry", "sphere") for part in touching)


class _Writer:
    def __init__(
        self, model: RobotModel, turned: Mapping[str, bool], findings: Findings, *, fixed: bool
    ) -> None:
        self._model, self._turned, self._findings, self._fixed = model, turned, findings, fixed
        self._colours = {
            material.name: colour.attributes.get("rgba", "")
            for material in model.element.within()
            if material.tag == "material" and (colour := material.first("color")) is not None
        }

    def lines(self, link: str, frame: FloatArray, joint: str = "") -> Iterator[str]:
        """The lines of a link with everything below it, and of the joint to it.

        Args:
            link: uppermost link of a body.
            frame: pose of this link in the written one; differs for the root only.
            joint: lines of the joint above it.
        """
        body = self._body(link, frame)
        yield f"  <link name={quoteattr(link)}>"
        yield from self._inertial(body)
        for name, pose in body.parts.items():
            for part in self._model.links[name].children:
                if part.tag in ("visual", "collision"):
                    yield self._shape(part, pose)
        for contact in self._model.links[link].all("contact"):
            yield _written(contact)
        yield "  </link>"
        yield from ([joint] if joint else [])
        for below in body.joints:
            yield from self.lines(
                below.child, np.eye(4), self._joint(below, link, body.parts[below.parent])
            )

    def _moves(self, joint: Joint) -> bool:
        if joint.name in self._turned:
            return True
        return joint.kind == "continuous" and self._model.mass_below(joint.child) > 0.0

    def _body(self, link: str, frame: FloatArray) -> Body:
        """The body whose uppermost link this is."""
        parts, joints, waiting = {link: frame}, [], [link]
        while waiting:
            parent = waiting.pop(0)
            for joint in self._model.joints_below(parent):
                if self._moves(joint) or is_caster(self._model.links[joint.child]):
                    joints.append(joint)
                else:
                    parts[joint.child] = parts[parent] @ joint.origin
                    waiting.append(joint.child)
        return Body(link, parts, tuple(joints))

    def _inertial(self, body: Body) -> Iterator[str]:
        found = {
            name: part
            for name in body.parts
            if (part := inertial_of(self._model.links[name])) is not None and part.mass
        }
        total = combined([part.moved(body.parts[name]) for name, part in found.items()])
        lift = self._lift(body, total)
        only = next(iter(found), "") if len(found) == 1 and not lift else ""
        inertial = self._model.links[only].first("inertial") if only else None
        if inertial is not None and np.array_equal(body.parts[only], np.eye(4)):
            yield _written(inertial)
        else:
            yield _inertial_text(total, lift)

    def _lift(self, body: Body, total: Inertial) -> float:
        """What to add to the principal moments; a finding if the body cannot move with them."""
        element, above = self._model.links[body.name], self._model.joint_above(body.name)
        is_fixed = self._fixed if above is None else not self._moves(above)
        if not total.mass:
            if not is_fixed:
                what = "moves" if above is not None else "is the base"
                sentence = f"the link {body.name!r} {what} but has no mass"
                hint = "add <inertial> to it, or to a link that is fixed to it"
                self._findings.add(URDF, element.mark, sentence, hint)
            return 0.0
        moments: FloatArray = np.asarray(np.linalg.eigvalsh(total.inertia), dtype=np.float64)
        lift = _lacking(moments)
        told = f"the inertia of the link {body.name!r} is not possible: its principal moments are "
        told += f"{', '.join(f'{moment:.3g}' for moment in moments)} kg m²"
        if moments[0] < -1e-9 * moments[2] or (moments[2] <= 0.0 and not is_fixed):
            hint = f"of a solid sphere of radius r all three are 0.4 m r²; here m = {total.mass:g}"
            self._findings.add(URDF, element.mark, told, hint)
        elif lift > SLOPPY * moments[2]:
            sentence = f"{told}, and the largest exceeds the sum of the others"
            hint = f"the simulation adds {lift:.3g} to each"
            self._findings.add(LEFT_OUT, element.mark, sentence, hint)
        return lift

    def _joint(self, joint: Joint, parent: str, pose: FloatArray) -> str:
        moves = self._moves(joint)
        kind = joint.kind if moves else "fixed"
        lines = [
            f"  <joint name={quoteattr(joint.name)} type={quoteattr(kind)}>",
            f"    <parent link={quoteattr(parent)}/><child link={quoteattr(joint.child)}/>",
            f"    {_placed(joint.element, pose)}",
        ]
        if moves:
            is_turned = self._turned.get(joint.name, False)
            axis = -joint.axis if is_turned else joint.axis
            lines.append(f'    <axis xyz="{_numbers(axis)}"/>')
            lines += [f"    {_limit(limit, is_turned)}" for limit in joint.element.all("limit")]
        return "\n".join([*lines, "  </joint>"])

    def _shape(self, part: Element, pose: FloatArray) -> str:
        geometry = part.first("geometry")
        assert geometry is not None
        inside = [_placed(part, pose), _written(geometry)]
        material = part.first("material")
        if material is not None and part.tag == "visual":
            colour = material.first("color")
            rgba = self._colours.get(material.name, "")
            rgba = rgba if colour is None else colour.attributes.get("rgba", rgba)
            if rgba:
                name = quoteattr(f"{material.name}_{rgba}")
                inside.append(f"<material name={name}><color rgba={quoteattr(rgba)}/></material>")
        return f"    <{part.tag}>{''.join(inside)}</{part.tag}>"


def _lacking(moments: FloatArray) -> float:
    """What must be added to each principal moment so that a rigid body can have them."""
    least, middle, most = moments.tolist()
    lacking = most - least - middle
    return float(lacking + INERTIA_MARGIN * most) if lacking > -INERTIA_MARGIN * most else 0.0


def _inertial_text(body: Inertial, lift: float) -> str:
    tensor = body.inertia + lift * np.eye(3)
    values = {
        "ixx": tensor[0, 0], "iyy": tensor[1, 1], "izz": tensor[2, 2],
        "ixy": tensor[0, 1], "ixz": tensor[0, 2], "iyz": tensor[1, 2],
    }  # fmt: skip
    inertia = " ".join(f'{key}="{float(value)!r}"' for key, value in values.items())
    return (
        f'    <inertial><origin xyz="{_numbers(body.centre)}"/><mass value="{float(body.mass)!r}"/>'
        f"<inertia {inertia}/></inertial>"
    )


def _placed(element: Element, pose: FloatArray) -> str:
    """The <origin> of an element in another frame, given the pose of its own in that one."""
    if np.array_equal(pose, np.eye(4)):
        origin = element.first("origin")
        return "" if origin is None else _written(origin)
    moved = pose @ origin_of(element)
    return f'<origin xyz="{_numbers(moved[:3, 3])}" rpy="{_numbers(_angles(moved))}"/>'


def _angles(transform: FloatArray) -> FloatArray:
    """Roll, pitch and yaw of a transform."""
    r = transform
    pitch = atan2(-r[2, 0], hypot(r[0, 0], r[1, 0]))
    if hypot(r[0, 0], r[1, 0]) < 1e-9:  # upright: only the difference of roll and yaw counts
        return np.array([atan2(-r[1, 2], r[1, 1]), pitch, 0.0])
    return np.array([atan2(r[2, 1], r[2, 2]), pitch, atan2(r[1, 0], r[0, 0])])


def _limit(element: Element, is_turned: bool) -> str:
    """The <limit> of a joint; with the axis reversed, the ends change places and signs."""
    if not is_turned:
        return _written(element)
    ends = {name: float(element.attributes.get(name) or 0.0) for name in ("lower", "upper")}
    turned = {"lower": f"{-ends['upper']!r}", "upper": f"{-ends['lower']!r}"}
    return _written(Element("limit", {**element.attributes, **turned}, element.mark))


def _numbers(values: FloatArray) -> str:
    return " ".join(repr(float(value) + 0.0) for value in values)  # + 0.0: no -0.0


def _written(element: Element) -> str:
    attributes = "".join(f" {name}={quoteattr(text)}" for name, text in element.attributes.items())
    inside = "".join(map(_written, element.children))
    return f"<{element.tag}{attributes}>{inside}</{element.tag}>"

"""Compares robot.yaml with its URDF: wheels, footprint, height and sensor mounts.

The base frame is on the floor, where the driven wheels say: midway between them, or where the
mounts of omnidirectional wheels have it. The URDF's own root may be elsewhere.

Codes: E302 what the simulation would contradict · W303 what is probably unintended.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import cos, inf, radians, sin

import numpy as np

from robots.arm_on_wheels import bodies_at_home, check_arm_at_home, links_of_arm
from robots.declared import DIFFERS, URDF
from robots.urdf.extent import points_of, radii_of, shapes_of
from robots.urdf.model import Joint, RobotModel, combined
from robots.urdf.sensors import ModelledSensor, sensors_of
from stack.documents import Node, Section
from stack.drivetrain.description import RobotDescription
from stack.drivetrain.drivetrain import WheelGeometry
from stack.drivetrain.limits import Limits
from stack.geometry.polygons import distances_to_edges, points_inside
from stack.sim.physics.engine import GRAVITY
from stack.types import FloatArray, Pose2D

LENGTH, SHARE = 0.005, 0.05
"""Lengths may differ by so many metres, or by this share: calibrated values differ by less."""

RADIUS, RADIUS_SHARE = 0.001, 0.02
"""Wheel radii may differ by so many metres, or by this share."""

LEVEL = 0.005
"""Heights of driven wheels may differ by this, metres; other shapes may reach so far below."""

SAME_FRAME = 0.002
"""An origin of the URDF that is closer to the base frame is the base frame, metres."""

AXLE = cos(radians(5.0))
BEYOND = 0.02
"""Shapes may be outside the footprint, or above the height, by this many metres."""

MOUNT = 0.03
"""Sensors may be mounted so far from their links, metres."""


@dataclass(frozen=True)
class Placement:
    """How the URDF stands on its wheels.

    Attributes:
        base: (3,) origin of the base frame in the URDF's root frame, metres.
        turned: joints that the drive names -> whether the axis must be reversed so that the wheel
            drives forward when its joint turns forward.
        at: joints that the drive names -> (x, y) of the links that they turn, base frame, metres.
    """

    base: FloatArray
    turned: Mapping[str, bool]
    at: Mapping[str, tuple[float, float]]


def place_on_wheels(top: Section, model: RobotModel, wheels: WheelGeometry) -> Placement:
    """Where the base frame is, by the driven wheels; reports what contradicts `wheels`.

    Args:
        top: the robot file.
        model: with all joints that `wheels` names.
        wheels: as described.
    """
    drivetrain = wheels.drivetrain(Limits())
    driven = [model.joints[name] for name in drivetrain.driven_joints]
    steered = [model.joints[name] for name in drivetrain.steering_joints]
    centres = np.array([model.poses[joint.child][:3, 3] for joint in driven])
    described = [wheels.places[joint.name] for joint in driven]
    middle = centres.mean(axis=0)
    x, y = np.mean([(place.x, place.y) for place in described], axis=0).tolist()
    base = middle - (x, y, wheels.radius)
    if np.abs(base).max() < SAME_FRAME:
        base = np.zeros(3)
    checks = _WheelChecks(top, model, wheels)
    checks.heights(driven, centres[:, 2] - base[2])
    turned = {}
    for joint, place in zip(driven, described, strict=True):
        turned[joint.name] = checks.axle(joint, place, rollers=drivetrain.slides_along_axles)
    for joint in steered:
        turned[joint.name] = checks.pivot(joint)
    at = {
        joint.name: tuple((model.poses[joint.child][:3, 3] - base)[:2].tolist())
        for joint in (*driven, *steered)
    }
    checks.lengths(at)
    if not top.findings.errors:  # a wrong radius or height puts everything at a wrong height
        checks.floor(base)
    return Placement(base, turned, at)


def check_radii(top: Section, model: RobotModel, wheels: WheelGeometry) -> None:
    """Report wheels that have no shape to roll on, or one of another radius.

    Args:
        top: the robot file.
        model: with all joints that `wheels` names.
        wheels: as described.
    """
    checks = _WheelChecks(top, model, wheels)
    names = {name: None for side in wheels.sides for name in side} or wheels.places
    for name in names:
        checks.radius(model.joints[name])


class _WheelChecks:
    """The comparisons of the wheels; each reports what it finds."""

    def __init__(self, top: Section, model: RobotModel, wheels: WheelGeometry) -> None:
        node = top.node.get("wheels")
        assert node is not None
        self._node, self._findings, self._model, self._wheels = node, top.findings, model, wheels

    def heights(self, driven: list[Joint], heights: FloatArray) -> None:
        """Report driven wheels that do not stand on one floor."""
        if np.ptp(heights) > LEVEL:
            low, high = driven[int(heights.argmin())].name, driven[int(heights.argmax())].name
            sentence = (
                f"the URDF's driven wheels are not at one height: {high!r} is {np.ptp(heights):.3f}"
                f" m above {low!r}"
            )
            self._error("", sentence, "correct the origins of their joints")

    def axle(self, joint: Joint, place: Pose2D, *, rollers: bool) -> bool:
        """Report an axle that does not lie across the driving direction.

        Returns:
            Whether the axis points to the right of it.
        """
        axis = self._model.axis_of(joint)
        across = float(axis @ (-sin(place.heading), cos(place.heading), 0.0))
        if abs(across) < AXLE:
            sentence = (
                f"the URDF's wheel joint {joint.name!r} turns about {_listed(axis)} in the base "
                f"frame; the axle must be {_listed((-sin(place.heading), cos(place.heading), 0))}"
            )
            self._error("", sentence, "correct <axis> or the rpy of its <origin>")
        elif rollers and sorted(round(abs(part), 6) for part in joint.axis) != [0.0, 0.0, 1.0]:
            sentence = (
                f"the axle of the URDF's wheel joint {joint.name!r} is {_listed(joint.axis)}; "
                "with rollers it must be an axis of its link"
            )
            self._error("", sentence, "rotate the joint's <origin> and use the axis 0 1 0")
        return across < 0.0

    def pivot(self, joint: Joint) -> bool:
        """Report a steering joint that is not upright; return whether its axis points down."""
        axis = self._model.axis_of(joint)
        if abs(axis[2]) < AXLE:
            sentence = f"the URDF's steering joint {joint.name!r} turns about {_listed(axis)}"
            self._error("", sentence, "a steering joint must turn about the vertical axis, 0 0 1")
        return bool(axis[2] < 0.0)

    def radius(self, joint: Joint) -> None:
        """Report a wheel that has no shape to roll on, or one of another radius."""
        links = [joint.child, *(below.child for below in self._model.downwards(joint.child))]
        elements = [self._model.links[name] for name in links]
        if not any(part.tag == "collision" for element in elements for part in element.children):
            sentence = f"the URDF's wheel {joint.child!r} has no <collision>: it cannot roll"
            self._error("", sentence, f"add a sphere of radius {self._wheels.radius:g}")
            return
        described = self._wheels.radius
        round_shapes = [found for element in elements for found in radii_of(element)]
        if not round_shapes:
            return  # a mesh
        kind, nearest = min(round_shapes, key=lambda found: abs(found[1] - described))
        if abs(nearest - described) > max(RADIUS, RADIUS_SHARE * described):
            sentence = (
                f"radius is {described:g} m, but the URDF's wheel {joint.child!r} is a {kind} of "
                f"radius {nearest:g} m"
            )
            self._error("radius", sentence, f"write `radius: {nearest:g}`, or correct the URDF")

    def lengths(self, at: Mapping[str, tuple[float, float]]) -> None:
        """Report distances between wheels that are others in the URDF."""
        for length in self._wheels.lengths(at):
            off = abs(length.described - length.modelled)
            if off > max(LENGTH, SHARE * abs(length.described)):
                sentence = (
                    f"the {length.what} is {length.described:g} m, but {length.modelled:.4g} m in "
                    "the URDF"
                )
                hint = f"write {length.modelled:.4g} m, or correct the origins of the joints"
                if length.modelled < 0.0:
                    hint = "left wheels are at y > 0 of the base frame, front wheels at x > 0"
                self._error(length.key, sentence, hint)

    def floor(self, base: FloatArray) -> None:
        """Report shapes that reach below the floor on which the wheels stand."""
        for name in self._model.links:
            points = points_of(self._model, name, "collision", meshes=False)
            deep = -float((points[:, 2] - base[2]).min(initial=0.0))
            if deep > LEVEL:
                sentence = (
                    f"the URDF's link {name!r} reaches {deep:.3f} m below the floor on which the "
                    f"driven wheels of radius {self._wheels.radius:g} m stand"
                )
                self._error("", sentence, "raise the shape, or correct the wheels")

    def _error(self, key: str, sentence: str, hint: str) -> None:
        node = (self._node.get(key) if key else None) or self._node
        self._findings.add(URDF, node.mark, f"wheels: {sentence}", hint)


def compare_body(
    top: Section, model: RobotModel, base: FloatArray, robot: RobotDescription
) -> None:
    """Warn of shapes outside footprint and height, and of sensors away from their links."""
    of_arm = links_of_arm(model, robot)
    points = {
        name: points_of(model, name, "collision", meshes=False) - base
        for name in model.links
        if name not in of_arm
    }
    outside = {name: _beyond(at[:, :2], robot.footprint.points) for name, at in points.items()}
    above = {name: float(at[:, 2].max(initial=0.0)) - robot.height for name, at in points.items()}
    origin = "coordinates count from the point on the floor between the driven wheels"
    if base[:2].any():
        origin += f", which is at {_listed(base)} in the URDF's frame {model.root!r}"
    for key, found, where in (("footprint", outside, "beyond it"), ("height", above, "above it")):
        farthest = max(found, key=lambda name: found[name])
        if found[farthest] > BEYOND:
            sentence = (
                f"{key}: the URDF's link {farthest!r} reaches {found[farthest]:.3f} m {where}"
            )
            top.findings.add(DIFFERS, top.mark_of(key), sentence, origin)
    _compare_mounts(top, model, base, robot)
    if robot.drivetrain.moves:
        _check_supports(top, model, points)
        _check_tipping(top, model, base, robot)
        check_arm_at_home(top, model, base, robot)


def _check_supports(top: Section, model: RobotModel, points: Mapping[str, FloatArray]) -> None:
    """Warn of fixed parts that stand on the floor with an edge or a face."""
    for name, at in points.items():
        shapes = {kind for kind in shapes_of(model.links[name]) if kind != "sphere"}
        if not shapes or float(at[:, 2].min(initial=inf)) > LEVEL or model.turns(name):
            continue
        sentence = (
            f"wheels: the URDF's link {name!r} does not turn and stands on the floor with a "
            f"{min(shapes)}: it may carry the robot, and the wheels slip"
        )
        hint = "use a sphere as its <collision>, a caster without friction, or raise it by 1 cm"
        mark = (top.node.get("wheels") or top.node).mark
        top.findings.add(DIFFERS, mark, sentence, hint)


def _check_tipping(
    top: Section, model: RobotModel, base: FloatArray, robot: RobotDescription
) -> None:
    """Warn of an emergency stop that lifts the rear wheels; an arm is at `home`.

    They carry nothing at a deceleration of g d / h, with the centre of mass h above the floor and d
    behind the foremost point on which the robot stands; none is beyond the footprint.
    """
    centre = combined(bodies_at_home(model, robot)).centre - base
    ahead = float(robot.footprint.points[:, 0].max()) - centre[0]
    if centre[2] <= 0.0 or ahead <= 0.0:
        return
    bearable = GRAVITY * ahead / centre[2]
    if robot.limits.stop <= bearable:
        return
    sentence = (
        f"limits: a stop with {robot.limits.stop:g} m/s² tips the robot over: its centre of mass "
        f"is {centre[2]:.2f} m high and {ahead:.2f} m behind the front of the footprint, which "
        f"bears {bearable:.1f} m/s²"
    )
    hint = f"set stop_deceleration, and linear_deceleration, well below {bearable:.1f} m/s²"
    top.findings.add(DIFFERS, (top.node.get("limits") or top.node).mark, sentence, hint)


def _compare_mounts(
    top: Section, model: RobotModel, base: FloatArray, robot: RobotDescription
) -> None:
    """Compare the only sensor of a kind with the only link of that kind."""
    found = sensors_of(model)
    lidars = [(lidar.mount.x, lidar.mount.y, lidar.height) for lidar in robot.real_lidars.values()]
    described: dict[str, tuple[Node | None, list[tuple[float, float, float]]]] = {
        "lidar": (top.node.get("lidar"), lidars),
        "camera": (top.node.get("camera"), [robot.camera.model.position] if robot.camera else []),
    }
    for kind, (node, positions) in described.items():
        sensors = found.get(kind, [])
        if node is None or len(sensors) != 1 or len(positions) != 1:
            continue
        (sensor,) = sensors
        if kind == "lidar":
            _compare_roll(top, node, sensor, robot)
        modelled = sensor.pose[:3, 3] - base
        off = float(np.linalg.norm(modelled - positions[0]))
        if off > MOUNT:
            sentence = (
                f"{kind}: it is at {_listed(positions[0])} m, but the URDF's sensor on "
                f"{sensor.link!r} is at {_listed(modelled)} m in the base frame, {off:.3f} m away"
            )
            top.findings.add(DIFFERS, node.mark, sentence)


def _compare_roll(
    top: Section, node: Node, sensor: ModelledSensor, robot: RobotDescription
) -> None:
    """Warn of the lidar if it is upside down in one of the two files alone."""
    (lidar,) = robot.real_lidars.values()
    up = float(sensor.pose[2, 2])
    if abs(up) >= AXLE and lidar.upside_down != (up < 0.0):
        way, roll = ("upside down", "180 deg") if up < 0.0 else ("upright", "0")
        sentence = f"lidar: roll: the URDF's sensor on {sensor.link!r} is {way}"
        hint = f"write `roll: {roll}`, or correct the URDF: its angles run the other way"
        top.findings.add(DIFFERS, (node.get("roll") or node).mark, sentence, hint)


def _beyond(points: FloatArray, corners: FloatArray) -> float:
    """How far the farthest point (n, 2) is outside a polygon, metres; 0: all are inside."""
    outside = points[~points_inside(points, corners)]
    return float(distances_to_edges(outside, corners).max(initial=0.0))


def _listed(values: FloatArray | tuple[float, ...]) -> str:
    return "[" + ", ".join(f"{round(float(value), 3) + 0.0:g}" for value in values) + "]"

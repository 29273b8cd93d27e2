"""Whether the costmaps fit the robot: layers and their sensors, inflation."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from missions.execution.fit.components import MISSING, Marks
from missions.execution.fit.needs import missing
from stack.components import BUILT_IN, Choice
from stack.costmap.choosing import LayerChoice
from stack.costmap.parameters import CostmapParameters
from stack.documents import Finding
from stack.drivetrain.description import RobotDescription
from stack.drivetrain.needs import lacking
from stack.parameters import suggestion

MARGIN = 0.3
"""Metres beyond the robot's inscribed radius that the suggested inflation reaches."""


def layer_findings(
    choices: Mapping[str, Choice], marks: Marks, robot: RobotDescription
) -> Iterator[Finding]:
    """Yield errors of layers without their sensor, and warnings of sensors without a layer.

    Args:
        choices: of the components, among them the costmap with its layers.
        marks: of the mission.
        robot: its sensors count.
    """
    choice = choices["costmap"]
    layers: tuple[LayerChoice, ...] = choice.parts
    mark, read = marks.of_component("costmap", "layers"), set()
    for layer in layers:
        what = f"the layer {layer.name!r}"
        for need in lacking(layer.component.needs, robot):
            yield missing(what, need, mark, robot, "remove it from `layers`")
        if not robot.all_lidars:
            continue
        for name in layer.component.lidars(layer.parameters(choice.parameters)):
            read.add(name)
            if name not in robot.all_lidars:
                sentence = f"{what} reads the lidar {name!r}, which {robot.name} does not have"
                hint: str = suggestion(name, robot.all_lidars)
                yield Finding(mark, MISSING, f"{sentence}", f"set its `source`; {hint}")
    if any(layer.use not in BUILT_IN["costmap_layer"] for layer in layers):
        return  # a plugin's layer may read any sensor
    for name in robot.real_lidars:
        if name not in read:
            sentence = f"no layer reads the lidar {name!r}: plans pass through what only it sees"
            hint = f"add {{use: obstacle, name: obstacle_{name}, source: {name}}} to `layers`"
            yield Finding(mark, "W144", sentence, hint)
    sees_depth = bool(robot.depth_cameras) and choices["depth"].parameters.obstacles
    if sees_depth and all(layer.use != "depth" for layer in layers):
        sentence = "no layer draws what the depth cameras see: plans pass through what only they do"
        yield Finding(mark, "W144", sentence, "add `depth` to `layers`")


def inflation_findings(choice: Choice, marks: Marks, robot: RobotDescription) -> Iterator[Finding]:
    """Yield a warning for each costmap whose inflation ends at the robot's own outline."""
    costs: CostmapParameters = choice.parameters
    inscribed = robot.footprint.inscribed_radius
    names = ["inflation_radius"]
    if costs.local_inflation_radius is not None:
        names.append("local_inflation_radius")
    for name in names:
        inflation = costs.inflation(local=name.startswith("local"))
        if inflation.inflation_radius > inscribed or inflation.turning_cost > 0.0:
            continue
        sentence = f"{name}: {inflation.inflation_radius:g} m does not reach beyond {robot.name}, "
        sentence += f"whose inscribed radius is {inscribed:.2f} m: plans touch corners and walls"
        named = marks.mission.components.get("costmap")
        mark = marks.of("robot") if named is None else named.marks.get(name, named.mark)
        yield Finding(mark, "W145", sentence, f"use about {inscribed + MARGIN:.2f} m")

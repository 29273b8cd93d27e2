"""The route graph that a mission's planner names, held against the world before anything moves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from missions.language.analysis.data_flow import children_of
from missions.language.model import Constant, Leaf, Mission, Step
from stack.components import Choice
from stack.documents import Finding, Mark
from stack.drivetrain.description import RobotDescription
from stack.errors import InputError
from stack.parameters import suggestion
from stack.planning.routes.geojson import read_route_graph
from stack.planning.routes.graph import RouteGraph
from stack.planning.routes.parameters import RouteParameters
from stack.sim.worlds.outlines import Outline, outlines
from stack.sim.worlds.world import World

SPACING = 0.1
"""Metres between the places of a lane that are looked at."""


def located_planner(
    choice: Choice, mission: Mission, robot: RobotDescription, world: World
) -> tuple[Choice, tuple[Finding, ...]]:
    """The planner with its graph's file looked for beside the mission, and what is odd about that.

    Raises:
        InputError: there is no graph, or it is faulty.
    """
    if not isinstance(choice.parameters, RouteParameters):
        if isinstance(choice.component, type) and not hasattr(choice.component, "with_edge"):
            _refuse_edges(mission, choice.name)
        return choice, ()
    given = choice.parameters.graph
    if not given:
        hint = "write `planner: {use: route, graph: routes/office.geojson}`"
        raise InputError([Finding(_mark(mission), "E111", "planner: route needs a `graph`", hint)])
    file = mission.source.parent / Path(given).expanduser()
    graph = _read(file, mission)
    drawn = outlines(world, mapped_only=True) if mission.map != "none" else []
    through = through_walls(graph, drawn, robot.footprint.inscribed_radius)
    unknown = list(_unknown_edges(mission, graph))
    if unknown:
        raise InputError(unknown)
    parameters = replace(choice.parameters, graph=str(file))
    return replace(choice, parameters=parameters), (*graph.warnings, *through)


def through_walls(
    graph: RouteGraph, outlines: Sequence[Outline], clearance: float
) -> Iterator[Finding]:
    """A warning for each lane on which the robot would touch something that stands there.

    Args:
        graph: of lanes.
        outlines: what stands there, map frame.
        clearance: metres from the middle of the robot to its nearest side.
    """
    for edge in graph.edges.values():
        points = edge.line.at(edge.line.samples(SPACING))
        for outline in outlines:
            depths = outline.depth_at(points) + clearance
            worst = int(depths.argmax())
            if depths[worst] <= 0.0:
                continue
            x, y = points[worst]
            yield Finding(
                Mark(graph.source), "W431",
                f"feature {edge.feature}: the edge {edge.id!r} leads through "
                f"{outline.name or 'a wall'} at ({x:.2f}, {y:.2f})",
                "draw it elsewhere; the robot goes round, if there is room", "warning",
            )  # fmt: skip
            break


def _refuse_edges(mission: Mission, planner: str) -> None:
    """Raise InputError when a mission closes edges of a graph that its planner does not have."""
    hint = "choose `planner: {use: route, graph: FILE}`"
    sentence = f"set_edge: the planner {planner} has no route graph"
    found = [Finding(step.mark, "E111", sentence, hint) for step in _edge_setters(mission)]
    if found:
        raise InputError(found)


def _unknown_edges(mission: Mission, graph: RouteGraph) -> Iterator[Finding]:
    for step in _edge_setters(mission):
        edge = step.ports.get("edge")
        if isinstance(edge, Constant) and edge.value not in graph.edges:
            sentence = f"set_edge: the route graph has no edge {edge.value!r}"
            yield Finding(step.mark, "E432", sentence, suggestion(str(edge.value), graph.edges))


def _edge_setters(mission: Mission) -> Iterator[Leaf]:
    """Every set_edge in a mission, each once."""
    roots = [mission.root, *(event.step for event in mission.events)]
    roots += [tree.root for tree in mission.trees.values() if tree.root is not None]
    waiting: list[Step] = roots[::-1]
    while waiting:
        step = waiting.pop()
        if isinstance(step, Leaf) and step.kind == "set_edge":
            yield step
        waiting += reversed(children_of(step))


def _mark(mission: Mission) -> Mark:
    component = mission.navigation.get("planner")
    if component is None:
        return Mark(str(mission.source))
    return component.marks.get("graph", component.mark)


def _read(file: Path, mission: Mission) -> RouteGraph:
    """The graph; a file that is not there is reported where the mission names it."""
    try:
        return read_route_graph(file)
    except InputError as error:
        found = [
            replace(item, mark=_mark(mission), sentence=f"{file}: {item.sentence}")
            if item.code == "E001"
            else item
            for item in error.findings
        ]
        raise InputError(found) from None

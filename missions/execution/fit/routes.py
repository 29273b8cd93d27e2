"""Check the route graph of a mission's planner against the mission and the world."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from missions.execution.fit.components import mark_of_component
from missions.execution.fit.steps import every_leaf
from missions.execution.fit.zones import KeepoutArea
from missions.language.kinds.leaf import LeafStep
from missions.language.model import Mission
from missions.language.values import Constant
from stack.components import Choice, Planner
from stack.documents import Finding, Mark
from stack.drivetrain.description import RobotDescription
from stack.errors import InputError
from stack.parameters import suggestion
from stack.planning.routes.geojson import read_route_graph
from stack.planning.routes.graph import RouteGraph
from stack.planning.routes.parameters import RouteParameters
from stack.sim.worlds.outlines import outlines
from stack.sim.worlds.world import World
from stack.types import FloatArray

SPACING = 0.1
"""Metres between the checked points of a lane."""

Distances = Callable[[FloatArray], FloatArray]
"""Points (n, 2) -> their distances (n,) to an obstacle or zone, metres; negative inside."""


def located_planner(
    choice: Choice, mission: Mission, robot: RobotDescription, world: World,
    areas: Sequence[KeepoutArea] = (),
) -> tuple[Choice, tuple[Finding, ...]]:  # fmt: skip
    """Return the planner with the path of its graph resolved, and the warnings about the graph.

    Raises:
        InputError: the graph is missing or has errors.
    """
    if not isinstance(choice.parameters, RouteParameters):
        planner: type[Planner] = choice.component
        if not planner.has_route_graph:
            _refuse_edges(mission, choice.name)
        return choice, ()
    given = choice.parameters.graph
    if not given:
        hint = "write `planner: {use: route, graph: routes/office.geojson}`"
        mark = mark_of_component(mission, "planner", "graph")
        raise InputError([Finding(mark, "E111", "planner: route needs a `graph`", hint)])
    file = mission.source.parent / Path(given).expanduser()
    graph = _read(file, mission)
    found = [] if mission.map == "none" else list(_through(graph, world, areas, robot))
    unknown = list(_unknown_edges(mission, graph))
    if unknown:
        raise InputError(unknown)
    parameters = replace(choice.parameters, graph=str(file))
    return replace(choice, parameters=parameters), (*graph.warnings, *found)


def _through(
    graph: RouteGraph, world: World, areas: Sequence[KeepoutArea], robot: RobotDescription
) -> Iterator[Finding]:
    """Yield a warning for each lane on which the robot would collide, or enter a keep-out zone."""
    radius = robot.footprint.inscribed_radius
    walls = outlines(world, mapped_only=True)
    obstacles = [(item.name or "a wall", item.distance_to, radius) for item in walls]
    zones = [(item.words(), item.distance_to, radius if item.whole else 0.0) for item in areas]
    yield from _first_on_each(
        graph, obstacles, "move the edge; the robot drives around the obstacle if there is room"
    )
    yield from _first_on_each(
        graph, zones, "move the edge or the zone; the robot drives around if there is room"
    )


def _first_on_each(
    graph: RouteGraph, things: Sequence[tuple[str, Distances, float]], hint: str
) -> Iterator[Finding]:
    """Report the first thing on each lane: its words, distances of points to it, and clearance."""
    for edge in graph.edges.values():
        points = edge.line.at(edge.line.samples(SPACING))
        for words, distance_to, clearance in things:
            depths = clearance - distance_to(points)
            worst = int(depths.argmax())
            if depths[worst] <= 0.0:
                continue
            x, y = points[worst]
            sentence = f"feature {edge.feature}: the edge {edge.id!r} leads through {words} at "
            sentence += f"({x:.2f}, {y:.2f})"
            yield Finding(Mark(graph.source), "W431", sentence, hint)
            break


def _refuse_edges(mission: Mission, planner: str) -> None:
    """Raise InputError when a mission sets edges and its planner has no route graph."""
    hint = "choose `planner: {use: route, graph: FILE}`"
    sentence = f"the planner {planner} has no route graph"
    found = [
        Finding(step.mark, "E111", f"{step.kind}: {sentence}", hint)
        for step in _edge_users(mission)
    ]
    if found:
        raise InputError(found)


def _unknown_edges(mission: Mission, graph: RouteGraph) -> Iterator[Finding]:
    for step in _edge_users(mission):
        edge = step.ports.get(step.behaviour.edge_port)
        if isinstance(edge, Constant) and edge.value not in graph.edges:
            sentence = f"{step.kind}: the route graph has no edge {edge.value!r}"
            yield Finding(step.mark, "E432", sentence, suggestion(str(edge.value), graph.edges))


def _edge_users(mission: Mission) -> Iterator[LeafStep]:
    """Yield every behaviour of a mission that names an edge, once."""
    return (leaf for leaf in every_leaf(mission) if leaf.behaviour.edge_port)


def _read(file: Path, mission: Mission) -> RouteGraph:
    """Read the graph; a missing file is reported at the mission's line that names it."""
    try:
        return read_route_graph(file)
    except InputError as error:
        found = [
            replace(
                item,
                mark=mark_of_component(mission, "planner", "graph"),
                sentence=f"{file}: {item.sentence}",
            )
            if item.code == "E001"
            else item
            for item in error.findings
        ]
        raise InputError(found) from None

"""The route graph that a mission names: found beside it, held against mission and world."""

import json

import pytest

from missions.execution.prepare import RunOptions, prepare
from missions.inspection.check import check_files
from stack.errors import InputError
from tests.stack.planning.routes.test_geojson import collection, edge, node

MISSION = """mission: lanes
robot: scout
world: depot
navigation: {planner: {use: route, graph: lanes.geojson}}
run:
  sequence:
    - set_edge: north
    - navigate_to_pose: $loading
"""
PLACES = {"west": (1.5, 8.7), "east": (14.5, 8.7), "south": (1.5, 1.3)}


@pytest.fixture
def mission(tmp_path):
    def write(text=MISSION, **edges):
        edges = {"north": ("west", "east"), **edges}
        lanes = [edge(name, *ends, [PLACES[end] for end in ends]) for name, ends in edges.items()]
        nodes = [node(name, *place) for name, place in PLACES.items()]
        (tmp_path / "lanes.geojson").write_text(json.dumps(collection(*nodes, *lanes)))
        (tmp_path / "lanes.yaml").write_text(text)
        return tmp_path / "lanes.yaml"

    return write


def test_the_file_is_looked_for_beside_the_mission(mission, tmp_path):
    plan = prepare(mission(west=("west", "south")), RunOptions())
    assert plan.choices["planner"].parameters.graph == str(tmp_path / "lanes.geojson")
    assert plan.warnings == ()


@pytest.mark.parametrize(
    ("before", "after", "finding"),
    [
        ("lanes.geojson", "lane.geojson", "lane.geojson: there is no such route graph; did you"),
        ("graph: lanes.geojson", "graph: lane.geojson", "lanes.yaml:4:43 error[E001] "),
        (", graph: lanes.geojson", "", "lanes.yaml:4:29 error[E111] planner: route needs a"),
        ("set_edge: north", "set_edge: nort",
         "lanes.yaml:7:7 error[E432] set_edge: the route graph has no edge 'nort'; did you mean"),
        ("use: route, graph: lanes.geojson", "use: astar",
         "lanes.yaml:7:7 error[E111] set_edge: the planner astar has no route graph; choose"),
        ("use: route", "use: route, cost: money",
         "lanes.yaml:4:42 error[E111] cost: 'money' is not one of"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_found_before_anything_moves(mission, before, after, finding):
    with pytest.raises(InputError) as raised:
        prepare(mission(MISSION.replace(before, after)), RunOptions())
    assert finding in str(raised.value)


def test_an_edge_through_shelves_and_a_node_of_nobody_are_odd(mission):
    lines = [line.text for line in check_files([str(mission(across=("south", "east")))])]
    assert len(lines) == 1
    # from (1.5, 1.3) to (14.5, 8.7) the robot, 0.2 m to its side, touches shelf a at 3.0, 2.6
    assert "warning[W431] feature 4: the edge 'across' leads through shelf a at (" in lines[0]
    alone = [line.text for line in check_files([str(mission())])]
    assert "feature 2: the node 'south' has no edge" in alone[0]

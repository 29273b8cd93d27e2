"""Route graphs from GeoJSON: valid files, findings with positions, and never a traceback."""

import copy
import json
from math import inf

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missions.execution.resources import MISSIONS
from stack.errors import InputError, ParameterError
from stack.planning.routes.geojson import parse_route_graph, read_route_graph


def node(name, x, y):
    return {
        "type": "Feature",
        "geometry": {"type": "Point", "coordinates": [x, y]},
        "properties": {"id": name},
    }


def edge(id, start, end, points, **given):
    return {
        "type": "Feature",
        "geometry": {"type": "LineString", "coordinates": points},
        "properties": {"id": id, "from": start, "to": end, **given},
    }


def collection(*features):
    return {"type": "FeatureCollection", "features": list(features)}


SOUND = collection(
    node("a", 0, 0), node("b", 4, 0), node(3, 4, 3.0),
    edge("ab", "a", "b", [[0.02, 0], [2, 1], [4, 0]], speed=0.3, weight=2, one_way=True),
    edge("b3", "b", "3", [[4, 0], [4, 3]], speed="50 %", closed=True, name="the ramp"),
)  # fmt: skip


def parsed(data):
    return parse_route_graph(json.dumps(data), "g.geojson")


def findings(data):
    with pytest.raises(InputError) as raised:
        parse_route_graph(data if isinstance(data, str) else json.dumps(data), "g.geojson")
    return [str(item) for item in raised.value.findings]


def changed(*path, to):
    data = copy.deepcopy(SOUND)
    inner = data
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = to
    return data


def test_nodes_and_edges_with_their_rules():
    graph = parsed(SOUND)
    assert graph.nodes == {"a": (0.0, 0.0), "b": (4.0, 0.0), "3": (4.0, 3.0)}
    ab, b3 = graph.edges["ab"], graph.edges["b3"]
    assert (ab.start, ab.end, ab.weight, ab.one_way, ab.closed) == ("a", "b", 2.0, True, False)
    assert ab.line.points.tolist() == [[0.0, 0.0], [2.0, 1.0], [4.0, 0.0]]  # its end is moved
    assert (ab.limit(0.8), b3.limit(0.8), b3.closed, b3.feature) == (0.3, 0.4, True, 4)
    assert ab.limit(0.2) == inf  # no limit to a robot that is slower
    assert graph.warnings == ()


def test_an_edge_without_geometry_is_straight():
    graph = parsed(changed("features", 3, "geometry", to=None))
    assert graph.edges["ab"].line.length == 4.0


def test_a_nav2_edge_is_one_way_and_ignored_properties_are_named():
    data = changed("features", 4, "properties", to={
        "id": 7, "startid": "b", "endid": 3, "cost": 1.0, "metadata": {"speed_limit": 80},
    })  # fmt: skip
    data["features"][4]["geometry"] = {
        "type": "MultiLineString",
        "coordinates": [[[4, 0], [4, 3]]],
    }
    graph = parsed(data)
    assert graph.edges["7"].one_way
    assert [str(item) for item in graph.warnings] == [
        "g.geojson:1:1 warning[W430] feature 4: ignored: cost, metadata"
    ]


def nav2_edge(id, start, end, points, **given):
    made = edge(id, start, end, points, **given)
    properties = {"startid": start, "endid": end, **made["properties"]}
    properties = {key: value for key, value in properties.items() if key not in ("from", "to")}
    return {**made, "properties": properties}


@pytest.mark.parametrize(
    "points",
    [
        [[0, 0], [4, 3]], [[1, 0], [4, 0]], [[[0, 0], [4, 0]]], [], [[0, 0]], "0 0, 4 0",
        [[0, 0], ["4", 0]],
    ],
)  # fmt: skip
def test_a_line_that_nav2_does_not_read_is_a_straight_one(points):
    places = [node("a", 0, 0), node("b", 4, 0)]
    graph = parsed(collection(*places, nav2_edge(7, "a", "b", points)))
    assert graph.edges["7"].line.points.tolist() == [[0, 0], [4, 0]]
    assert [item.code for item in graph.warnings] == ["W430"]
    assert "feature 2" in str(graph.warnings[0])
    assert "a straight line is used" in str(graph.warnings[0])
    assert "E431" in findings(collection(*places, edge(7, "a", "b", points)))[0]


def test_equal_ids_of_nav2_edges_are_told_apart():
    graph = parsed(
        collection(
            node("a", 0, 0), node("b", 4, 0), nav2_edge(7, "a", "b", [[0, 0], [4, 0]]),
            nav2_edge(7, "b", "a", [[4, 0], [0, 0]]), nav2_edge(7, "a", "b", [[0, 0], [4, 0]]),
            nav2_edge("7_2", "b", "a", [[4, 0], [0, 0]]),
        )
    )  # fmt: skip
    assert {name: (e.start, e.end) for name, e in graph.edges.items()} == {
        "7": ("a", "b"), "7_2": ("b", "a"), "7_3": ("a", "b"), "7_2_2": ("b", "a"),
    }  # fmt: skip
    assert len(graph.warnings) == 3


def test_a_property_that_nav2_does_not_read_is_a_warning():
    odd = nav2_edge(7, "a", "b", [[0, 0], [4, 0]], fid=12)
    graph = parsed(collection(node("a", 0, 0), node("b", 4, 0), odd))
    assert "no property 'fid'; it is ignored" in str(graph.warnings[0])


def test_an_edge_is_closed_and_opened_in_a_copy():
    graph = parsed(SOUND)
    assert graph.with_edge("ab", closed=True).edges["ab"].closed
    assert not graph.edges["ab"].closed
    with pytest.raises(ParameterError, match="no edge 'abb'") as raised:
        graph.with_edge("abb", closed=True)
    assert raised.value.hint == "did you mean 'ab'?"


@pytest.mark.parametrize(
    ("data", "finding"),
    [
        ("[1,\n 2,", "g.geojson:2:4 error[E430] not JSON: Expecting value"),
        ("{}", "error[E430] not a GeoJSON FeatureCollection"),
        (collection(), "error[E430] the graph has no edge; add a LineString feature"),
        (changed("features", 0, to=5), "error[E431] feature 0: not a Feature"),
        (changed("features", 0, "geometry", "type", to="Polygon"),
         "error[E431] feature 0: its geometry is 'Polygon'; a node is a Point, an edge a"),
        (changed("features", 1, "properties", "id", to="a"),
         "error[E432] feature 1: feature 0 is also a node 'a'; rename one"),
        (changed("features", 4, "properties", "id", to="ab"),
         "error[E432] feature 4: feature 3 is also an edge 'ab'; rename one"),
        (changed("features", 3, "properties", "to", to="bb"),
         "error[E432] feature 3: `to`: there is no node 'bb'; did you mean 'b'?"),
        (changed("features", 3, "properties", "to", to=True),
         "error[E431] feature 3: `to`: expected a word or an integer, got True"),
        (changed("features", 3, "properties", "speed", to=-1),
         "error[E431] feature 3: speed: -1 m/s must be above 0 m/s"),
        (changed("features", 3, "properties", "speed", to="150 %"),
         "error[E431] feature 3: speed: 1.5 must be at most 1"),
        (changed("features", 3, "properties", "oneway", to=True),
         "error[E431] feature 3: there is no property 'oneway'; did you mean 'one_way'?"),
        (changed("features", 3, "geometry", "coordinates", to=[[4, 0], [0, 0]]),
         "error[E431] feature 3: the line begins at (4, 0), but its node 'a' is at (0, 0), 4.00 m"),
        (changed("features", 3, "geometry", "coordinates", to=[[0, 0], ["4", 0]]),
         "error[E431] feature 3: [[0, 0], ['4', 0]] is not a list of positions"),
        (changed("features", 0, "geometry", "coordinates", to=[1e9, 0]),
         "error[E431] feature 0: [1000000000.0, 0] is not a position"),
    ],
)  # fmt: skip
def test_mistakes_are_found_with_their_feature(data, finding):
    found = findings(data)
    assert any(finding in line for line in found), found


def test_all_mistakes_are_reported_at_once_with_their_lines():
    data = changed("features", 3, "properties", "speed", to="fast")
    data["features"][4]["properties"]["to"] = "c"
    text = json.dumps(data, indent=1)
    lines = [int(line.split(":")[1]) for line in findings(text)]
    begins = [n for n, line in enumerate(text.splitlines(), 1) if '"Feature"' in line]
    assert lines == [begins[3], begins[4]]


def test_a_missing_file_names_its_neighbour(tmp_path):
    (tmp_path / "office.geojson").write_text("{}")
    with pytest.raises(InputError, match=r"did you mean 'office\.geojson'"):
        read_route_graph(tmp_path / "ofice.geojson")


def test_a_node_without_edges_is_a_warning():
    data = collection(*SOUND["features"], node("alone", 9, 9))
    assert "the node 'alone' has no edge" in str(parsed(data).warnings[0])


def test_the_shipped_graphs_are_sound():
    for file in sorted((MISSIONS / "routes").glob("*.geojson")):
        assert read_route_graph(file).warnings == ()


JUNK = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=6),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=6), inner,
                                                                max_size=3),
    max_leaves=5,
)  # fmt: skip


@given(data=st.data())
@settings(deadline=None, max_examples=150)
def test_no_damage_to_a_file_makes_a_traceback(data):
    """Any value of a valid graph replaced by anything: it is read, or rejected with findings."""
    damaged = copy.deepcopy(SOUND)
    inner = damaged
    while True:
        keys = list(inner) if isinstance(inner, dict) else list(range(len(inner)))
        key = data.draw(st.sampled_from(keys))
        deeper = isinstance(inner[key], dict | list) and len(inner[key]) > 0
        if not deeper or data.draw(st.integers(0, 3)) == 0:
            break
        inner = inner[key]
    inner[key] = data.draw(JUNK)
    try:
        parse_route_graph(json.dumps(damaged), "g.geojson")
    except InputError as error:
        assert error.findings


@given(text=st.text(max_size=40) | st.binary(max_size=40).map(lambda b: b.decode("latin-1")),
       cut=st.integers(0, 700))  # fmt: skip
@settings(deadline=None, max_examples=100)
def test_no_text_makes_a_traceback(text, cut):
    whole = json.dumps(SOUND)
    for broken in (text, whole[:cut] + text + whole[cut:]):
        try:
            parse_route_graph(broken, "g.geojson")
        except InputError as error:
            assert error.findings

"""Shortest paths over arcs, held against trying every way there is."""

from itertools import pairwise, permutations
from math import inf

from hypothesis import given, settings
from hypothesis import strategies as st

from stack.planning.routes.search import Arc, cheapest, cheapest_looked_at

VERTICES = 6

ARCS = st.lists(
    st.tuples(st.integers(0, 5), st.integers(0, 5), st.integers(0, 9) | st.just(inf)),
    max_size=18,
)


def least_by_trying(costs):
    """The least cost from 0 to 1 over every order of vertices that visits none twice."""
    best = inf
    for count in range(VERTICES - 1):
        for between in permutations(range(2, VERTICES), count):
            way = (0, *between, 1)
            total = 0.0
            for start, end in pairwise(way):
                total += min((c for a, b, c in costs if (a, b) == (start, end)), default=inf)
            best = min(best, total)
    return best


@given(ARCS)
@settings(deadline=None, max_examples=100)
def test_the_cheapest_way_is_as_cheap_as_any(given_arcs):
    found = cheapest([Arc(a, b, float(c)) for a, b, c in given_arcs], 0, 1)
    least = least_by_trying(given_arcs)
    assert (found is None) == (least == inf)
    if found is not None:
        assert sum(arc.cost for arc in found) == least
        assert [arc.start for arc in found] == [0, *(arc.end for arc in found[:-1])]


@given(ARCS, st.lists(st.integers(0, 5) | st.just(inf), min_size=18, max_size=18),
       st.lists(st.booleans(), min_size=18, max_size=18))  # fmt: skip
@settings(deadline=None, max_examples=100)
def test_looking_late_finds_what_looking_at_everything_finds(given_arcs, extra, unsure):
    """Costs are a lower bound until they are looked at; the truth is that and `extra`."""
    arcs = [
        Arc(a, b, float(c), looked_at=not doubt)
        for (a, b, c), doubt in zip(given_arcs, unsure, strict=False)
    ]
    more = {id(arc): add for arc, add in zip(arcs, extra, strict=False)}
    truth = [
        (arc.start, arc.end, arc.cost + (0 if arc.looked_at else more[id(arc)])) for arc in arcs
    ]

    def look(arc):
        assert not arc.looked_at
        arc.looked_at, arc.cost = True, arc.cost + more[id(arc)]

    found = cheapest_looked_at(lambda: arcs, 0, 1, look)
    least = least_by_trying(truth)
    assert (found is None) == (least == inf)
    if found is not None:
        assert sum(arc.cost for arc in found) == least


def test_what_is_not_on_the_way_is_not_looked_at():
    near, far = Arc(0, 1, 1.0, looked_at=False), Arc(0, 1, 5.0, looked_at=False)
    looked = []

    def look(arc):
        looked.append(arc)
        arc.looked_at = True

    assert cheapest_looked_at(lambda: [far, near], 0, 1, look) == [near]
    assert looked == [near]

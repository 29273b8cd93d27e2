"""Shortest paths over arcs, compared with exhaustive search."""

from itertools import pairwise, permutations
from math import inf

from hypothesis import given, settings
from hypothesis import strategies as st

from stack.planning.routes.search import RouteArc, cheapest, cheapest_evaluated

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
def test_the_cheapest_path_costs_the_least_of_all(given_arcs):
    found = cheapest([RouteArc(a, b, float(c)) for a, b, c in given_arcs], 0, 1)
    least = least_by_trying(given_arcs)
    assert (found is None) == (least == inf)
    if found is not None:
        assert sum(arc.cost for arc in found) == least
        assert [arc.start for arc in found] == [0, *(arc.end for arc in found[:-1])]


@given(ARCS, st.lists(st.integers(0, 5) | st.just(inf), min_size=18, max_size=18),
       st.lists(st.booleans(), min_size=18, max_size=18))  # fmt: skip
@settings(deadline=None, max_examples=100)
def test_lazy_evaluation_finds_the_same_cost_as_full_evaluation(given_arcs, extra, unsure):
    """Costs are a lower bound until evaluated; the true cost adds `extra`."""
    arcs = [
        RouteArc(a, b, float(c), evaluated=not doubt)
        for (a, b, c), doubt in zip(given_arcs, unsure, strict=False)
    ]
    more = {id(arc): add for arc, add in zip(arcs, extra, strict=False)}
    truth = [
        (arc.start, arc.end, arc.cost + (0 if arc.evaluated else more[id(arc)])) for arc in arcs
    ]

    def evaluate(arc):
        assert not arc.evaluated
        arc.evaluated, arc.cost = True, arc.cost + more[id(arc)]

    found = cheapest_evaluated(lambda: arcs, 0, 1, evaluate)
    least = least_by_trying(truth)
    assert (found is None) == (least == inf)
    if found is not None:
        assert sum(arc.cost for arc in found) == least


def test_arcs_off_the_best_path_are_not_evaluated():
    near, far = RouteArc(0, 1, 1.0, evaluated=False), RouteArc(0, 1, 5.0, evaluated=False)
    evaluated = []

    def evaluate(arc):
        evaluated.append(arc)
        arc.evaluated = True

    assert cheapest_evaluated(lambda: [far, near], 0, 1, evaluate) == [near]
    assert evaluated == [near]

"""Factors and designs: values, bounds, and that a run depends on its number alone."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from itertools import product
from statistics import NormalDist

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missions.sweeps.design import Design, RunDescription, default_design
from missions.sweeps.factors import Factor, parts_of, read_factor
from stack.errors import InputError

SPEED = read_factor("controller.cruise_speed", "uniform(0.4, 0.8)")
USE = read_factor("controller.use", "pure_pursuit,mppi")


@pytest.mark.parametrize(
    ("text", "share", "value"),
    [
        ("uniform(0.4, 0.8)", 0.25, "0.5"),
        ("uniform(1 m, 2 m)", 0.5, "1.5 m"),
        ("loguniform(0.01, 1)", 0.5, "0.1"),  # the geometric mean
        ("normal(2, 0.5)", 0.5, "2"),  # the median
        ("normal(2, 0.5)", 0.0, "0.5"),  # cut at three deviations
        ("a,b,c", 0.34, "b"),
        ("a,b,c", 0.999, "c"),
    ],
)
def test_the_value_at_a_share(text, share, value):
    assert read_factor("x", text).at(share) == value


def test_whole_numbers_are_equally_likely():
    factor = replace(read_factor("x", "uniform(1, 4)"), whole=True)
    drawn = [factor.at(number / 400) for number in range(400)]
    assert [drawn.count(text) for text in ("1", "2", "3", "4")] == [100] * 4
    assert factor.typed("3") == 3


@pytest.mark.parametrize(
    ("text", "shares"),
    [
        # Φ((x ± ½ - 10) / 2) of a normal distribution that is cut half a number beyond 4 and 16
        ("normal(10, 2)", {"10": 0.1976, "12": 0.1211, "4": 0.0024}),
        # log((x + ½) / (x - ½)) / log(1000.5 / 0.5)
        ("loguniform(1, 1000)", {"1": 0.1445, "10": 0.0132}),
    ],
)
def test_whole_numbers_have_the_distribution_that_is_asked_for(text, shares):
    factor = replace(read_factor("x", text), whole=True)
    drawn = [factor.at((number + 0.5) / 20_000) for number in range(20_000)]
    for value, share in shares.items():
        assert drawn.count(value) / 20_000 == pytest.approx(share, abs=2e-4)
    assert {drawn[0], drawn[-1]} == {f"{end:.0f}" for end in factor.ends}


def test_a_cut_normal_distribution_has_its_quantiles():
    """By the definition of the truncated normal: F(x) = (Φ(x) - Φ(-3)) / (Φ(3) - Φ(-3))."""
    factor, normal = read_factor("x", "normal(0, 1)"), NormalDist()
    x = float(factor.at(0.9))
    assert (normal.cdf(x) - normal.cdf(-3)) / (normal.cdf(3) - normal.cdf(-3)) == pytest.approx(
        0.9, abs=1e-5
    )


@given(
    st.sampled_from(["uniform", "loguniform", "normal"]),
    st.floats(0.01, 10.0), st.floats(0.01, 10.0), st.floats(0.0, 1.0, exclude_max=True),
)  # fmt: skip
def test_no_value_is_beyond_the_ends(kind, low, more, share):
    factor = Factor("x", kind, (), low, more if kind == "normal" else low + more)
    first, last = factor.ends
    assert first <= float(factor.at(share)) <= last


@pytest.mark.parametrize(
    ("values", "typed"),
    [
        ("1,2,3", [1, 2, 3]), ("0.5,1", [0.5, 1.0]), ("5 s,7 s", [5, 7]), ("5 s,1 min", None),
        ("true,false", [True, False]), ("a,1", None),
    ],
)  # fmt: skip
def test_types_of_columns(values, typed):
    factor = read_factor("x", values)
    assert [factor.typed(text) for text in factor.values] == (typed or list(factor.values))


def test_commas_in_brackets_do_not_split():
    assert parts_of("[1, 2, 90 deg], dock") == ["[1, 2, 90 deg]", "dock"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("uniform(1)", "uniform has two numbers, got 1"),
        ("uniform(2, 1)", "2 is not below 1"),
        ("uniform(1 m, 2 s)", "m and s are different units"),
        ("uniform(a, 2)", "'a' is not a number"),
        ("loguniform(0, 1)", "0 of loguniform is not above 0"),
        ("normal(1, 0)", "the deviation 0 is not above 0"),
        ("gamma(1, 2)", "'gamma' is not a distribution"),
        ("a,a", "the value a is listed twice"),
        ("", "no values"),
    ],
)
def test_wrong_factors(text, words):
    with pytest.raises(InputError, match=words):
        read_factor("x", text)


def test_a_grid_meets_every_combination_with_every_seed():
    design = Design("grid", (read_factor("a", "1,2"), read_factor("b", "x,y,z")), 7, 12)
    runs = [design.run(number) for number in range(12)]
    once = [(("a", a), ("b", b)) for a, b in product("12", "xyz")]
    assert [run.settings for run in runs] == once * 2
    assert [run.seed for run in runs] == [7] * 6 + [8] * 6


def test_a_random_run_depends_on_its_number_alone():
    design = Design("random", (SPEED, USE), 3, 10)
    longer = replace(design, runs=1000)
    assert [design.run(n) for n in range(10)] == [longer.run(n) for n in reversed(range(10))][::-1]
    assert len({design.run(n).settings for n in range(10)}) == 10
    assert [design.run(n).seed for n in range(3)] == [3, 4, 5]
    assert design.run(0) != replace(design, seed=4).run(0)


def test_without_factors_only_the_seed_varies():
    assert Design("random", (), 5, 3).run(2) == RunDescription(2, 7)


def test_the_default_design():
    assert default_design((USE,)) == "grid"
    assert default_design((USE, SPEED)) == default_design(()) == "random"


@pytest.mark.parametrize("kind", ["latin", "sobol"])
def test_what_needs_scipy_says_so(kind, monkeypatch):
    monkeypatch.setattr("stack.optional_packages.find_spec", lambda _: None)
    words = (
        rf"{kind} needs the Python package scipy, which is not inst.*pip install 'treepilot\[sweep"
    )
    with pytest.raises(InputError, match=words):
        Design(kind, (SPEED,), 2, 4).run(0)


def shares(design: Design) -> np.ndarray:
    """Where in its range of 0 to 1 each run (rows) has each factor (columns)."""
    return np.array([
        [float(text) for _, text in design.run(number).settings] for number in range(design.runs)
    ])  # fmt: skip


def unit_design(kind: str, dimensions: int, seed: int, runs: int) -> Design:
    """A design whose factors are spread between 0 and 1."""
    factors = [read_factor(f"x{n}", "uniform(0, 1)") for n in range(dimensions)]
    return Design(kind, tuple(factors), seed, runs)


@settings(deadline=None, max_examples=25)
@given(st.integers(1, 5), st.integers(0, 2**40), st.integers(1, 60))
def test_each_stratum_of_a_latin_hypercube_has_one_point(dimensions, seed, runs):
    design = unit_design("latin", dimensions, seed, runs)
    strata = np.floor(shares(design) * runs).clip(max=runs - 1)
    assert (np.sort(strata, axis=0) == np.arange(runs)[:, None]).all()
    assert (shares(design) == shares(replace(design))).all()
    assert runs < 2 or (shares(design) != shares(replace(design, seed=seed + 1))).any()


@settings(deadline=None, max_examples=25)
@given(st.integers(1, 5), st.integers(0, 2**40), st.integers(0, 6))
def test_a_sobol_sequence_of_a_power_of_two_has_one_point_in_each_stratum(dimensions, seed, power):
    """Each of its dimensions is a (0, m, 1)-net (Sobol 1967). Further runs continue it."""
    runs = 2**power
    design = unit_design("sobol", dimensions, seed, runs)
    strata = np.floor(shares(design) * runs).clip(max=runs - 1)
    assert (np.sort(strata, axis=0) == np.arange(runs)[:, None]).all()
    assert (shares(replace(design, runs=runs + 3))[:runs] == shares(design)).all()
    assert (shares(design) != shares(replace(design, seed=seed + 1))).any()


@pytest.mark.parametrize("kind", ["latin", "sobol"])
def test_lists_and_whole_numbers_are_spread_evenly(kind):
    whole = replace(read_factor("n", "uniform(1, 4)"), whole=True)
    design = Design(kind, (USE, whole), 1, 16)
    runs = [dict(design.run(number).settings) for number in range(16)]
    assert Counter(run["controller.use"] for run in runs) == {"pure_pursuit": 8, "mppi": 8}
    assert Counter(run["n"] for run in runs) == {"1": 4, "2": 4, "3": 4, "4": 4}

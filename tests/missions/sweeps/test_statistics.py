"""Statistics of sweeps against published figures, closed forms and simulation."""

from __future__ import annotations

import re
from math import erfc, sqrt

import numpy as np
import pytest
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st

from missions.sweeps.claims import Decision, read_claim, read_condition
from missions.sweeps.report.charts import histogram
from missions.sweeps.row import SweepRow
from missions.sweeps.statistics import (
    groups_of,
    is_proved,
    mann_whitney,
    mcnemar,
    newcombe,
    sensitivities,
    wilcoxon,
)
from stack.errors import InputError


def rows(outcomes: str, **figures):
    """Rows by letters: s success, f failure, r refused."""
    words = {"s": "success", "f": "failure", "r": "refused"}
    return [SweepRow(n, n, {}, words[letter], **figures) for n, letter in enumerate(outcomes)]


def test_newcombe_has_the_published_interval():
    """56/70 and 48/80: 0.0524 to 0.3339 by method 10 (Newcombe 1998, table II, example a)."""
    assert newcombe((56, 70), (48, 80)) == pytest.approx((0.0524, 0.3339), abs=5e-5)


@given(st.lists(st.integers(-6, 6), min_size=8, max_size=40).filter(any))
def test_wilcoxon_is_the_one_of_scipy(differences):
    """Whole numbers have ties and zeros."""
    expected = scipy.stats.wilcoxon(
        differences, zero_method="wilcox", correction=True, method="approx"
    ).pvalue
    assert wilcoxon(differences) == pytest.approx(min(1.0, expected))


def test_mcnemar_is_the_binomial_test():
    """Of 9 discordant pairs 1 and 8: p = 2 (1 + 9) / 2^9."""
    assert mcnemar(1, 8) == mcnemar(8, 1) == pytest.approx(20 / 512)
    assert mcnemar(0, 0) == mcnemar(3, 3) == 1.0


def test_mcnemar_of_many_pairs():
    """2^1030 is no float. By the normal approximation with continuity: z = 29 / sqrt(1030)."""
    assert mcnemar(500, 530) == pytest.approx(erfc(29 / sqrt(1030) / sqrt(2)), rel=1e-3)
    assert 0.0 < mcnemar(0, 1030) < 1e-300


def test_mann_whitney_of_separate_samples():
    """All of 10 values above all of 10: U = 100, z = 49.5 / sqrt(100 · 21 / 12)."""
    share, p_value = mann_whitney(range(10, 20), range(10))
    assert share == 1.0 and p_value == pytest.approx(1.827e-4, rel=1e-3)
    assert mann_whitney([1.0] * 9, [1.0] * 9) == (0.5, 1.0)


@pytest.mark.parametrize("rate", [0.5, 0.9, 0.97])
def test_a_claim_is_rarely_wrong_however_often_it_is_looked_at(rate):
    """At the claimed rate itself, where any answer is an error, at most 5 % of 400 sweeps of 400
    runs get one; 5 % and three deviations of 400 draws are 8.3 %."""
    generator = np.random.default_rng(1)
    wrong = 0
    for _ in range(400):
        sums = np.cumsum(generator.random(400) < rate)
        wrong += any(is_proved(int(s), n, rate, 0.05) is not None for n, s in enumerate(sums, 1))
    assert wrong / 400 <= 0.083


def test_a_true_claim_is_proved_and_a_wrong_one_refuted():
    """Without a failure the mixture is ½ · ¾ · … (2n - 1) / 2n: 20 · 0.97ⁿ or more from n = 205."""
    assert is_proved(204, 204, 0.97, 0.05) is None and is_proved(205, 205, 0.97, 0.05) is True
    assert is_proved(5, 20, 0.97, 0.05) is False
    assert is_proved(0, 0, 0.97, 0.05) is None


def test_a_claim_counts_runs_in_their_order():
    """A missing run ends the sample: those after it may be over because they were short."""
    claim = read_claim("success > 50 % at 95 %")
    every = rows("s" * 12)
    assert claim.verdict(every) is True
    assert claim.verdict([*every[:3], *every[4:]]) is None
    assert claim.verdict(rows("r" + "s" * 12)) is True
    assert claim.verdict(rows("f" * 12)) is False
    assert claim.describe(every[:2]) == "success > 50 % at 95 %: not decided"


def test_a_decision_run_by_run_is_that_of_all_runs():
    """Whatever the order in which they end."""
    claim, every = read_claim("success > 50 % at 95 %"), rows("rfsss" + "s" * 20)
    decision = Decision(claim, every[7::-1])
    for count in range(8, 25):
        assert decision.verdict is claim.verdict(every[:count])
        decision.add(every[count])
    assert decision.verdict is True


@pytest.mark.parametrize(
    "text", ["success > 2 at 95 %", "time > 3 at 95 %", "success > 0.9", "success > 0.9 at 100 %"]
)
def test_wrong_claims(text):
    with pytest.raises(InputError, match=r"not a claim|between 0 and 1|not in"):
        read_claim(text)


@pytest.mark.parametrize(
    ("text", "holds"),
    [
        ("success < 0.8", True), ("success < 75 %", False), ("success <= 75 %", True),
        ("success.low > 0.3", True),  # Wilson of 3/4: 0.301 to 0.954
        ("success.low > 0.31", False), ("refused > 0", True), ("time > 11", False),
        ("clearance < 0.2", False), ("error > 0", True),  # no run has an error of its pose
    ],
)  # fmt: skip
def test_conditions(text, holds):
    assert read_condition(text).holds(rows("sssfr", seconds=10.0, clearance=0.2)) is holds


@pytest.mark.parametrize(
    "text",
    ["succes < 1", "success", "success = 1", "success < 1 or 2", "success < 95", "refused > 101 %"],
)
def test_wrong_conditions(text):
    with pytest.raises(InputError, match=r"not FIGURE|no figure|is from 0 to 1; write it as"):
        read_condition(text)


def test_groups_are_values_or_equally_many_runs():
    assert groups_of(["b", "a", "b"]) == [0, 1, 0]
    assert groups_of([3, 1, 3, 2]) == [2, 0, 2, 1]
    many = groups_of([float(number) for number in range(50)])
    assert [many.count(group) for group in range(5)] == [10] * 5


def test_the_factor_that_matters_comes_first():
    """y = a + noise of the same variance: a explains half of it, in five groups a little less."""
    generator = np.random.default_rng(2)
    a, b, noise = generator.normal(size=(3, 2000))
    found = sensitivities({"b": list(b), "a": list(a)}, list(a + noise))
    assert [one.factor for one in found] == ["a", "b"]
    assert found[0].share == pytest.approx(0.45, abs=0.04) and found[0].p_value < 0.01
    assert found[1].share < 0.01


@given(st.lists(st.floats(0.0, 1e4), min_size=1, max_size=5))
def test_each_value_is_in_a_bar_of_the_histogram(values):
    """Products of a step may be a rounding error above the lowest value, or below the highest."""
    page = histogram("time", "s", np.array(values), np.empty(0))
    counted = [int(count) for count in re.findall(r": (\d+) runs", page)]
    assert sum(counted) == len(values)

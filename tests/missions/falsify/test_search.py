"""The search on functions whose minimum is known, and the shrinking of what it finds."""

from math import hypot

import numpy as np
import pytest

from missions.falsify.search import Search
from missions.falsify.shrinking import Number, Shrinking


def runs_until_found(margin, dimensions, budget, seed):
    """How many points the search needs for a margin below 0; the budget + 1 if it finds none."""
    search, count = Search(dimensions, budget, seed), 0
    while points := search.ask(16):
        assert all(point.shape == (dimensions,) for point in points)
        assert all(((point >= 0.0) & (point < 1.0)).all() for point in points)
        margins = [margin(point) for point in points]
        search.tell(points, margins)
        count += len(points)
        if min(margins) < 0.0:
            return count
    assert count == budget
    return budget + 1


@pytest.mark.parametrize("seed", range(5))
def test_a_ball_of_a_thousandth_of_the_cube_is_found(seed):
    """Of radius 0.066 in three dimensions: 4/3 pi r^3 = 0.0012. By chance 200 points find it with
    a probability of 21 %."""

    def margin(point):
        return float(np.linalg.norm(point - (0.85, 0.2, 0.6))) - 0.066

    assert runs_until_found(margin, 3, 200, seed) <= 200


@pytest.mark.parametrize("seed", range(3))
def test_one_dimension(seed):
    """An interval of 0.004: 100 points by chance find it with a probability of 33 %."""
    assert runs_until_found(lambda point: abs(point[0] - 0.737) - 0.002, 1, 100, seed) <= 100


def test_another_valley_is_found_after_convergence_in_the_first():
    """A wide valley without a failure, and a narrow one with it."""

    def margin(point):
        wide = 0.2 + hypot(point[0] - 0.2, point[1] - 0.2)
        narrow = 4.0 * hypot(point[0] - 0.9, point[1] - 0.85) - 0.1
        return min(wide, narrow)

    found = [runs_until_found(margin, 2, 200, seed) for seed in range(8)]
    assert sum(count <= 200 for count in found) >= 7


def test_the_budget_is_kept_and_the_seed_decides():
    def points(seed):
        search, every = Search(2, 37, seed), []
        while batch := search.ask(8):
            search.tell(batch, [float(point.sum()) for point in batch])
            every += batch
        return np.array(every)

    assert points(1).shape == (37, 2)
    assert np.array_equal(points(1), points(1)) and not np.array_equal(points(1), points(2))


def number(name, text):
    try:
        return Number(float(text), default={"a.x": 1.0}.get(name, 0.0))
    except ValueError:
        return None


def shrunk(settings, fails, budget):
    tries = Shrinking(number, budget).shrink(settings)
    try:
        tried = next(tries)
        while True:
            tried = tries.send(fails(tried))
    except StopIteration as end:
        return end.value


def test_only_what_matters_is_left():
    """It fails with the push at a strength above 0.3 and a.x above 2; nothing else matters."""
    tried = []

    def fails(settings):
        tried.append(settings)
        push = float(settings.get("fault.push.left", 0.1)) if "push" in settings["faults"] else 0
        return push > 0.3 and float(settings.get("a.x", 1.0)) > 2.0

    settings = {
        "a.x": "8.8137", "a.y": "3", "faults": "gyro_bias+push+kidnap", "a.use": "mppi",
        "fault.push.left": "0.91234", "fault.kidnap.at": "3", "fault.gyro_bias.bias": "1",
    }  # fmt: skip
    found = shrunk(settings, fails, 60)
    assert found.keys() == {"a.x", "faults", "fault.push.left"} and found["faults"] == "push"
    # four halvings of 1 to 8.8 end 0.49 above 2 at most, those of 0 to 0.91 0.06 above 0.3;
    # then two digits
    assert 2.0 < float(found["a.x"]) <= 2.5 and 0.3 < float(found["fault.push.left"]) <= 0.36
    assert len(found["a.x"]) <= 3 and fails(found) and len(tried) <= 30


def test_shrinking_keeps_its_budget():
    calls = []
    settings = {"a.x": "3", "a.y": "4", "faults": "push+kidnap"}
    assert shrunk(settings, lambda tried: bool(calls.append(tried)), 3) == settings
    assert len(calls) == 3

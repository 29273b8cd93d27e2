"""The speed on the screen, with a wall clock that the test sets."""

import pytest

from stack.runtime.pace_meter import PaceMeter


class Clocks:
    """A wall clock, a robot's clock and the meter between them."""

    def __init__(self) -> None:
        self.wall = self.time = 0.0
        self.meter = PaceMeter(lambda: self.wall)

    def run(self, seconds: float, factor: float, held: bool = False) -> None:
        """Let wall seconds pass in steps of 50 ms."""
        for _ in range(round(seconds / 0.05)):
            self.wall += 0.05
            self.time += 0.05 * factor
            self.meter.advance(self.time, held)


@pytest.fixture
def clocks() -> Clocks:
    return Clocks()


def test_before_the_first_step_it_is_zero(clocks):
    assert clocks.meter.factor == 0.0


def test_it_follows_a_change_of_speed_within_five_seconds(clocks):
    clocks.run(60.0, 1.0)
    assert clocks.meter.factor == pytest.approx(1.0)
    clocks.run(2.5, 8.0)
    # Of the last 5 s half were at 1 and half at 8; a sample more or less is 0.1 s.
    assert clocks.meter.factor == pytest.approx(4.5, abs=0.2)
    clocks.run(2.7, 8.0)
    assert clocks.meter.factor == pytest.approx(8.0)


@pytest.mark.parametrize("factor", [0.0, 1.0], ids=["frozen", "a real robot"])
def test_a_hold_leaves_it_as_it_was(clocks, factor):
    clocks.run(10.0, 2.0)
    clocks.run(600.0, factor, held=True)
    assert clocks.meter.factor == pytest.approx(2.0)
    clocks.run(1.0, 2.0)
    assert clocks.meter.factor == pytest.approx(2.0)


def test_seconds_pass_at_any_speed_without_growing_memory(clocks):
    clocks.run(100.0, 30.0)
    assert len(clocks.meter._samples) <= 53

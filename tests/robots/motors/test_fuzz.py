"""Random and mutated frames: no crash, and no command that the brain has not given."""

from tests.robots.motors.fuzz import fuzz


def test_20_000_random_and_mutated_frames():
    happened = fuzz(20_000)
    assert happened["frames"] >= 20_000
    assert happened["stopped"] > 0.1 * happened["cycles"]
    assert happened["fast"] > 0.4 * happened["cycles"]
    assert happened["ignored"] > 5_000

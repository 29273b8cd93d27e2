"""Fixtures of simulated robots."""

import pytest

from robots.simulated import SimulatedBody
from stack.types import Pose2D
from tests.stack.sim.sim_rover import EMPTY, ROVER


@pytest.fixture
def build():
    """Makes simulated robots, which are closed at the end of the test."""
    made = []

    def make(description=ROVER, world=EMPTY, start=Pose2D(0.0, 0.0), seed=1, pace=0.0):
        made.append(SimulatedBody(description, world, start=start, seed=seed))
        made[-1].pace = pace
        return made[-1]

    yield make
    for body in made:
        body.close()

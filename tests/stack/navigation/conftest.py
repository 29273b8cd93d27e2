import pytest

from stack.types import Pose2D
from tests.stack.navigation.toy_drive import ToyDrive
from tests.stack.navigation.toy_world import ToyWorld, robot, room


@pytest.fixture
def make():
    """make(world=…, **settings): toy drives that let go of their planner's thread at the end."""
    made = []

    def build(world=None, **settings):
        world = world or ToyWorld(room(8, 6), robot(), Pose2D(1.0, 3.0))
        made.append(ToyDrive(world, **settings))
        return made[-1]

    yield build
    for drive in made:
        drive.navigator.close()

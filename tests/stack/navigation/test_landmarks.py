"""Names of places and doors in sentences."""

import pytest

from stack.navigation.landmarks import Doorway, Landmarks
from stack.types import Pose2D

MARKS = Landmarks(
    {"west": Pose2D(1.0, 2.0), "east": Pose2D(9.0, 2.0), "attic": Pose2D(40.0, 2.0)},
    [Doorway("gate", (5.0, 1.0), (5.0, 3.0))],
)


def test_a_pose_of_a_place_has_its_name():
    assert MARKS.name(Pose2D(1.0, 2.0, 1.0)) == "'west' (1.00, 2.00)"
    assert MARKS.name(Pose2D(1.1, 2.0)) == "(1.10, 2.00)"


@pytest.mark.parametrize(
    ("at", "around"),
    [((4.0, 2.0), "between 'west' and 'east'"), ((0.5, 2.0), "near 'west'"), ((25.0, 2.0), "")],
)
def test_a_point_is_between_two_places_or_near_one(at, around):
    assert MARKS.around(at) == around


@pytest.mark.parametrize(
    ("x", "y", "is_door"), [(5.2, 2.0, True), (5.4, 2.0, False), (5.0, 3.2, True)]
)
def test_what_stands_in_a_doorway_is_the_door(x, y, is_door):
    what = "the door 'gate'" if is_door else "something that is not on the map"
    assert MARKS.obstacle((x, y)) == what


def test_without_names_there_are_only_positions():
    assert Landmarks().where((1.0, 2.0)) == "(1.00, 2.00)"


def test_positions_of_known_poses_in_a_sentence_get_the_names_of_their_places():
    sentence = "goal (9.00, 2.00) is in an occupied cell; the nearest free place is (8.40, 2.00)"
    poses = (Pose2D(1.0, 2.0), Pose2D(9.0, 2.0, 1.0), Pose2D(9.0, 2.0))
    assert MARKS.named(sentence, poses) == (
        "goal 'east' (9.00, 2.00) is in an occupied cell; the nearest free place is (8.40, 2.00)"
    )

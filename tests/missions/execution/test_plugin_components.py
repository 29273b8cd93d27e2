"""Goal checkers, and classes without a base class, from the plugins of a mission."""

import pytest

from missions.execution.prepare import RunOptions, prepare
from missions.inspection.listing import description_of, installed, rows_of
from stack.components import DriveState
from stack.errors import InputError
from stack.types import Pose2D
from tests.stack.navigation.toy_world import robot

PLUGIN = '''
from dataclasses import dataclass

from stack.components import GoalChecker
from stack.parameters import parameter


class NearEnough(GoalChecker):
    """Reached within a radius, whatever the heading."""

    @dataclass(frozen=True)
    class Parameters:
        """The radius."""

        radius: float = parameter(0.5, "m", above=0.0, help="radius around the goal")

    def set_goal(self, goal, tolerance):
        self.goal = goal

    def reached(self, state):
        return state.pose.distance_to(self.goal) <= self.parameters.radius


class NoBase:
    """A controller whose author forgot the base class."""

    @dataclass(frozen=True)
    class Parameters:
        """None."""

    def set_segment(self, segment):
        self.segment = segment

    def step(self, state):
        raise NotImplementedError
'''
MISSION = """mission: near
robot: scout
world: small_room
plugins: [./plugins]
navigation: {NAVIGATION}
run:
  navigate_to_pose: {goal: [1.2, 2.8, 90 deg]}
"""


@pytest.fixture
def mission(tmp_path):
    (tmp_path / "plugins").mkdir()
    (tmp_path / "plugins" / "near.py").write_text(PLUGIN, "utf-8")

    def write(navigation):
        path = tmp_path / "near.yaml"
        path.write_text(MISSION.replace("{NAVIGATION}", navigation), "utf-8")
        return path

    return write


def test_a_goal_checker_of_a_plugin_is_chosen_by_its_name(mission):
    path = mission("{goal_checker: {use: near_enough, radius: 80 cm}}")
    choices = prepare(path, RunOptions()).choices
    assert choices["progress_checker"].name == "pose_progress"
    checker = choices["goal_checker"].create(robot())
    checker.set_goal(Pose2D(1.0, 1.0), None)
    for x, reached in ((1.7, True), (1.9, False)):
        assert checker.reached(DriveState(0.0, Pose2D(x, 1.0), False, 0.0)) == reached
    assert "near_enough" in dict(rows_of("goal_checkers", installed(str(path))))


@pytest.mark.parametrize(
    ("navigation", "sentence"),
    [
        ("{controller: no_base}", "it does not inherit treepilot.Controller; "
                                  "write `class NoBase(Controller):`"),
        ("{goal_checker: near}", "there is no goal checker 'near'"),
    ],
)  # fmt: skip
def test_what_does_not_fit_says_what_to_write(mission, navigation, sentence):
    with pytest.raises(InputError) as caught:
        prepare(mission(navigation), RunOptions())
    assert sentence in str(caught.value)


def test_checkers_are_described_with_their_parameters():
    text = description_of("pose_progress", installed(), expert=True)
    assert "angle" in text and "distance" in text and "default 8 s" in text

"""Words of other tools: each has a hint, and the hint names what exists here."""

import re

import pytest

from behaviours.catalogue import find_behaviours
from missions.inspection.diagnosis import findings_of
from missions.language.foreign_words import MODIFIERS as WORDS
from missions.language.foreign_words import node_meaning, plain
from missions.language.keys import MODIFIERS
from missions.language.kinds import node_types
from missions.language.sections import SECTIONS

KNOWN = node_types(find_behaviours())
KEYS = {word for section in SECTIONS.values() for word in section}

BEHAVIOR_TREE_CPP = """
Sequence SequenceWithMemory ReactiveSequence AsyncSequence Fallback ReactiveFallback AsyncFallback
Parallel ParallelAll IfThenElse WhileDoElse Switch2 Switch3 Inverter ForceSuccess ForceFailure
Repeat RetryUntilSuccessful KeepRunningUntilFailure Delay RunOnce Timeout LoopInt LoopDouble
LoopString Precondition SkipUnlessUpdated WaitValueUpdate EntryUpdated AlwaysSuccess AlwaysFailure
SetBlackboard UnsetBlackboard Script ScriptCondition Sleep SubTree
""".split()
NAV2 = """
PipelineSequence RoundRobin RecoveryNode RateController DistanceController SpeedController
GoalUpdatedController PathLongerOnApproach SingleTrigger GoalUpdater ComputePathToPose
ComputePathThroughPoses ComputeRoute FollowPath NavigateToPose NavigateThroughPoses FollowWaypoints
Spin BackUp Wait DriveOnHeading AssistedTeleop ClearEntireCostmap ClearCostmapAroundRobot
ClearCostmapExceptRegion SmoothPath TruncatePath TruncatePathLocal PlannerSelector
ControllerSelector SmootherSelector GoalCheckerSelector ProgressCheckerSelector
ReinitializeGlobalLocalization RemovePassedGoals GoalReached GoalUpdated IsStuck IsBatteryLow
IsBatteryCharging IsPathValid InitialPoseReceived TransformAvailable TimeExpired DistanceTraveled
PathExpiringTimer AreErrorCodesPresent WouldAPlannerRecoveryHelp WouldAControllerRecoveryHelp
DockRobot UndockRobot FollowObject
""".split()

PY_TREES = """
Sequence Selector Parallel Repeat Retry EternalGuard Timeout OneShot Inverter FailureIsSuccess
SuccessIsFailure Condition PassThrough ForEach Failure UnsetBlackboardVariable SetBlackboardVariable
CheckBlackboardVariableExists CheckBlackboardVariableValue CheckBlackboardVariableValues
CompareBlackboardVariables WaitForBlackboardVariable WaitForBlackboardVariableValue Timer
""".split()


@pytest.mark.parametrize("word", [*BEHAVIOR_TREE_CPP, *NAV2, *PY_TREES])
def test_every_node_of_the_other_tools_has_a_meaning_here(word):
    assert node_meaning(word, KNOWN)


@pytest.mark.parametrize(
    ("word", "hint"),
    [
        ("ComputePathToPose", "did you mean 'compute_path'?"),
        ("Inverter", "write `invert: true` beside the node"),
        ("ForceFailure", "write `on_failure: continue` beside the node, and `fail` behind it"),
        ("NavigateToPose", "did you mean 'navigate_to_pose'?"),
        ("GoTo", "did you mean 'navigate_to_pose'?"),
        ("go_to", "did you mean 'navigate_to_pose'?"),
        ("UndockRobot", "did you mean 'undock'?"),
        ("Delay", "did you mean 'wait'?"),
        ("Selector", "did you mean 'fallback'?"),
        ("PassThrough", "leave it out, or write `name: …` beside the node"),
        ("press_button", ""),
    ],
)
def test_the_meaning_of_a_word(word, hint):
    assert node_meaning(word, KNOWN) == hint


def test_the_tables_name_what_exists():
    named = {(word, one) for word, text in WORDS.items() for one in re.findall(r"`(\w+)", text)}
    assert {(word, one) for word, one in named if one not in {*KNOWN, *MODIFIERS, *KEYS}} == set()


def test_the_tables_have_no_word_that_is_found_without_them():
    """A word that exists here, in another spelling, needs no entry; a wrong one would hide it."""
    ours = {plain(word) for word in KNOWN}
    others = [plain(word) for names in KNOWN.values() for word in names]
    assert not ours & {*others, *WORDS}
    assert len(set(others)) == len(others), "two nodes claim one word"
    assert set(WORDS) == {plain(word) for word in WORDS}


def test_the_names_of_a_plugin_are_hints_too(tmp_path):
    """Whoever writes a behaviour states its names elsewhere; no table has to learn them."""
    (tmp_path / "grippers.py").write_text(
        "from behaviours.base import RobotBehaviour\n\n\n"
        "class Grasp(RobotBehaviour):\n    '''Close the gripper.'''\n\n"
        "    also_known_as = ('PressButton',)\n\n    def update(self): ...\n"
    )
    known = node_types(find_behaviours(["./grippers.py"], tmp_path))
    assert node_meaning("press_button", known) == "did you mean 'grasp'?"


@pytest.mark.parametrize(
    ("node", "expected"),
    [
        ("navigate_to_pos: [1, 2]", ["E121"]),  # resembles a behaviour
        ("Selector: []", ["E121"]),  # a word of another tool with a node here
        ("if: []", ["E121"]),  # with a modifier here
        ("ForceFailure: []", ["E121"]),
        ("other: {}", ["E121"]),  # a tree of the file
        ("press_button: {}", ["W115"]),  # may be a behaviour of a mission's plugin
        ("grippers.Close: {}", ["W115"]),
    ],
)
def test_a_file_of_trees_reports_unknown_words(tmp_path, node, expected):
    file = tmp_path / "trees.yaml"
    file.write_text(f"trees:\n  a: {{do: {{{node}}}}}\n  other: {{do: {{say: hello}}}}\n")
    assert [item.code for item in findings_of(file)] == expected

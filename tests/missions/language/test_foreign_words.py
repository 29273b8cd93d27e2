"""Words of other tools: each has a hint, and the hint names what exists here."""

import re

import pytest

from behaviours.catalogue import find_behaviours
from missions.inspection.diagnosis import findings_of
from missions.language.foreign_words import MODIFIERS as WORDS
from missions.language.foreign_words import NODES as OTHER_NODES
from missions.language.foreign_words import node_meaning, plain
from missions.language.keys import MODIFIERS
from missions.language.kinds import NODES
from missions.language.sections import SECTIONS

KNOWN = [*NODES, *find_behaviours().names()]
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


@pytest.mark.parametrize("word", [*BEHAVIOR_TREE_CPP, *NAV2])
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
        ("close_gripper", ""),
    ],
)
def test_the_meaning_of_a_word(word, hint):
    assert node_meaning(word, KNOWN) == hint


def test_the_tables_name_what_exists():
    assert set(OTHER_NODES.values()) <= set(KNOWN)
    named = {(word, one) for word, text in WORDS.items() for one in re.findall(r"`(\w+)", text)}
    assert {(word, one) for word, one in named if one not in {*KNOWN, *MODIFIERS, *KEYS}} == set()


def test_the_tables_have_no_word_that_is_found_without_them():
    """A word that exists here, in another spelling, needs no entry; a wrong one would hide it."""
    ours = {plain(word) for word in KNOWN}
    assert not ours & {*OTHER_NODES, *WORDS}
    assert {*OTHER_NODES, *WORDS} == {plain(word) for word in (*OTHER_NODES, *WORDS)}


@pytest.mark.parametrize(
    ("node", "expected"),
    [
        ("navigate_to_pos: [1, 2]", ["E121"]),  # resembles a behaviour
        ("Selector: []", ["E121"]),  # a word of another tool with a node here
        ("if: []", ["E121"]),  # with a modifier here
        ("ForceFailure: []", ["E121"]),
        ("other: {}", ["E121"]),  # a tree of the file
        ("close_gripper: {}", []),  # may be a behaviour of a mission's plugin
        ("grippers.Close: {}", []),
    ],
)
def test_a_file_of_trees_reports_unknown_words_with_a_meaning(tmp_path, node, expected):
    file = tmp_path / "trees.yaml"
    file.write_text(f"trees:\n  a: {{do: {{{node}}}}}\n  other: {{do: {{say: hello}}}}\n")
    assert [item.code for item in findings_of(file)] == expected

"""`treepilot schema`: the page is complete and short; drafts are mended by what `check` says."""

from __future__ import annotations

from pathlib import Path

import pytest

from missions.execution.prepare import diagnose
from missions.execution.resources import load_world
from missions.inspection.drafting.prompt import examples, page
from missions.inspection.listing import installed
from missions.language.kinds import NODES
from missions.language.reading.words import Draft
from tests.missions.inspection.drafts import DRAFTS, OTHERS, text_of
from tests.missions.inspection.repairer import findings_of, rounds

MOST_TOKENS = 6000
CHARACTERS_OF_A_TOKEN = 3.6
"""Of English with code, in the tokenizers of today's models: 3.5 to 4."""


@pytest.fixture(scope="module")
def prompt():
    return page(installed())


def test_the_prompt_is_short(prompt):
    assert len(prompt) / CHARACTERS_OF_A_TOKEN < MOST_TOKENS


def test_the_prompt_has_the_words_of_the_language(prompt):
    known = installed()
    for word in NODES:
        assert f"\n- {word}: " in prompt
    shown = {name for name in known.catalogue.names() if f"\n- {name}(" in prompt}
    missing = {*known.catalogue.names()} - shown
    assert missing == {  # the scout has no arm
        "close_gripper", "detect_blocks", "home_arm", "look_at", "move_arm", "open_gripper", "pick",
        "place",
    }  # fmt: skip
    assert "navigate_to_pose(goal: Pose, tolerance: m = none" in prompt
    assert "desk_a       [1.9, 2.2, 180 deg]" in prompt


def test_another_robot_has_other_behaviours():
    text = page(installed(), "fetcher", "pantry", prompt=False)
    assert "\n- pick(" in text
    assert "# Robot fetcher" in text and "# World pantry" in text
    assert "Markdown" not in text


@pytest.mark.parametrize(
    ("robot", "world"),
    [("scout", "office"), ("glide", "warehouse"), ("buggy", "car_park"), ("scout", "small_room")],
)
def test_its_examples_check_clean(tmp_path, robot, world):
    places = load_world(world, Path()).places
    for text in examples(robot, world, places):
        findings = diagnose(tmp_path / "example.yaml", None, Draft(text)).findings
        assert [str(one) for one in findings] == []


def test_each_draft_has_a_mistake(tmp_path):
    for name in DRAFTS:
        file = tmp_path / "draft.yaml"
        file.write_text(text_of(name))
        assert findings_of(file), name
    assert len(DRAFTS) == 50


def test_drafts_are_mended_by_what_the_findings_say(tmp_path):
    """By a repairer without understanding, in one or two rounds."""
    took = {name: rounds(text_of(name), tmp_path / "draft.yaml") for name in DRAFTS}
    assert [name for name, count in took.items() if count is None or count > 2] == []


def test_so_are_most_drafts_that_nobody_had_looked_at(tmp_path):
    took = {name: rounds(text_of(name), tmp_path / "draft.yaml") for name in OTHERS}
    mended = [name for name, count in took.items() if count is not None and count <= 2]
    assert len(mended) >= 0.8 * len(OTHERS)


def test_two_mistakes_take_two_rounds(tmp_path):
    """Each draft inside Markdown and with a sentence before it."""
    for name in list(DRAFTS)[4:]:
        text = f"Here is a mission for the robot.\n\n```yaml\n{text_of(name)}```\n\nDone.\n"
        count = rounds(text, tmp_path / "draft.yaml")
        assert count is not None and count <= 3, name

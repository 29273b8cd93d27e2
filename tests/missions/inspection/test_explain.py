"""`treepilot explain`: every code has a cause and a fix, and examples do what they say."""

import re
from pathlib import Path

import pytest

from missions.inspection.explain import every_code, explanation
from missions.language.codes import CODES
from stack.errors import InputError
from stack.types import FailureCode
from tests.missions.mission_fakes import read_text

ROOT = Path(__file__).parents[3]


def test_every_code_that_the_sources_speak_of_is_explained():
    spoken = {
        code
        for package in ("missions", "stack", "robots")
        for file in (ROOT / package).rglob("*.py")
        for code in re.findall(r'"([EW]\d{3})"', file.read_text())
    }
    assert spoken - set(every_code()) == set()


def test_an_explanation_has_cause_example_and_fix():
    assert explanation("e112").splitlines() == [
        "E112 (error): event",
        "",
        "cause    an event is `name: {when, hold, do, then}`; a key is missing or invalid",
        "example  events: [{lost: {when: localisation.health < 0.3}}]",
        "fix      add `when` and `do`; `then` is resume, restart or abort",
    ]
    assert explanation("W107").startswith("W107 (warning): ")
    assert explanation("W208").startswith("W208 (warning): ")  # as `check` reports it


def test_the_code_of_a_failure_is_explained_with_the_behaviours_that_have_it():
    assert explanation("missed").splitlines() == [
        "MISSED (failure)",
        "",
        "cause    the fingers have closed on nothing, or the hand holds no block",
        "fix      detect the blocks again",
        "from     close_gripper, pick, place",
    ]
    for code in FailureCode:
        assert explanation(code).startswith(f"{code} (failure)\n\ncause    ")
        assert code.meaning and code.remedy and FailureCode(str(code)) is code


def test_an_unknown_code_names_the_nearest():
    with pytest.raises(InputError, match=r"did you mean 'E16[0-9]'"):
        explanation("E1600")


OUTSIDE = {
    "E109", "E110", "E111", "E114", "E116", "E126", "E127", "E180", "E181", "E182", "E183", "E184",
    "W110", "W111", "W112", "W113", "W114", "W140", "W141", "W142", "W143", "W144", "W145", "W146",
    "W115", "W147", "W148", "W149", "W150", "W151", "W152",
}  # fmt: skip
"""Codes that need options, other files, a world, a robot or an installation to provoke."""
NEEDS = {
    "E141": "arguments: {dwell: {type: duration, default: 3 s}}",
    "E134": "blackboard: {photo: {type: path, initial: a}}",
    "E135": "blackboard: {photo: {type: path, initial: a}}",
    "E142": "places: {dock: [1, 2]}",
    "E143": "blackboard: {photo: {type: path, optional: true}}",
    "E168": "places: {dock: [1, 2]}\nblackboard: {n: {type: float, optional: true}}",
    "W104": "places: {dock: [1, 2]}",
    "W134": "places: {dock: [1, 2]}",
    "E150": "blackboard: {n: {type: int, initial: 0}}",
}


@pytest.mark.parametrize("code", sorted(set(CODES) - OUTSIDE))
def test_the_example_of_a_code_provokes_it(tmp_path, code):
    parts = [CODES[code].example, NEEDS.get(code, "")]
    if "run:" not in parts[0]:
        parts.append("run: {say: hello}")
    try:
        found = read_text(tmp_path, "\n".join(parts)).warnings
    except InputError as error:
        found = error.findings
    assert code in {item.code for item in found}

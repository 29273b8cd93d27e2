"""`treepilot test`: mocks, the clock, changes, expectations, coverage and output."""

import dataclasses
from pathlib import Path
from textwrap import dedent

import pytest

from missions.language.model import Resources
from missions.language.reading.mission import read_mission
from missions.testing.session import Options, run_file, run_files
from tests.missions.mission_fakes import CATALOGUE, HEAD

SAMPLE = Path(__file__).with_name("shelf_patrol.yaml")
SETTINGS = Options(catalogue_for=lambda *_: CATALOGUE, resources=Resources())
MISSION = """
places: {dock: [0, 0]}
arguments: {rounds: {type: int, default: 1}}
blackboard: {n: {type: int, initial: 0}, photo: {type: path, optional: true}}
events:
  - low: {when: battery.charge < 0.3, do: {use: charge}}
run:
  sequence:
    - sequence:
        - {navigate_to_pose: $dock, name: drive out, timeout: 60 s}
        - {take_photo: {}, out: {image: $photo}, retry: {attempts: 2, delay: 1 s}}
        - set: {n: $n + 1}
      repeat: $rounds
    - {spin: 90 deg, when: $n > 5}
trees:
  charge: {do: {sequence: [{navigate_to_pose: $dock}, {wait_until: battery.charge > 0.8}]}}
"""


@pytest.fixture
def run(tmp_path):
    def run_case(case, **wanted):
        file = tmp_path / "mission.yaml"
        indented = "".join(f"    {line}\n" for line in dedent(case).strip().splitlines())
        file.write_text(f"{MISSION}{HEAD}tests:\n  - name: it\n{indented}")
        return run_file(file, dataclasses.replace(SETTINGS, **wanted)).results[0]

    return run_case


def problems(result):
    return [(item.what, item.expected, item.got) for item in result.problems]


def test_the_sample_mission_of_the_language_has_no_errors_and_its_tests_pass():
    session = run_files([str(SAMPLE)], Options(resources=Resources()))
    assert session.exit_code == 0
    assert "1 passed" in session.text
    # 10 s to the first shelf, interrupted at 4 s, back on the way at 60 s, the photograph fails
    # once: 60 + 10 + 3 + 0.5 s, then 10 + 3 s to the second.
    file = run_file(SAMPLE, Options(resources=Resources()))
    assert file.results[0].seconds == pytest.approx(86.5, abs=0.5)
    assert [item.code for item in file.mission.warnings] == []


def test_behaviours_of_the_robot_are_mocked_and_the_others_run(run):
    result = run("expect: {status: success, n: 1, ran: {drive out: 1, set: 1, spin: 0}}")
    assert problems(result) == []
    assert result.seconds == 0.0


def test_mocks_take_time_fail_in_turn_and_set_outputs(run):
    result = run("""
        mock:
          drive out: {takes: 12 s}
          take_photo: {returns: [failure, success], takes: 500 ms, sets: {image: a.jpg}}
        expect: {status: success, photo: a.jpg, ran: {take_photo: 2}, order: [drive out, set]}
        """)
    assert problems(result) == []
    # 12 s, 0.5 s, a second's delay, 0.5 s
    assert result.seconds == pytest.approx(14.0, abs=0.05)


def test_a_mock_fails_with_a_code(run):
    result = run("""
        mock: {navigate_to_pose: NO_VALID_PATH}
        expect: {status: failure, failure: NO_VALID_PATH, ran: {set: 0}}
        """)
    assert problems(result) == []


def test_a_mock_that_never_ends_runs_into_the_time_limit(run):
    result = run("""
        mock: {drive out: running}
        expect: {failure: TIMED_OUT}
        """)
    assert problems(result) == []
    assert result.seconds == pytest.approx(60.0)


def test_trees_can_be_mocked(run):
    result = run("""
        mock: {charge: {takes: 5 s}, drive out: {takes: 2 s}}
        at: {1 s: {battery.charge: 0.1}, 3 s: {battery.charge: 1}}
        expect: {status: success, ran: {charge: 1, drive out: 2, wait_until: 0}}
        """)
    assert problems(result) == []
    assert result.seconds == pytest.approx(8.0, abs=0.05)  # 1 + 5 + 2


def test_real_leaves_a_behaviour_as_it_is(run):
    result = run("mock: {take_photo: real}\nexpect: {failure: NO_IMAGE, ran: {take_photo: 2}}")
    assert problems(result) == []
    # No camera in a test: twice 2 s of patience, a second's delay between them.
    assert result.seconds == pytest.approx(5.0, abs=0.05)


def test_values_keys_and_events_come_at_their_time(run):
    result = run("""
        mock: {drive out: {takes: 5 s}}
        at: {1 s: {event: low, $n: 3, battery.charge: 50 %}, 4: {battery.charge: 0.9}}
        expect: {status: success, $n: 4, ran: {low: 1}, order: [drive out, low, set]}
        """)
    assert problems(result) == []


def test_arguments_are_given_as_the_mission_declares_them(run):
    assert problems(run("arguments: {rounds: 3}\nexpect: {n: 3, ran: {drive out: 3}}")) == []


def test_within_limits_the_mission_or_each_run(run):
    mock = "mock: {drive out: {takes: 5 s}}\n"
    assert problems(run(f"{mock}expect: {{within: 6 s}}")) == []
    assert problems(run(f"{mock}expect: {{within: 3 s}}")) == [("within", "3 s", "still running")]
    assert problems(run(f"{mock}expect: {{within: {{drive out: 4 s}}}}")) == [
        ("within drive out", "4 s", "5 s")
    ]
    assert problems(run(f"{mock}expect: {{status: running, within: 3 s}}")) == []


@pytest.mark.parametrize(
    ("expect", "problem"),
    [
        ("{status: failure}", ("status", "failure", "success")),
        ("{failure: LOST}", ("failure", "LOST", "none, success")),
        ("{n: 2}", ("$n", "2", "1")),
        ("{photo: a.jpg}", ("$photo", "'a.jpg'", "not set")),
        ("{ran: {set: 3}}", ("ran set", "3 times", "1")),
        ("{ran: {set: [2, 4]}}", ("ran set", "2 to 4 times", "1")),
        ("{order: [set, drive out]}",
         ("order", "set, drive out", "no later start of drive out; first starts: drive out, set")),
    ],
)  # fmt: skip
def test_unmet_expectations_are_failures(run, expect, problem):
    result = run(f"expect: {expect}")
    assert problems(result) == [problem]
    assert not result.passed


def test_a_case_that_expects_nothing_expects_success(run):
    assert problems(run("mock: {spin: {}}")) == []
    assert problems(run("mock: {navigate_to_pose: failure}")) == [("status", "success", "failure")]


def test_an_expectation_without_a_status_expects_success(run):
    assert problems(run("mock: {navigate_to_pose: LOST}\nexpect: {n: 0}")) == [
        ("status", "success", "failure")
    ]
    assert problems(run("mock: {navigate_to_pose: LOST}\nexpect: {failure: LOST}")) == []


def test_a_mission_without_an_end_is_a_failure(run):
    result = run("mock: {navigate_to_pose: success, take_photo: running}\nexpect: {n: 0}")
    assert problems(result) == [("status", "success", "running after 3600 s")]
    text = "mock: {take_photo: running}\nexpect: {status: running, within: 9 s}"
    assert problems(run(text)) == []


def test_own_failure_codes_are_in_quotes(run):
    result = run("""
        mock: {navigate_to_pose: "NO_TEA"}
        expect: {failure: 'NO_TEA'}
        """)
    assert problems(result) == []


FILE = f"""{MISSION}{HEAD}tests:
  - {{name: goes well, expect: {{status: success}}}}
  - {{name: counts badly, expect: {{n: 7}}}}
"""


def test_the_output_shows_position_expected_and_actual_value(tmp_path):
    file = tmp_path / "mission.yaml"
    file.write_text(FILE)
    session = run_files([str(file)], SETTINGS)
    assert session.exit_code == 1
    lines = session.text.splitlines()
    number = FILE.splitlines().index("  - {name: counts badly, expect: {n: 7}}") + 1
    assert lines[0] == f"{file} .F"
    assert lines[3:7] == [
        f"{file}:{number}:38: $n", "    expected  7", "    got       1",
        "    the mission: success after 0.0 s",
    ]  # fmt: skip
    assert "1 failed, 1 passed" in lines[-1]


def test_a_keyword_selects_cases_and_an_empty_selection_is_reported(tmp_path):
    file = tmp_path / "mission.yaml"
    file.write_text(FILE)
    assert run_files([str(file)], dataclasses.replace(SETTINGS, keyword="WELL")).exit_code == 0
    none = run_files([str(file)], dataclasses.replace(SETTINGS, keyword="nowhere"))
    assert (none.exit_code, "no tests ran" in none.text) == (2, True)


def test_coverage_lists_unreached_nodes(tmp_path):
    file = tmp_path / "mission.yaml"
    file.write_text(FILE)
    found = run_file(file, SETTINGS)
    # The event, the tree in it, and its two nodes; and the turn that is skipped.
    assert [name for _, name in found.unreached] == [
        "low", "charge", "spin", "navigate_to_pose", "wait_until",
    ]  # fmt: skip
    text = run_files([str(file)], dataclasses.replace(SETTINGS, coverage=True)).text
    assert "3 of 8 nodes ticked, 37 %" in text
    assert f"{file}:14:8 spin is never ticked" in text


FAULTY = [
    ("tests: {a: b}", "E115 1:8"),
    ("tests: [3]", "E115 1:9"),
    ("tests: [{nam: a}]", "E115 1:10"),
    ("tests: [{arguments: {round: 3}}]", "E115 1:22"),
    ("tests: [{arguments: {rounds: many}}]", "E115 1:30"),
    ("tests: [{mock: {navigate: success}}]", "E115 1:17"),
    ("tests: [{mock: {spin: done}}]", "E115 1:23"),
    ("tests: [{mock: {spin: {return: success}}}]", "E115 1:24"),
    ("tests: [{mock: {spin: {takes: 3 m}}}]", "E115 1:31"),
    ("tests: [{mock: {take_photo: {sets: {picture: a}}}}]", "E115 1:37"),
    ("tests: [{mock: {take_photo: {sets: {image: 3}}}}]", "E115 1:44"),
    ("tests: [{at: {soon: {battery.charge: 1}}}]", "E115 1:15"),
    ("tests: [{at: {3 s: {battery.level: 1}}}]", "E115 1:21"),
    ("tests: [{at: {3 s: {battery.charge: 2}}}]", "E115 1:37"),
    ("tests: [{at: {3 s: {time: 2}}}]", "E115 1:21"),
    ("tests: [{at: {3 s: {$m: 2}}}]", "E115 1:21"),
    ("tests: [{at: {3 s: {event: high}}}]", "E115 1:28"),
    ("tests: [{at: {3 s: 3}}]", "E115 1:20"),
    ("tests: [{expect: {status: done}}]", "E115 1:27"),
    ("tests: [{expect: {failure: lost}}]", "E115 1:28"),
    ("tests: [{expect: {m: 3}}]", "E115 1:19"),
    ("tests: [{expect: {n: three}}]", "E115 1:22"),
    ("tests: [{expect: {ran: {dive: 1}}}]", "E115 1:25"),
    ("tests: [{expect: {ran: {spin: [1, 2, 3]}}}]", "E115 1:31"),
    ("tests: [{expect: {order: [spin, dive]}}]", "E115 1:33"),
    ("tests: [{expect: {within: 3 m}}]", "E115 1:27"),
    ("tests: [{expect: {ran: {spin: [5, 2]}}}]", "E115 1:31"),
    ("tests: [{expect: {status: success, failure: LOST}}]", "E115 1:45"),
    ("tests: [{expect: {status: running, failure: LOST}}]", "E115 1:45"),
    ("tests: [{expect: {failure: LOSTT}}]", "E115 1:28"),
    ("tests: [{mock: {spin: LOSTT}}]", "E115 1:23"),
    ("tests: [{expect: {n: 1, $n: 2}}]", "E115 1:25"),
    ("tests: [{expect: {order: [spin, set, spin], ran: {spin: 1}}}]", "E115 1:57"),
]


@pytest.mark.parametrize(("text", "expected"), FAULTY)
def test_faulty_cases_are_found_with_the_rest(tmp_path, text, expected):
    from stack.errors import InputError

    file = tmp_path / "mission.yaml"
    file.write_text(f"{text}\n{MISSION}{HEAD}")
    with pytest.raises(InputError) as caught:
        read_mission(file, SETTINGS.catalogue_for, Resources())
    assert [f"{item.code} {item.mark.line}:{item.mark.column}" for item in caught.value.findings] \
        == [expected]  # fmt: skip


FRAGILE = """
from behaviours.base import RobotBehaviour


class Fragile(RobotBehaviour):
    \"\"\"Fails when it is set up.\"\"\"

    def setup(self, **resources):
        raise KeyError("no camera")

    def update(self):
        raise NotImplementedError
"""


def test_a_case_that_crashes_is_a_failed_row_and_the_others_still_run(tmp_path, capsys):
    (tmp_path / "fragile.py").write_text(FRAGILE)
    (tmp_path / "mission.yaml").write_text(f"""{HEAD}
plugins: [fragile.py]
run: {{fragile: {{}}}}
tests:
  - {{name: mocked, mock: {{fragile: success}}, expect: {{status: success}}}}
  - {{name: real, mock: {{fragile: real}}, expect: {{status: success}}}}
  - {{name: mocked again, mock: {{fragile: success}}, expect: {{status: success}}}}
""")
    session = run_files([str(tmp_path / "mission.yaml")], Options(resources=Resources()))
    assert session.exit_code == 1
    assert "mission.yaml .F." in session.text and "1 failed, 2 passed" in session.text
    assert "crash\n    expected  no exception\n" in session.text
    assert "setup failed: KeyError: 'no camera' (fragile.py:9)" in session.text
    assert "the test 'real' crashed" in capsys.readouterr().err

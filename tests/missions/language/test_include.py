"""`include`: trees and places of other files, their scope, and findings."""

import pytest

from stack.errors import InputError
from stack.types import Pose2D
from tests.missions.mission_fakes import Ran, read_text

DOCKING = """
places: {dock: [1, 2, 90 deg]}
trees:
  go_home:
    do: {sequence: [{navigate_to_pose: $dock}, {use: greet, with: {word: home}}]}
  greet:
    in: {word: text}
    do: {say: $word}
"""


@pytest.fixture
def files(tmp_path):
    def write(**texts):
        for name, text in texts.items():
            (tmp_path / f"{name}.yaml").write_text(text)
        return tmp_path

    return write


def findings(folder, text):
    with pytest.raises(InputError) as caught:
        read_text(folder, text)
    return [
        f"{item.mark.file.rpartition('/')[2]}:{item.mark.line}:{item.mark.column} {item.code}"
        for item in caught.value.findings
    ]


def test_an_included_tree_runs_with_its_own_files_places(files):
    folder = files(docking=DOCKING)
    mission = read_text(folder, "include: [docking.yaml]\nrun: {use: go_home}")
    it = Ran(mission)
    assert it.ticks() == [Pose2D(1.0, 2.0, pytest.approx(1.5708, abs=1e-4)), "home"]
    assert mission.warnings == ()


def test_the_mission_sees_the_places_and_trees_of_what_an_included_file_includes(files):
    folder = files(docking=DOCKING, more="include: [docking.yaml]\ntrees: {a: {do: {say: a}}}")
    text = "include: [more.yaml]\nrun: {sequence: [{use: go_home}, {navigate_to_pose: $dock}]}"
    assert len(Ran(read_text(folder, text)).ticks()) == 3


def test_a_file_that_two_others_include_is_read_once(files):
    folder = files(docking=DOCKING, a="include: [docking.yaml]", b="include: [docking.yaml]")
    read_text(folder, "include: [a.yaml, b.yaml]\nrun: {use: go_home}")


FAULTY = [
    # An included tree knows nothing of the mission, nor of the world.
    ({"a": "trees: {t: {do: {say: $word}}}"},
     "include: [a.yaml]\nblackboard: {word: {type: text, initial: b}}\nrun: {use: t}",
     "a.yaml:1:23 E140"),
    ({"a": "trees: {t: {do: {navigate_to_pose: $lobby}}}"}, "include: [a.yaml]\nrun: {use: t}",
     "a.yaml:1:36 E140"),
    ({"a": "trees: {t: {do: {use: own}}}"},
     "include: [a.yaml]\nrun: {use: t}\ntrees: {own: {do: {say: a}}}", "a.yaml:1:23 E122"),
    ({"a": "trees: {t: {do: {use: t}}}"}, "include: [a.yaml]\nrun: {use: t}", "a.yaml:1:18 E125"),
    # Several files.
    ({"a": "include: [b.yaml]", "b": "include: [a.yaml]"}, "include: [a.yaml]\nrun: {say: a}",
     "b.yaml:1:11 E113"),
    ({"a": "include: [c.yaml]"}, "include: [a.yaml]\nrun: {say: a}", "a.yaml:1:11 E113"),
    ({"a": "trees: {}"}, "include: [a.yaml, a.yaml]\nrun: {say: a}", "mission.yaml:1:19 E113"),
    ({"a": "trees: {t: {do: {say: a}}}", "b": "trees: {t: {do: {say: a}}}"},
     "include: [a.yaml, b.yaml]\nrun: {use: t}", "b.yaml:1:9 E114"),
    ({"a": "trees: {t: {do: {say: a}}}"},
     "include: [a.yaml]\nrun: {use: t}\ntrees: {t: {do: {say: a}}}", "mission.yaml:3:9 E114"),
    ({"a": "places: {p: [1, 1]}"}, "include: [a.yaml]\nplaces: {p: [1, 2]}\nrun: {say: a}",
     "mission.yaml:2:10 E114"),
    # Their content.
    ({"a": "run: {say: a}"}, "include: [a.yaml]\nrun: {say: a}", "a.yaml:1:1 E007"),
    ({"a": "places: {p: [1]}"}, "include: [a.yaml]\nrun: {say: a}", "a.yaml:1:13 E106"),
    ({"a": "trees: {t: {do: {sey: a}}}"}, "include: [a.yaml]\nrun: {say: a}", "a.yaml:1:18 E121"),
    ({"a": "trees: [\n"}, "include: [a.yaml]\nrun: {say: a}", "a.yaml:1:8 E004"),
]  # fmt: skip


@pytest.mark.parametrize(("others", "text", "expected"), FAULTY)
def test_findings_name_the_included_file(files, others, text, expected):
    assert findings(files(**others), text) == [expected]


def test_a_library_may_hold_trees_that_this_mission_does_not_use(files):
    mission = read_text(files(docking=DOCKING), "include: [docking.yaml]\nrun: {say: a}")
    assert mission.warnings == ()

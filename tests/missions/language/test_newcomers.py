"""What newcomers write first: each mistake is one finding that says where, what and what to do."""

import pytest

from missions.inspection.check import check_files
from tests.missions.language.probe_table import HEAD

MISTAKES = [
    ("task: a\nrun: {wait: 1 s}",
     "E101 1", "available: arguments, blackboard, doc,"),
    ("places: {a: [1,2]}",
     "E101 1", "add `run: …`"),
    ("world: ofice\nrun: {wait: 1 s}",
     "E110 1", "did you mean 'office'?"),
    ("robot: ./my_robot\nrun: {wait: 1 s}",
     "E110 1", "paths are relative to the folder of the file"),
    ("run:\n\tsequence:\n\t- wait: 1 s",
     "E004 2", "indent with spaces"),
    ("run:\n  sequence\n    - wait: 1 s",
     "E004 2", "write `sequence:`"),
    ("run:\n  sequence:\n    - wait:1 s",
     "E121 3", "write a space after the colon: `wait: 1 s`"),
    ("run:\n  sequence:\n    -wait: 1 s\n    -say: a",
     "E124 3", "write `- ` in front of each node"),
    ("places: {a: [1, 2}\nrun: {wait: 1 s}",
     "E004 1", "inside brackets, put texts with `: ` or"),
    ("run:\n"
     "  sequence:\n"
     "    - navigate_to_pose:\n"
     "      goal: [3, 2, 0]\n"
     "    - wait: 1 s",
     "E123 4", "goal is a port of navigate_to_pose: indent it"),
    ("run:\n  navigate_to_pose:\n    goal: [3, 2, 0]\n    timeout: 30 s",
     "E130 4", "timeout is a modifier: write it beside"),
    ("places: {a: [3, 2]}\nrun: {navigate_to_pose: a}",
     "E132 2", "write $a"),
    ("blackboard: {n: {type: int, initial: 0}}\n"
     "run: {sequence: [{set: {$n: 1}}, {check: $n > 1}]}",
     "E140 2", "write `n: …`"),
    ("run: {check: $battery.charge > 0.2}",
     "E140 1", "write `battery.charge` without $"),
    ("run: {use: $t}\ntrees: {t: {do: {wait: 1 s}}}",
     "E122 1", "did you mean 't'?"),
    ("places: {$a: [3, 2]}\nrun: {wait: 1 s}",
     "E144 1", "use letters, digits and _"),
    ("places: {kitchen: [3, 2]}\nrun: {navigate_to_pose: $kichen}",
     "E140 2", "did you mean '$kitchen'?"),
    ("places: {my place: [3, 2]}\nrun: {navigate_to_pose: $my place}",
     "E144 1", "use letters, digits and _"),
    ("places: {shelf-a: [3, 2]}\nrun: {navigate_to_pose: $shelf-a}",
     "E144 1", "use letters, digits and _"),
    ("run: {navigate_to_pose: \"3, 2\"}",
     "E132 1", "write [3, 2]"),
    ("run: {navigate_to_pose: 3, 2}",
     "E132 1", "write 3.2, or [3, 2] for two numbers"),
    ("run: {navigate_to_pose: {x: 3, y: 2}}",
     "E132 1", "write [3, 2]"),
    ("run: {navigate_to_pose: {goal: {x: 3, y: 2, yaw: 90}}}",
     "E132 1", "write [3, 2, 90]"),
    ("places: {a: {x: 3, y: 2}}\nrun: {navigate_to_pose: $a}",
     "E106 1", "write [3, 2]"),
    ("run: {navigate_to_pose: [3, 2, 90]}",
     "E132 1", "write 90 deg"),
    ("run: {spin: 90}",
     "E132 1", "write 90 deg, or 90 rad"),
    ("run: {navigate_to_pose: [3, 2], timeout: 30sec}",
     "E132 1", "write 30 s"),
    ("run: {wait: 1:30}",
     "E132 1", "write 90 s"),
    ("run: {back_up: {distance: 0,5}}",
     "E132 1", "write 0.5, or [0, 5] for two numbers"),
    ("run: {navigate_to_pose: [3, 2], retry: -1}",
     "E132 1", "write retry: 3"),
    ("run: {navigate_to_pose: [3, 2], repeat: true}",
     "E132 1", "or write `forever` or {until: …}"),
    ("run: {spin: 90 deg, repeat: -1}",
     "E132 1", "or write `forever` or {until: …}"),
    ("run: {spin: 90 deg, while: true}",
     "W107 1", "correct or remove the condition"),
    ("run:\n"
     "  if: battery.charge < 0.2\n"
     "  then: {say: low}\n"
     "  else: {say: ok}",
     "E121 2", "write `when: …` beside the node"),
    ("run:\n  for: {x: [1,2]}\n  do: {wait: $x}",
     "E121 2", "did you mean 'for_each'?"),
    ("run:\n  for_each: [[1,2],[3,2]]\n  do: {navigate_to_pose: $item}",
     "E124 2", "write {item: [[1, 2], [3, 2]]}"),
    ("run:\n  sequence:\n    wait: 1 s\n    say: a",
     "E124 3", "write `- ` in front of each node"),
    ("run:\n  - wait: 1 s\n  - say: a",
     "E120 2", "write a list under `sequence:`"),
    ("run:\n  sequence:\n    - wait: 1 s\n      say: a",
     "E120 4", "write each as a list item, with `- ` in front"),
    ("run: {use: patrol}",
     "E122 1", "declare it under `trees`"),
    ("run: patrol\ntrees: {patrol: {do: {wait: 1 s}}}",
     "E121 1", "patrol is a tree: write `use: patrol`"),
    ("run: {use: t}\ntrees: {t: {sequence: [{wait: 1 s}]}}",
     "E101 2", "write do: {sequence: …}"),
    ("run: {use: t}\ntrees:\n  - t: {do: {wait: 1 s}}",
     "E101 3", "write `name: {do: …}` for each, without `- `"),
    ("run: {use: t, n: 3}\ntrees: {t: {in: {n: int}, do: {say: '${n}'}}}",
     "E123 1", "inputs of a tree stand below `with:`: write"),
    ("run: {Inverter: {check: battery.charging}}",
     "E121 1", "write `invert: true` beside the node"),
    ("places: {a: [1,2], a: [3,2]}\nrun: {wait: 1 s}",
     "E011 1", "remove or rename one"),
    ("include: [common.yaml]\nrun: {wait: 1 s}",
     "E113 1", "paths are relative to the folder of the file"),
    ("include: common.yaml\nrun: {wait: 1 s}",
     "E113 1", "write include: [common.yaml]"),
    ("plugins: [./my_plugins]\nrun: {wait: 1 s}",
     "E110 1", "paths are relative to the folder of the file"),
    ("// my mission\nrun: {wait: 1 s}",
     "E004 1", "a comment begins with #"),
    ("run: {say: hello # you}",
     "E004 1", "` #` begins a comment: put a text with it in"),
    ("blackboard: {b: {type: bool, initial: yes}}\nrun: {check: $b}",
     "E108 1", "write true"),
    ("arguments: {dwell: 3 s}\nrun: {wait: $dwell}",
     "E101 1", "write dwell: {type: duration, default: 3 s}"),
    ("blackboard: {n: 0}\nrun: {set: {n: 1}}",
     "E101 1", "write n: {type: int, initial: 0}"),
    ("run: {check: !battery.charging}",
     "E004 1", "write `not` for a negation, or put it in"),
    ("events:\n"
     "  low: {when: battery.charge < 0.2, do: {say: low}}\n"
     "run: {wait: 10 s}",
     "E112 2", "write `- name:` for each event, the most"),
    ("events:\n  - low: {when: battery.charge < 0.2}\nrun: {wait: 10 s}",
     "E112 2", "add `do: …`"),
    ("navigation: {controller: purepursuit}\nrun: {wait: 1 s}",
     "E111 1", "there is no controller 'purepursuit'"),
    ("robot: {name: scout}\nrun: {wait: 1 s}",
     "E101 1", "write robot: scout"),
    ("format: one\nrun: {wait: 1 s}",
     "E105 1", "write format: 1"),
    ("start: 1, 2\nrun: {wait: 1 s}",
     "E106 1", "write [1, 2]"),
    ("map: my_map.yaml\nrun: {wait: 1 s}",
     "E110 1", "paths are relative to the folder of the file"),
    ("run:\n"
     "  parallel:\n"
     "    - wait: 1 s\n"
     "    - wait: 2 s\n"
     "  succeed_on: one",
     "E123 5", "write `parallel: {succeed_on: one, do: […]}`:"),
    ("",
     "E101 2", "add `run: …`"),
    ("blackboard: {p: {type: path, optional: true}}\n"
     "run: {sequence: [{take_photo: {}, out: {image: p}}, {say: '${p}'}]}",
     "E135 2", "write $p"),
    ("places:\n  - a: [3, 2]\nrun: {navigate_to_pose: $a}",
     "E101 2", "write name: [x, y, heading] for each"),
    ("run:",
     "E120 1", "write `wait: 3 s`"),
    ("run:\n  sequence: wait",
     "E124 2", "write sequence: [NODE, NODE]"),
    ("run: {wait_until: time}",
     "E153 1", "compare it: time > …"),
    ("run:\n  event: {when: battery.charge < 0.2, do: {say: low}}",
     "E121 2", "available: approach_object, assisted_teleop,"),
    ("run: {say: {message: hello}}",
     "E130 1", "did you mean 'text'?"),
    ("run: {spin: 90 deg, retry: {times: 3}}",
     "E123 1", "did you mean 'attempts'?"),
    ("run: {wait_until: pose.heading > 90, timeout: 9 s}",
     "W107 1", "pose.heading is between -180 and 180 deg, and"),
    ("run: {wait_until: robot.speed > 5, timeout: 9 s}",
     "W141 1", "compare it with a speed that it can reach"),
]  # fmt: skip
"""A mission, its one finding, and part of the message: most often of the hint."""

RIGHT = [
    "run: {navigate_to_pose: [3, 2], timeout: 30}",
    "run: {sequence: [{spin: 90 deg}, {wait: 1 s}], repeat: forever}",
    "run: {wait: 1 s} #comment\n#another\nplaces: {a: [1,2]}",
    "run: {wait: 1.5}",
]


def _found(text, folder):
    absent = [f"{key}: {value}\n" for key, value in HEAD.items() if f"{key}:" not in text]
    file = folder / "mission.yaml"
    file.write_text("".join([text, "\n", *absent]))
    return check_files([str(file)])


@pytest.mark.parametrize(("text", "expected", "says"), MISTAKES)
def test_a_mistake_is_one_finding_that_says_what_to_do(text, expected, says, tmp_path):
    found = _found(text, tmp_path)
    assert [f"{it.finding.code} {it.finding.mark.line}" for it in found] == [expected]
    assert says in found[0].text


@pytest.mark.parametrize("text", RIGHT)
def test_what_looks_odd_and_is_right_has_no_finding(text, tmp_path):
    assert [item.text for item in _found(text, tmp_path)] == []

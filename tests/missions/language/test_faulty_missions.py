"""Faulty missions: each with the codes and positions that reading it must report.

One file: a test compares the codes of all its tables with the table of codes.
"""

from textwrap import dedent

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missions.language.codes import CODES
from missions.language.keys import MISSION, RESERVED
from missions.language.model import Resources
from missions.language.reading.mission import read_mission
from stack.errors import InputError, ParameterError
from tests.missions.language.probe_table import probes
from tests.missions.mission_fakes import CATALOGUE, PLACES, read_text

NAMES = """
places: {dock: [0, 0]}
arguments: {dwell: {type: duration, default: 3 s}, most: {type: int, default: 3}}
blackboard:
  n: {type: int, initial: 0}
  photo: {type: path, optional: true}
  word: {type: text, initial: hm}
run:
"""
"""Eight lines; the tested node is in line 9 onwards, indented by two."""


def findings(folder, text, **overrides):
    """`code line:column` of every error, in order."""
    with pytest.raises(InputError) as caught:
        read_text(folder, text, **overrides)
    assert all(item.mark.file == str(folder / "mission.yaml") for item in caught.value.findings)
    return [f"{item.code} {item.mark.line}:{item.mark.column}" for item in caught.value.findings]


NODES = [
    # nodes and modifiers
    ("{wait: 1 s, say: hello}", "E120 9:15"),
    ("[{wait: 1 s}]", "E120 9:3"),
    ("3", "E120 9:3"),
    ("{}", "E120 9:3"),
    ("{timeout: 3 s, name: a}", "E120 9:3"),
    ("navigate_to_pos: $dock", "E121 9:3"),
    ("stop", "E121 9:3"),
    ("{for_each: {t: [1, 2.5]}, do: {py_trees.behaviours.TickCounter: {duration: $t}}}",
     "E131 9:34", "E141 9:78"),
    ("nowhere.Thing: {}", "E121 9:3"),
    ("use: inspect", "E122 9:8"),
    ("use:", "E122 9:3"),
    ("{wait: 1 s, timout: 3 s}", "E123 9:15"),
    ("{navigate_to_pose: , goal: $dock}", "E123 9:24"),
    ("{wait: 1 s, on_failure: ignore}", "E123 9:27"),
    ("{wait: 1 s, name: 3}", "E123 9:21"),
    ("{wait: 1 s, with: {time: 3 s}}", "E123 9:15"),
    ("{wait: 1 s, do: stop}", "E123 9:15"),
    ("{sequence: [{wait: 1 s}], out: {a: $n}}", "E123 9:29"),
    ("{wait: 1 s, retry: {attempts: 2, delays: 1 s}}", "E123 9:36"),
    ("{wait: 1 s, retry: {delay: 1 s}}", "E123 9:22"),
    ("{wait: 1 s, retry: 0}", "E132 9:22"),
    ("{wait: 1 s, retry: often}", "E132 9:22"),
    ("{wait: 1 s, repeat: 2.5}", "E132 9:23"),
    ("{wait: 1 s, timeout: 0 s}", "E132 9:24"),
    ("{wait: 1 s, timeout: 3 m}", "E132 9:24"),
    ("{wait: 1 s, timeout: $dock}", "E141 9:24"),
    ("{wait: 1 s, recover: 3}", "E123 9:24"),
    ("{wait: 1 s, recover: {attempts: 2}}", "E124 9:15"),
    ("{wait: 1 s, recover: {attempts: 2, round_robin: [stop]}}", "E121 9:52"),
    ("{wait: 1 s, every: 3 m}", "E132 9:22"),
    ("{wait: 1 s, every: 0 s}", "E132 9:22"),
    # composites
    ("sequence: []", "E124 9:13"),
    ("sequence:", "E124 9:3"),
    ("reactive: {wait: 1 s}", "E124 9:13"),
    ("fallback: [{wait: 1 s}, stop, [a]]", "E121 9:27", "E120 9:33"),
    ("parallel: {succeed_on: 3, do: [{wait: 1 s}]}", "E132 9:26"),
    ("parallel: {succeed_on: some, do: [{wait: 1 s}]}", "E132 9:26"),
    ("parallel: {fail_on: one, do: [{wait: 1 s}]}", "E130 9:14"),
    ("{for_each: $dock, do: {wait: 1 s}}", "E124 9:14"),
    ("{for_each: {a: [1]}}", "E124 9:4"),
    ("{for_each: {a: 3}, do: {wait: $a}}", "E132 9:18"),
    ("{for_each: {a: [[1, 2], [1]]}, do: {navigate_to_pose: $a}}", "E132 9:27"),
    ("{for_each: {a: [one]}, do: {wait: $a}}", "E141 9:37"),
    ("follow_waypoints", "E131 9:3"),
    ("follow_waypoints: {waypoint: [$dock]}", "E130 9:22"),
    ("follow_waypoints: $dock", "E141 9:21"),
    ("follow_waypoints: {waypoints: [$dock], tolerance: 3 s}", "E132 9:53"),
    ("{follow_waypoints: [$dock], do: {wait: $waypoint}}", "E141 9:42"),
    ("{follow_waypoints: [$dock], do: {set: {waypoint_number: 1}}}", "E142 9:42"),
    ("{follow_waypoints: [$dock], do: []}", "E120 9:35"),
    ("{follow_waypoints: [$dock], out: {mised: $n}}", "E134 9:37"),
    ("{follow_waypoints: [$dock], out: {missed: $n}}", "E141 9:45"),
    ("{sequence: [{follow_waypoints: [$dock]}, {say: $waypoint}]}", "E140 9:50"),
    # ports
    ("wait: {tme: 1 s}", "E130 9:10"),
    ("navigate_to_pose", "E131 9:3"),
    ("wait: {time: 2 m}", "E132 9:16"),
    ("wait: -1 s", "E132 9:9"),
    ("wait: soon", "E132 9:9"),
    ("wait: true", "E132 9:9"),
    ("clear_costmap: {which: locl}", "E132 9:26"),
    ("spin: {angle: 2 m}", "E132 9:17"),
    ("take_photo: 3", "E133 9:15"),
    ("back_up: {distance: 0}", "E132 9:23"),
    ("back_up: {distance: $dwell}", "E141 9:23"),
    ("navigate_to_pose: dock", "E132 9:21"),
    ('navigate_to_pose: "$dock"', "E132 9:21"),
    ("visit: {goals: [[1, 0], $dock, $n]}", "E141 9:34"),
    ("visit: {goals: [[1, 0]], speeds: [1, 3 s]}", "E132 9:40"),
    ("py_trees.behaviours.TickCounter: {duration: $n, completion_status: success}", "E132 9:3"),
    ("{take_photo: {}, out: {imge: $photo}}", "E134 9:26"),
    ("{take_photo: {}, out: {image: photo}}", "E135 9:33"),
    ("{take_photo: {}, out: $photo}", "E135 9:25"),
    ("{take_photo: {}, out: {image: $n}}", "E141 9:33"),
    ("{take_photo: {}, out: {image: $dock}}", "E142 9:33"),
    # texts with values in them
    ("say: at ${dok}", "E151 9:13"),
    ("say: at ${$dok}", "E140 9:13"),
    ("say: 'at ${$dok}'", "E140 9:14"),
    ("say: ${n} of ${", "E150 9:16"),
    ("say: ${}", "E150 9:10"),
    ("say: ${$n >}", "E150 9:14"),
    ("say: ${battery.level}", "E151 9:10"),
    ("say: ${error}", "E154 9:10"),
    ("say: at ${photo}", "E143 9:3"),
    ("visit: {goals: [[1, 0]], speeds: ['${n}']}", "E132 9:37"),
    ("clear_costmap: {which: '${word}'}", "E132 9:26"),
    # names
    ("navigate_to_pose: $dok", "E140 9:21"),
    ("navigate_to_pose: {goal: $dwell}", "E141 9:28"),
    ("set: {dock: 1}", "E142 9:9"),
    ("set: {most: 1}", "E142 9:9"),
    ("set: {m: 1}", "E140 9:9"),
    ("set: visited", "E132 9:8"),
    ("say: $photo", "E143 9:3"),
    ("sequence: [{say: $photo}, {take_photo: {}, out: {image: $photo}}]", "E143 9:15"),
    ("check: $photo == 'a'", "E143 9:3"),
    # expressions
    ("check: $n >", "E150 9:14"),
    ("check: $n = 3", "E150 9:13"),
    ("check: ($n > 3", "E150 9:17"),
    ("check: 1 < $n < 3", "E150 9:17"),
    ("check: $n > 3 4", "E150 9:17"),
    ("check: [a]", "E150 9:10"),
    ("check: __import__('os')", "E155 9:10"),
    ("check: $n is 3", "E150 9:16"),
    ("check: battery.level > 0.3", "E151 9:10"),
    ("check: n > 3", "E151 9:10"),
    ("check: $m > 3", "E140 9:10"),
    ("check: robot.speed < 3 s", "E152 9:22"),
    ("check: $word > 3", "E152 9:10"),
    ("check: $n == $word", "E152 9:13"),
    ("check: $n and true", "E152 9:10"),
    ("check: not $n", "E152 9:14"),
    ("check: $dock.z > 1", "E152 9:15"),
    ("check: pose.distance_to($n) < 1", "E152 9:27"),
    ("check: 'battery.level > 0.3'", "E151 9:11"),
    ("check: 99999999999999999999 > $n", "E150 9:10"),
    ("check: min($n) > 1", "E152 9:14"),
    ("check: abs() > 1", "E155 9:10"),
    ("check: 'abs(1, 2) > 1'", "E155 9:11"),
    ("check: mix($n) > 1", "E155 9:10"),
    ("check: length($n) > 1", "E152 9:17"),
    ("check: $n[0] > 1", "E152 9:10"),
    ("check: 'contains($n, 1)'", "E152 9:20"),
    ("check: 'contains([1, 2], $dock)'", "E152 9:28"),
    ("check: contains(detected) ", "E155 9:10"),
    ("check: 'distance($dock, $n) < 1 m'", "E152 9:27"),
    ("check: 'pose(1 m, 1 s) == $dock'", "E152 9:21"),
    ("check: 'pose(1, 2, 90) == $dock'", "E152 9:22"),
    ("check: '[$n, $dock][0] == $n'", "E152 9:16"),
    ("check: $n % 0 == 1", "E157 9:15"),
    ("check: min > 1", "E155 9:10"),
    ("set: {n: 'min($n'}", "E150 9:19"),
    # units of products
    ("check: 2 m * pose.x < 3 s", "E152 9:23"),
    ("check: 2 m / 1 s < 0.5 m", "E152 9:20"),
    ("check: pose.x * pose.x < 1 m", "E152 9:26"),
    ("check: battery.charge < 3 s", "E152 9:25"),
    ("check: 20 % + $dwell > 1 s", "E152 9:15"),
    ("check: pose.x / 2 m < 1 m", "E152 9:23"),
    ("check: 'min(1 m, 2 s) < 1 m'", "E152 9:20"),
    ("check: 'robot.speed % 1 s < 1'", "E152 9:23"),
    # expressions at ports
    ("wait: $n * 2 m", "E153 9:9"),
    ("wait: {time: $dwell * $dwell}", "E153 9:16"),
    ("wait: batery.charge * 2 s", "E151 9:9"),
    ("wait: $n * 2 s s", "E150 9:18"),
    ("wait: 2 * 3 s", "E132 9:9"),
    ("wait: -$dwell", "E132 9:9"),
    ("wait: $dwell / ($most - 3)", "E157 9:9"),
    ("spin: {angle: $n * 2 m}", "E153 9:17"),
    ("navigate_to_pose: {goal: [$n, $dwell, 0]}", "E152 9:28"),
    ("navigate_to_pose: $n + 1", "E153 9:21"),
    ("{wait: 1 s, repeat: $n / 2}", "E153 9:23"),
    ("{wait: 1 s, timeout: $n * 2 m}", "E153 9:24"),
    ("set: {n: '${n}'}", "E150 9:13"),
    ("set: {word: 'a ${nn}'}", "E151 9:20"),
    # typed lists
    ("{for_each: {x: [$dwell, $dock]}, do: {say: '${x}'}}", "E156 9:27"),
    ("{for_each: {x: [3 s, 2 m]}, do: {say: '${x}'}}", "E156 9:24"),
    ("{for_each: {x: [3 s, 5 s]}, do: {spin: {angle: $x}}}", "E141 9:50"),
    ("check: battery.charge", "E153 9:10"),
    ("check: 3", "E153 9:10"),
    ("set: {n: 2.5}", "E153 9:12"),
    ("set: {n: $n / 2}", "E153 9:12"),
    ("set: {word: idle}", "E151 9:15"),
    ("check: error == LOST", "E154 9:10"),
    ("{wait: 1 s, when: attempt > 1}", "E154 9:21"),
    ("{wait: 1 s, recover: {attempts: 2, unless: error == LOSST, round_robin: [{spin: 90 deg}]}}",
     "E151 9:55"),
]  # fmt: skip


@pytest.mark.pain("n3180", "n3508", "n2847")
@pytest.mark.parametrize(("node", "expected"), [(item[0], list(item[1:])) for item in NODES])
def test_faulty_nodes(tmp_path, node, expected):
    assert findings(tmp_path, f"{NAMES}  {node}\n") == expected


FILES = [
    ("wrld: office\nrun: {say: a}", "E101 1:1"),
    ("robot: 3\nrun: {say: a}", "E101 1:8"),
    (
        "blackboard: {p: {type: Path, optional: true, keep: true}}\n"
        "run: {sequence: [{compute_path: [1, 2], out: {path: $p}}, {follow_path: $p}]}",
        "E136 1:14",
    ),
    # a misspelt key is one mistake: what it holds is read as if it were spelt right
    ("place: {hall: [1, 2]}\nrun: {navigate_to_pose: $hall}", "E101 1:1"),
    ("tree: {a: {do: {say: hi}}}\nrun: {use: a}", "E101 1:1"),
    ("blakboard: {n: {type: int}}\nrun: {set: {n: 1}}", "E101 1:1"),
    ("argument: {n: {type: duration, default: 3 s}}\nrun: {wait: $n}", "E101 1:1"),
    ("argument: {n: {type: duration, default: 3 m}}\nrun: {wait: $n}", "E101 1:1", "E108 1:41"),
    ("runs: {say: a}", "E101 1:1"),
    ("event: [{a: {when: time, do: {say: b}}}]\nrun: {say: a}", "E101 1:1", "E153 1:20"),
    ("blackboard: {n: {typ: int, initial: 0}}\nrun: {set: {n: $n + 1}}", "E101 1:18"),
    ("arguments: {n: {type: int, defalt: 3}}\nrun: {say: a, repeat: $n}", "E101 1:28"),
    ("run: {use: a, with: {n: 1}}\ntrees: {a: {inn: {n: int}, do: {say: a, repeat: $n}}}",
     "E101 2:13"),
    ("run: {use: a}\ntrees: {a: {doo: {say: a}}}", "E101 2:13"),
    ("doc: x", "E101 1:1"),
    ("format: 2\nrun: {say: a}", "E105 1:9"),
    ("perception: []\nmapping: {}\nrun: {say: a}", "E104 1:1", "E104 2:1"),
    ("events: {lost: {}}\nrun: {say: a}", "E112 1:9"),
    ("events: [lost]\nrun: {say: a}", "E112 1:10"),
    ("events: [{lost: {}, do: stop}]\nrun: {say: a}", "E112 1:10"),
    ("events: [{lost: {}}]\nrun: {say: a}", "E112 1:11", "E112 1:11"),
    ("events: [{lost-1: {when: time > 3 s, do: {say: b}}}]\nrun: {say: a}", "E144 1:11"),
    ("events: [{a: {when: time > 3, do: {say: b}}}, {a: {when: time > 9, do: {say: b}}}]\n"
     "run: {say: a}", "E112 1:48"),
    ("events: [{a: {when: time > 3, do: {say: b}, than: abort}}]\nrun: {say: a}", "E112 1:45"),
    ("events: [{a: {when: time > 3, do: {say: b}, then: stop}}]\nrun: {say: a}", "E112 1:51"),
    ("events: [{a: {when: time > 3, hold: 3 m, do: {say: b}}}]\nrun: {say: a}", "E132 1:37"),
    ("events: [{a: {when: time, do: {sy: b}}}]\nrun: {say: a}", "E153 1:21", "E121 1:32"),
    ("events: [{a: {when: error == LOST, do: {say: b}}}]\nrun: {say: a}", "E154 1:21"),
    ("blackboard: {w: {type: text}}\nevents: [{a: {when: $w == 'b', do: {say: b}}}]\n"
     "run: {say: a}", "E143 2:11"),
    ("include: trees.yaml\nrun: {say: a}", "E113 1:10"),
    ("include: [3]\nrun: {say: a}", "E113 1:11"),
    ("include: [nowhere.yaml]\nrun: {say: a}", "E113 1:11"),
    ("include: [mission.yaml]\nrun: {say: a}", "E113 1:11"),
    ("places: {dock: [1]}\nrun: {say: a}", "E106 1:16"),
    ("places: {dock-2: [1, 2]}\nrun: {say: a}", "E144 1:10"),
    ("places: [1]\nrun: {say: a}", "E101 1:9"),
    ("start: dok\nrun: {say: a}", "E106 1:8"),
    ("start: [1, 2, 3 m]\nrun: {say: a}", "E106 1:8"),
    ("initial_pose: somewhere\nrun: {say: a}", "E106 1:15"),
    ("blackboard: {n: {type: integer}}\nrun: {say: a}", "E107 1:24"),
    ("blackboard: {n: {type: int, init: 3}}\nrun: {say: a}", "E101 1:29"),
    ("blackboard: {n: {type: float, unit: cm}}\nrun: {say: a}", "E107 1:37"),
    ("blackboard: {n: {type: int, unit: m}}\nrun: {say: a}", "E107 1:35"),
    ("blackboard: {n: {}}\nrun: {say: a}", "E101 1:14"),
    ("blackboard: {n: {type: int, initial: soon}}\nrun: {say: a}", "E108 1:38"),
    ("arguments: {n: {type: int, default: soon}}\nrun: {say: a}", "E108 1:37"),
    ("arguments: {n: {type: int}}\nrun: {say: a}", "E108 1:13"),
    ("arguments: {n: {type: list of duration, default: [3 s, 2 m]}}\nrun: {say: a}", "E108 1:56"),
    ("blackboard: {n: {type: list of float, unit: m, initial: [3 s]}}\nrun: {say: a}", "E108 1:58"),
    ("blackboard: {n: {type: list of text, unit: m}}\nrun: {say: a}", "E107 1:44"),
    ("arguments: {n: {type: duration, default: '$m * 2'}}\nrun: {say: a}", "E140 1:43"),
    (f"run: {{say: '{'a' * 10_000}${{time}}'}}", "E150 1:12"),
    ("arguments: {n: {type: int, default: 3, range: [4, 9]}}\nrun: {say: a}", "E108 1:37"),
    ("arguments: {n: {type: int, default: 3, range: 4}}\nrun: {say: a}", "E108 1:47"),
    ("arguments: {n: {type: list of Pose, default: [$lobby, $dock]}}\nrun: {say: a}", "E140 1:55"),
    ("navigation: 3\nrun: {say: a}", "E101 1:13"),
    ("navigation: {planner: {use: 3}}\nrun: {say: a}", "E101 1:29"),
    ("parameters: [nowhere.yaml]\nrun: {say: a}", "E110 1:14"),
    ("plugins: [3]\nrun: {say: a}", "E101 1:11"),
    ("run: {use: a}\ntrees: {a: {do: {use: a}}}", "E125 2:18"),
    ("run: {use: a}\ntrees: {a: {do: {use: b}}, b: {do: {use: a}}}", "E125 2:37"),
    ("run: {use: a}\ntrees: {a: {in: {n: integer}, do: {say: hi}}}", "E131 1:12", "E107 2:21"),
    ("run: {use: a}\ntrees: {a: {}}", "E101 2:9"),
    ("run: {use: a}\ntrees: {a: {in: {n: {type: int, default: soon}}, do: {say: hi}}}",
     "E108 2:42"),
    ("run: {use: a}\ntrees: {a: {in: {n: {default: 3}}, do: {say: hi}}}", "E101 2:18"),
    ("run: {use: a}\ntrees: {a: {in: {n: {type: int, defalt: 3}}, do: {say: hi}}}",
     "E101 2:33"),
    ("blackboard: {k: {type: int, initial: 1}}\nrun: {use: a}\n"
     "trees: {a: {in: {n: {type: int, default: $k}}, do: {say: hi}}}", "E108 3:42"),
    ("arguments: {w: {type: text, default: 'at ${time}'}}\nrun: {say: $w}", "E108 1:38"),
    ("run: {use: a}\ntrees: {a: {in: {n: int}, do: {say: hi}}}", "E131 1:12"),
    ("run: {use: a, with: {n: 1.5}}\ntrees: {a: {in: {n: int}, do: {say: hi}}}", "E132 1:25"),
    ("run: {use: a, with: {m: 1}}\ntrees: {a: {do: {say: hi}}}", "E130 1:22"),
    ("run: {use: a, out: {m: $k}}\ntrees: {a: {do: {say: hi}}}", "E134 1:21"),
    ("run: {use: a}\ntrees: {a: {in: {n: int}, out: {n: int}, do: {say: hi}}}",
     "E131 1:12", "E144 2:33"),
    ("run: {use: a, with: {n: 1}}\ntrees: {a: {in: {n: int}, do: {set: {n: 2}}}}", "E142 2:38"),
    ("run: {use: a}\ntrees: {a: {out: {n: int}, do: {check: $n > 1}}}", "E143 2:33"),
    ("run: {say: a}\nrun: {say: b}", "E011 2:1"),
    ("run: !!python/object {say: a}", "E009 1:6"),
    # what cannot happen
    ("run: {sequence: [{act: a, repeat: forever}, {act: b}, {act: c}]}", "E160 1:46"),
    ("run: {sequence: [{py_trees.behaviours.Running: {}}, {act: b}]}", "E160 1:54"),
    ("run: {sequence: [{wait_until: time < 0 s}, {act: b}]}", "E163 1:31", "E160 1:45"),
    ("run: {act: a, while: 'battery.charge < 20 % and battery.charge > 50 %'}", "E164 1:22"),
    ("run: {sequence: [{check: 1 > 2}, {act: b}]}", "E160 1:35"),
    ("run: {sequence: [{use: t}, {act: b}]}\ntrees: {t: {do: {act: a, repeat: forever}}}",
     "E160 1:29"),
    ("run: {fallback: [{say: a}, {act: b}]}", "E160 1:29"),
    ("run: {reactive_fallback: [{act: a, on_failure: continue}, {act: b}]}", "E160 1:60"),
    ("run: {fallback: [{for_each: {a: [b]}, on_failure: continue, do: {act: $a}}, {act: b}]}",
     "E160 1:78"),
    ("run: {fallback: [{sequence: [{say: a}, {wait: 1 s}]}, {act: b}]}", "E160 1:56"),
    ("run: {fallback: [{parallel: {succeed_on: one, do: [{act: a}, {say: b}]}}, {act: b}]}",
     "E160 1:76"),
    ("events: [{low: {when: battery.charge < 0, do: {act: a}}}]\nrun: {act: b}", "E161 1:23"),
    ("events: [{low: {when: battery.charge > 0.5 and 0.2 > battery.charge, do: {act: a}}}]\n"
     "run: {act: b}", "E161 1:23"),
    ("run: {parallel: [{spin: 90 deg}, {sequence: [{back_up: {}}]}]}", "E162 1:35"),
    ("run: {parallel: [{use: t}, {spin: 90 deg, retry: 2}]}\ntrees: {t: {do: {spin: 90 deg}}}",
     "E162 1:29"),
    ("run: {parallel: [{home_arm: {}}, {pick: {}}]}", "E162 1:35"),
    ("run: {parallel: [{close_gripper: {}}, {sequence: [{pick: {}}]}]}", "E162 1:40"),
    ("run: {switch: fast}", "E170 1:15"),
    ("run: {switch: {cases: {a: {act: a}}}}", "E170 1:7"),
    ("run: {switch: {value: error, case: {}, cases: {LOST: {act: a}}}}", "E154 1:23", "E170 1:30"),
    ("arguments: {m: {type: text, one_of: [a, b], default: a}}\n"
     "run: {switch: {value: $m, cases: {a: {act: a}, c: {act: c}}, default: {act: d}}}",
     "E170 2:48"),
    ("run: {fallback: [{act: a}, {switch: {value: error, cases: {LOSTT: {act: a}},"
     " default: {act: b}}}]}", "E170 1:60"),
    ("arguments: {m: {type: text, default: a}}\n"
     "run: {switch: {value: $m, cases: {1: {act: a}}}}", "E170 2:35"),
    ("arguments: {n: {type: int, default: 1}}\n"
     "run: {switch: {value: $n, cases: {a: {act: a}}}}", "E153 2:23"),
    ("blackboard: {n: {type: int, initial: 0}}\nrun: {unset: $n}", "E171 2:14"),
    ("run: {follow_path: [[1, 2]]}", "E132 1:20"),
    ("run: {follow_path: [1, 2]}", "E132 1:20"),
    ("run: {unset: {}}", "E171 1:7"),
    ("run: {unset: $m}", "E140 1:14"),
    ("run: {fail: {code: NO_PROGRES, because: a}}", "E172 1:7"),
    ("run: {fail: {code: no tea, because: a}}", "E172 1:7"),
    ("run: {act: a, invert: 3}", "E123 1:23"),
    ("run: {act: a, repeat: {until: $n > 3}}", "E140 1:31"),
    ("run: {act: a, repeat: {until: time > 3, time: 3}}", "E123 1:41"),
    ("run: {act: a, repeat: {}}", "E123 1:23"),
    ("run: {sequence: [{fail: because}, {act: a}]}", "E160 1:36"),
]  # fmt: skip


@pytest.mark.pain("n3180", "n3508", "n2847")
@pytest.mark.parametrize(("text", "expected"), [(item[0], list(item[1:])) for item in FILES])
def test_faulty_files(tmp_path, text, expected):
    assert findings(tmp_path, text) == expected


def test_there_are_at_least_200_cases():
    """Those of YAML, included files, worlds and `tests` are in their own test files."""
    assert len(NODES) + len(FILES) + len(WARNINGS) >= 200


def test_every_finding_comes_in_one_go(tmp_path):
    text = """
        wrld: office
        places: {dock: [1]}
        run:
          sequence:
            - navigate_to_pose: $dok
            - {wait: 3 m, timout: 3 s}
        """
    expected = ["E101 2:1", "E106 3:16", "E140 6:25", "E132 7:14", "E123 7:19"]
    assert findings(tmp_path, text) == expected


@pytest.mark.parametrize(
    ("node", "hint"),
    [
        ("use: {tree: inspect}", "got a mapping; write `use: NAME`"),
        ("{spin: 90 deg, repeat: always}", "got 'always'; or write `forever` or {until: …}"),
        (
            "parallel: {succeed_on: any, do: [{say: a}, {wait: 1 s}]}",
            "got 'any'; write all, one or a number",
        ),
        ("navigate_to_pos: $dock", "did you mean 'navigate_to_pose'?"),
        ("{wait: 1 s, timout: 3 s}", "did you mean 'timeout'?"),
        ("{navigate_to_pose: , goal: $dock}", "goal is a port of navigate_to_pose: indent it"),
        ("navigate_to_pose: $dok", "did you mean '$dock'?"),
        ("check: $m > 3", "available: $dock, $dwell, $lobby, $most, $n, $photo, $word"),
        ("check: $wrd == ''", "did you mean '$word'?"),
        ("navigate_to_pose: dock", "write $dock"),
        ("{take_photo: {}, out: {image: photo}}", "write $photo"),
        ("check: n > 3", "write $n"),
        ("check: $n = 3", "compare with =="),
        ("check: battery.charg > 0.3", "did you mean 'battery.charge'?"),
        ("wait: {time: 2 m}", "allowed units: s, ms, min, h"),
    ],
)
def test_a_finding_suggests_a_fix(tmp_path, node, hint):
    with pytest.raises(InputError) as caught:
        read_text(tmp_path, f"{NAMES}  {node}\n")
    assert hint in str(caught.value)


@pytest.mark.parametrize(
    ("overrides", "sentence"),
    [
        ({"dwel": "5s"}, "--set dwel:1:1 error[E109] the mission has no argument 'dwel'; did you"),
        ({"dwell": "5 m"}, "--set dwell:1:1 error[E109] dwell: '5 m' is in m, expected a duration"),
        ({"dwell": "["}, "--set dwell:1:1 error[E109] the `[` that opens here is not closed"),
        ({"most": "soon"}, "--set most:1:1 error[E109] most: expected a whole number, got 'soon'"),
    ],
)
def test_faulty_options(tmp_path, overrides, sentence):
    with pytest.raises(InputError) as caught:
        read_text(tmp_path, f"{NAMES}  {{wait: 1 s}}\n", **overrides)
    assert sentence in str(caught.value)


WARNINGS = [
    ("blackboard: {n: {type: int}}\nrun: {say: a}", "W102 1:14"),
    ("arguments: {n: {type: int, default: 3}}\nrun: {say: a}", "W102 1:13"),
    ("places: {n: [0, 0]}\nblackboard: {n: {type: int}}\nrun: {say: a}", "W101 2:14", "W102 2:14"),
    ("run: {for_each: {lobby: [a]}, do: {say: $lobby}}", "W101 1:18"),
    ("blackboard: {n: {type: int}, m: {type: int}}\n"
     "run: {use: a, out: {n: $m}}\n"
     "trees: {a: {out: {n: int}, do: {set: {n: 1}}}}", "W102 1:14", "W101 3:19"),
    ("blackboard: {n: {type: int, doc: for the report}}\n"
     "run: {use: a, out: {n: $n}}\n"
     "trees: {a: {out: {n: int}, do: {set: {n: 1}}}}",),
    ("run: {say: a}\ntrees: {spare: {do: {say: b}}}", "W103 2:9"),
    ("run: {say: arrived at $lobby}", "W104 1:23"),
    ("run: {parallel: [{spin: 90 deg}, {sequence: [{say: a}, {back_up: {}}]}]}", "W105 1:35"),
    ("run: {parallel: [{spin: 90 deg}, {back_up: {}, when: time > 3}]}", "W105 1:35"),
    ("run: {reactive: [{sequence: [{act: a}, {wait: 1 s}]}, {act: b}]}", "W106 1:19"),
    ("run: {reactive: [{use: t}, {act: b}]}\ntrees: {t: {do: {wait: 1 s}}}", "W106 1:19"),
    ("run: {reactive: [{fallback: [{act: a}, {wait: 1 s}]}, {act: b}]}",),
    ("run: {reactive: [{wait: 1 s, every: 9 s}, {act: b}]}",),
    ("run: {reactive: [{wait: 1 s, on_failure: continue, timeout: 1 s}, {act: b}]}", "W106 1:19"),
    ("run: {reactive: [{for_each: {n: [1, 2]}, do: {wait: $n}}, {act: b}]}", "W106 1:19"),
    ("run: {reactive: [{for_each: {n: []}, do: {wait: $n}}, {act: b}]}", "W133 1:33"),
    ("run: {act: a, when: battery.charge >= 0}", "W107 1:21"),
    ("run: {act: a, while: localisation.health + 1 > 0.5}", "W107 1:22"),
    ("run: {act: a, when: not 2 > 1}", "W107 1:21"),
    ("arguments: {n: {type: bool, default: false}}\nrun: {act: a, when: $n}",),
    ("run: {act: a, when: robot.speed > 1 or robot.speed < 0.5}",),
    ("run: {say: a, retry: 3}", "W108 1:7"),
    ("run: {say: a, on_failure: continue}", "W108 1:7"),
    ("run: {wait: 1 s, recover: {attempts: 2, round_robin: [{say: a}]}}", "W108 1:7"),
    ("run: {sequence: [{wait: 1 s}, {fallback: [{act: a}, {say: b}]}], retry: 2}", "W108 1:7"),
    ("run: {wait: 1 s, timeout: 3 s, retry: 2}",),
    ("blackboard: {n: {type: int}}\n"
     "run: {parallel: [{set: {n: 1}}, {wait_until: $n > 3, retry: 2}]}",),
    ("run: {act: a, every: 3 s, retry: 2}", "W109 1:7"),
    ("arguments: {m: {type: text, one_of: [a, b], default: a}}\n"
     "run: {switch: {value: $m, cases: {a: {act: a}}}}", "W170 2:34"),
    ("run: {act: a, every: 3 s, repeat: 2}", "W109 1:7"),
    ("run: {act: a, every: 3 s, repeat: forever}",),
    ("run: {reactive: [{spin: 90 deg}, {wait: 1 s}]}", "W106 1:19"),
    ("run: {use: a, with: {n: 1}}\ntrees: {a: {in: {n: int}, out: {m: int}, do: {say: b}}}",
     "W102 2:18", "W102 2:33"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "expected"), [(item[0], list(item[1:])) for item in WARNINGS])
def test_warnings_do_not_stop_a_mission(tmp_path, text, expected):
    mission = read_text(tmp_path, text)
    found = [f"{item.code} {item.mark.line}:{item.mark.column}" for item in mission.warnings]
    assert found == expected


def test_errors_of_resources_are_reported_at_their_key(tmp_path):
    def refuse(*_):
        raise InputError("there is none of that name")

    def component(kind, name, values, mapped):
        if name == "a_star":
            raise InputError(f"there is no {kind} {name!r}")
        if "lookahed" in values:
            raise ParameterError("lookahed", "there is no such parameter")

    resources = Resources(lambda name, beside: PLACES, refuse, refuse, check_component=component)
    text = """
        robot: skout
        map: house.yaml
        navigation: {planner: a_star, controller: {use: pure_pursuit, lookahed: 3}}
        run: {say: hello}
        """
    with pytest.raises(InputError) as caught:
        read_text(tmp_path, text, resources)
    found = [f"{item.code} {item.mark.line}:{item.mark.column}" for item in caught.value.findings]
    assert found == ["E110 2:8", "E110 3:6", "E111 4:23", "E111 4:73"]


def test_a_key_that_belongs_under_navigation_is_sent_there(tmp_path):
    resources = Resources(lambda name, beside: PLACES, navigation_kinds=("safety", "controller"))
    text = "safety: {padding: 0.1}\ncontroler: mppi\nnav2_params: nav2.yaml\nrun: {say: a}"
    with pytest.raises(InputError) as caught:
        read_text(tmp_path, text, resources)
    safety, controller, nav2 = sorted(caught.value.findings, key=lambda item: item.mark.line)
    assert safety.sentence == "`safety` does not belong to the top of a mission"
    assert nav2.sentence == "`nav2_params` does not belong to the top of a mission"
    assert safety.hint == nav2.hint == "write it under `navigation`"
    assert controller.code == "E101" and controller.mark.line == 2


def test_the_keys_of_a_mission_are_those_that_editors_propose():
    assert not set(MISSION) & set(RESERVED)


PREPARED = ("E412",)
"""Codes of the files that a mission names; missions/inspection/explain.py describes them."""


def test_every_code_that_is_reported_is_in_the_table():
    reported = {code.split()[0] for item in (*NODES, *FILES, *WARNINGS) for code in item[1:]}
    of_probes = {code for probe in probes() for code, _ in probe.expected}
    reported |= {code for code in of_probes if code not in PREPARED}
    assert {code for code in reported if not code.startswith("E0")} <= set(CODES)
    # The others need a mission of 10 000 nodes, a broken class, options or other files, or are
    # about `tests`; tested elsewhere.
    assert set(CODES) - reported == {
        "E109", "E114", "E116", "E126", "E127", "E184", "W110", "W111", "W112", "W113", "W114",
        "W115", "W150", "W151", "W152",
    }  # fmt: skip


WHOLE = dedent("""
    format: 1
    places: {dock: [0, 0, 90 deg]}
    arguments: {dwell: {type: duration, default: 3 s, range: [0, 10]}}
    blackboard: {photo: {type: path, optional: true}, n: {type: int, initial: 0}}
    run:
      sequence:
        - for_each: {place: [$dock, $lobby]}
          on_failure: continue
          do: {use: look, with: {at: $place}, out: {picture: $photo}}
        - set: {n: $n + 1}
          when: $photo is set and battery.charge > 20 %
        - parallel: {succeed_on: one, do: [{wait: $dwell}, {say: hello}]}
    trees:
      look:
        in: {at: Pose}
        out: {picture: path}
        do:
          fallback:
            - navigate_to_pose: {goal: $at, tolerance: 20 cm}
              timeout: 90 s
              recover: {attempts: 3, unless: error == LOST, round_robin: [{spin: 90 deg}]}
            - {take_photo: {}, out: {image: $picture}, retry: {attempts: 2, delay: 1 s}, every: 2 s}
    events:
      - low:
          when: battery.charge < 0.3 and not battery.charging
          hold: 2 s
          do: {navigate_to_pose: $dock, timeout: 30 s}
          then: resume
    include: []
    tests:
      - name: it goes well
        arguments: {dwell: 1 s}
        mock: {navigate_to_pose: {takes: 10 s, returns: [NO_VALID_PATH, success]}}
        at: {4 s: {battery.charge: 0.1, $n: 2}, 60 s: {event: low}}
        expect: {status: success, n: 3, ran: {look: 2}, within: 10 min}
    """)
PIECES = [
    "", " ", "\n", "\n  ", ":", "- ", "{", "}", "[", "]", "$", "$n", "'", '"', "#", "&a ", "*a",
    "3", "null", "true", "and", "not", "3 s", "90 deg", "~", "\t", "%", "use: look", "when: ",
    "é", "\0",
]  # fmt: skip


@settings(deadline=None, max_examples=250)
@given(
    cuts=st.lists(
        st.tuples(st.integers(0, len(WHOLE)), st.integers(0, 12), st.sampled_from(PIECES)),
        min_size=1,
        max_size=4,
    )
)
def test_damaged_missions_give_findings_and_never_a_traceback(tmp_path_factory, cuts):
    text = WHOLE
    for at, length, piece in cuts:
        text = text[:at] + piece + text[at + length :]
    file = tmp_path_factory.mktemp("mutant") / "mission.yaml"
    file.write_text(f"{text}\nmission: test\nrobot: scout\nworld: office\n")
    try:
        read_mission(file, lambda *_: CATALOGUE, Resources(lambda *_: PLACES))
    except InputError as error:
        assert error.findings
        assert all(item.mark.line >= 1 and item.mark.column >= 1 for item in error.findings)


def test_the_whole_mission_itself_is_fine(tmp_path):
    warnings = read_text(tmp_path, WHOLE).warnings
    assert [item.code for item in warnings] == ["W109"]


def test_a_finding_in_a_text_of_several_lines_is_at_its_begin(tmp_path):
    text = """
        robot: scout
        run:
          sequence:
            - navigate_through: {goals: [$nowhere, $corn
        er]}
            - check: 1 <
                2 + foo
        """
    with pytest.raises(InputError) as caught:
        read_text(tmp_path, text)
    lines = {5: 44, 7: 14}
    for item in caught.value.findings:
        assert item.mark.line in lines and item.mark.column <= lines[item.mark.line], item


def unknown(name, _folder):
    raise InputError(f"there is no world {name!r}")


def test_without_its_world_a_mission_is_not_blamed_for_the_names_of_places(tmp_path):
    """A misspelled world is one error; what does not depend on its places is still reported."""
    text = """
    mission: m
    format: 1
    robot: scout
    world: ofice
    start: dock
    arguments: {desk: {type: Pose, default: $hall}}
    run:
      sequence:
        - navigate_to_pose: $shelf
          when: $low
        - navigate_to_pose: {gaol: $dock}
    """
    found = findings(tmp_path, dedent(text), resources=Resources(world_places=unknown))
    assert found == ["E110 5:8", "E130 12:26"]
    names = findings(tmp_path, dedent(text))
    assert names == ["E106 6:8", "E140 7:41", "E140 10:25", "E140 11:13", "E130 12:26",
                     "E140 12:32"]  # fmt: skip

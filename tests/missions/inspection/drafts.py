"""Fifty drafts with mistakes that language models make when they write a mission.

Each is what follows `HEAD`, or a whole text where it begins with `=`.
"""

# ruff: noqa: E501 - a draft is easier to read in one line

HEAD = """\
mission: draft
robot: scout
world: office
"""

DRAFTS = {
    # Around the YAML.
    "fences": "=```yaml\n" + HEAD + "run: {navigate_to_pose: $desk_a}\n```\n",
    "prose and fences": "=Here is the mission you asked for.\n\n```yaml\n" + HEAD
    + "run: {navigate_to_pose: $desk_a}\n```\n\nIt drives to the desk and stops there.\n",
    "prose before": "=Here is the mission:\n\n" + HEAD + "run: {navigate_to_pose: $desk_a}\n",
    "prose after": HEAD + "run: {navigate_to_pose: $desk_a}\n\nThis mission drives to desk A.\n",
    "tabs": HEAD + "run:\n\tnavigate_to_pose: $desk_a\n",
    "comment of C": HEAD + "// drive to the desk\nrun: {navigate_to_pose: $desk_a}\n",
    "two documents": HEAD + "run: {navigate_to_pose: $desk_a}\n---\n",
    # Names.
    "place of no world": HEAD + "run: {navigate_to_pose: $desk_d}\n",
    "place without $": HEAD + "run: {navigate_to_pose: desk_a}\n",
    "robot that is not there": "=" + HEAD.replace("scout", "scoot")
    + "run: {navigate_to_pose: $desk_a}\n",
    "world that is not there": "=" + HEAD.replace("office", "offices")
    + "run: {navigate_to_pose: $desk_a}\n",
    "behaviour of Nav2": HEAD + "run: {NavigateToPose: {goal: $desk_a}}\n",
    "misspelt behaviour": HEAD + "run: {navigate_to: $desk_a}\n",
    "invented behaviour": HEAD + "run: {go_to_place: $desk_a}\n",
    "misspelt port": HEAD + "run: {navigate_to_pose: {gaol: $desk_a}}\n",
    "port of Nav2": HEAD + "run: {navigate_to_pose: {pose: $desk_a}}\n",
    "invented port": HEAD + "run: {navigate_to_pose: {goal: $desk_a, avoid_people: true}}\n",
    "wait with duration": HEAD + "run: {wait: {duration: 3 s}}\n",
    "message of say": HEAD + "run: {say: {message: hello}}\n",
    "invented output": HEAD + "blackboard: {photo: {type: path, optional: true}}\n"
    "run: {sequence: [{take_photo: {}, out: {picture: $photo}}, {say: '${photo}'}]}\n",
    "misspelt key of a mission": "=" + HEAD.replace("mission:", "missions:")
    + "run: {navigate_to_pose: $desk_a}\n",
    "name instead of mission": "=" + HEAD.replace("mission:", "name:")
    + "run: {navigate_to_pose: $desk_a}\n",
    "invented key of a mission": HEAD + "author: a model\nrun: {navigate_to_pose: $desk_a}\n",
    "tree instead of run": HEAD + "tree: {navigate_to_pose: $desk_a}\n",
    # Values.
    "time in words": HEAD + "run: {wait: five seconds}\n",
    "other unit": HEAD + "run: {wait: 3 m}\n",
    "angle in metres": HEAD + "run: {spin: 90 cm}\n",
    "degrees in words": HEAD + "run: {spin: 90 degrees}\n",
    "pose as keys": HEAD + "run: {navigate_to_pose: {goal: {x: 2.0, y: 3.0}}}\n",
    "pose in a text": HEAD + 'run: {navigate_to_pose: {goal: "2.0, 3.0, 0.0"}}\n',
    "text for a switch": HEAD + "run: {relocalise: {only_if_lost: 'yes'}}\n",
    "text of a choice": HEAD + "run: {clear_costmap: everything}\n",
    "percent sign alone": HEAD + "run: {check: battery.charge > 20percent}\n",
    "unknown robot value": HEAD + "run: {check: battery.level > 0.2}\n",
    "robot value with $": HEAD + "run: {check: $battery.charge > 0.2}\n",
    "comparison with one =": HEAD + "blackboard: {n: {type: int, initial: 0}}\n"
    "run: {sequence: [{set: {n: 1}}, {check: $n = 1}]}\n",
    "and as &&": HEAD + "run: {check: battery.charge > 0.2 && localisation.health > 0.5}\n",
    # Structure.
    "several nodes in run": HEAD + "run:\n  navigate_to_pose: $desk_a\n  wait: 3 s\n",
    "list as run": HEAD + "run:\n  - navigate_to_pose: $desk_a\n  - wait: 3 s\n",
    "children key": HEAD + "run: {sequence: {children: [{wait: 1 s}, {spin: 90 deg}]}}\n",
    "type key": HEAD + "run: {type: navigate_to_pose, goal: $desk_a}\n",
    "modifier in the ports": HEAD + "run: {navigate_to_pose: {goal: $desk_a, timeout: 60 s}}\n",
    "selector": HEAD + "run: {selector: [{navigate_to_pose: $desk_a}, {say: no}]}\n",
    "retries": HEAD + "run: {navigate_to_pose: $desk_a, retries: 3}\n",
    "inverter": HEAD + "run: {inverter: {check: battery.charge < 0.2}}\n",
    "undeclared key": HEAD + "run: {sequence: [{take_photo: {}, out: {image: $photo}}, "
    "{say: '${photo}'}]}\n",
    "output without $": HEAD + "blackboard: {photo: {type: path, optional: true}}\n"
    "run: {sequence: [{take_photo: {}, out: {image: photo}}, {say: '${photo}'}]}\n",
    "type of another language": HEAD + "blackboard: {n: {type: integer, initial: 0}}\n"
    "run: {sequence: [{set: {n: $n + 1}}, {say: '${n}'}]}\n",
    "value of a key": HEAD + "blackboard: {n: {type: int, value: 0}}\n"
    "run: {sequence: [{set: {n: $n + 1}}, {say: '${n}'}]}\n",
    "action of an event": HEAD + "events:\n  - low: {when: battery.charge < 0.2, "
    "action: {say: low}, then: abort}\nrun: {navigate_to_pose: $desk_a}\n",
}  # fmt: skip


OTHERS = {
    "block children": HEAD+"run:\n  sequence:\n    children:\n      - navigate_to_pose: $desk_a\n      - wait: 3 s\n",
    "block type": HEAD+"run:\n  sequence:\n    - type: navigate_to_pose\n      goal: $desk_a\n    - type: wait\n      time: 3 s\n",
    "string place in list": HEAD+"run: {for_each: {d: [desk_a, desk_b]}, do: {navigate_to_pose: $d}}\n",
    "action names": HEAD+"run:\n  sequence:\n    - action: navigate_to_pose\n      goal: $desk_a\n    - say: hello\n",
    "timeout seconds": HEAD+"run:\n  navigate_to_pose: $desk_a\n  timeout: 30 seconds\n",
    "timeout in ports block": HEAD+"run:\n  navigate_to_pose:\n    goal: $desk_a\n    timeout: 60 s\n",
    "condition key": HEAD+"run:\n  navigate_to_pose: $desk_a\n  if: battery.charge > 0.2\n",
    "event list wrong": HEAD+"events:\n  low: {when: battery.charge < 0.2, do: {say: low}}\nrun: {navigate_to_pose: $desk_a}\n",
    "args": HEAD+"args: {dwell: {type: duration, default: 3 s}}\nrun: {wait: $dwell}\n",
    "variables": HEAD+"variables: {n: {type: int, initial: 0}}\nrun: {sequence: [{set: {n: $n + 1}}, {say: '${n}'}]}\n",
    "double quotes dollar": HEAD+'run: {navigate_to_pose: {goal: "$desk_a"}}\n',
    "jinja": HEAD+"run: {navigate_to_pose: '{{ desk_a }}'}\n",
    "set_value": HEAD+"blackboard: {n: {type: int, initial: 0}}\nrun: {sequence: [{set: {key: n, value: 1}}, {say: '${n}'}]}\n",
    "nav loop": HEAD+"run:\n  loop:\n    navigate_to_pose: $desk_a\n",
    "repeat times": HEAD+"run: {spin: 90 deg, repeat: {times: 3}}\n",
    "retry count": HEAD+"run: {navigate_to_pose: $desk_a, retry: {count: 3}}\n",
    "take_picture": HEAD+"run: take_picture\n",
    "rotate": HEAD+"run: {rotate: {degrees: 90}}\n",
    "go home": HEAD+"run: {sequence: [{navigate_to_pose: $desk_a}, {return_to_dock: {}}]}\n",
    "world path": "mission: d\nrobot: scout\nworld: office.yaml\nrun: {wait: 1 s}\n",
    "not with !": HEAD+"run: {check: '!battery.charging'}\n",
    "json": '{"mission": "d", "robot": "scout", "world": "office", "run": {"navigate_to_pose": {"goal": "desk_a"}}}\n',
    "parallel policy": HEAD+"run: {parallel: {success_threshold: 1, children: [{wait: 1 s}, {say: a}]}}\n",
    "recovery": HEAD+"run:\n  navigate_to_pose: $desk_a\n  recovery:\n    - clear_costmap: both\n",
    "heading in degrees": HEAD+"run: {navigate_to_pose: {goal: [2, 3, 90]}}\n",
}  # fmt: skip
"""Written after the findings were improved for `DRAFTS`; 8 of these were mended then."""


def text_of(name: str) -> str:
    """Return a draft as a model sends it."""
    return {**DRAFTS, **OTHERS}[name].removeprefix("=")

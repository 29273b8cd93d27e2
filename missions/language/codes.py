"""Every code that reading a mission may report: what it means, an example, and the fix."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Code:
    """One kind of finding.

    Attributes:
        title: in a few words.
        cause: what the reader saw.
        example: a piece of a mission that provokes it.
        fix: what to do.
    """

    title: str
    cause: str
    example: str
    fix: str


CODES: dict[str, Code] = {
    "E101": Code("keys of a section", "a key is unknown, missing or holds the wrong kind of value",
                 "wrld: office", "use the key that is suggested"),
    "E104": Code("not supported yet", "the key belongs to a later version",
                 "safety: {}", "leave it out"),
    "E105": Code("format", "the file is written for another version of the language",
                 "format: 2", "write format: 1"),
    "E106": Code("place or pose", "not a pose, or a place nobody declared",
                 "places: {dock: [1]}", "write [x, y, heading]"),
    "E107": Code("type", "there is no such type", "blackboard: {n: {type: integer}}",
                 "use a type of the table of types"),
    "E108": Code("argument or key", "a default, initial value or range does not fit the type",
                 "arguments: {n: {type: int, default: soon}}", "give a value of the type"),
    "E109": Code("--set", "an option sets an argument that is not declared, or to a wrong value",
                 "--set dwel=5s", "set a declared argument"),
    "E110": Code("robot, world, map or plugin", "something the mission refers to cannot be used",
                 "world: ofice", "name one that exists"),
    "E111": Code("component", "a component or one of its parameters is wrong",
                 "navigation: {planner: a_star}", "use the name that is suggested"),
    "E112": Code("event", "an event is `name: {when, hold, do, then}`; a part is missing or wrong",
                 "events: [{lost: {when: localisation.quality < 0.3}}]",
                 "give it `when` and `do`; `then` is resume, restart or abort"),
    "E113": Code("include", "a file cannot be read, stands there twice, or includes itself",
                 "include: [nowhere.yaml]", "name a file with `trees` and `places`, once"),
    "E114": Code("name in two files", "two files declare a tree or place of the same name",
                 "include: [a.yaml, b.yaml]", "rename one of them"),
    "E115": Code("test", "a case under `tests` does not fit the mission",
                 "tests: [{name: a, expect: {status: done}}]", "use the word that is suggested"),
    "E120": Code("node", "a node is one key that names its type, its value the ports",
                 "run: {wait: 1 s, say: hello}", "write a list under `sequence`"),
    "E121": Code("behaviour", "there is no behaviour of this name", "run: navigate_to_pos",
                 "use the name that is suggested; trees are run with `use`"),
    "E122": Code("tree", "there is no tree of this name under `trees`", "run: {use: inspct}",
                 "declare it under `trees`"),
    "E123": Code("modifier", "a modifier is unknown, misplaced or has a wrong value",
                 "run: {wait: 1 s, timout: 3 s}", "use the modifier that is suggested"),
    "E124": Code("children", "a composite needs children", "run: {sequence: []}",
                 "give it at least one child"),
    "E125": Code("endless tree", "a tree uses itself, directly or through others",
                 "trees: {a: {do: {use: a}}}", "use `repeat` to do something again"),
    "E126": Code("size", "the mission is too large once its trees are put in", "",
                 "use smaller trees"),
    "E127": Code("behaviour cannot be built",
                 "its class refuses what it was given, or its setup fails",
                 "", "mend the behaviour"),
    "E130": Code("port", "the behaviour or tree has no such port", "run: {wait: {tme: 1 s}}",
                 "use the port that is suggested"),
    "E131": Code("missing port", "a port without default is not given", "run: navigate_to_pose",
                 "give the port a value"),
    "E132": Code("port value", "wrong type, unit or range", "run: {wait: {time: 2 m}}",
                 "give a value of the port's type and unit"),
    "E133": Code("bare value", "a value without port name, and it is not clear whose it is",
                 "run: {take_photo: 3}", "name the port"),
    "E134": Code("output", "the behaviour or tree has no such output",
                 "run: {take_photo: {}, out: {imge: $photo}}", "use the output that is suggested"),
    "E135": Code("output target", "an output goes to a blackboard key",
                 "run: {take_photo: {}, out: {image: photo}}", "write $key"),
    "E140": Code("unknown name", "no place, argument, key or variable of this name is known here",
                 "run: {navigate_to_pose: $dok}", "use the name that is suggested, or declare it"),
    "E141": Code("type of a name", "the name stands for a value of another type",
                 "run: {navigate_to_pose: $dwell}", "use a name of the port's type"),
    "E142": Code("cannot be written",
                 "places, arguments, loop variables and `in` cannot be written",
                 "run: {set: {dock: 1}}", "write a blackboard key or an `out`"),
    "E143": Code("read before written", "nothing can have written the key when it is read",
                 "run: {say: $photo}", "give it an initial value, or ask `$key is set` first"),
    "E144": Code("not a name", "a name is letters, digits and _, and begins with a letter",
                 "places: {dock-2: [1, 2]}", "rename it"),
    "E150": Code("expression", "the text is not an expression", "run: {check: $n > }",
                 "complete the expression"),
    "E151": Code("robot value", "the robot has no such value", "run: {check: battery.level > 0.3}",
                 "use the value that is suggested; keys are written $key"),
    "E152": Code("types in an expression", "the two sides do not go together",
                 "run: {check: robot.speed < 3 s}", "compare like with like"),
    "E153": Code("type of an expression", "the expression gives another type than is wanted",
                 "run: {check: battery.charge}", "write a comparison"),
    "E154": Code("error, attempt", "there is no failure or attempt at this place",
                 "run: {check: error == LOST}", "use it in `unless`, recoveries or retried nodes"),
    "E160": Code("never reached", "the child before it never ends in the way that leads here",
                 "run: {sequence: [{say: a, repeat: forever}, {say: b}]}",
                 "put it first, or let what is before it end"),
    "E161": Code("event that never comes", "its condition is never true, or another comes first",
                 "events: [{low: {when: battery.charge < 0, do: {say: low}}}]\nrun: {say: a}",
                 "mend the condition"),
    "E162": Code("two at the wheel at once", "two children of a parallel begin to move the robot",
                 "run: {parallel: [{spin: {}}, {back_up: {distance: 1 m}}]}",
                 "put them into a sequence"),
    "W101": Code("hidden name", "the name hides another of the same name further out",
                 "places: {n: [0, 0]}\nblackboard: {n: {type: int}}", "rename one of them"),
    "W102": Code("unused name", "nobody reads or writes it", "blackboard: {n: {type: int}}",
                 "remove it"),
    "W103": Code("unused tree", "`run` never gets there", "trees: {spare: {do: {say: hello}}}",
                 "remove it, or `use` it"),
    "W104": Code("text with $", "a text is not filled in; `$name` inside it stays as it is",
                 "run: {say: arrived at $dock}", "write `arrived at ${dock}`"),
    "W105": Code("two at the wheel", "two children of a parallel may move the robot together",
                 "run: {parallel: [{spin: {}}, {sequence: [{wait: 3 s}, {spin: {}}]}]}",
                 "put them into a sequence"),
    "W106": Code("starts again at every tick",
                 "a reactive composite looks at every child again; this one takes time",
                 "run: {reactive: [{spin: {}}, {wait: 1 s}]}",
                 "use a sequence, or move it to the end"),
    "W107": Code("always the same", "whatever the robot does, the condition has one outcome",
                 "run: {say: a, when: battery.charge >= 0}", "mend the condition, or leave it out"),
    "W108": Code("nothing to retry", "what is retried, recovered or passed over cannot fail",
                 "run: {say: a, retry: 3}", "leave it out"),
    "W109": Code("kept results count", "`every` keeps its last result, and it is counted as a run",
                 "run: {spin: {}, every: 5 s, retry: 3}",
                 "put one of them on a node inside"),
}  # fmt: skip
"""Code -> what `treepilot explain` and the documentation say about it."""

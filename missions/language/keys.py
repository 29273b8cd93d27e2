"""Table of the keys of mission files: word, meaning, how the value is written, where it stands.

Readers, hover, completion and the tables of docs/reference.md are made from it. A section is a
mapping with known keys; missions.language.sections holds them all by name.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

from stack.parameters import Declaration


class Form(Enum):
    """How the value of a key is written, in the words of the documentation."""

    WORD = "one of its words"
    VALUE = "value of its declaration, or a $name"
    LITERAL = "value of its declaration"
    TEXT = "text"
    NAME = "one line of text"
    TEXTS = "list of texts"
    NUMBER = "1"
    ANY = "value of its type"
    RANGE = "`[least, most]`"
    TYPE = "type"
    TYPES = "names with types"
    INPUTS = "names with types or keys"
    EXPRESSION = "expression"
    NODE = "node"
    NODES = "list of nodes"
    CASES = "texts with nodes"
    PLACE = "place or pose"
    POSES = "names with poses"
    FILE = "file"
    FILES = "list of files"
    ROBOT = "name or file of a robot"
    WORLD = "name or file of a world"
    COMPONENT = "component"
    COMPONENTS = "components by kind"
    SECTION = "keys"
    NAMED = "names with keys"
    NAMED_LIST = "list of names with keys"
    LIST = "list of entries"
    OUTCOMES = "outcome or list of outcomes"
    DURATIONS = "duration or list of durations"
    DURATION_OF = "duration, or names with durations"
    COUNTS = "names with numbers"
    NODE_NAMES = "list of names"
    MOCKS = "names with mocks"
    VALUES = "names with values"
    CHANGES = "times with changes"
    TARGETS = "outputs with keys"
    OUTPUT_VALUES = "outputs with values"
    CODE = "failure code"


@dataclass(frozen=True, slots=True)
class Key:
    """One key of a section.

    Attributes:
        word: as written.
        doc: its meaning.
        form: how its value is written.
        required: whether the section needs it.
        declared: declaration of a single value.
        words: allowed words, the default first if there is one.
        section: name of the section of its value.
    """

    word: str
    doc: str
    form: Form
    required: bool = False
    declared: Declaration | None = None
    words: tuple[str, ...] = ()
    section: str = ""


Keys = Mapping[str, Key]

ATTEMPTS = Declaration("attempts", int, at_least=1)
DELAY = Declaration("delay", float, unit="s", default=0.0, at_least=0.0)
TIMES = Declaration("repeat", int, at_least=1)
LIMIT = Declaration("timeout", float, unit="s", above=0.0)
PERIOD = Declaration("every", float, unit="s", above=0.0)
HOLD = Declaration("hold", float, unit="s", default=0.0, at_least=0.0)
AGAIN = Declaration("again", float, unit="s", above=0.0)
TAKES = Declaration("takes", float, unit="s", at_least=0.0)
WITHIN = Declaration("within", float, unit="s", above=0.0)
LASTS = Declaration("for", float, unit="s", above=0.0)
AFTER = Declaration("after", float, unit="s", default=10.0, at_least=0.0)
INVERT = Declaration("invert", bool, default=False)
OPTIONAL = Declaration("optional", bool, default=False)
KEEP = Declaration("keep", bool, default=False)
ON_FAILURE_WORDS = ("fail", "continue")
THEN_WORDS = ("resume", "restart", "abort")
STATUS_WORDS: tuple[str, ...] = ("success", "failure", "running")


def section(*keys: Key) -> Keys:
    """Return a section: its keys by word."""
    return {key.word: key for key in keys}


MISSION = section(
    Key("mission", "Name of the mission.", Form.NAME, required=True),
    Key("format", "Version of the mission language: `1`.", Form.NUMBER),
    Key("doc", "One-sentence description of the mission.", Form.TEXT),
    Key("robot", "Name of a shipped robot, or the path of a `robot.yaml`; or `{use: replayed, log: "
        "file}`.", Form.ROBOT, required=True, section="replayed robot"),
    Key("world", "Name of a shipped world, or the path of a world file; not for replayed robots.",
        Form.WORLD),
    Key("start", "True start pose of the robot: a place or `[x, y, heading]`.", Form.PLACE),
    Key("initial_pose", "Initial pose estimate: `start`, `unknown`, a place or a pose.",
        Form.PLACE, words=("start", "unknown")),
    Key("map", "`from_world` (the default), `none`, a ROS `map.yaml`, or a folder of a saved map.",
        Form.FILE, words=("from_world", "none")),
    Key("markers", "The fiducial markers that the robot knows: `from_world` (the default), `none`, "
        "or a map of markers. A saved map with `markers.yaml` brings its own.",
        Form.FILE, words=("from_world", "none")),
    Key("places", "Named poses in the map frame: `dock: [0, 0, 90 deg]`.", Form.POSES),
    Key("parameters", "Parameter files, applied in order before `navigation`.", Form.FILES),
    Key("navigation", "Components of the navigation stack and their parameters.",
        Form.COMPONENTS),
    Key("localisation",
        "Estimator of the pose: a name, or `{use: name, parameter: value}`.", Form.COMPONENT),
    Key("odometry",
        "Fusion of the odometry: a name, or `{use: name, parameter: value}`.", Form.COMPONENT),
    Key("plugins", "Folders, files or modules with your own behaviours and components of "
        "navigation.", Form.FILES),
    Key("include", "Files whose `trees` and `places` this mission can use.", Form.FILES),
    Key("arguments", "Typed inputs of the mission, set with `--set name=value`.", Form.NAMED,
        section="argument"),
    Key("blackboard", "Typed keys that nodes can read and write.", Form.NAMED,
        section="blackboard key"),
    Key("events", "Conditions checked on every tick in this order; a triggered event pre-empts "
        "`run`.", Form.NAMED_LIST, section="event"),
    Key("faults", "Faults that befall the simulated robot: `- lidar_dropout: {share: 0.4}`, with "
        "`at` and `for`; `treepilot list faults`.", Form.LIST, section="fault"),
    Key("run", "The behaviour tree of the mission.", Form.NODE, required=True),
    Key("trees", "Subtrees for `use`, with inputs (`in`) and outputs (`out`).", Form.NAMED,
        section="tree"),
    Key("tests", "Test cases for `treepilot test`, run without a simulator.", Form.LIST,
        section="case"),
)  # fmt: skip
"""Keys at the top of a mission file."""

RESERVED = ("mapping", "sensors", "perception")
"""Words at the top of a mission file that later versions will support."""

TREE_FILE = section(*(MISSION[word] for word in ("include", "format", "doc", "places", "trees")))
"""Keys at the top of an included file."""

_TYPE = Key("type", "The type of its values.", Form.TYPE, required=True)
_UNIT = Key("unit", "SI unit, for `type: float`.", Form.TEXT)
_DOC = Key("doc", "Description.", Form.TEXT)

REPLAYED_ROBOT = section(
    Key("use", "`replayed`: play a log instead of driving.", Form.WORD, required=True,
        words=("replayed",)),
    Key("log", "CARMEN log (.log, .clf, .gz), ROS bag or `sensors.mcap`; a file or a `$name`.",
        Form.TEXT, required=True),
    Key("robot", "Robot that describes the drive and the shape; default: `scout`. The sensors are "
        "those of the log.", Form.TEXT),
    Key("lidars", "Topics of a ROS bag with laser scans; default: all.", Form.TEXTS),
    Key("odometry", "Topic of a ROS bag with odometry; default: the first.", Form.TEXT),
    Key("imu", "Topic of a ROS bag with inertial samples; default: the first.", Form.TEXT),
    Key("after", "How long the robot stands after the end of the log, for the rest of the mission; "
        "default: 10 s.", Form.VALUE, declared=AFTER),
)  # fmt: skip
"""Keys of `robot` when a log is replayed."""

ARGUMENT = section(
    _TYPE,
    Key("default", "Value without `--set`.", Form.ANY),
    Key("range", "`[minimum, maximum]` of a number.", Form.RANGE),
    Key("one_of", "Allowed texts.", Form.TEXTS),
    _UNIT, _DOC,
)  # fmt: skip

BLACKBOARD_KEY = section(
    _TYPE,
    Key("initial", "Value at the start of the mission.", Form.ANY),
    Key("optional", "Whether it can be unset; test with `$key is set`.", Form.LITERAL,
        declared=OPTIONAL),
    Key("keep", "Whether the next run of the mission begins with the value of the last one.",
        Form.LITERAL, declared=KEEP),
    _UNIT, _DOC,
)  # fmt: skip

INPUT = section(
    Key("type", "Type of the input.", Form.TYPE, required=True),
    Key("default", "Value if `with` does not set the input.", Form.ANY),
    _UNIT, _DOC,
)  # fmt: skip

TREE = section(
    Key("in", "Inputs: `{target: Pose, dwell: {type: duration, default: 3 s}}`.", Form.INPUTS,
        section="input"),
    Key("out", "Outputs: `{photo: path}`.", Form.TYPES),
    Key("doc", "Description of the tree.", Form.TEXT),
    Key("events", "Events that are alive while the tree is running, as those of the mission.",
        Form.NAMED_LIST, section="event"),
    Key("do", "Root node of the tree.", Form.NODE, required=True),
)  # fmt: skip

EVENT = section(
    Key("when", "the condition; evaluated on every tick. The event fires when it becomes true",
        Form.EXPRESSION, required=True),
    Key("hold", "how long the condition must be true; default: 0 s", Form.VALUE, declared=HOLD),
    Key("again", "fires again while the condition stays true, this long after `do` has ended",
        Form.VALUE, declared=AGAIN),
    Key("do", "the node to run, until it ends", Form.NODE, required=True),
    Key("then", "`resume` (default) continues the mission where it was, `restart` starts `run` "
        "again, `abort` ends the mission as failed", Form.WORD, words=THEN_WORDS),
)  # fmt: skip

FAULT = section(
    Key("at", "when it begins: a time, or `{time, near, within, per_minute}`: `near` is a place or "
        "`[x, y]`, `within` the distance to it, `per_minute` the probability that it begins within "
        "a minute, again and again; default: 0 s", Form.ANY),
    Key("for", "how long it lasts; default: to the end", Form.LITERAL, declared=LASTS),
)  # fmt: skip

RETRY = section(
    Key("attempts", "number of attempts, the first one included", Form.VALUE, required=True,
        declared=ATTEMPTS),
    Key("delay", "pause before the next attempt; default: 0 s", Form.VALUE, declared=DELAY),
)  # fmt: skip

RECOVER = section(
    Key("attempts", "number of attempts, the first one included", Form.VALUE, required=True,
        declared=ATTEMPTS),
    Key("unless", "condition under which the failure is final: no recovery, no further attempt",
        Form.EXPRESSION),
    Key("round_robin", "the recoveries; each failure runs the next one, after the last the first",
        Form.NODES, required=True),
)  # fmt: skip

REPEAT = section(
    Key("until", "condition evaluated after each run; if true, the node succeeds", Form.EXPRESSION,
        required=True),
)  # fmt: skip

MODIFIERS = section(
    Key("name", "label in the dashboard and the report", Form.NAME),
    Key("when", "condition evaluated when the node starts; if false, the node is skipped",
        Form.EXPRESSION),
    Key("while", "condition evaluated on every tick; if false, the node is halted and fails "
        "(CHECK_FAILED)", Form.EXPRESSION),
    Key("finally", "node to run however the node ends: after its success or failure, and for one "
        "tick when it is halted", Form.NODE),
    Key("on_failure", "`continue` turns a failure into a success; default: `fail`", Form.WORD,
        words=ON_FAILURE_WORDS),
    Key("invert", "`true` turns a success into a failure (CHECK_FAILED) and a failure into a "
        "success", Form.LITERAL, declared=INVERT),
    Key("repeat", "run again after a success: a number of times, `forever`, or `{until: "
        "condition}`", Form.SECTION, declared=TIMES, words=("forever",), section="repeat"),
    Key("recover", "after a failure run the next recovery, then try again", Form.SECTION,
        section="recover"),
    Key("retry", "try again after a failure: a number of attempts, or `{attempts: 3, delay: "
        "500 ms}`", Form.SECTION, declared=ATTEMPTS, section="retry"),
    Key("timeout", "time limit per attempt; then the node is halted and fails (TIMED_OUT)",
        Form.VALUE, declared=LIMIT),
    Key("every", "run at most once in this period; in between the node returns its last result",
        Form.VALUE, declared=PERIOD),
    Key("with", "with `use`: inputs of the tree", Form.VALUES),
    Key("out", "targets of outputs: `{output: $key}`", Form.TARGETS),
    Key("do", "with `for_each` and `follow_waypoints`: the node to run for each item",
        Form.NODE),
)  # fmt: skip
"""Keys beside the type of a node; those that add a node to the tree stand outermost first."""

CASE = section(
    Key("name", "a sentence about what is tested", Form.NAME),
    Key("arguments", "values for the mission's arguments", Form.VALUES),
    Key("mock", "name of a behaviour, tree or node -> its mock: `{returns, takes, sets}`, or "
        "`real`", Form.MOCKS, section="mock", words=("real",)),
    Key("at", "time -> change at this time: `battery.charge: 0.1`, `$key: value`, `event: name`",
        Form.CHANGES),
    Key("expect", "expected results", Form.SECTION, section="expectation"),
)  # fmt: skip

MOCK = section(
    Key("returns", "outcome of each run: success, failure, running or a failure code",
        Form.OUTCOMES, words=STATUS_WORDS),
    Key("takes", "duration of each run; default: 0 s", Form.DURATIONS, declared=TAKES),
    Key("sets", "outputs with the values that they receive at each success", Form.OUTPUT_VALUES),
)  # fmt: skip

ANY_KEY = "$key"
"""Stands in EXPECTATION for the name of any blackboard key."""

EXPECTATION = section(
    Key("status", "success (default), failure, or running (at the time limit)", Form.WORD,
        words=STATUS_WORDS),
    Key("failure", "code of the first cause", Form.CODE),
    Key("ran", "name -> number of starts, or `[least, most]`", Form.COUNTS),
    Key("order", "names in the order of their starts; others may start in between",
        Form.NODE_NAMES),
    Key("within", "time limit of the mission; or name -> longest duration of a run",
        Form.DURATION_OF, declared=WITHIN),
    Key(ANY_KEY, "value of a blackboard key at the end; the $ is optional", Form.ANY),
)  # fmt: skip


def required(keys: Keys) -> list[str]:
    """Return the keys that a section needs."""
    return [word for word, key in keys.items() if key.required]

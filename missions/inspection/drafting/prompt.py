"""`treepilot schema`: the mission language, what there is, and the usual mistakes, on one page.

Everything comes from the tables that readers, checks and documentation are made from.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from itertools import chain

from behaviours.kind import BehaviourKind
from missions.execution.resources import load_robot, load_world
from missions.inspection.file_descriptions import (
    CURRENT_FOLDER,
    robot_summary_of,
    world_description,
)
from missions.inspection.listing import Installed
from missions.language.codes import CODES
from missions.language.expressions.functions import FUNCTIONS
from missions.language.expressions.robot_values import ROBOT_VALUES
from missions.language.expressions.value_types import NAMED
from missions.language.foreign_words import MODIFIERS as FOREIGN
from missions.language.foreign_words import PORTS as FOREIGN_PORTS
from missions.language.keys import MISSION, RECOVER, Keys
from missions.language.kinds import NODES
from missions.language.sections import SECTIONS
from robots.load import robot_names
from stack.drivetrain.description import RobotDescription
from stack.drivetrain.needs import lacking
from stack.parameters import Declaration, units
from stack.sim.worlds.world import World
from stack.types import FailureCode, Pose2D

ROBOT, WORLD = "scout", "office"
"""Of the page, unless others are asked for."""

LEFT_OUT = ("plugins", "include", "tests", "markers", "odometry", "parameters")
"""Keys of a mission that a first draft needs not."""

PARTS = ("argument", "blackboard key", "event", "tree", "input")
"""Sections whose keys the page lists."""

INSTRUCTIONS = """\
Write one mission for treepilot: a YAML file that becomes a behaviour tree for a mobile robot.
Answer with the YAML alone: no prose before or after it, no Markdown fences, spaces instead of tabs.
Use only what this page lists; invent no behaviour, port, key, place or value. Your draft is read by
`treepilot check --json`, which lists each mistake with its line and what to write instead: apply
exactly that and send the whole file again."""

CONVENTIONS = """\
- A node is one key, the type, with its ports: `wait: {time: 3 s}`. Modifiers stand beside the type,
  at the same indentation, not inside the ports. A value alone goes to the only required port.
- Composites hold a list of nodes. The tree has one root: several nodes stand in a `sequence`.
- Numbers are SI (m, s, rad, m/s). With a unit: `90 deg`, `30 cm`, `2 min`.
- A pose is a list `[x, y, heading]` in the map frame, or `$place`.
- `$name` reads a place, argument, blackboard key, loop variable or input; in a text `${name}`.
  Values of the robot have no `$`: `battery.charge < 0.2`. `set: {n: $n + 1}` writes a key.
- Every blackboard key is declared, with `initial` or `optional: true`. An output goes to a key that
  is declared: `out: {image: $photo}` beside the node.
- A node succeeds, fails or is skipped (`when` is false). A failure ends the mission unless a
  `retry`, `recover`, `fallback` or `on_failure: continue` deals with it.
- Expressions: + - * / < <= > >= == != and or not, `$key is set`, parentheses."""

COMMON = (
    "E120", "E123", "E131", "E132", "E135", "E140", "E142", "E143", "E150", "E151", "E153", "E162",
    "W104", "W106", "W125",
)  # fmt: skip
"""Codes of mistakes that authors make often."""

FOREIGN_WORDS = (
    "if", "loop", "inverter", "forcesuccess", "retryuntilsuccessful", "recoverynode", "then",
    "condition", "isbatterylow", "goalupdated", "stop", "delay",
)  # fmt: skip
"""Words of other tools that authors use often."""


def page(
    known: Installed, robot: str | None = None, world: str | None = None, *, prompt: bool = True
) -> str:
    """Return the page.

    Args:
        known: behaviours and components.
        robot: name or file; None: the usual one.
        world: name or file; None: the usual one.
        prompt: with instructions for a language model, examples and usual mistakes.

    Raises:
        InputError: there is no such robot or world.
    """
    described = load_robot(robot or ROBOT, CURRENT_FOLDER)
    scene = load_world(world or WORLD, CURRENT_FOLDER)
    names = robot or ROBOT, world or WORLD
    parts = [
        *([INSTRUCTIONS] if prompt else []),
        _part("Keys of a mission", _keys(MISSION, LEFT_OUT)),
        _part("Entries", _entries()),
        _part("Conventions", [CONVENTIONS]),
        _part("Composites", (f"- {word}: {kind.doc}" for word, kind in NODES.items())),
        _part("Modifiers, beside the type of a node", _modifiers()),
        _part(
            "Behaviours: name(port: type or unit = default) -> outputs",
            _behaviours(known, described),
        ),
        _part("Values", _values()),
        _part(f"Robot {names[0]}", _robot(described)),
        _part(f"World {names[1]}", [world_description(scene)]),
    ]
    if prompt:
        parts += [_part("Mistakes", _mistakes()), _part("Examples", _examples(names, scene))]
    return "\n\n".join(parts)


def _part(title: str, lines: Iterable[str]) -> str:
    return "\n".join([f"# {title}", *lines])


def _keys(keys: Keys, left_out: tuple[str, ...] = ()) -> Iterator[str]:
    for word, key in keys.items():
        if word not in left_out:
            needed = " (required)" if key.required else ""
            yield f"- {word}{needed}: {key.doc}"


def _entries() -> Iterator[str]:
    """Yield the keys of what stands in a mission by name."""
    for section in PARTS:
        rows = (
            f"{word}{' (required)' if key.required else ''}: {key.doc.rstrip('.')}"
            for word, key in SECTIONS[section].items()
            if word not in ("doc", "keep")
        )
        yield f"- {section}: {'; '.join(rows)}"
    yield f"- types: {', '.join(NAMED)}, list of TYPE"


def _modifiers() -> Iterator[str]:
    yield from _keys(SECTIONS["node"])
    yield "  recover: " + "; ".join(f"{word}: {key.doc}" for word, key in RECOVER.items())


def _behaviours(known: Installed, robot: RobotDescription) -> Iterator[str]:
    """Yield the behaviours that the robot can carry out."""
    for name in known.catalogue.names():
        kind = known.catalogue.get(name)
        if kind is not None and not list(lacking(kind.needs, robot)):
            yield f"- {signature(kind)}: {kind.summary}"


def signature(kind: BehaviourKind) -> str:
    """Return a behaviour with its ports and outputs, in a line."""
    ports = ", ".join(map(_port, kind.ports.values()))
    outputs = ", ".join(f"{item.name}: {_type(item)}" for item in kind.outputs.values())
    return f"{kind.name}({ports})" + (f" -> {outputs}" if outputs else "")


def _port(port: Declaration) -> str:
    text = f"{port.name}: {port.range_text() if port.one_of else _type(port)}"
    if port.required:
        return text
    default = "none" if port.default is None else _default(port)
    return f"{text} = {default}"


def _default(port: Declaration) -> str:
    if isinstance(port.default, bool):
        return str(port.default).lower()
    if isinstance(port.default, list | tuple):
        return f"[{', '.join(map(str, port.default))}]"
    return f"{port.default:g}" if isinstance(port.default, float) else str(port.default or '""')


def _type(item: Declaration) -> str:
    """Return the type of a value in a word: the unit of a number that has one."""
    name = item.type_name().replace("true or false", "bool").replace("whole number", "int")
    return name.replace("number in ", "").replace("duration", "s")


def _values() -> Iterator[str]:
    yield "- of the robot: " + "; ".join(
        f"{name} ({item.help})" for name, item in ROBOT_VALUES.items()
    )
    yield "- functions: " + "; ".join(f"{one.signature} {one.help}" for one in FUNCTIONS.values())
    yield f"- units: {' '.join(units())}"
    yield f"- failure codes, for `error`: {' '.join(FailureCode)}"


def _robot(robot: RobotDescription) -> Iterator[str]:
    yield robot_summary_of(robot)
    sensors = [*robot.all_lidars, *robot.sonars, *robot.depth_cameras]
    sensors += ["camera"] if robot.camera is not None else []
    yield f"sensors: {', '.join(sensors) or 'none'}; other robots: {', '.join(robot_names())}"


def _mistakes() -> Iterator[str]:
    for code in COMMON:
        item = CODES[code]
        example = " / ".join(item.example.splitlines())
        yield f"- {item.title}: {item.cause}. Wrong: `{example}`. {item.fix.capitalize()}."
    yield from (f"- not `{word}`: {FOREIGN[word]}" for word in FOREIGN_WORDS)
    ports = ", ".join(f"{foreign} -> {own}" for foreign, own in FOREIGN_PORTS.items())
    yield f"- ports have other names here: {ports}"


def examples(robot: str, world: str, places: Mapping[str, Pose2D]) -> list[str]:
    """Return three short missions for a robot in a world: a drive, a patrol, and a fallback.

    Args:
        robot: name or file.
        world: name or file.
        places: at least one.
    """
    names = list(places)
    first, second = names[0], names[-1]
    head = f"robot: {robot}\nworld: {world}\n"
    return [text.format(head=head, first=first, second=second) for text in _EXAMPLES]


def _examples(names: tuple[str, str], world: World) -> Iterator[str]:
    shown = examples(*names, world.places or {"start": world.start})
    yield from chain.from_iterable((text.rstrip(), "---") for text in shown)


_EXAMPLES = (
    """\
mission: drive and come back
{head}run:
  sequence:
    - navigate_to_pose: {{goal: ${first}}}
      timeout: 2 min
      retry: 2
    - wait: 3 s
    - navigate_to_pose: {{goal: ${second}, tolerance: 20 cm}}
""",
    """\
mission: patrol with recoveries
{head}arguments:
  stops: {{type: list of Pose, default: [${first}, ${second}]}}
blackboard:
  visited: {{type: int, initial: 0}}
events:
  - low_battery: {{when: battery.charge < 20 %, do: {{say: "the battery is low"}}, then: abort}}
run:
  sequence:
    - for_each: {{stop: $stops}}
      on_failure: continue
      do: {{use: visit, with: {{goal: $stop}}}}
    - say: "visited ${{visited}} stops"
trees:
  visit:
    in: {{goal: Pose}}
    do:
      sequence:
        - navigate_to_pose: {{goal: $goal}}
          timeout: 90 s
          recover:
            attempts: 4
            round_robin:
              - clear_costmap: both
              - back_up: {{distance: 30 cm}}
              - spin: 90 deg
        - set: {{visited: $visited + 1}}
""",
    """\
mission: try one place, else the other
{head}run:
  fallback:
    - navigate_to_pose: ${second}
      timeout: 60 s
    - sequence:
        - say: "cannot reach {second}"
        - navigate_to_pose: ${first}
""",
)

"""Reader of `faults` in missions, worlds and files of faults.

faults:
  - lidar_dropout: {share: 0.4}
    at: 20 s
    for: 10 s
  - push
    at: {near: dock}
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import inf
from typing import Any

from stack.documents import Findings, Node, Section
from stack.errors import InputError, ParameterError
from stack.parameters import FARTHEST, Declaration, build, declarations, suggestion
from stack.sim.faults.fault import BEFORE, LASTING, Fault
from stack.sim.faults.planned import PlannedFault
from stack.sim.faults.registry import fault_kind, fault_names
from stack.types import Pose2D

CODE = "E210"

TIME = Declaration("time", float, "simulated time from which it may begin", "s", 0.0, at_least=0.0)
WITHIN = Declaration(
    "within", float, "distance to the place `near`", "m", 0.5, above=0.0, at_most=FARTHEST
)
PER_MINUTE = Declaration(
    "per_minute", float, "probability that it begins within a minute, again and again",
    default=0.0, at_least=0.0, at_most=0.999,
)  # fmt: skip
DURATION = Declaration("for", float, "how long it lasts; default: to the end", "s", inf, above=0.0)
TIMING = ("at", "for")
ORIGIN = Pose2D(0.0, 0.0)
CIRCLE = tuple(
    Declaration(name, float, "world frame", "m", at_least=-FARTHEST, at_most=FARTHEST)
    for name in ("x", "y")
)
Places = Mapping[str, Pose2D] | None


def read_faults(
    nodes: Sequence[Node], findings: Findings, places: Places
) -> tuple[PlannedFault, ...]:
    """Read a list of faults.

    Args:
        nodes: its entries.
        findings: receives what is wrong.
        places: named poses that it may refer to, world frame; None: they are not known yet, and
            any name is one.
    """
    found = [fault for node in nodes if (fault := _fault(node, findings, places)) is not None]
    return numbered(found)


def numbered(faults: Sequence[PlannedFault]) -> tuple[PlannedFault, ...]:
    """Return faults with different names: `push`, `push_2`, `push_3`."""
    names: list[str] = []
    for fault in faults:
        number = 1 + sum(other.kind == fault.kind for other in faults[: len(names)])
        names.append(fault.kind if number == 1 else f"{fault.kind}_{number}")
    return tuple(replace(fault, name=name) for fault, name in zip(faults, names, strict=True))


def default_fault(name: str) -> PlannedFault:
    """Return a fault with the default numbers of its kind, from the beginning to the end.

    Raises:
        InputError: there is no such kind.
    """
    return PlannedFault(name, name, fault_kind(name).Parameters())


def changed(fault: PlannedFault, name: str, raw: Any) -> PlannedFault:
    """Return a fault with another number: of its parameters, `at` (seconds) or `for`.

    Raises:
        ParameterError: there is no such number, or it is wrong.
    """
    kind = fault_kind(fault.kind).kind
    known = declarations(fault_kind(fault.kind).Parameters)
    if name in known:
        value = known[name].read(raw)
        return replace(fault, parameters=replace(fault.parameters, **{name: value}))
    timing = ["at", PER_MINUTE.name] if kind != BEFORE else []
    timing += ["for"] if kind == LASTING else []
    if name not in timing:
        hint: str = suggestion(name, [*known, *timing])
        raise ParameterError(name, f"the fault {fault.name} has no number {name!r}", hint)
    if name == "at":
        return replace(fault, time=replace(TIME, name="at").read(raw))
    if name == "for":
        return replace(fault, duration=DURATION.read(raw))
    return replace(fault, per_minute=PER_MINUTE.read(raw))


def _fault(node: Node, findings: Findings, places: Places) -> PlannedFault | None:
    """Read an entry: the name of its kind, or a mapping with it."""
    if isinstance(node.value, str):
        kind = _kind(node, findings)
        return None if kind is None else default_fault(str(node.value))
    words = [key for key, _ in node.entries if key.value not in TIMING]
    if not node.is_mapping or len(words) != 1:
        got = f"got {len(words)} of them" if node.is_mapping else f"got {node.words()}"
        hint = "write `- lidar_dropout: {share: 0.4}`, and `at: 20 s` and `for: 10 s` below it"
        findings.add(CODE, node.mark, f"a fault is one kind with its numbers; {got}", hint)
        return None
    section = Section(node, findings, "a fault", CODE)
    kind = _kind(words[0], findings)
    name = str(words[0].value)
    section.node_of(name)
    parameters = None if kind is None else _parameters(kind, section, name, places)
    when, duration = _when(section, places), section.value(DURATION)
    if kind is not None:
        _refuse_timing(kind, section)
    if parameters is None:
        return None
    return PlannedFault(name, name, parameters, *when, duration)


def _kind(node: Node, findings: Findings) -> type[Fault] | None:
    try:
        return fault_kind(str(node.value))
    except InputError:
        hint: str = suggestion(str(node.value), fault_names())
        findings.add(CODE, node.mark, f"there is no fault {node.value!r}", hint)
        return None


def _parameters(kind: type[Fault], section: Section, name: str, places: Places) -> Any:
    """Return the parameters of a fault; None if they are wrong."""
    node = section.node.get(name)
    raw: Any = {} if node is None or node.value is None else node.plain()
    where = section.key_mark(name) if node is None else node.mark
    if not isinstance(raw, dict):
        sentence = f"{name}: expected its numbers {{name: value}}, got {raw!r:.40}"
        section.findings.add(CODE, where, sentence)
        return None
    poses = [key for key, item in declarations(kind.Parameters).items() if _is_pose(item)]
    for key in poses:
        named = raw[key].removeprefix("$") if isinstance(raw.get(key), str) else None
        if named is not None and (places is None or named in places):
            raw[key] = ORIGIN if places is None else places[named]
    try:
        return build(kind.Parameters, raw)
    except ParameterError as error:
        own = None if node is None else node.get(error.name)
        sentence = f"{name}: {error}"
        section.findings.add(CODE, where if own is None else own.mark, sentence, error.hint)
        return None


def _is_pose(declared: Declaration) -> bool:
    return declared.type in (Pose2D, Pose2D | None)


def _when(
    section: Section, places: Places
) -> tuple[float, tuple[float, float, float] | None, float]:
    """Return time, circle and probability a minute of `at`."""
    node = section.node_of("at")
    if node is None:
        return 0.0, None, 0.0
    if not node.is_mapping:
        return section.read(replace(TIME, name="at"), node, 0.0), None, 0.0
    when = section.part("at", node)
    time, within, chance = when.value(TIME), when.value(WITHIN), when.value(PER_MINUTE)
    near = when.node_of("near")
    middle = None if near is None else _place(when, near, places)
    when.done()
    circle = None if middle is None else (*middle, within)
    return time, circle, chance


def _place(section: Section, node: Node, places: Places) -> tuple[float, float] | None:
    """Return x and y of a place or a point."""
    if not isinstance(node.value, str):
        found = section.parts("near", node, CIRCLE)
        return None if found is None else (found[0], found[1])
    name = node.value.removeprefix("$")
    if places is None:
        return ORIGIN.x, ORIGIN.y
    if name not in places:
        hint: str = suggestion(name, places)
        section.findings.add(CODE, node.mark, f"near: there is no place {name!r}", hint)
        return None
    return places[name].x, places[name].y


def _refuse_timing(kind: type[Fault], section: Section) -> None:
    """Report `at` and `for` of a kind that has neither begin nor end."""
    words = {"at": (BEFORE,), "for": tuple(k for k in ("now", BEFORE))}
    for word, kinds in words.items():
        node = section.node.get(word)
        if node is not None and kind.kind in kinds:
            reason = "is there before the run" if kind.kind == BEFORE else "happens in one moment"
            name = next(
                str(key.value) for key, _ in section.node.entries if key.value not in TIMING
            )
            section.findings.add(CODE, node.mark, f"{name} {reason}: `{word}` has no meaning")

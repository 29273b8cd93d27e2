"""Files of sweeps: the options of the command line as YAML."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

from missions.sweeps.claims import Claim, Condition, read_claim, read_condition
from missions.sweeps.design import DESIGNS
from missions.sweeps.factors import Factor, listed, read_factor
from missions.sweeps.sweep import KEEP
from stack.documents import Finding, Findings, Mark, Node, Section, read_file
from stack.errors import InputError
from stack.parameters import REQUIRED, Declaration

T = TypeVar("T")

WHAT, CODE = "sweep file", "E520"

KEYS = {
    declared.name: declared
    for declared in (
        Declaration("mission", str, "mission file or name of a shipped mission", default=REQUIRED),
        Declaration("runs", int, "number of runs", default=None, at_least=1),
        Declaration("design", str, "how values are chosen", default=None, one_of=DESIGNS),
        Declaration("worlds", str, "pattern of world files, or of names", default=None),
        Declaration("seed", int, "seed of the first run", default=None, at_least=0),
        Declaration("jobs", int, "processes", default=None, at_least=1),
        Declaration("cluster", str, "address of a Dask scheduler", default=None),
        Declaration("out", str, "folder of the results", default=None),
        Declaration("keep", str, "runs whose folders are kept", default=None, one_of=KEEP),
        Declaration("time_limit", float, "simulated time", "s", default=None, above=0.0),
        Declaration("hang_after", float, "wall time", "s", default=None, above=0.0),
    )
}

OTHERS = ("vary", "robots", "set", "parameters", "until", "fail_if")


@dataclass(frozen=True)
class SweepFile:
    """Contents of a sweep file; None and empty: not given.

    Attributes:
        values: of KEYS, by key.
        factors: under `vary`. marks: their positions, by name.
        robots: under `robots`. arguments: under `set`. parameters: under `parameters`.
        until: claim that ends the sweep. fail_if: conditions.
    """

    values: Mapping[str, Any]
    factors: tuple[Factor, ...] = ()
    marks: Mapping[str, Mark] = field(default_factory=dict)
    robots: tuple[str, ...] | None = None
    arguments: Mapping[str, str] = field(default_factory=dict)
    parameters: Mapping[str, str] = field(default_factory=dict)
    until: Claim | None = None
    fail_if: tuple[Condition, ...] = ()

    def refusal(self, factor: Factor, error: InputError) -> InputError:
        """Return the error of a factor, with its place in the file if it is there."""
        if factor.name not in self.marks:
            return InputError(f"--vary {factor.name}: {error}")
        sentence = f"vary: {factor.name}: {error}"
        return InputError([Finding(self.marks[factor.name], CODE, sentence)])


EMPTY = SweepFile({})


def is_sweep_file(path: Path) -> bool:
    """Whether a file is one of a sweep, and no mission."""
    if path.suffix not in (".yaml", ".yml") or not path.is_file():
        return False
    try:
        node = read_file(path, WHAT)
    except InputError:
        return False  # the reader of missions says what is wrong
    words = {*KEYS, *OTHERS} - {"mission", "parameters"}  # missions have these, too
    return node.get("run") is None and any(node.get(key) for key in words)


def read_sweep_file(path: Path) -> SweepFile:
    """Read a file.

    Raises:
        InputError: it has errors; all of them as findings with line and column.
    """
    findings = Findings()
    top = Section(read_file(path, WHAT), findings, "the sweep", CODE, (*KEYS, *OTHERS))
    values = {name: top.value(declared) for name, declared in KEYS.items()}
    factors = _factors(top.node_of("vary"), findings)
    until = [node] if (node := top.node_of("until")) is not None else []
    words = SweepFile(
        values, tuple(factors.values()), {name: mark for name, mark in _marks(top.node_of("vary"))},
        tuple(_each(top.sequence("robots"), "robots", str, findings)) if top.node.get("robots")
        else None,
        _texts(top.node_of("set"), "set", findings),
        _texts(top.node_of("parameters"), "parameters", findings),
        next(_each(until, "until", read_claim, findings), None),
        tuple(_each(_nodes(top.node_of("fail_if")), "fail_if", read_condition, findings)),
    )  # fmt: skip
    top.done()
    findings.raise_errors()
    return _located(words, path.parent)


def _located(words: SweepFile, folder: Path) -> SweepFile:
    """Return the words with names of files relative to the folder of the sweep file."""
    values = dict(words.values)
    if (folder / str(values["mission"])).exists():
        values["mission"] = str(folder / values["mission"])
    if values["worlds"] is not None and "/" in values["worlds"]:
        values["worlds"] = str(folder / values["worlds"])
    robots = tuple(str(folder / name) if "/" in name else name for name in words.robots or ())
    return replace(words, values=values, robots=None if words.robots is None else robots)


def _factors(node: Node | None, findings: Findings) -> dict[str, Factor]:
    found: dict[str, Factor] = {}
    if node is None:
        return found
    if not node.is_mapping:
        hint = "write one line a factor: controller.cruise_speed: uniform(0.4, 0.8)"
        findings.add(CODE, node.mark, f"vary: expected a mapping, got {node.words()}", hint)
    for key, value in node.entries:
        name = str(key.value)
        try:
            if value.is_sequence:
                found[name] = listed(name, [_text(item) for item in value.items])
            else:
                found[name] = read_factor(name, _text(value))
        except InputError as error:
            findings.add(CODE, value.mark, f"vary: {name}: {error}")
    return found


def _marks(node: Node | None) -> list[tuple[str, Mark]]:
    return [] if node is None else [(str(key.value), key.mark) for key, _ in node.entries]


def _texts(node: Node | None, what: str, findings: Findings) -> dict[str, str]:
    if node is None:
        return {}
    if not node.is_mapping:
        findings.add(CODE, node.mark, f"{what}: expected a mapping, got {node.words()}")
    return {
        str(key.value): text
        for key, value in node.entries
        for text in _each([value], f"{what}: {key.value}", str, findings)
    }


def _nodes(node: Node | None) -> list[Node]:
    """Return the items of a list, or the one value in its place."""
    return [] if node is None else node.items if node.is_sequence else [node]


def _each(
    nodes: Iterable[Node], what: str, read: Callable[[str], T], findings: Findings
) -> Iterator[T]:
    """Yield what is read from the texts of nodes; add a finding for each that is refused."""
    for node in nodes:
        try:
            yield read(_text(node))
        except InputError as error:
            findings.add(CODE, node.mark, f"{what}: {error}")


def _text(node: Node) -> str:
    """Return a value as it would be written on the command line.

    Raises:
        InputError: it is a mapping, or has one in it.
    """
    if node.is_mapping:
        raise InputError("expected a text or a number, got a mapping")
    if node.is_sequence:
        return f"[{', '.join(_text(item) for item in node.items)}]"
    if isinstance(node.value, bool):
        return "true" if node.value else "false"
    return "" if node.value is None else str(node.value)

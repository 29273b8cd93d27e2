"""Reader of the key `robot`: a name or file, or a log that is replayed.

    robot: {use: replayed, log: $log, robot: scout}

Values of components and of `robot` may refer to arguments.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import is_dataclass
from pathlib import Path
from typing import Any

from missions.language.expressions.scope import UNSET, Scope, Symbol
from missions.language.keys import AFTER, REPLAYED_ROBOT
from missions.language.model import Replay
from missions.language.reading.port_expressions import reference_name
from missions.language.reading.words import WordRole, Words
from stack.documents import Findings, Node, Section
from stack.errors import ParameterError
from stack.parameters import suggestion, values_of

REPLAYED = "replayed"
USUAL_ROBOT = "scout"
"""Drive, limits and shape of a replayed robot unless the mission names another."""


class HeaderValues:
    """Values at the top of a mission, with `$name` replaced by the values of arguments.

    Args:
        arguments: by name.
        given: names of the arguments that the command line sets: paths in them are relative to the
            current folder.
        folder: of the mission, for all other paths.
    """

    def __init__(
        self, arguments: Mapping[str, Symbol], given: frozenset[str], folder: Path,
        findings: Findings, words: Words,
    ) -> None:  # fmt: skip
        self.arguments, self.given, self.folder = arguments, given, folder
        self.findings, self.words = findings, words
        self.used: set[Symbol] = set()

    def plain(self, node: Node) -> Any:
        """Return the value of a node without positions."""
        if node.is_mapping:
            return {str(key.value): self.plain(value) for key, value in node.entries}
        if node.is_sequence:
            return [self.plain(item) for item in node.items]
        name = reference_name(node)
        return node.value if name is None else self._argument(name, node)

    def path(self, node: Node) -> Path | None:
        """Return the path that a node holds; None after a finding."""
        value = self.plain(node)
        if not isinstance(value, str) or not value:
            if value is not UNSET:
                self.findings.add("E101", node.mark, f"expected a file, got {node.words()}")
            return None
        name = reference_name(node)
        return (Path.cwd() if name in self.given else self.folder) / Path(value).expanduser()

    def _argument(self, name: str, node: Node) -> Any:
        symbol = self.arguments.get(name)
        self.words.add(node, WordRole.VALUE, Scope((self.arguments,)))
        if symbol is None:
            hint = suggestion(name, self.arguments) if self.arguments else "declare it there"
            sentence = f"${name}: values at the top of a mission refer to its `arguments`"
            self.findings.add("E101", node.mark, sentence, hint)
            return UNSET
        self.used.add(symbol)
        return _plain(symbol.value)


def _plain(value: Any) -> Any:
    """Return the value of an argument as it would be written: a pose is `[x, y, heading]`."""
    if isinstance(value, tuple | list):
        return [_plain(item) for item in value]
    if is_dataclass(value) and not isinstance(value, type):
        return list(values_of(value).values())
    return value


class RobotReader:
    """Reads `robot: {use: replayed, log: …}`."""

    def __init__(self, values: HeaderValues) -> None:
        self.values, self.findings = values, values.findings

    def replay(self, node: Node) -> tuple[str, Replay | None]:
        """Return the robot that describes the drive, and the log; None after a finding."""
        self.values.words.keys(node, "replayed robot")
        if node.get("use") is None and node.get("log") is None:
            name = node.get("name") or node.get("type")
            sentence = "`robot` is a name or a path; only a replayed robot has keys"
            hint = f"write robot: {name.value if name else USUAL_ROBOT}"
            self.findings.add("E101", node.mark, sentence, hint)
            return USUAL_ROBOT, None
        section = Section(node, self.findings, "`robot`", "E101", [*REPLAYED_ROBOT])
        use = section.node_of("use", required=True)
        if use is not None:
            self.values.words.choice(use, (REPLAYED,))
            if use.value != REPLAYED:
                sentence = f"robot: {use.words()} is not a kind of robot with settings"
                self.findings.add("E101", use.mark, sentence, f"write `use: {REPLAYED}`")
        log = section.node_of("log", required=True)
        path = None if log is None else self.values.path(log)
        robot, after = section.node_of("robot"), section.node_of("after")
        lidars = self._texts(section.node_of("lidars"), "lidars")
        odometry, imu = (self._text(section.node_of(word), word) for word in ("odometry", "imu"))
        base = self._text(robot, "robot") if robot is not None else USUAL_ROBOT
        seconds = AFTER.default if after is None else self._seconds(after)
        section.done()
        if path is None or use is None or log is None:
            return base, None
        return base, Replay(path, log.mark, tuple(lidars), odometry, imu, seconds)

    def _seconds(self, node: Node) -> float:
        try:
            return float(AFTER.read(self.values.plain(node)))
        except ParameterError as error:
            self.findings.add("E101", node.mark, str(error), error.hint)
            return 0.0

    def _text(self, node: Node | None, word: str) -> str:
        if node is None:
            return ""
        value = self.values.plain(node)
        if isinstance(value, str) and value:
            return value
        self.findings.add("E101", node.mark, f"{word}: expected a text, got {node.words()}")
        return ""

    def _texts(self, node: Node | None, word: str) -> list[str]:
        if node is None:
            return []
        if not node.is_sequence:
            sentence = f"{word}: expected a list of topics, got {node.words()}"
            self.findings.add("E101", node.mark, sentence)
            return []
        return [self._text(item, word) for item in node.items]

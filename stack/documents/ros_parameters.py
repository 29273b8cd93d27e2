"""The YAML of ROS parameter files: what ROS accepts and other files of treepilot refuse.

ROS reads these files with libyaml (rcl_yaml_param_parser), nav2_bringup with PyYAML before. Both
take the last of several equal keys, know infinite numbers, and YAML 1.1's words for true and false.
"""

from __future__ import annotations

from typing import Any, ClassVar

from stack.documents.findings import Mark
from stack.documents.yaml_nodes import CORE_WORDS, Composer, Node

DUPLICATE = "W111"
_MERGE = "<<"
_TRUE, _FALSE = ("yes", "Yes", "YES", "on", "On", "ON"), ("no", "No", "NO", "off", "Off", "OFF")


class RosComposer(Composer):
    """Composes the nodes of a ROS parameter file; duplicate keys are warnings."""

    words: ClassVar = {**CORE_WORDS, **dict.fromkeys(_TRUE, True), **dict.fromkeys(_FALSE, False)}

    def _repeated(
        self, entry: tuple[Node, Node], first: Mark, entries: list[tuple[Node, Node]]
    ) -> None:
        key, _ = entry
        at = next(at for at, (known, _) in enumerate(entries) if known.value == key.value)
        line = entries[at][0].mark.line
        sentence = f"duplicate key {key.value!r}: the value in line {line} has no effect"
        self.findings.add(DUPLICATE, key.mark, sentence, "ROS uses the last one; remove one")
        entries[at] = entry

    def _entries(self, depth: int) -> list[tuple[Node, Node]]:
        """Entries of a mapping, with those of the mappings that its `<<` names."""
        entries = super()._entries(depth)
        merged = next((value for key, value in entries if key.value == _MERGE), None)
        if merged is None:
            return entries
        own = [entry for entry in entries if entry[0].value != _MERGE]
        known = {key.value for key, _ in own}
        for source in merged.items or [merged]:
            own += [entry for entry in source.entries if entry[0].value not in known]
            known |= {key.value for key, _ in source.entries}
        return own

    def _special(self, text: str, mark: Mark) -> float:
        number: Any = text.replace(".", "")
        return float(number)

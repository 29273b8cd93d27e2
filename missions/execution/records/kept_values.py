"""Values of blackboard keys with `keep: true`: kept from one run of a mission to the next.

They are in one JSON file per mission beside its run folders, `<mission>.kept.json`. It is replaced
as a whole, at most once a second of robot time and at the end of a run, so a killed run loses at
most its last second. Keys that the mission no longer declares stay in the file.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from missions.execution.prepare import PreparedMission, RunOptions
from missions.language.expressions.scope import UNSET, Symbol
from missions.trees.mission_tree import MissionTree
from missions.trees.slots import Slot
from stack.documents.files import decoded, read_input
from stack.errors import EvaluationError, Finding, InputError, Mark, ParameterError
from stack.schedule import Schedule
from stack.telemetry.hub import Telemetry
from stack.types import Pose2D

FORMAT = 1
PERIOD = 1.0
"""Seconds of robot time between two writes."""

BYTES = 10_000_000
"""Largest file that is read."""


class KeptValues:
    """The kept values of one mission.

    Args:
        runs: folder of the run folders.
        stem: of the mission file.
        mission: the mission's name.
        symbols: its blackboard.
        forget: start from the initial values; the file of earlier runs becomes `.bak`.

    Raises:
        InputError: the file is damaged, of another mission or format, or a value does not fit its
            key. It is not changed.
    """

    def __init__(
        self, runs: Path, stem: str, mission: str, symbols: Mapping[str, Symbol], *, forget: bool
    ) -> None:
        self.path, self._mission = runs / f"{stem}.kept.json", mission
        self._entries: dict[str, Any] = {}
        self.values: dict[str, Any] = {}
        self._writes = Schedule(PERIOD)
        if not self.path.exists():
            return
        if forget:
            self.path.replace(self.path.with_name(f"{self.path.name}.bak"))
            return
        self._entries = self._read()
        kept = {name: symbol for name, symbol in symbols.items() if symbol.keep}
        self.values = {
            name: self._value(symbol) for name, symbol in kept.items() if name in self._entries
        }

    def restore(self, tree: MissionTree, telemetry: Telemetry) -> None:
        """Write the values of the last run into a new tree, and into the event log."""
        for name, value in self.values.items():
            tree.write(name, None if value is UNSET else value)
            text = f"{name} = {tree.blackboard()[name]}, kept from the last run"
            telemetry.emit("kept", text, source="mission")

    def follow(self, tree: MissionTree, time: float, lose: Callable[[str, str], None]) -> None:
        """Save changed values if the last time was at least a second ago; see `save`."""
        if self._writes.take(time):
            self.save(tree, lose)

    def save(self, tree: MissionTree, lose: Callable[[str, str], None]) -> None:
        """Replace the file if a value has changed; `lose` gets file and reason if it fails."""
        new = {
            name: {"type": str(kind), "value": None if value is UNSET else _plain(value)}
            for name, (kind, value) in tree.kept().items()
        }
        if all(self._entries.get(name) == entry for name, entry in new.items()):
            return
        self._entries |= new
        content = {"format": FORMAT, "mission": self._mission, "values": self._entries}
        unfinished = self.path.with_name(f".{self.path.name}.new")
        try:
            unfinished.write_text(json.dumps(content, indent=2, ensure_ascii=False) + "\n", "utf-8")
            unfinished.replace(self.path)
        except OSError as error:
            unfinished.unlink(missing_ok=True)
            lose(self.path.name, error.strerror or str(error))

    def _read(self) -> dict[str, Any]:
        """Return the entries of the file."""
        try:
            raw = read_input(self.path, "file of kept values", BYTES)
            content = json.loads(decoded(raw, self.path))
        except (ValueError, RecursionError) as error:
            raise self._refused(f"damaged: {error}") from None
        if not isinstance(content, dict) or not isinstance(content.get("values"), dict):
            raise self._refused("damaged: expected an object with format, mission and values")
        if content.get("format") != FORMAT:
            raise self._refused(f"format {content.get('format')!r}; this version reads {FORMAT}")
        if content.get("mission") != self._mission:
            raise self._refused(
                f"it belongs to the mission {content.get('mission')!r}, not {self._mission!r};"
                " write the runs of the two missions into different folders (--out)"
            )
        entries: dict[str, Any] = content["values"]
        for name, entry in entries.items():
            if not isinstance(entry, dict) or set(entry) != {"type", "value"}:
                raise self._refused(f"damaged: {name!r} has no type and value")
        return entries

    def _value(self, symbol: Symbol) -> Any:
        """Return the value of a key as the mission declares it."""
        entry, kind = self._entries[symbol.name], symbol.type
        if entry["type"] != str(kind):
            raise self._refused(
                f"{symbol.name!r} was kept as {entry['type']}, the mission declares {kind}"
            )
        if entry["value"] is None:
            return UNSET
        try:
            value = kind.declaration(symbol.name).read(entry["value"])
            Slot(symbol).write(value)  # checks its size
        except (ParameterError, EvaluationError) as error:
            raise self._refused(f"{symbol.name!r}: {error}") from None
        return value

    def _refused(self, sentence: str) -> InputError:
        hint = "correct the file, or start without it: --forget-kept (it becomes a .bak file)"
        return InputError([Finding(Mark(str(self.path), 1, 1), "E136", sentence, hint)])


def kept_values_of(plan: PreparedMission, options: RunOptions) -> KeptValues | None:
    """Return the kept values of a run with records; None if there are none to keep."""
    mission = plan.mission
    if options.out is None or plan.recording is not None:
        return None
    if not any(symbol.keep for symbol in mission.blackboard.values()):
        return None
    return KeptValues(
        options.out.parent, mission.source.stem, mission.name, mission.blackboard,
        forget=options.forget_kept,
    )  # fmt: skip


def _plain(value: Any) -> Any:
    """Return a value as JSON: a pose is [x, y, heading] in metres and radians."""
    if isinstance(value, Pose2D):
        return [value.x, value.y, value.heading]
    if isinstance(value, list):
        return [_plain(item) for item in value]
    return value

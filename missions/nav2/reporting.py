"""Output of a Nav2 import: components of the mission, warnings, a listing, a parameter file."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from missions.language.model import Component
from missions.nav2.reading import Nav2Settings
from missions.nav2.reasons import NO_EQUIVALENT
from stack.documents import Finding, Mark, as_yaml

CODE = "W110"
MAX_NAMES = 6
"""Number of parameters that a warning names; it counts the others."""


def components_of(settings: Nav2Settings) -> dict[str, Component]:
    """Return the imported settings as components of a mission, with positions in the Nav2 file."""
    unknown_position = Mark("nav2_params")
    found = {}
    for kind, chosen in settings.kinds.items():
        mark = chosen.use_mark or next(iter(chosen.marks.values()), unknown_position)
        found[kind] = Component(kind, chosen.use, mark, chosen.values, chosen.marks)
    return found


def warnings_of(settings: Nav2Settings) -> tuple[Finding, ...]:
    """Return the warnings of the import, and one per server about parameters without effect."""
    by_server: dict[str, list[tuple[str, Mark]]] = {}
    for item in settings.ignored:
        if item.reason == NO_EQUIVALENT:
            server, _, name = item.path.partition(".")
            by_server.setdefault(server, []).append((name, item.mark))
    without_effect = (_warning(server, items) for server, items in by_server.items())
    return (*settings.warnings, *without_effect)


def _warning(server: str, items: list[tuple[str, Mark]]) -> Finding:
    names = ", ".join(name for name, _ in items[:MAX_NAMES])
    more = f" and {len(items) - MAX_NAMES} more" if len(items) > MAX_NAMES else ""
    hint = "`treepilot nav2 FILE` lists everything"
    return Finding(items[0][1], CODE, f"{server}: no equivalent for {names}{more}", hint)


def lines_of(settings: Nav2Settings) -> Iterator[str]:
    """Yield the listing: imported parameters with their equivalents, ignored ones with reasons."""
    yield f"Imported: {len(settings.imported)}"
    for item in settings.imported:
        equivalent = f"{item.kind}.{item.name} = {_short(item.value)}"
        yield f"  {item.mark.line:>5}  {item.path}  ->  {equivalent}"
    yield f"Ignored: {len(settings.ignored)}"
    for ignored in settings.ignored:
        yield f"  {ignored.mark.line:>5}  {ignored.path}  ({ignored.reason})"


def parameter_file(settings: Nav2Settings, source: str) -> str:
    """Return the imported settings as a treepilot parameter file, for a mission's `parameters`."""
    section: dict[str, Any] = {
        kind: {**({"use": chosen.use} if chosen.use else {}), **chosen.values}
        for kind, chosen in settings.kinds.items()
    }
    return f"# From {source}, by `treepilot nav2`.\n{as_yaml(section)}"


def _short(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)

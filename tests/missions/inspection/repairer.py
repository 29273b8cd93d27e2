"""A repairer of drafts without understanding: it does what the findings of `check --json` say.

It reads the fields of a finding and the words of its hint, and knows nothing of missions.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

from missions.inspection.check import as_json, check_files
from missions.inspection.drafting.fixes import end_of_value

FENCE = re.compile(r"^\s*(```|~~~)")


def findings_of(file: Path) -> list[dict]:
    """Return the errors of a file, as `check --json` prints them."""
    found = json.loads(as_json(check_files([str(file)])))
    return [finding for finding in found if finding["severity"] == "error"]


def rounds(text: str, file: Path, most: int = 6) -> int | None:
    """Return after how many repairs a draft is clean; None if it is not after `most`."""
    for number in range(most + 1):
        file.write_text(text)
        found = findings_of(file)
        if not found:
            return number
        text = repaired(text, found)
    return None


def repaired(text: str, found: list[dict]) -> str:
    """Return a text with what the findings say, the last one first: positions stay valid."""
    for finding in sorted(found, key=lambda it: (it["line"], it["column"]), reverse=True):
        lines = text.split("\n")
        if finding["line"] > len(lines):
            continue
        text = "\n".join(_repaired(lines, finding))
    return text


def _repaired(lines: list[str], finding: dict) -> list[str]:
    row, at, hint = finding["line"] - 1, finding["column"] - 1, finding["hint"]
    if finding["fix"]:
        end = at + len(finding["word"])
        lines[row] = lines[row][:at] + finding["fix"] + lines[row][end:]
        return lines
    for pattern, rule in RULES.items():
        told = re.search(pattern, hint)
        if told:
            return rule(lines, row, at, told)
    return lines


Rule = Callable[[list[str], int, int, "re.Match[str]"], list[str]]


def _inside_fences(lines, row, at, told):
    first, *others = (number for number, line in enumerate(lines) if FENCE.match(line))
    return lines[first + 1 : others[0] if others else None]


def _without_tabs(lines, row, at, told):
    return [line.replace("\t", "  ") for line in lines]


def _without_line(lines, row, at, told):
    return lines[:row] + lines[row + 1 :]


def _as_comment(lines, row, at, told):
    lines[row] = lines[row].replace("//", "#", 1)
    return lines


def _without_entry(lines, row, at, told):
    """Remove a key with its value: in brackets, or the line and what is indented below it."""
    line = lines[row]
    if line[:at].count("{") > line[:at].count("}"):
        start, end = _entry(line, at)
        lines[row] = line[:start] + line[end:]
        return lines
    below = row + 1
    while below < len(lines) and re.match(rf" {{{at + 1},}}", lines[below]):
        below += 1
    return lines[:row] + lines[below:]


def _entry(line: str, at: int) -> tuple[int, int]:
    """Return begin and end of `key: value` in brackets, with the comma before or behind it."""
    colon = line.index(":", at)
    value = colon + 1 + len(line[colon + 1 :]) - len(line[colon + 1 :].lstrip())
    end = end_of_value(line, value + 1) - 1
    if line[:at].rstrip().endswith(","):
        return len(line[:at].rstrip()) - 1, end
    behind = re.match(r"\s*,\s*", line[end:])
    return at, end + (behind.end() if behind else 0)


def _first_available(lines, row, at, told):
    end = end_of_value(lines[row], at + 1) - 1
    lines[row] = lines[row][:at] + told[1] + lines[row][end:]
    return lines


def _literal(lines, row, at, told):
    return _first_available(lines, row, at, told)


def _renamed(lines, row, at, told):
    """`write KEY: VALUE` at a key: its name changes, its value stays."""
    lines[row] = lines[row][:at] + re.sub(r"^\w+", told[1], lines[row][at:])
    return lines


def _at_top(lines, row, at, told):
    return [told[1], *lines] if told[1] not in lines else lines


def _below_sequence(lines, row, at, told):
    """Put the keys of a block, or its items, below `sequence:`."""
    indent = len(lines[row]) - len(lines[row].lstrip())
    first = row
    while first and (not lines[first - 1].strip() or lines[first - 1].startswith(" " * indent)):
        first -= 1
    last = row
    while last + 1 < len(lines) and lines[last + 1].startswith(" " * indent):
        last += 1
    block = []
    for line in lines[first : last + 1]:
        inner = line[indent:]
        is_node = inner[:1] not in (" ", "-")
        block.append(" " * (indent + 2) + ("- " if is_node else "") + inner)
    return [*lines[:first], " " * indent + "sequence:", *block, *lines[last + 1 :]]


def _without_key(lines, row, at, told):
    """Leave out a key around a list: `{children: [a]}` becomes `[a]`."""
    line = lines[row]
    if line[at] != "{":
        return lines[:row] + lines[row + 1 :]
    end = end_of_value(line, at + 1) - 1
    inner = re.sub(rf"^\{{\s*{told[1]}:\s*|\s*\}}$", "", line[at:end])
    lines[row] = line[:at] + inner + line[end:]
    return lines


def _type_as_key(lines, row, at, told):
    """`{type: wait, time: 3 s}` becomes `{wait: {time: 3 s}}`."""
    line = lines[row]
    if "{" not in line[: at + 1]:
        return _type_as_key_of_block(lines, row, at, told[1])
    start = line.rindex("{", 0, at + 1)
    end = end_of_value(line, start + 1) - 1
    ports = re.sub(rf"^\{{\w+: {told[1]}(,\s*)?|\}}$", "", line[start:end])
    lines[row] = f"{line[:start]}{{{told[1]}: {{{ports}}}}}{line[end:]}"
    return lines


def _type_as_key_of_block(lines, row, at, word):
    """The same in lines: what stands beside the type is indented below it."""
    lines[row] = f"{lines[row][:at]}{word}:"
    below = row + 1
    while below < len(lines) and re.match(rf" {{{at}}}[^ -]", lines[below]):
        lines[below] = "  " + lines[below]
        below += 1
    return lines


def _beside(lines, row, at, told):
    """Move an entry out of the ports of a node, behind them."""
    line = lines[row]
    if "{" not in line[:at]:
        below = row + 1
        while below < len(lines) and lines[below].startswith(" " * at):
            below += 1
        parent = next(above for above in reversed(lines[:row]) if not above.startswith(" " * at))
        indent = len(parent) - len(parent.lstrip(" -"))
        return [*lines[:row], *lines[row + 1 : below], " " * indent + line.strip(), *lines[below:]]
    begin, end = _entry(line, at)
    moved = line[begin:end].strip(", ")
    opened = line.rindex("{", 0, at)
    closed = end_of_value(line, opened + 1) - 1
    lines[row] = f"{line[:begin]}{line[end:closed]}, {moved}{line[closed:]}"
    return lines


def _as_items(lines, row, at, told):
    """Write `- ` in front of each key of a block."""
    below = row
    while below < len(lines) and lines[below].startswith(" " * at):
        is_key = lines[below][at : at + 1] != " "
        sign = "- " if is_key else "  "
        lines[below] = lines[below][:at] + sign + lines[below][at:]
        below += 1
    return lines


def _unwrapped(lines, row, at, told):
    """`{inverter: {NODE}}` becomes `{NODE, invert: true}`."""
    line = lines[row]
    colon = line.index(":", at)
    if not line[colon + 1 :].strip():
        below = row + 1
        while below < len(lines) and lines[below].startswith(" " * (at + 1)):
            below += 1
        inner = [re.sub("^  ", "", one) for one in lines[row + 1 : below]]
        inner[0] = line[:at] + inner[0].lstrip()
        return [*lines[:row], *inner, " " * at + told[1], *lines[below:]]
    value = line.index("{", colon)
    end = end_of_value(line, value + 1) - 1
    lines[row] = f"{line[:at]}{line[value + 1 : end - 1]}, {told[1]}{line[end:]}"
    return lines


RULES: dict[str, Rule] = {
    r"keep only the lines between the fences": _inside_fences,
    r"indent with spaces": _without_tabs,
    r"remove the line|remove `---`": _without_line,
    r"a comment begins with #": _as_comment,
    r"^remove it": _without_entry,
    r"in front, below `sequence:`|write a list under `sequence:`": _below_sequence,
    r"leave out `(\w+):`": _without_key,
    r"write `(\w+): \{…\}` instead": _type_as_key,
    r"is a modifier: write it beside": _beside,
    r"write `([^`…]+)`(?: or `[^`]+`)? beside the node": _unwrapped,
    r"write `- name:` for each event": _as_items,
    r"declare it at the top: (.+)": _at_top,
    r"write `(\w+): [^…]*`$": _renamed,
    r"^available: ([\w$]+)": _first_available,
    r"write a number with a unit: (.+)": _literal,
}
"""What a hint says -> what is done."""

"""Seeded mutations of files: characters, lines, indentation and words, one to three at once."""

from __future__ import annotations

import random
import re
from collections.abc import Callable

Mutation = Callable[[str, random.Random], str]

CHARACTERS = ":-[]{}$'\"#,&*!|>%@`?~=()<>./ \t\n0123456789aeénulyx_"
WORDS = (
    "null", "true", "false", "~", "0", "-1", "1e9", "3 s", "2 m", "90 deg", "20 %", "none", "all",
    "[]", "{}", "$nothing", "$dock", "forever", "continue", "success", "sequence", "parallel",
    "reactive", "fallback", "wait", "use", "do", "when", "while", "retry", "timeout", "every",
    "error == LOST", "battery.charge > 0.3", "time", "'text'", "\"", "x" * 300,
)  # fmt: skip
_TOKEN = re.compile(r"[\w.$]+|[^\w\s]")


def mutated(text: str, chance: random.Random) -> str:
    """Return the text with one to three mutations; never the unchanged text."""
    result = text
    while result == text:
        for _ in range(chance.choice((1, 1, 1, 2, 3))):
            result = chance.choice(MUTATIONS)(result, chance)
    return result


def _place(text: str, chance: random.Random) -> int:
    return chance.randrange(len(text) + 1)


def _drop_character(text: str, chance: random.Random) -> str:
    at = _place(text, chance)
    return text[:at] + text[at + 1 :]


def _add_character(text: str, chance: random.Random) -> str:
    at = _place(text, chance)
    return text[:at] + chance.choice(CHARACTERS) + text[at:]


def _swap_characters(text: str, chance: random.Random) -> str:
    at = _place(text, chance)
    return text[:at] + text[at : at + 2][::-1] + text[at + 2 :]


def _by_lines(change: Callable[[list[str], int, random.Random], None]) -> Mutation:
    def mutation(text: str, chance: random.Random) -> str:
        lines = text.split("\n")
        written = [n for n, line in enumerate(lines) if line.split("#")[0].strip()]
        if written:
            change(lines, chance.choice(written), chance)
        return "\n".join(lines)

    return mutation


def _drop_line(lines: list[str], at: int, chance: random.Random) -> None:
    del lines[at]


def _repeat_line(lines: list[str], at: int, chance: random.Random) -> None:
    lines.insert(chance.randrange(len(lines)), lines[at])


def _move_line(lines: list[str], at: int, chance: random.Random) -> None:
    lines.insert(chance.randrange(len(lines)), lines.pop(at))


def _indent(lines: list[str], at: int, chance: random.Random) -> None:
    if chance.random() < 0.5:
        lines[at] = " " * chance.randint(1, 4) + lines[at]
    else:
        lines[at] = lines[at][min(chance.randint(1, 4), len(lines[at]) - len(lines[at].lstrip())) :]


def _cut(lines: list[str], at: int, chance: random.Random) -> None:
    lines[at] = lines[at][: chance.randrange(len(lines[at]) + 1)]


def _break_off(lines: list[str], at: int, chance: random.Random) -> None:
    del lines[at + 1 :]


def _comment(lines: list[str], at: int, chance: random.Random) -> None:
    lines[at] = "# " + lines[at]


def _empty_value(lines: list[str], at: int, chance: random.Random) -> None:
    lines[at] = re.sub(r":\s.*", ":", lines[at])


def _words(text: str) -> list[re.Match[str]]:
    return list(_TOKEN.finditer(text))


def _drop_word(text: str, chance: random.Random) -> str:
    found = chance.choice(_words(text) or [re.compile("").match(text)])
    return text[: found.start()] + text[found.end() :]


def _other_word(text: str, chance: random.Random) -> str:
    words = _words(text)
    if not words:
        return text
    found = chance.choice(words)
    new = chance.choice(words)[0] if chance.random() < 0.5 else chance.choice(WORDS)
    return text[: found.start()] + new + text[found.end() :]


def _other_number(text: str, chance: random.Random) -> str:
    numbers = list(re.finditer(r"\d+(\.\d+)?", text))
    if not numbers:
        return text
    found = chance.choice(numbers)
    new = chance.choice(("0", "-3", "1000000", "0.001", "1e400", "9" * 30, found[0] + "0"))
    return text[: found.start()] + new + text[found.end() :]


MUTATIONS: tuple[Mutation, ...] = (
    _drop_character, _add_character, _swap_characters, _drop_word, _other_word, _other_number,
    *map(_by_lines, (
        _drop_line, _repeat_line, _move_line, _indent, _cut, _break_off, _comment, _empty_value,
    )),
)  # fmt: skip

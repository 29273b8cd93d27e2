"""A hundred damaged mission and world files: exit code 2, a position, never a traceback."""

from __future__ import annotations

import random
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from missions.cli import app as cli
from missions.execution.resources import MISSIONS, mission_files, world_files

POSITION = re.compile(r"\S+\.yaml:\d+:\d+ error\[E\d{3}\] \S")


def lines_with(pattern: str, lines: list[str]) -> list[int]:
    return [n for n, line in enumerate(lines) if re.search(pattern, line.split("#")[0])]


def edited(text: str, pattern: str, change: Callable[[str], str], chance: random.Random) -> str:
    """One line that matches, changed; the text as it was when none does."""
    lines = text.split("\n")
    found = lines_with(pattern, lines)
    if not found:
        return text
    at = chance.choice(found)
    lines[at] = change(lines[at])
    return "\n".join(lines)


def misspelt_key(text: str, chance: random.Random) -> str:
    return edited(text, r"^[a-z_]{4,}:", lambda line: line[0] + line[2:], chance)


def unknown_key(text: str, chance: random.Random) -> str:
    lines = text.rstrip("\n").split("\n")
    return "\n".join([*lines, f"surprise_{chance.randrange(100)}: 1", ""])


def twice(text: str, chance: random.Random) -> str:
    lines = text.rstrip("\n").split("\n")
    line = lines[chance.choice(lines_with(r"^[a-z_]+: \S", lines))]
    return "\n".join([*lines, line, ""])


def open_bracket(text: str, chance: random.Random) -> str:
    return edited(text, r"[\]}]\s*$", lambda line: re.sub(r"[\]}]\s*$", "", line), chance)


def tab(text: str, chance: random.Random) -> str:
    return edited(text, r"^  +\S", lambda line: "\t" + line.lstrip(), chance)


def binary(text: str, chance: random.Random) -> str:
    at = chance.randrange(len(text) // 2, len(text))
    return text[:at] + "\udcff" + text[at:]  # written as the byte 0xff


def control_character(text: str, chance: random.Random) -> str:
    at = chance.randrange(len(text))
    return text[:at] + "\x00" + text[at:]


def tagged(text: str, chance: random.Random) -> str:
    danger = "!!python/object/apply:os.system ['echo no']"
    return edited(text, r"^doc:", lambda _: f"doc: {danger}", chance) + f"\nx: {danger}\n"


def wrong_format(text: str, chance: random.Random) -> str:
    return edited(text, r"^format:", lambda _: f"format: {chance.randrange(2, 99)}", chance)


def wrong_unit(text: str, chance: random.Random) -> str:
    return edited(
        text,
        r"\d (deg|m/s|s)\b",
        lambda line: re.sub(r"(\d) (deg|m/s|s)\b", r"\1 kg", line),
        chance,
    )


def not_a_number(text: str, chance: random.Random) -> str:
    return edited(text, r"\[-?\d[^\]]*,", lambda line: re.sub(r"\[-?[\d.]+", "[many", line), chance)


def empty(text: str, chance: random.Random) -> str:
    return "# nothing left\n" * chance.randrange(3)


def a_list(text: str, chance: random.Random) -> str:
    return "\n".join(f"- {line}" for line in ("drive", "wait"))


def unknown_world(text: str, chance: random.Random) -> str:
    return edited(text, r"^(world|start):", lambda line: line.split(":")[0] + ": nowhere", chance)


DAMAGES = [
    misspelt_key, unknown_key, twice, open_bracket, tab, binary, control_character, tagged,
    wrong_format, wrong_unit, not_a_number, empty, a_list, unknown_world,
]  # fmt: skip


def damaged_files() -> list[tuple[str, Path, str]]:
    """(what was done, which file, the damaged text), a hundred of them, always the same."""
    chance = random.Random(20)
    originals = [*mission_files(), *world_files()]
    cases: list[tuple[str, Path, str]] = []
    while len(cases) < 100:
        source, damage = chance.choice(originals), chance.choice(DAMAGES)
        if source in world_files() and damage is unknown_world:
            continue  # a world may be called anything
        text = source.read_text("utf-8")
        result = damage(text, chance)
        if result != text:
            cases.append((damage.__name__, source, result))
    return cases


@pytest.fixture(scope="module")
def place(tmp_path_factory) -> Path:
    """A folder with what the missions refer to beside them."""
    folder = tmp_path_factory.mktemp("damaged")
    shutil.copytree(MISSIONS / "my_behaviours", folder / "my_behaviours")
    return folder


def treepilot(monkeypatch, capsys, *words: str) -> tuple[int, str]:
    monkeypatch.setattr("sys.argv", ["treepilot", *words])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    caught = capsys.readouterr()
    return int(ended.value.code or 0), caught.out + caught.err


@pytest.mark.parametrize(
    ("damage", "source", "text"),
    damaged_files(),
    ids=[f"{n:02d}-{d}-{s.stem}" for n, (d, s, _) in enumerate(damaged_files())],
)
def test_a_damaged_file_gives_a_position_and_exit_code_2(
    place, monkeypatch, capsys, damage, source, text
):
    path = place / f"{source.stem}.yaml"
    path.write_bytes(text.encode("utf-8", errors="surrogateescape"))
    code, words = treepilot(monkeypatch, capsys, "check", str(path))
    assert code == 2, f"{damage} went unnoticed:\n{text}"
    assert POSITION.search(words), words
    assert "Traceback" not in words


@pytest.mark.parametrize("source", [*mission_files(), *world_files()], ids=lambda file: file.stem)
def test_the_undamaged_originals_are_fine(monkeypatch, capsys, source):
    assert treepilot(monkeypatch, capsys, "check", str(source))[0] == 0


def test_a_damaged_mission_does_not_run_either(place, monkeypatch, capsys, tmp_path):
    path = place / "typo.yaml"
    good = (MISSIONS / "01_drive_to_a_point.yaml").read_text("utf-8")
    path.write_text(good.replace("navigate_to_pose", "navigate_to_pos"), "utf-8")
    out = tmp_path / "run"
    code, words = treepilot(monkeypatch, capsys, "run", str(path), "--headless", "--out", str(out))
    assert code == 2
    assert "did you mean 'navigate_to_pose'" in words
    assert not out.exists()

"""The documentation's figures are those of docs/figures, and these say where they come from."""

from __future__ import annotations

import json
import re
import socket
import subprocess
from dataclasses import asdict, replace

import pytest

from tests.benchmarks.__main__ import BENCHMARKS, DRIVING
from tests.benchmarks.figures import (
    BLOCK,
    FIGURES,
    Figures,
    FiguresError,
    block,
    documents,
    layouts,
    read,
    updated,
    write,
)
from tests.benchmarks.origin import current_version, machine, today

MEASURED = sorted(file.stem for file in FIGURES.glob("*.json"))
SHOWN = {name for file in documents() for _, name, _, _ in BLOCK.findall(file.read_text("utf-8"))}


def two_walls() -> Figures:
    """Figures of the table with the fewest columns."""
    rows = [
        {"side": side, "seeds": 3, "RMS cm (worst seed)": rms, "samples": 90, "success": 3}
        for side, rms in (("right", 2.34567), ("left", None))
    ]
    return Figures(
        name="wall", command="python -m tests.benchmarks wall --docs", commit="0123456789" * 4,
        dirty=False, date="2026-11-02", setting={"recording": "off", "seeds": 3}, rows=rows,
        machine={"processor": "Xeon", "cores": 2, "load": 0.12, "system": "Debian GNU/Linux 12",
                 "python": "3.11.7", "numpy": "2.4.6", "pybullet": "3.2.7"},
    )  # fmt: skip


@pytest.mark.parametrize("file", documents(), ids=lambda file: file.name)
def test_the_tables_of_a_page_are_those_of_the_figures(file):
    text = file.read_text("utf-8")
    assert updated(text) == text, "tables and docs/figures differ: run `make figures`"


def test_every_benchmark_has_a_table_and_every_file_is_shown():
    assert SHOWN == {*layouts(), "summary"}
    assert {*BENCHMARKS} == {*layouts()}
    assert {*MEASURED} == {*layouts()}


@pytest.mark.parametrize("name", MEASURED)
def test_a_file_of_figures_is_complete_and_says_how_to_measure_it(name):
    figures = read(name)
    assert figures.command.startswith(f"python -m tests.benchmarks {name} ")
    assert set(figures.setting) == {*BENCHMARKS[name].options, *BENCHMARKS[name].setting}


def test_figures_of_whole_runs_say_whether_recording_was_on():
    assert {name for name in DRIVING if DRIVING[name].setting["recording"] == "off"} == {*DRIVING}
    assert BENCHMARKS["speed"].setting["recording"] == "on"
    assert layouts()["speed"].columns["recording"] == "{recording}"


@pytest.mark.parametrize("file", documents(), ids=lambda file: file.name)
def test_no_speed_or_success_rate_stands_in_a_page_by_itself(file):
    prose = BLOCK.sub("", file.read_text("utf-8"))
    loose = re.findall(r"[\d.]+ ?(?:×|x|times) (?:faster|real.time)|\b\d+ of \d+ \w+ pass", prose)
    assert not loose


def test_a_table_is_written_from_the_rows(tmp_path):
    write(two_walls(), tmp_path)
    text = "Before.\n<!-- figures: wall -->\n| by hand |\n<!-- /figures -->\nAfter.\n"
    written = updated(text, tmp_path)
    assert written == (
        "Before.\n<!-- figures: wall -->\n\n"
        "| side | success | samples | RMS error, worst seed |\n|---|---|---|---|\n"
        "| right | 3/3 | 90 | 2.3 cm |\n"
        "| left | 3/3 | 90 | – |\n\n"
        "*Commit `0123456789`, 2 November 2026; recording off, seeds 3; Xeon, 2 cores, load 0.1."
        " Command: `python -m tests.benchmarks wall --docs`.*\n\n"
        "<!-- /figures -->\nAfter.\n"
    )
    assert updated(written, tmp_path) == written
    assert json.loads((tmp_path / "wall.json").read_text("utf-8"))["rows"][0] == {
        "side": "right", "seeds": 3, "RMS cm (worst seed)": 2.3457, "samples": 90, "success": 3,
    }  # fmt: skip


def test_a_table_without_figures_says_so(tmp_path):
    assert block("wall", tmp_path) == (
        "\n*Not measured yet. Command: `python -m tests.benchmarks wall --docs`.*\n\n"
    )
    assert block("summary", tmp_path) == "\n*Not measured yet.*\n\n"


def test_the_summary_adds_up_the_tables_that_are_there(tmp_path):
    rows = [{"success": "20/20", "collisions": 0}, {"success": "18/20", "collisions": 3}]
    write(replace(two_walls(), name="courses", rows=rows), tmp_path)
    write(replace(two_walls(), name="missions", rows=rows), tmp_path)
    assert block("summary", tmp_path) == (
        "\n| benchmark | result |\n|---|---|\n| narrow passages | 38/40 passed |\n"
        "| shipped missions | 38/40 succeeded, 3 contacts |\n\n"
    )
    speeds = [("pure_pursuit", "off", 16.71), ("pure_pursuit", "on", 7.8), ("mppi", "off", 10.0)]
    speed = [
        {"controller": controller, "recording": recording, "x real time": factor}
        for controller, recording, factor in speeds
    ]
    write(replace(two_walls(), name="speed", rows=speed), tmp_path)
    assert (
        "| office patrol on one core, pure_pursuit | 16.7 × real time with recording off,"
        " 7.8 × real time with recording on |"
    ) in block("summary", tmp_path)


def test_a_change_of_the_figures_or_of_the_table_shows(tmp_path):
    write(two_walls(), tmp_path)
    text = updated("<!-- figures: wall -->\n<!-- /figures -->\n", tmp_path)
    by_hand = text.replace("2.3 cm", "1.3 cm")
    assert by_hand != text
    assert updated(by_hand, tmp_path) == text
    write(replace(two_walls(), date="2026-11-03"), tmp_path)
    assert updated(text, tmp_path) == text.replace("2 November", "3 November")


def test_the_caption_tells_that_files_were_changed(tmp_path):
    write(replace(two_walls(), dirty=True), tmp_path)
    assert "`0123456789` with uncommitted changes, 2 November" in block("wall", tmp_path)


@pytest.mark.parametrize("key", asdict(two_walls()))
def test_figures_without_one_of_their_parts_are_refused(key, tmp_path):
    plain = asdict(two_walls())
    del plain[key]
    (tmp_path / "wall.json").write_text(json.dumps(plain), "utf-8")
    with pytest.raises(FiguresError, match=f"wall.json.*'{key}' is a required property"):
        read("wall", tmp_path)


@pytest.mark.parametrize("key", two_walls().machine)
def test_figures_of_an_unnamed_machine_are_refused(key, tmp_path):
    figures = two_walls()
    del figures.machine[key]
    with pytest.raises(FiguresError, match=rf"\$\.machine: '{key}' is a required property"):
        write(figures, tmp_path)


@pytest.mark.parametrize(
    ("change", "where"),
    [
        ({"command": "python -m tests.benchmarks barn --barn /home/me/worlds"}, r"\$\.command"),
        ({"commit": "0123456"}, r"\$\.commit"),
        ({"setting": {"recording": "perhaps"}}, r"\$\.setting\.recording"),
        ({"setting": {}}, r"\$\.setting"),
        ({"rows": []}, r"\$\.rows"),
        ({"name": "walls"}, "its name is 'walls'; expected 'wall'"),
    ],
)
def test_wrong_figures_are_refused(change, where, tmp_path):
    (tmp_path / "wall.json").write_text(json.dumps(asdict(two_walls()) | change), "utf-8")
    with pytest.raises(FiguresError, match=where):
        read("wall", tmp_path)


def test_a_row_without_a_column_of_the_table_is_refused(tmp_path):
    figures = two_walls()
    del figures.rows[1]["samples"]
    write(figures, tmp_path)
    with pytest.raises(FiguresError, match=r"wall\.json: a row has no 'samples'"):
        block("wall", tmp_path)


def test_comments_that_do_not_pair_are_refused(tmp_path):
    with pytest.raises(FiguresError, match="3 comments of figures make 1 tables"):
        updated("<!-- figures: wall -->\n<!-- figures: wall -->\n<!-- /figures -->\n", tmp_path)
    with pytest.raises(FiguresError, match="no table 'walls'"):
        updated("<!-- figures: walls -->\n<!-- /figures -->\n", tmp_path)


def test_the_version_is_the_commit_and_whether_code_differs_from_it(tmp_path):
    def git(*words):
        identity = ["-c", "user.name=A", "-c", "user.email=a@example.org"]
        command = ["git", *identity, *words]
        return subprocess.run(command, cwd=tmp_path, check=True, capture_output=True, text=True)

    git("init", "--quiet")
    for name in ("code.py", "README.md"):
        (tmp_path / name).write_text("1\n", "utf-8")
    git("add", "-A")
    git("commit", "--quiet", "--message", "first")
    (tmp_path / "README.md").write_text("2\n", "utf-8")
    version = current_version(tmp_path)
    assert version.commit == git("rev-parse", "HEAD").stdout.strip()
    assert not version.dirty
    (tmp_path / "code.py").write_text("2\n", "utf-8")
    assert current_version(tmp_path).dirty


def test_the_machine_of_now_is_complete_and_names_no_host(tmp_path):
    write(replace(two_walls(), machine=machine(), date=today()), tmp_path)
    text = (tmp_path / "wall.json").read_text("utf-8")
    assert socket.gethostname() not in text

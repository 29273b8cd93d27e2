"""Whole sweeps: journal, table, resuming, other sweeps in the folder, files and pages."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from dataclasses import replace
from math import sqrt
from pathlib import Path
from statistics import mean, stdev
from time import sleep  # noqa: TID251 - another process is waited for

import pyarrow.parquet
import pytest
import typer
from typer.testing import CliRunner

from missions.bench.processes import ProcessEnded
from missions.cli.app import app
from missions.cli.sweep_runs import interruptible
from missions.sweeps import runner
from missions.sweeps.checking import checked
from missions.sweeps.design import RunDescription
from missions.sweeps.factors import read_factor
from missions.sweeps.report.page import page_of, run_command
from missions.sweeps.report.results import read_results
from missions.sweeps.row import SweepRow
from missions.sweeps.runner import ExecutionSettings, run_sweep
from missions.sweeps.sweep import Sweep, with_choices
from missions.sweeps.sweep_file import EMPTY, is_sweep_file, read_sweep_file
from missions.sweeps.table import JOURNAL, TABLE, SweepFolder
from stack.errors import InputError

ROOT = Path(__file__).parents[3]

FACTORS = (read_factor("angle", "uniform(20 deg, 60 deg)"), read_factor("times", "1,2"))


@pytest.fixture
def executed(monkeypatch):
    """Runs without processes and simulation: the numbers of those that were made."""
    made: list[int] = []

    def results(start, entries, jobs, runs_per_process, **_):
        for run in entries:
            made.append(run.number)
            outcome = "failure" if run.number % 5 == 4 else "success"
            yield run, SweepRow(run.number, run.seed, dict(run.settings), outcome,
                                seconds=10.0 + run.number, versions=runner.versions())  # fmt: skip

    monkeypatch.setattr(runner, "results", results)
    return made


def swept(turn, out, follow=lambda rows: None, execution=None, **changes):
    sweep = Sweep(str(turn), 12, "random", FACTORS)
    ready = checked(replace(sweep, **changes), EMPTY.refusal)
    return run_sweep(ready, SweepFolder(out), execution or ExecutionSettings(), follow)


def test_the_table_has_typed_factors_and_a_row_a_run(turn, tmp_path, executed):
    rows = swept(turn, tmp_path / "out")
    table = pyarrow.parquet.read_table(tmp_path / "out" / TABLE)
    assert table.column_names[:4] == ["number", "seed", "angle", "times"]
    assert str(table.schema.field("angle").type) == "double"
    assert str(table.schema.field("times").type) == "int64"
    assert table["number"].to_pylist() == list(range(12)) == [row.number for row in rows]
    assert table["seconds"].to_pylist()[3] == 13.0
    assert all(20.0 <= angle <= 60.0 for angle in table["angle"].to_pylist())
    assert "treepilot=0" in table["versions"][0].as_py()


def test_an_interrupted_sweep_makes_each_run_once(turn, tmp_path, executed):
    def stop(rows):
        if len(rows) == 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        swept(turn, tmp_path / "out", stop)
    journal = tmp_path / "out" / JOURNAL
    journal.write_bytes(journal.read_bytes()[:-30])  # the power failed: run 4 is cut off
    assert pyarrow.parquet.read_table(tmp_path / "out" / TABLE).num_rows == 5
    rows = swept(turn, tmp_path / "out")
    assert executed == [0, 1, 2, 3, 4, *range(4, 12)]
    assert [row.number for row in rows] == list(range(12))
    assert rows == swept(turn, tmp_path / "other")
    assert len(journal.read_text().splitlines()) == 12


def test_a_sweep_grows(turn, tmp_path, executed):
    swept(turn, tmp_path / "out")
    rows = swept(turn, tmp_path / "out", runs=20)
    assert executed == list(range(20)) and len(rows) == 20


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"seed": 3}, "seed was 0, is 3"),
        ({"time_limit": 60.0}, "time_limit was 3600.0, is 60.0"),
        ({"factors": FACTORS[:1]}, "the factor times was 1,2, is not there"),
        ({"factors": (read_factor("angle", "uniform(20 deg, 50 deg)"), FACTORS[1])},
         r"the factor angle was uniform\(20, 60\) deg, is uniform\(20, 50\) deg"),
        ({"factors": FACTORS[::-1]}, "in the order angle, times, are in times, angle"),
        ({"parameters": {"controller.cruise_speed": "0.4"}}, "parameters was none, is controller"),
    ],
)  # fmt: skip
def test_another_sweep_in_the_folder_is_an_error(turn, tmp_path, executed, changes, words):
    swept(turn, tmp_path / "out")
    with pytest.raises(InputError, match=f"has another sweep: .*{words}.*choose another --out"):
        swept(turn, tmp_path / "out", **changes)


def test_the_path_of_the_mission_does_not_matter(turn, tmp_path, executed, monkeypatch):
    swept(turn, tmp_path / "out")
    monkeypatch.chdir(turn.parent)
    swept(turn.name, tmp_path / "out")
    assert executed == list(range(12))


def test_a_changed_mission_is_another_sweep(turn, tmp_path, executed):
    swept(turn, tmp_path / "out")
    turn.write_text(turn.read_text().replace("timeout: 4 s", "timeout: 5 s"))
    with pytest.raises(InputError, match=r"turn\.yaml has changed"):
        swept(turn, tmp_path / "out")


def test_rows_of_another_version_are_refused(turn, tmp_path, executed):
    swept(turn, tmp_path / "out")
    file = tmp_path / "out" / "sweep.json"
    content = json.loads(file.read_text())
    content["versions"]["treepilot"] = "0.0.9"
    file.write_text(json.dumps(content))
    with pytest.raises(
        InputError, match=r"treepilot 0\.0\.9 \(now .*choose another --out, or inst"
    ):
        swept(turn, tmp_path / "out")


def test_a_damaged_line_of_the_journal_can_be_removed(turn, tmp_path, executed):
    swept(turn, tmp_path / "out")
    journal = tmp_path / "out" / JOURNAL
    lines = journal.read_bytes().splitlines(keepends=True)
    journal.write_bytes(b"".join([*lines[:2], b"\xff{{\n", *lines[3:]]))
    with pytest.raises(InputError, match=r"journal\.jsonl:3:1 .*not a row.*remove this line"):
        swept(turn, tmp_path / "out")
    journal.write_bytes(b"".join([*lines[:2], *lines[3:]]))
    assert len(swept(turn, tmp_path / "out")) == 12 and executed == [*range(12), 2]


def test_a_file_in_the_place_of_the_folder(turn, tmp_path, executed):
    (tmp_path / "out").touch()
    with pytest.raises(InputError, match=r"File exists.*make the folder writable, or choose"):
        swept(turn, tmp_path / "out")


@pytest.mark.parametrize("name", ["thesis.txt", JOURNAL])
def test_a_folder_with_something_else_is_left_alone(turn, tmp_path, executed, name):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / name).write_text("years of work")
    with pytest.raises(InputError, match="is not empty and holds no sweep"):
        swept(turn, tmp_path / "out")
    assert (tmp_path / "out" / name).read_text() == "years of work"


def test_two_sweeps_in_one_folder_are_an_error(turn, tmp_path, executed):
    def start_another(_):
        with pytest.raises(InputError, match=r"a sweep is running in .*out; choose another --out"):
            swept(turn, tmp_path / "out")

    rows = swept(turn, tmp_path / "out", start_another)
    assert executed == list(range(12)) == [row.number for row in rows]


def test_a_claim_ends_the_sweep(turn, tmp_path, executed):
    from missions.sweeps.claims import read_claim

    claim = read_claim("success > 0.3 at 95 %")
    rows = swept(turn, tmp_path / "out", execution=ExecutionSettings(until=claim), runs=500)
    assert claim.verdict(rows) is True and claim.verdict(rows[:-1]) is None
    assert len(rows) == len(executed) < 30


def test_a_claim_needs_a_random_sample(turn):
    """A grid begins with the runs of the first combinations, which may be the easy ones."""
    words = ["sweep", str(turn), "--vary", "times=1,2", "--until", "success > 0.5 at 95 %"]
    done = CliRunner().invoke(app, [*words, "--dry-run"])
    assert "the design is grid; use --design random" in str(done.exception)
    assert CliRunner().invoke(app, [*words, "--design", "random", "--dry-run"]).exit_code == 0


@pytest.mark.parametrize(
    ("name", "value"),
    [("runs", "x"), ("seed", None), ("arguments", {"a": 1}), ("factors", [{}]), ("factors", 3),
     ("files", ["a"]), ("versions", {"treepilot": 1})],
)  # fmt: skip
def test_a_damaged_description_is_an_error(turn, tmp_path, executed, name, value):
    swept(turn, tmp_path / "out")
    file = tmp_path / "out" / "sweep.json"
    file.write_text(json.dumps({**json.loads(file.read_text()), name: value}))
    with pytest.raises(InputError, match=r"sweep\.json is damaged, or"):
        SweepFolder(tmp_path / "out").sweep()


@pytest.mark.parametrize("line", ['{"number": "x"}', "[1]", "3"])
def test_a_damaged_journal_is_an_error(tmp_path, line):
    plain = SweepRow(0, 0, {}, "success").plain()
    text = json.dumps({**plain, **json.loads(line)}) if line.startswith("{") else line
    (tmp_path / JOURNAL).write_text(f"{json.dumps(plain)}\n{text}\n")
    with pytest.raises(InputError, match=r"journal\.jsonl:2:1 error\[E004\] not a row of a sweep"):
        SweepFolder(tmp_path).rows(2)


def test_a_row_may_have_any_character(tmp_path):
    """U+2028 and U+0085 end a line for `str.splitlines`, but not in JSON."""
    row = SweepRow(0, 0, {}, "failure", reason="one\u2028two\x85three\nfour")
    folder = SweepFolder(tmp_path)
    with folder.open_journal() as journal:
        folder.write(journal, row)
    assert folder.rows(1) == [row]


def test_a_full_disk_keeps_what_is_there(tmp_path):
    """/dev/full is a disk without space (full(4))."""
    row = SweepRow(0, 0, {}, "success")
    with Path("/dev/full").open("ab", buffering=0) as full, pytest.raises(InputError) as error:
        SweepFolder(tmp_path).write(full, row)
    assert "No space left on device; the rows before are kept" in str(error.value)


def test_processes_that_end_are_outcomes(tmp_path):
    run, folder = RunDescription(3, 4), SweepFolder(tmp_path)
    ends = {
        "hung": ProcessEnded("hung: no progress for 9 s", hung=True),
        "killed": ProcessEnded("the process was ended by SIGKILL", killed=True),
        "crashed": ProcessEnded("the process was ended by SIGSEGV"),
    }
    for outcome, end in ends.items():
        row = runner._row(run, end, folder.runs)
        assert (row.number, row.outcome, row.reason) == (3, outcome, end.reason)
        assert row.folder == ""
    (tmp_path / "runs" / "00003").mkdir(parents=True)
    for name in ("events.jsonl", "mission.yaml"):
        (tmp_path / "runs" / "00003" / name).touch()
    assert runner._row(run, ends["killed"], folder.runs).folder == "runs/00003"
    named = tmp_path / "runs" / "00003" / "count"  # of a mission that keeps values
    named.mkdir()
    for name in ("events.jsonl", "mission.yaml"):
        (named.parent / name).rename(named / name)
    assert runner._row(run, ends["killed"], folder.runs).folder == "runs/00003/count"


def test_worlds_are_files_or_shipped_ones(tmp_path, monkeypatch):
    sweep = Sweep("m", 4, "grid")
    shipped = with_choices(sweep, "twin_*", ("scout", "jackal"))
    assert [factor.values for factor in shipped.factors] == [
        ("twin_galleries", "twin_rooms"), ("scout", "jackal")
    ]  # fmt: skip
    for name in ("b", "a"):
        (tmp_path / f"{name}.yaml").touch()
    every = with_choices(sweep, f"{tmp_path}/*.yaml", None)
    assert every.factors[0].values == (str(tmp_path / "a.yaml"), str(tmp_path / "b.yaml"))
    monkeypatch.chdir(tmp_path)
    assert with_choices(sweep, "*.yaml", None).factors[0].values == ("a.yaml", "b.yaml")
    for pattern in ("atlantis*", "**x", ".", "/", ""):
        with pytest.raises(InputError, match="no world file matches"):
            with_choices(sweep, pattern, None)
    with pytest.raises(InputError, match="robots: it has no values"):
        with_choices(sweep, None, ())
    with pytest.raises(InputError, match="the factor robot is given twice"):
        with_choices(replace(sweep, factors=(read_factor("robot", "a,b"),)), None, ("scout",))


FILE = """\
mission: ./turn.yaml
runs: 8
vary:
  angle: uniform(20 deg, 60 deg)
  times: [1, 2]
  start: [dock, [2, 2.5, 90 deg]]
design: random
time_limit: 5 min
until: success > 0.9 at 95 %
fail_if: [success < 0.5]
"""


def test_a_file_has_the_words_of_the_command_line(turn, tmp_path):
    file = tmp_path / "sweep.yaml"
    file.write_text(FILE)
    words = read_sweep_file(file)
    assert is_sweep_file(file) and not is_sweep_file(turn)
    assert [factor.probes for factor in words.factors] == [
        ("20 deg", "60 deg"), ("1", "2"), ("dock", "[2, 2.5, 90 deg]")
    ]  # fmt: skip
    assert words.values["time_limit"] == 300.0 and words.until.rate == 0.9
    assert [condition.text for condition in words.fail_if] == ["success < 0.5"]
    for word in ("robots: [scout, glide]", "set: {times: 2}", "seed: 3"):
        (tmp_path / "short.yaml").write_text(f"mission: ./turn.yaml\n{word}\n")
        assert is_sweep_file(tmp_path / "short.yaml")
    done = CliRunner().invoke(app, ["sweep", str(file), "--runs", "3", "--dry-run"])
    assert done.exit_code == 0 and done.output.startswith("3 runs of ")
    assert len(done.output.splitlines()) == 5


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ("desing: grid", "1 error[E520] the sweep has no key 'desing'; did you mean 'design'"),
        ("runs: 0", "7 error[E520] runs: 0 must be at least 1"),
        ("vary: {times: 'gamma(1, 2)'}", "15 error[E520] vary: times: 'gamma' is not a distri"),
        ("vary: {times: [1, 7]}", "8 error[E520] vary: times: 7 is refused: "),
        ("vary: {tines: [1, 2]}", "8 error[E520] vary: tines: the mission turn.yaml has no arg"),
        ("vary: [a]", "7 error[E520] vary: expected a mapping, got a list"),
        ("set: {angle: {a: 1}}", "14 error[E520] set: angle: expected a text or a number, got a m"),
        ("parameters: {a.b: [{c: 1}]}", "19 error[E520] parameters: a.b: expected a text or a n"),
        ("vary: {times: {a: 1}}", "15 error[E520] vary: times: expected a text or a number, got"),
        ("robots: [{a: b}]", "10 error[E520] robots: expected a text or a number, got a mapping"),
        ("fail_if: {a: b}", "10 error[E520] fail_if: expected a text or a number, got a mapping"),
        ("fail_if: [success < 1, succes < 1]", "24 error[E520] fail_if: succes < 1: there is no"),
        ("until: success > 2 at 95 %", "8 error[E520] until: success > 2 at 95 %: the rate 2 is"),
        ("until: [a]", "8 error[E520] until: [a]: not a claim"),
        ("keep: everything", "7 error[E520] keep: 'everything' is not one of all, failures, none"),
    ],
)
def test_findings_of_a_file_name_line_and_column(turn, tmp_path, wrong, words):
    file = tmp_path / "sweep.yaml"
    key = wrong.partition(":")[0]
    first = "runs: 8\n" if key != "runs" else "worlds: small_room\n"
    file.write_text(f"mission: ./turn.yaml\n{first}{wrong}\n")
    done = CliRunner().invoke(app, ["sweep", str(file), "--dry-run"])
    assert f"sweep.yaml:3:{words}" in str(done.exception), done.output


@pytest.mark.parametrize(
    ("option", "value"),
    [("--until", "a"), ("--fail-if", "a"), ("--vary", "times=gamma(1)"), ("--vary", "times=2")],
)
def test_errors_of_the_command_line_name_the_option(turn, option, value):
    words = [str(turn), "--vary", "times=1", option, value]  # times is given twice
    done = CliRunner().invoke(app, ["sweep", *words, "--dry-run"])
    assert str(done.exception).startswith(f"{option}") and value in str(done.exception)


def command(*words):
    return subprocess.Popen(
        [sys.executable, "-m", "treepilot", *words], stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True, env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip


def lines_in(journal: Path) -> list[dict]:
    text = journal.read_text() if journal.exists() else ""
    return [json.loads(line) for line in text[: text.rfind("\n") + 1].splitlines()]


def wait_for_rows(journal: Path, count: int) -> None:
    for _ in range(1200):
        if len(lines_in(journal)) >= count:
            return
        sleep(0.1)
    raise AssertionError("no rows within two minutes")


def children_of(process: int) -> list[int]:
    return [int(child) for child in
            Path(f"/proc/{process}/task/{process}/children").read_text().split()]  # fmt: skip


def is_running(process: int) -> bool:
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.slow
def test_a_sweep_survives_signals(turn, tmp_path):
    """A killed worker is a row; Ctrl-C and SIGTERM keep all; a killed command leaves no process.

    The rows are those of a sweep without interruption.
    """
    turn.write_text("mission: short\nrobot: scout\nworld: small_room\nrun: {wait: 0.2 s}\n")
    out = tmp_path / "out"
    words = ("sweep", str(turn), "--runs", "4000", "--out", str(out))
    process = command(*words)
    wait_for_rows(out / JOURNAL, 2)
    workers = [child for child in children_of(process.pid)
               if "spawn_main" in Path(f"/proc/{child}/cmdline").read_text()]  # fmt: skip
    os.kill(workers[0], signal.SIGKILL)
    wait_for_rows(out / JOURNAL, 5)
    process.send_signal(signal.SIGINT)
    _, told = process.communicate(timeout=60)
    assert process.returncode == 130 and "run the command again to continue" in told
    first = lines_in(out / JOURNAL)
    assert [row["outcome"] for row in first if row["outcome"] != "success"] == ["killed"]

    process = command(*words)
    wait_for_rows(out / JOURNAL, len(first) + 2)
    process.send_signal(signal.SIGTERM)
    _, told = process.communicate(timeout=60)
    assert process.returncode == 130 and f"{len(first)} of 4000 runs are already there" in told
    table = pyarrow.parquet.read_table(out / TABLE)
    first = lines_in(out / JOURNAL)
    assert table["number"].to_pylist() == sorted(row["number"] for row in first)

    process = command(*words)
    wait_for_rows(out / JOURNAL, len(first) + 2)
    alive = children_of(process.pid)
    process.kill()
    process.communicate()
    for _ in range(100):
        if not any(map(is_running, alive)):
            break
        sleep(0.1)
    assert alive and not any(map(is_running, alive))
    numbers = [row["number"] for row in lines_in(out / JOURNAL)]
    assert sorted(numbers) == list(range(len(numbers)))

    ready = checked(Sweep(str(turn), len(numbers) + 2, "random"), EMPTY.refusal)
    rows = run_sweep(ready, SweepFolder(out), ExecutionSettings(), lambda _: None)
    whole = run_sweep(ready, SweepFolder(tmp_path / "whole"), ExecutionSettings(), lambda _: None)
    assert [row.number for row in rows] == list(range(len(numbers) + 2))
    assert [(one.number, one.outcome) for one, other in zip(rows, whole, strict=True)
            if one.without_costs != other.without_costs] == [
                (row["number"], "killed") for row in first if row["outcome"] == "killed"
            ]  # fmt: skip


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_signal_that_a_callback_drops_ends_the_sweep_at_the_next_look(tmp_path, capsys):
    """Python prints exceptions of `__del__` and goes on."""

    class Dropping:
        def __del__(self):
            signal.raise_signal(signal.SIGINT)

    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(typer.Exit) as ended, interruptible(tmp_path) as check:
        check()
        Dropping()
        check()
        pytest.fail("the signal is lost")
    assert ended.value.exit_code == 130 and "run the command again" in capsys.readouterr().err
    assert signal.getsignal(signal.SIGINT) is before


def test_the_help_of_sweep_has_the_options_of_its_runs():
    for words in (["sweep", "--help"], ["sweep", "-h"]):
        done = CliRunner().invoke(app, words, env={"COLUMNS": "200"})
        assert done.exit_code == 0
        assert "--vary" in done.output and "treepilot sweep report DIR" in done.output


def test_kept_runs_are_shown_by_commands(turn, tmp_path, executed, monkeypatch):
    swept(turn, tmp_path / "out", runs=5)
    results = read_results(tmp_path / "out")
    kept = replace(results.rows[4], folder="runs/00004")
    monkeypatch.chdir(tmp_path)
    text = page_of([replace(results, rows=(*results.rows[:4], kept))])
    for word in ("report", "replay"):
        assert f"<code>treepilot {word} out/runs/00004</code>" in text


def test_the_page_of_a_shortened_sweep_has_its_runs(turn, tmp_path, executed):
    swept(turn, tmp_path / "out")
    swept(turn, tmp_path / "out", runs=5)
    assert pyarrow.parquet.read_table(tmp_path / "out" / TABLE).num_rows == 5
    results = read_results(tmp_path / "out")
    assert len(results.rows) == 5
    settings = results.rows[4].settings
    assert run_command(results, results.rows[4]) == (
        f"treepilot run {turn} --seed 4 --forget-kept --set 'angle={settings['angle']}' "
        f"--set times={settings['times']}"
    )


def test_the_page_counts_a_run_without_factors_but_has_no_value_of_it(turn, tmp_path, executed):
    """As the baseline of a tuning."""
    swept(turn, tmp_path / "out", runs=30)
    results = read_results(tmp_path / "out")
    plain = replace(results, rows=(replace(results.rows[0], settings={}), *results.rows[1:]))
    text = page_of([plain])
    assert "success 80.0% (62.7% to 90.5%); 30 runs" in text and len(plain.varied) == 29
    only = replace(results, rows=plain.rows[:1])
    assert "1 of 30 runs" in page_of([only])


def test_pages_of_one_sweep_and_of_two(turn, tmp_path, executed):
    swept(turn, tmp_path / "a", runs=30)
    swept(turn, tmp_path / "b", runs=30)
    page = tmp_path / "a" / "report.html"
    done = CliRunner().invoke(
        app, ["sweep", "report", str(tmp_path / "a"), "--fail-if", "success < 0.75"]
    )
    assert done.exit_code == 0
    text = page.read_text()
    assert "success 80.0% (62.7% to 90.5%); 30 runs" in text  # Wilson of 24/30
    assert "angle" in text and "times" in text and "<script" not in text and "http" not in text
    assert "success < 0.75: does not hold, success is 0.8" in done.output
    ones = [row for row in read_results(tmp_path / "a").rows if row.settings["times"] == "1"]
    times = [row.seconds for row in ones if row.is_success]
    error = stdev(times) / sqrt(len(times))
    assert f'<td class="number">{mean(times):.4g} ± {error:.2g}</td>' in text
    assert f"treepilot run {turn} --seed 4 --forget-kept" in text  # no folder is kept of run 4
    again = CliRunner().invoke(
        app, ["sweep", "report", str(tmp_path / "a"), str(tmp_path / "b"),
              "--fail-if", "success < 0.85"],
    )  # fmt: skip
    assert again.exit_code == 1 and "success < 0.85: holds, success is 0.8" in again.output
    assert "median difference +0 s in 24 pairs; Wilcoxon signed-rank p = 1.000" in page.read_text()
    assert "simulated time of the successes" in page.read_text()
    assert "30 pairs with the same seed and settings: 0 succeed only in the second" in (
        page.read_text()
    )

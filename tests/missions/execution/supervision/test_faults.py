"""Faults of behaviours under a supervisor: each ends in time, with a report that names the node."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.missions.execution.test_engine import PATIENCE, ROOT, until

pytestmark = pytest.mark.slow

PLUGIN = """\
import ctypes, os, time
from py_trees.common import Status
from behaviours.base import RobotBehaviour


class Faulty(RobotBehaviour):
    '''Do something terrible.'''

    def update(self) -> Status:
        '''Do it.'''
        open({mark!r}, "w").close()
        {fault}
        return Status.RUNNING
"""
MISSION = """\
mission: faulty
robot: scout
world: small_room
plugins: [./plugins]
run: {sequence: [{faulty: {}, name: culprit}]}
"""
ENDLESS = "while True: pass"
HANGS = {
    "endless loop": (ENDLESS, signal.SIGINT),
    "call that holds the GIL": ("sum(range(10**15))", signal.SIGTERM),
    "call that swallows every exception": ("\n        ".join([
        "while True:",
        "    try: time.sleep(1000)",
        "    except BaseException: pass",
    ]), signal.SIGINT),
}  # fmt: skip
DEATHS = {
    "os._exit as if all were well": ("os._exit(0)", "exit code 0"),
    "os._exit as if the input were wrong": ("os._exit(2)", "exit code 2"),
    "segmentation fault": ("ctypes.string_at(0)", "SIGSEGV"),
    "closed descriptors": ("os.closerange(0, 1000); os.abort()", "SIGABRT"),
}


def begin(folder: Path, fault: str, *words: str) -> subprocess.Popen[str]:
    """Start the mission in a folder of its own; return once the faulty node was ticked."""
    (folder / "plugins").mkdir()
    (folder / "plugins" / "faulty.py").write_text(
        PLUGIN.format(mark=str(folder / "ticked"), fault=fault)
    )
    process = run_in(folder, *words)
    ticked(folder, process)
    return process


def run_in(folder: Path, *words: str) -> subprocess.Popen[str]:
    """Run the mission with the plugin that is there."""
    (folder / "faulty.yaml").write_text(MISSION)
    return subprocess.Popen(
        [sys.executable, "-m", "missions.cli.app", "run", str(folder / "faulty.yaml"),
         "--headless", "--out", str(folder / "out"), *words],
        cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def ticked(folder: Path, process: subprocess.Popen[str]) -> None:
    """Wait until the faulty node was ticked."""
    until(lambda: (folder / "ticked").exists() or process.poll() is not None)


def report_of(folder: Path) -> dict[str, object]:
    return json.loads((folder / "out" / "report.json").read_text("utf-8"))


@pytest.mark.parametrize(("fault", "number"), HANGS.values(), ids=HANGS)
def test_a_signal_ends_a_run_whose_node_never_returns(tmp_path, fault, number):
    process = begin(tmp_path, fault)
    process.send_signal(number)
    _, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 3, errors
    report = report_of(tmp_path)
    assert report["status"] == "error"
    assert "did not end within 2 s" in report["reason"]
    assert "culprit (faulty, faulty.yaml:5) had not returned" in report["reason"]
    assert "faulty.py" in errors  # the stacks of the threads


@pytest.mark.parametrize(("fault", "cause"), DEATHS.values(), ids=DEATHS)
def test_an_engine_that_dies_is_reported_at_once(tmp_path, fault, cause):
    process = begin(tmp_path, fault)
    output, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 3
    report = report_of(tmp_path)
    assert cause in report["reason"] and "culprit" in report["reason"]
    assert report["reason"] in output
    assert (tmp_path / "out" / "events.jsonl").read_bytes().endswith(b"\n")


def test_a_slow_node_is_a_warning_with_its_name_and_not_in_the_log(tmp_path):
    fault = "\n        ".join(["time.sleep(0.8)", "return Status.SUCCESS"])
    process = begin(tmp_path, fault)
    _, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0
    assert "! slow: culprit (faulty, faulty.yaml:5) has not returned for 0." in errors
    assert "slow" not in (tmp_path / "out" / "events.jsonl").read_text("utf-8")
    assert "slow: culprit" in (tmp_path / "out" / "log.txt").read_text("utf-8")


def test_an_engine_that_makes_no_step_is_reported_and_in_the_end_killed(tmp_path):
    process = begin(tmp_path, ENDLESS, "--hang-timeout", "3")
    _, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 3
    assert "the engine has made no step for 2 s; culprit (faulty, faulty.yaml:5)" in errors
    assert "it made no step for 3 s" in report_of(tmp_path)["reason"]


def test_a_thread_of_a_plugin_does_not_keep_the_command(tmp_path):
    fault = "\n        ".join([
        "import threading",
        "threading.Thread(target=time.sleep, args=(1000,)).start()",
        "return Status.SUCCESS",
    ])  # fmt: skip
    process = begin(tmp_path, fault)
    output, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0
    assert output.startswith("faulty: success")


STARTS = {
    "hangs": ("while True: pass", 130, "interrupted", "did not end within 2 s of the signal"),
    "dies": ("os._exit(7)", 3, "error", "ended by itself with exit code 7"),
    "raises": (
        "raise ValueError('no camera')",
        2,
        "error",
        "faulty cannot be built: ValueError: no camera",
    ),
}


@pytest.mark.parametrize(("fault", "code", "status", "reason"), STARTS.values(), ids=STARTS)
def test_a_run_that_ends_while_it_starts_has_a_report(tmp_path, fault, code, status, reason):
    """The node is made twice: by the check, and when the folder of the run is there."""
    (tmp_path / "plugins").mkdir()
    begin_of = f"""
    def __init__(self, *arguments, **more):
        super().__init__(*arguments, **more)
        if os.path.exists({str(tmp_path / "out")!r}):
            open({str(tmp_path / "ticked")!r}, "w").close()
            {fault}

    def update("""
    text = PLUGIN.format(mark="", fault="").replace("\n    def update(", begin_of)
    (tmp_path / "plugins" / "faulty.py").write_text(text)
    process = run_in(tmp_path)
    ticked(tmp_path, process)
    if code == 130:
        process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == code, errors
    report = report_of(tmp_path)
    assert report["status"] == status and reason in report["reason"]
    assert (report["mission"], report["simulated_seconds"]) == ("faulty", 0.0)


def test_how_the_mission_ended_is_the_first_cause_of_a_run_that_hangs_afterwards(tmp_path):
    fault = "\n        ".join([
        "from stack.telemetry.recorder import RunFolder",
        "RunFolder.write_report = lambda *_: time.sleep(10**6)",
        "return Status.FAILURE",
    ])  # fmt: skip
    process = begin(tmp_path, fault, "--hang-timeout", "1")
    process.communicate(timeout=PATIENCE)
    assert process.returncode == 3
    reason = report_of(tmp_path)["reason"]
    assert reason.startswith("the mission ended: failure: ") and "culprit" in reason
    assert "; then the engine was killed: it did not close its records within 1 s" in reason


def test_of_several_missions_one_that_hangs_is_found_after_another_has_ended(tmp_path):
    short = tmp_path / "short.yaml"
    short.write_text("mission: short\nrobot: scout\nworld: small_room\nstart: $dock\n"
                     "run: {sequence: [{wait: 0.1 s}]}\n")  # fmt: skip
    fault = "\n        ".join([
        "self.count = getattr(self, 'count', 0) + 1",
        "while self.count > 20: pass",
    ])  # fmt: skip
    process = begin(tmp_path, fault, str(short), "--hang-timeout", "3")
    output, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 3
    assert "culprit (faulty, faulty.yaml:5) has not returned" in errors
    assert "short: success" in output
    assert "faulty: error; the engine was killed: it made no step for 3 s" in output

import json
import os
import subprocess
import sys
from pathlib import Path
from threading import Event, Thread

import pytest

from stack.errors import TelemetryError
from stack.telemetry.records import MissionState, RunInfo
from stack.telemetry.rendezvous import (
    announce,
    find_run,
    live_runs,
    run_directory,
    run_table,
    states_of,
    withdraw,
)
from stack.telemetry.server import TelemetryServer
from stack.types import Footprint


def about(name, mission="patrol"):
    """A run of this name."""
    return RunInfo(name, mission, "", "rover", "office", 0, Footprint.circle(0.3))


def test_a_run_is_found_until_it_withdraws(runtime_directory):
    info = about("patrol-1")
    handle = announce(info, Path("runs/patrol-1"))
    assert live_runs() == [handle]
    assert (handle.pid, handle.mission, handle.robot) == (os.getpid(), "patrol", "rover")
    assert handle.identity == info.identity and len(handle.identity) == 32
    assert handle.folder == str(Path.cwd() / "runs/patrol-1")
    assert handle.descriptor.stat().st_mode & 0o777 == 0o600
    second = announce(about("patrol-2"))
    assert second.folder == "" and second.identity != handle.identity
    assert second.address != handle.address and len(live_runs()) == 2
    withdraw(handle)
    withdraw(second)
    assert live_runs() == [] and list(run_directory().iterdir()) == []


def test_the_folder_is_private(runtime_directory):
    assert run_directory().stat().st_mode & 0o777 == 0o700


def test_a_folder_others_may_enter_is_refused(runtime_directory):
    run_directory().chmod(0o755)
    with pytest.raises(TelemetryError, match=r"mode 755.*chmod 700"):
        live_runs()


def test_a_link_or_file_instead_of_the_folder_is_refused(runtime_directory, tmp_path):
    place = Path(runtime_directory) / "treepilot"
    place.symlink_to(tmp_path)
    with pytest.raises(TelemetryError, match="is not a folder"):
        run_directory()
    place.unlink()
    place.touch()
    with pytest.raises(TelemetryError, match="treepilot"):
        run_directory()


def test_a_folder_of_another_user_is_refused(runtime_directory, monkeypatch):
    run_directory()
    monkeypatch.setattr(os, "getuid", lambda: 4242)
    with pytest.raises(TelemetryError, match=r"belongs to user .*, not to 4242"):
        run_directory()


def test_without_a_runtime_folder_it_is_in_the_temporary_one(monkeypatch, tmp_path):
    monkeypatch.delenv("XDG_RUNTIME_DIR", raising=False)
    monkeypatch.setattr("tempfile.gettempdir", lambda: str(tmp_path))
    assert run_directory() == tmp_path / f"treepilot-{os.getuid()}"


def test_a_path_too_long_for_a_socket_is_refused(monkeypatch, tmp_path):
    deep = tmp_path / ("x" * 100)
    deep.mkdir()
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(deep))
    with pytest.raises(TelemetryError, match="longer than the 107 bytes"):
        announce(about("a"))


def test_what_a_dead_process_left_is_removed(runtime_directory):
    program = (
        "from tests.stack.telemetry.test_rendezvous import about, announce; announce(about('dead'))"
    )
    subprocess.run([sys.executable, "-c", program], check=True, cwd=Path(__file__).parents[3])
    left = list(run_directory().iterdir())
    assert len(left) == 1
    assert live_runs() == [] and list(run_directory().iterdir()) == []


def test_a_recycled_pid_is_not_taken_for_the_run(runtime_directory):
    handle = announce(about("old"))
    values = json.loads(handle.descriptor.read_text())
    handle.descriptor.write_text(json.dumps(values | {"process_started": 1}))
    assert live_runs() == []


def test_invalid_descriptors_are_skipped(runtime_directory):
    (run_directory() / "1-0.json").write_text("{")
    (run_directory() / "2-0.json").write_text('{"pid": 1}')
    handle = announce(about("a"))
    elsewhere = run_directory() / "3-0.json"
    elsewhere.write_text(handle.descriptor.read_text().replace('"pid": ', '"pid": 9'))
    assert live_runs() == [handle]
    withdraw(handle)


@pytest.fixture
def same_named(runtime_directory, tmp_path):
    """Two live runs with the name `same`, in the folders A and B."""
    return [announce(about("same"), tmp_path / part / "same") for part in "AB"]


def test_a_run_is_found_by_its_folder_and_by_its_identity(same_named, tmp_path, monkeypatch):
    first, second = same_named
    assert find_run(str(tmp_path / "A/same")) == first
    assert find_run(str(tmp_path / "A/../B/same")) == second
    monkeypatch.chdir(tmp_path)
    assert find_run("B/same") == second
    assert find_run(first.identity[:8]) == first and find_run(second.identity.upper()) == second
    lonely = announce(about("lonely"))
    assert find_run("lonely") == lonely


@pytest.mark.parametrize("name", ["same", "", "only", "newest"])
def test_no_run_is_chosen_when_several_match(same_named, tmp_path, name):
    with pytest.raises(TelemetryError) as error:
        find_run(name)
    message = str(error.value)
    assert "name one by its folder, or by the first digits of RUN" in message
    for handle in same_named:
        assert handle.identity[:8] in message and handle.folder in message


def test_a_folder_never_means_a_run_of_that_name_elsewhere(same_named, tmp_path):
    with pytest.raises(TelemetryError, match=r"no run '.*C/same' is live; live runs:"):
        find_run(str(tmp_path / "C/same"))
    with pytest.raises(TelemetryError, match="no run"):
        find_run(same_named[0].identity[:3])


def test_the_only_run_needs_no_name(runtime_directory):
    with pytest.raises(TelemetryError, match="no mission is running"):
        find_run("only")
    handle = announce(about("patrol-1"))
    assert find_run("") == find_run("only") == find_run("newest") == handle


def test_the_table_asks_each_engine_for_its_state(runtime_directory, info, snapshot_at):
    """An engine that does not answer delays the table once, whatever their number."""
    server = TelemetryServer()
    server.open(info)
    silent = [announce(about(f"silent\x1b-{n}")) for n in range(5)]
    over = Event()

    def serve():
        while not over.is_set():
            if server.wants_snapshot(0.0):
                server.snapshot(snapshot_at(state=MissionState.EMERGENCY_STOP))

    engine = Thread(target=serve)
    engine.start()
    try:
        states = states_of(live_runs(), timeout=1.0)
        table = run_table([server.handle])
    finally:
        over.set()
        engine.join()
    assert states.pop(info.identity) == "emergency stop"
    assert list(states.values()) == ["no answer"] * 5
    heading, row = table.splitlines()
    assert heading.split() == ["RUN", "NAME", "ROBOT", "MISSION", "SINCE", "STATE", "FOLDER"]
    assert row.startswith(info.identity[:8]) and "emergency stop" in row
    assert "\x1b" not in run_table(silent[:1])
    server.close(None)

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from stack.errors import TelemetryError
from stack.telemetry.rendezvous import announce, live_runs, run_directory, withdraw


def test_a_run_is_found_until_it_withdraws(runtime_directory):
    handle = announce("patrol-1", "patrol")
    assert live_runs() == [handle]
    assert (handle.pid, handle.mission) == (os.getpid(), "patrol")
    second = announce("patrol-2", "patrol")
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
        announce("a", "b")


def test_what_a_dead_process_left_is_removed(runtime_directory):
    program = "from stack.telemetry.rendezvous import announce; announce('dead', 'mission')"
    subprocess.run([sys.executable, "-c", program], check=True)
    left = list(run_directory().iterdir())
    assert len(left) == 1
    assert live_runs() == [] and list(run_directory().iterdir()) == []


def test_a_recycled_pid_is_not_taken_for_the_run(runtime_directory):
    handle = announce("old", "mission")
    values = json.loads(handle.descriptor.read_text())
    handle.descriptor.write_text(json.dumps(values | {"process_started": 1}))
    assert live_runs() == []


def test_invalid_descriptors_are_skipped(runtime_directory):
    (run_directory() / "1-0.json").write_text("{")
    (run_directory() / "2-0.json").write_text('{"pid": 1}')
    handle = announce("a", "b")
    elsewhere = run_directory() / "3-0.json"
    elsewhere.write_text(handle.descriptor.read_text().replace('"pid": ', '"pid": 9'))
    assert live_runs() == [handle]
    withdraw(handle)

"""`treepilot runs open`: with a display, over SSH, in a browser and for Foxglove."""

import os
import shlex
import sys
from socket import gethostname

import pytest
from typer.testing import CliRunner

from missions.cli.running.runs import runs_app
from missions.inspection.exchange.viewing import DISPLAYS, copying, has_display, tunnel
from stack.errors import InputError
from stack.telemetry.hub import SNAPSHOTS
from stack.telemetry.recorder import RunFolder
from stack.telemetry.recording_parameters import RecordingParameters
from stack.telemetry.snapshots.log import SnapshotLog
from tests.stack.telemetry.foxglove_reader import read
from tests.stack.telemetry.synthetic_run import SyntheticRun

SSH = {"SSH_CONNECTION": "192.0.2.7 50000 192.0.2.1 2222", "USER": "ann"}
"""As sshd sets it: client and its port, server and its port."""


@pytest.fixture
def parent(tmp_path):
    """Two runs."""
    run = SyntheticRun()
    for name in ("shown", "plain"):
        folder = RunFolder.create(tmp_path / name, "mission: x\n")
        folder.events.touch()
        log = SnapshotLog(folder.path / SNAPSHOTS, RecordingParameters())
        log.open(run.info())
        log.snapshot(run.snapshot_at(0.0))
        log.close(None)
    return tmp_path


@pytest.fixture
def started(monkeypatch):
    """The command lines with which viewers were started; on Linux over SSH."""
    found = []
    monkeypatch.setattr(os, "execv", lambda _, words: found.append(words[1:]))
    monkeypatch.setattr(sys, "platform", "linux")
    for name in DISPLAYS:
        monkeypatch.delenv(name, raising=False)
    for name, value in SSH.items():
        monkeypatch.setenv(name, value)
    return found


def invoke(parent, *arguments):
    return CliRunner().invoke(runs_app, ["--folder", str(parent), "open", *arguments])


def test_without_a_display_it_says_how_to_see_the_recording_elsewhere(parent, started):
    refused = invoke(parent, "shown").exception
    assert isinstance(refused, InputError) and started == []
    for text in (
        f"scp -P 2222 ann@192.0.2.1:{parent}/shown/mission.rrd .\n",
        f"treepilot runs --folder {parent} open shown --web\n",
        "ssh -N -L 9090:127.0.0.1:9090 -L 9876:127.0.0.1:9876 -p 2222 ann@192.0.2.1\n",
        f"treepilot runs --folder {parent} open shown --foxglove\n",
        f"treepilot replay {parent}/shown",
    ):
        assert text in str(refused)


def test_a_browser_is_served_on_this_machine_only(parent, started, monkeypatch):
    shown = invoke(parent, "shown", "--web").stdout.splitlines()
    recording = str(parent / "shown/mission.rrd")
    assert started == [["--serve-web", "--bind", "127.0.0.1", recording]]
    assert shown[1] == f"on your computer: {tunnel(SSH)}"
    assert shown[2].startswith("open http://127.0.0.1:9090?url=")
    monkeypatch.setenv("DISPLAY", ":0")
    assert not any("ssh" in line for line in invoke(parent, "shown", "--web").stdout.splitlines())


@pytest.mark.parametrize("name", DISPLAYS)
def test_with_a_display_the_viewer_opens_a_window(parent, started, monkeypatch, name):
    monkeypatch.setenv(name, "x")
    assert invoke(parent, "shown").exit_code == 0
    assert started == [["--bind", "127.0.0.1", str(parent / "shown/mission.rrd")]]


def test_which_systems_have_a_display():
    assert has_display({DISPLAYS[0]: "x"}, "linux")
    assert not has_display({DISPLAYS[0]: ""}, "linux")
    assert has_display({}, "darwin")


@pytest.mark.parametrize(
    ("environment", "address"),
    [
        ({"SSH_CONNECTION": "192.0.2.7 50000 192.0.2.1 22", "USER": "ann"}, "ann@192.0.2.1"),
        ({"SSH_CONNECTION": "::7 50000 2001:db8::1 22"}, "2001:db8::1"),
        ({"SSH_CONNECTION": "damaged", "USER": "ann"}, gethostname()),
        ({}, gethostname()),
    ],
)
def test_the_address_is_the_one_by_which_ssh_came(environment, address, tmp_path):
    assert shlex.split(tunnel(environment))[-1] == address
    assert "-p" not in tunnel(environment)
    place = copying(tmp_path / "a b", environment)
    named = address.replace("2001:db8::1", "[2001:db8::1]")
    assert shlex.split(place) == ["scp", f"{named}:{tmp_path}/a b", "."]


def test_a_run_is_prepared_for_foxglove(parent, started):
    shown = invoke(parent, "plain", "--foxglove")
    assert shown.exit_code == 0, shown.exception
    file = parent / "plain/foxglove.mcap"
    assert shown.stdout.splitlines() == [
        f"{file}: in Foxglove, Open local file",
        f"copy it to your computer: {copying(file, SSH)}",
    ]
    assert len(read(file)["/pose"]) == 1 and started == []


def test_the_recording_is_drawn_again_only_if_the_snapshots_are_newer(parent, started):
    recording, snapshots = parent / "shown/mission.rrd", parent / "shown" / SNAPSHOTS
    invoke(parent, "shown", "--web")
    assert recording.stat().st_size > 10_000
    recording.write_bytes(b"kept")
    os.utime(recording, ns=(0, snapshots.stat().st_mtime_ns))
    invoke(parent, "shown", "--web")
    assert recording.read_bytes() == b"kept"
    os.utime(snapshots, ns=(0, snapshots.stat().st_mtime_ns + 1))
    invoke(parent, "shown", "--web")
    assert recording.stat().st_size > 10_000 and len(started) == 3

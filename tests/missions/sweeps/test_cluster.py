"""Sweeps on a Dask cluster: real worker processes on the loopback device."""

from __future__ import annotations

import os
import signal
from dataclasses import replace

import pytest
from distributed import LocalCluster
from typer.testing import CliRunner

from missions.cli.app import app
from missions.inspection.run_folders import is_run_folder
from missions.sweeps import cluster
from missions.sweeps.checking import checked
from missions.sweeps.design import RunDescription
from missions.sweeps.factors import listed, read_factor
from missions.sweeps.packing import UnpackedSweep, differences, environment, pack_sweep
from missions.sweeps.runner import ExecutionSettings, made_rows, run_sweep
from missions.sweeps.sweep import Sweep
from missions.sweeps.sweep_file import EMPTY
from missions.sweeps.table import SweepFolder
from missions.sweeps.worker import RunMaker, SweepInputs
from robots.load import find_robot
from stack.errors import InputError

PLUGIN = """\
from treepilot import Behaviour, Status


class Shrug(Behaviour):
    \"\"\"Succeed at once.\"\"\"

    def update(self) -> Status:
        return Status.SUCCESS
"""


@pytest.fixture
def own(turn):
    """A sweep with files of its own: mission, plugin, world and robot."""
    base = turn.parent
    (base / "plugins").mkdir()
    (base / "plugins" / "shrug.py").write_text(PLUGIN)
    text = turn.read_text().replace("run:\n  sequence:\n", "run:\n  sequence:\n    - shrug\n")
    turn.write_text(f"plugins: [./plugins]\n{text}")
    scout = find_robot("scout", base).parent
    described = (scout / "robot.yaml").read_text("utf-8")
    (base / "mine").mkdir()
    for file in scout.iterdir():
        if file.is_file():
            (base / "mine" / file.name).write_bytes(file.read_bytes())
    (base / "mine" / "robot.yaml").write_text(described)
    factors = (
        listed("robot", (str(base / "mine"), "scout")), read_factor("goal", "$home,$window"),
    )  # fmt: skip
    return checked(Sweep(str(turn), 8, "grid", factors), EMPTY.refusal)


def without_costs(rows):
    return [row.without_costs for row in rows]


def test_a_packed_sweep_has_the_rows_of_the_original(own, tmp_path):
    """On a machine without its files, and in another folder."""
    inputs = SweepInputs(own.sweep, tmp_path / "here" / "runs", own.paths)
    packed = pack_sweep(inputs)
    runs = [own.sweep.plan.run(number) for number in range(4)]
    expected = [RunMaker(inputs)(run) for run in runs]
    for name in ("mine", "plugins", "turn.yaml"):
        (tmp_path / name).rename(tmp_path / f"gone_{name}")
    (tmp_path / "there").mkdir()
    unpacked = UnpackedSweep(packed, tmp_path / "there")
    make = RunMaker(unpacked.inputs)
    rows = [unpacked.row_there(make(unpacked.run_here(run)), run) for run in runs]
    assert without_costs(rows) == without_costs(expected)
    assert [row.outcome for row in rows] == ["success", "failure"] * 2


def test_a_packed_sweep_has_its_files_of_faults(turn, tmp_path):
    """As a factor and for all runs, alone and joined with others."""
    file = tmp_path / "far.yaml"
    file.write_text("faults: [{lidar_bias: {bias: 1 m}}]\n")
    factors = (listed("faults", ("none", str(file), f"{file}+push")),)
    for sweep in (
        Sweep(str(turn), 3, "grid", factors),
        Sweep(str(turn), 1, "random", faults=f"push+{file}"),
    ):
        ready = checked(sweep, EMPTY.refusal)
        inputs = SweepInputs(ready.sweep, tmp_path / "here" / "runs", ready.paths)
        packed = pack_sweep(inputs)
        runs = [*ready.sweep.descriptions()]
        expected = [RunMaker(inputs)(run) for run in runs]
        hidden = file.rename(tmp_path / "hidden")
        (there := tmp_path / f"there_{sweep.runs}").mkdir()
        unpacked = UnpackedSweep(packed, there)
        make = RunMaker(unpacked.inputs)
        rows = [unpacked.row_there(make(unpacked.run_here(run)), run) for run in runs]
        hidden.rename(file)
        assert without_costs(rows) == without_costs(expected)
        assert len({row.event_hash for row in rows}) == sweep.runs


def test_files_of_treepilot_do_not_travel(own, tmp_path):
    shipped = checked(Sweep("01_drive_to_a_point", 2, "random"), EMPTY.refusal)
    packed = pack_sweep(SweepInputs(shipped.sweep, tmp_path, shipped.paths))
    assert packed.environment["missions/worlds/small_room.yaml"]
    assert packed.places == {}
    assert len(packed.content) < len(
        pack_sweep(SweepInputs(own.sweep, tmp_path, own.paths)).content
    )


def test_what_differs_on_another_machine_is_named():
    here = environment(["missions/worlds/small_room.yaml"])
    assert differences(here, here) == [] and here["sources of treepilot"]
    there = {**here, "numpy": "1.0", "missions/worlds/small_room.yaml": "not there"}
    assert differences(here, there) == [
        f"numpy 1.0 (here {here['numpy']})",
        "missions/worlds/small_room.yaml not there (here "
        f"{here['missions/worlds/small_room.yaml']})",
    ]
    with pytest.raises(
        InputError, match=r"worker tcp://b:1 has numpy 1\.0 .*would differ; install"
    ):
        cluster._check(here, there, "tcp://b:1")
    with pytest.raises(InputError, match="cannot run treepilot: No module named 'missions'"):
        cluster._check(here, ModuleNotFoundError("No module named 'missions'"), "tcp://b:1")


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nonsense://x", "tcp:/127.0.0.1"])
def test_a_scheduler_that_does_not_answer_is_an_error(turn, tmp_path, monkeypatch, address):
    monkeypatch.setattr(cluster, "CONNECTING", 1.0)
    words = ["sweep", str(turn), "--runs", "2", "--cluster", address, "--out", str(tmp_path / "o")]
    done = CliRunner().invoke(app, words)
    assert f"--cluster {address}: no Dask scheduler answers" in str(done.exception)


def test_a_cluster_needs_dask_and_no_jobs(turn, monkeypatch):
    words = ["sweep", str(turn), "--cluster", "tcp://127.0.0.1:9"]
    done = CliRunner().invoke(app, [*words, "--jobs", "2"])
    assert "leave --jobs out" in str(done.exception)
    monkeypatch.setattr("stack.optional_packages.find_spec", lambda _: None)
    done = CliRunner().invoke(app, words)
    assert "--cluster needs the Python package distributed" in str(done.exception)
    assert "treepilot[cluster]" in str(done.exception)


@pytest.fixture(scope="module")
def two_workers():
    with LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, host="127.0.0.1",
        dashboard_address=None, silence_logs=50,
    ) as made:  # fmt: skip
        yield made


@pytest.mark.parametrize(
    ("address", "words"),
    [
        ("nonsense", "Invalid url scheme"),
        ("tcp://machine", "missing port number"),
        ("tcp://machine:port", "no Dask scheduler answers"),
        ("http://machine:8786", "unknown scheme http"),
        ("tls://machine:8786", "tls without certificates"),
    ],
)
def test_an_address_that_is_none_is_refused_at_once(address, words):
    """A Client that cannot be made leaves a thread behind that Python waits for at its end."""
    with pytest.raises(InputError, match=words):
        cluster._connected(address)


@pytest.mark.slow
def test_a_cluster_has_the_rows_of_this_machine(own, tmp_path, two_workers):
    """One worker is killed in the middle: Dask replaces it and repeats its run."""
    killed: list[int] = []

    def kill(rows):
        if len(rows) == 2 and not killed:
            killed.append(next(iter(two_workers.workers.values())).pid)
            os.kill(killed[0], signal.SIGKILL)

    execution = ExecutionSettings(cluster=two_workers.scheduler_address)
    rows = run_sweep(own, SweepFolder(tmp_path / "far"), execution, kill)
    local = run_sweep(own, SweepFolder(tmp_path / "near"), ExecutionSettings(), lambda _: None)
    assert killed and without_costs(rows) == without_costs(local)
    kept = [row.folder for row in rows if row.folder]
    assert len(kept) == 4 and all(is_run_folder(tmp_path / "far" / folder) for folder in kept)
    again = run_sweep(own, SweepFolder(tmp_path / "far"), execution, lambda _: None)
    assert again == rows  # nothing is missing


@pytest.mark.slow
def test_a_run_that_ends_each_of_its_workers_is_a_row(own, tmp_path, two_workers):
    execution = ExecutionSettings(cluster=two_workers.scheduler_address)
    deadly = replace(own.sweep, factors=(), mission=str(_deadly(tmp_path)))
    ready = checked(replace(deadly, runs=1, design="random"), EMPTY.refusal)
    rows = run_sweep(ready, SweepFolder(tmp_path / "out"), execution, lambda _: None)
    assert [row.outcome for row in rows] == ["crashed"]
    assert rows[0].reason.startswith("its worker ended 4 times")  # Dask's allowed-failures is 3


def _deadly(folder):
    (folder / "deadly").mkdir()
    text = PLUGIN.replace("Shrug", "Die").replace("return Status.SUCCESS", "os._exit(7)")
    (folder / "deadly" / "die.py").write_text(f"import os\n\n{text}")
    file = folder / "deadly.yaml"
    file.write_text(
        "mission: die\nrobot: scout\nworld: small_room\nplugins: [./deadly]\nrun: die\n"
    )
    return file


@pytest.mark.slow
def test_closing_cancels_and_removes_the_files_of_the_workers(own, tmp_path, two_workers):
    execution = ExecutionSettings(cluster=two_workers.scheduler_address)
    long = replace(own.sweep, mission=str(tmp_path / "long.yaml"), factors=())
    (tmp_path / "long.yaml").write_text(
        "mission: long\nrobot: scout\nworld: small_room\nrun: {wait: 100 h}\n"
    )
    inputs = SweepInputs(replace(long, time_limit=1e6), tmp_path / "long" / "runs")
    short = RunDescription(0, 0, (("mission", str(tmp_path / "turn.yaml")),))
    made = made_rows(inputs, iter([short, RunDescription(1, 1)]), execution)
    next(made)
    made.close()
    with two_workers.get_client() as client:
        left = client.run(lambda dask_worker: [
            name for name in os.listdir(dask_worker.local_directory) if "treepilot" in name
        ])  # fmt: skip
        assert left and not any(left.values())
        assert not any(client.processing().values())

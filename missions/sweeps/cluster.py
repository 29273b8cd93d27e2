"""Runs of a sweep in the worker processes of a Dask cluster.

Dask schedules, starts workers that have died again, and repeats their runs. A worker gets the
packed sweep once, as a plugin, and makes its runs with the `RunMaker` of local processes.
"""

from __future__ import annotations

import faulthandler
import shutil
from collections.abc import Callable, Generator, Iterable, Mapping
from contextlib import suppress
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory, mkdtemp
from threading import Lock
from time import perf_counter
from typing import Any

from distributed import Client, Future, KilledWorker, WorkerPlugin, get_worker, wait
from distributed.client import FutureCancelledError
from distributed.comm.addressing import parse_address, parse_host_port
from distributed.security import Security

from missions.execution.resources import versions
from missions.inspection.exchange.packing import pack, unpack
from missions.sweeps.design import RunDescription
from missions.sweeps.packing import (
    PackedSweep,
    UnpackedSweep,
    differences,
    environment,
    pack_sweep,
)
from missions.sweeps.row import CRASHED, SweepRow
from missions.sweeps.table import place_of
from missions.sweeps.worker import RunMaker, SweepInputs
from stack.errors import InputError

CONNECTING = 30.0
"""Wall seconds in which the scheduler must answer."""

WITHOUT_WORKERS = 600.0
"""Wall seconds that a sweep waits for a worker: a job of a batch system may be queued."""

POLL_PERIOD = 2.0
"""Wall seconds between two looks at the progress."""

ALIVE_PERIOD = 1.0
"""Wall seconds between two signs of life of a run in a worker."""

STDERR = 2
"""File descriptor."""

CONTINUE = "the finished runs are kept: run the command again to continue"

Made = tuple[SweepRow, bytes]
"""The row of a run, and its packed run folder if that is kept."""


def cluster_rows(
    address: str, inputs: SweepInputs, runs: Iterable[RunDescription], silence: float,
    on_poll: Callable[[], None] = lambda: None,
) -> Generator[SweepRow, None, None]:  # fmt: skip
    """Make runs on a cluster; yield their rows as the runs finish.

    A run whose workers have died as often as the scheduler allows is `crashed`. When the generator
    is closed, the runs that are not over are cancelled.

    Args:
        address: of the scheduler, `tcp://HOST:PORT` or `tls://HOST:PORT`.
        inputs: of all runs.
        runs: each is taken when a worker is free, after the rows so far.
        silence: wall seconds without a step after which a run ends its worker.
        on_poll: called at times.

    Raises:
        InputError: the scheduler does not answer, there are no workers, or they differ from this
            machine.
    """
    packed = pack_sweep(inputs)
    with _connected(address) as client:
        _await_workers(client, address)
        _compare(client, packed)
        client.register_plugin(RunPlugin(packed, silence), name=packed.name)
        pending: dict[Future[Made], RunDescription] = {}
        try:
            for run, future in _over(client, address, packed.name, pending, iter(runs), on_poll):
                yield _row(run, future, inputs)
        finally:
            _finish(client, packed.name, pending)


def _over(  # noqa: PLR0913 - the state of the runs and what follows them
    client: Client, address: str, name: str, pending: dict[Future[Made], RunDescription],
    waiting: Iterable[RunDescription], on_poll: Callable[[], None],
) -> Generator[tuple[RunDescription, Future[Made]], None, None]:  # fmt: skip
    """Yield runs that are over; as many as there are worker processes are under way."""
    seen = perf_counter()
    while True:
        workers = len(client.nthreads())
        while len(pending) < max(workers, 1) and (following := [*islice(waiting, 1)]):
            run = following[0]
            future = client.submit(make_run, name, run, pure=False, key=f"{name}-{run.number}")
            pending[future] = run
        if not pending:
            return
        try:
            with client.as_current():
                done = wait([*pending], timeout=POLL_PERIOD, return_when="FIRST_COMPLETED").done
        except FutureCancelledError:
            raise InputError(f"the connection to {address} is lost", CONTINUE) from None
        except TimeoutError:
            done = set()
        on_poll()
        if workers:
            seen = perf_counter()
        elif perf_counter() - seen > WITHOUT_WORKERS:
            sentence = f"{address} has had no worker for {WITHOUT_WORKERS / 60.0:g} min"
            raise InputError(sentence, CONTINUE)
        for future in done:
            yield pending.pop(future), future


def _row(run: RunDescription, future: Future[Made], inputs: SweepInputs) -> SweepRow:
    """Return the row of a run that is over; its folder is unpacked."""
    try:
        made: Made = future.result(timeout=CONNECTING)
    except KilledWorker as error:
        attempts = error.allowed_failures + 1
        reason = f"its worker ended {attempts} times, the last one {error.last_worker.address}"
        return SweepRow.without_figures(run, CRASHED, reason, versions())
    row, folder = made
    if folder:
        place = place_of(inputs.runs, run.number)
        shutil.rmtree(place, ignore_errors=True)
        with TemporaryDirectory(prefix="treepilot-") as temporary:
            file = Path(temporary) / "run.zip"
            file.write_bytes(folder)
            unpack(file, (inputs.runs.parent / row.folder).parent)
    return row


def _connected(address: str) -> Client:
    try:
        _check_address(address)
        return Client(address, timeout=CONNECTING, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise InputError(
            f"--cluster {address}: no Dask scheduler answers: {error}",
            "start one with `dask scheduler`; addresses are tcp://HOST:PORT or tls://HOST:PORT",
        ) from None


def _check_address(address: str) -> None:
    """Raise ValueError for an address of which no Client can be made: that would wait for 60 s."""
    scheme, place = parse_address(address, strict=True)
    parse_host_port(place)
    if scheme not in ("tcp", "tls"):
        raise ValueError(f"unknown scheme {scheme}")
    if scheme == "tls" and not Security().get_connection_args("client").get("ssl_context"):
        raise ValueError("tls without certificates (DASK_DISTRIBUTED__COMM__TLS__CA_FILE, …)")


def _await_workers(client: Client, address: str) -> None:
    try:
        client.wait_for_workers(1, timeout=WITHOUT_WORKERS)
    except TimeoutError:
        raise InputError(
            f"the scheduler {address} has no workers",
            f"start some with `dask worker {address} --nworkers auto --nthreads 1`",
        ) from None


def _compare(client: Client, packed: PackedSweep) -> None:
    """Raise InputError if a worker has other versions or sources than this machine."""
    shipped = [name for name in packed.environment if "/" in name]
    found: Mapping[str, Any] = client.run(environment, shipped, on_error="return")
    for worker, there in found.items():
        _check(packed.environment, there, worker)


def _check(here: Mapping[str, str], there: Any, where: str) -> None:
    advice = "install the same versions on all machines"
    if isinstance(there, BaseException):
        raise InputError(f"the worker {where} cannot run treepilot: {there}", advice)
    found = differences(here, there)
    if found:
        raise InputError(
            f"the worker {where} has {', '.join(found[:4])}; its runs would differ", advice
        )


def _finish(client: Client, name: str, pending: Mapping[Future[Made], RunDescription]) -> None:
    """Cancel what is not over, and let the workers remove their files."""
    with suppress(OSError, TimeoutError, RuntimeError):  # the scheduler may be gone
        client.cancel([*pending], force=True)
        client.unregister_worker_plugin(name)


class CancelledError(Exception):
    """The sweep has ended before this run."""


class RunPlugin(WorkerPlugin):
    """Makes the runs of a sweep in a worker process, one at a time.

    Args:
        packed: the sweep.
        silence: wall seconds without a step after which a run ends the process.
    """

    def __init__(self, packed: PackedSweep, silence: float) -> None:
        self.name = packed.name
        self._packed, self._silence = packed, silence

    def setup(self, worker: Any) -> None:
        """Begin in a worker."""
        self._folder = Path(mkdtemp(prefix=f"{self.name}-", dir=worker.local_directory))
        self._worker = worker.address
        self._lock, self._is_over, self._alive_at = Lock(), False, 0.0
        self._maker: RunMaker | None = None
        self._unpacked: UnpackedSweep | None = None

    def teardown(self, worker: Any) -> None:
        """End the run under way, and remove the files."""
        self._is_over = True
        if self._lock.acquire(blocking=False) and self._maker is not None:
            self._maker.close()
        shutil.rmtree(self._folder, ignore_errors=True)

    def make(self, run: RunDescription) -> Made:
        """Make a run; return its row, and its run folder if that is kept."""
        with self._lock:
            if self._maker is None or self._unpacked is None:
                shipped = [name for name in self._packed.environment if "/" in name]
                _check(self._packed.environment, environment(shipped), self._worker)
                self._unpacked = UnpackedSweep(self._packed, self._folder)
                self._maker = RunMaker(self._unpacked.inputs, self._alive)
            self._watch()
            try:
                row = self._maker(self._unpacked.run_here(run))
            finally:
                faulthandler.cancel_dump_traceback_later()
            folder = _packed_folder(self._unpacked.inputs, row)
            return self._unpacked.row_there(row, run), folder

    def _alive(self) -> None:
        if self._is_over:
            raise CancelledError
        if perf_counter() - self._alive_at > ALIVE_PERIOD:
            self._watch()

    def _watch(self) -> None:
        """End the process, with a traceback, if it makes no step for too long."""
        self._alive_at = perf_counter()
        faulthandler.dump_traceback_later(self._silence, exit=True, file=STDERR)


def _packed_folder(inputs: SweepInputs, row: SweepRow) -> bytes:
    """Return the packed folder of a run, which is removed here; empty if it is not kept."""
    if not row.folder:
        return b""
    folder = inputs.runs.parent / row.folder
    file = inputs.runs.parent / "run.zip"
    file.unlink(missing_ok=True)
    pack(folder, file)
    shutil.rmtree(place_of(inputs.runs, row.number), ignore_errors=True)
    return file.read_bytes()


def make_run(name: str, run: RunDescription) -> Made:
    """Make a run in the worker in which this is called; the task of the cluster.

    Args:
        name: of the plugin.
        run: to make.
    """
    plugin: Any = get_worker().plugins[name]
    made: Made = plugin.make(run)
    return made

"""Discovery of a user's live runs: descriptors and sockets in a private folder.

A run is chosen by its folder, name or identity, never by being the newest. Runs are listed with
the states that their engines tell.
"""

from __future__ import annotations

import json
import os
import stat
import tempfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, fields, replace
from datetime import UTC, datetime
from math import ceil
from pathlib import Path
from time import monotonic  # noqa: TID251 - transport timeouts are wall time

from stack.columns import columns
from stack.errors import TelemetryError
from stack.parameters import values_of
from stack.telemetry.codec import decode_one_of, encode
from stack.telemetry.messages import Goodbye, Inquiry, RunState, Served
from stack.telemetry.records import RunInfo
from stack.types.printable import printable

MAX_SOCKET_PATH = 107
"""Longest path of a Unix socket, bytes (Linux's sun_path without the final zero)."""


ONLY = ("", "only", "newest")
"""Words for the only live run."""

SHORTEST_PREFIX = 4
"""Fewest digits of an identity that name a run."""

SHOWN_DIGITS = 8
"""Digits of the identities in the table; the first ones are enough to name a run."""

STATE_TIMEOUT = 0.3
"""Wall seconds that all engines together get to tell their states."""

NO_ANSWER = "no answer"

HOW_TO_NAME = "name one by its folder, or by the first digits of RUN"

LINGER_MS = 50
"""Longest time that a goodbye may take."""


@dataclass(frozen=True, slots=True)
class RunHandle:
    """Descriptor of a live run.

    Attributes:
        identity: of this run alone; commands carry it.
        run_id: name of the run; another run may have the same.
        folder: absolute path of the run folder; empty if there is none.
        address: for TelemetryClient.
        since: when it was announced, ISO 8601, UTC.
        process_started: start time of the process in kernel ticks, to detect a recycled pid; 0 if
            the system does not provide it.
    """

    identity: str
    run_id: str
    robot: str
    mission: str
    folder: str
    pid: int
    address: str
    since: str
    process_started: int = 0

    @property
    def socket(self) -> Path:
        """Path of the socket."""
        return Path(self.address.removeprefix("ipc://"))

    @property
    def descriptor(self) -> Path:
        """Path of the file that describes this run."""
        return self.socket.with_suffix(".json")


def run_directory() -> Path:
    """The folder for the sockets of this user's runs; created if missing.

    Raises:
        TelemetryError: it belongs to another user, others have access, or it is not a folder.
    """
    runtime = os.environ.get("XDG_RUNTIME_DIR", "")
    if runtime and Path(runtime).is_dir():
        folder = Path(runtime) / "treepilot"
    else:
        folder = Path(tempfile.gettempdir()) / f"treepilot-{os.getuid()}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
    except OSError as error:
        raise TelemetryError(f"cannot create the folder for the run's socket: {error}") from None
    if not stat.S_ISDIR(found.st_mode):
        raise TelemetryError(f"{folder} is not a folder; remove it")
    if found.st_uid != os.getuid():
        raise TelemetryError(
            f"{folder} belongs to user {found.st_uid}, not to {os.getuid()}; "
            "set XDG_RUNTIME_DIR to a folder of your own"
        )
    if found.st_mode & 0o077:
        mode = stat.S_IMODE(found.st_mode)
        raise TelemetryError(
            f"other users have access to {folder} (mode {mode:o}); run: chmod 700 {folder}"
        )
    return folder


def usual_folders() -> list[Path]:
    """Return where a login, cron or `su` of this user would put the sockets."""
    user = os.getuid()
    return [Path(f"/run/user/{user}/treepilot"), Path(f"/tmp/treepilot-{user}")]


def _is_private(folder: Path) -> bool:
    try:
        found = folder.lstat()
    except OSError:
        return False
    is_own = stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid()
    return is_own and not found.st_mode & 0o077


def choose_socket() -> Path:
    """Return a free path for the socket of a run of this process.

    Raises:
        TelemetryError: there is no private folder, or its path is too long for a socket.
    """
    folder, pid = run_directory(), os.getpid()
    taken = 0
    while (folder / f"{pid}-{taken}.json").exists():
        taken += 1
    socket = folder / f"{pid}-{taken}.sock"
    if len(os.fsencode(socket)) > MAX_SOCKET_PATH:
        raise TelemetryError(
            f"{socket} is longer than the {MAX_SOCKET_PATH} bytes of a socket's path; "
            "set XDG_RUNTIME_DIR to a shorter folder"
        )
    return socket


def announce(info: RunInfo, folder: Path | None = None) -> RunHandle:
    """Announce that this process runs a mission, and choose the address of its socket.

    Args:
        info: of the run.
        folder: of the run; None if it has none.

    Raises:
        TelemetryError: there is no private folder, or its path is too long for a socket.
    """
    socket, pid = choose_socket(), os.getpid()
    handle = RunHandle(
        info.identity, info.run_id, info.robot, info.mission,
        "" if folder is None else str(folder.resolve()), pid, f"ipc://{socket}",
        datetime.now(UTC).isoformat(timespec="seconds"), _process_started(pid),
    )  # fmt: skip
    _write(handle)
    return handle


def announce_again(handle: RunHandle) -> RunHandle:
    """Announce a run whose descriptor or socket was deleted; its address changes only if it must.

    Raises:
        TelemetryError: there is no private folder, or its path is too long for a socket.
    """
    if run_directory() != handle.socket.parent:
        handle = replace(handle, address=f"ipc://{choose_socket()}")
    _write(handle)
    return handle


def _write(handle: RunHandle) -> None:
    """Write the descriptor of a run.

    Raises:
        TelemetryError: it cannot be written.
    """
    unfinished = handle.descriptor.with_suffix(".new")
    try:
        unfinished.unlink(missing_ok=True)
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC
        with os.fdopen(os.open(unfinished, flags, 0o600), "w", encoding="utf-8") as file:
            json.dump(asdict(handle), file)
        unfinished.replace(handle.descriptor)
    except OSError as error:
        raise TelemetryError(f"cannot announce the run: {error}") from None


def withdraw(handle: RunHandle) -> None:
    """Remove the descriptor and the socket of a run. Safe to call twice."""
    for file in (handle.descriptor, handle.socket):
        with suppress(OSError):
            file.unlink()


def live_runs() -> list[RunHandle]:
    """This user's live runs, oldest first; removes the files of runs that have died.

    Runs that were started with another XDG_RUNTIME_DIR or TMPDIR are found in the usual folders.

    Raises:
        TelemetryError: the folder of the sockets is not private.
    """
    runs, own = [], run_directory()
    others = [folder for folder in usual_folders() if folder != own and _is_private(folder)]
    for file in sorted(file for folder in (own, *others) for file in folder.glob("*.json")):
        handle = _read(file)
        if handle is not None and handle.descriptor == file:
            if is_alive(handle):
                runs.append(handle)
            else:
                withdraw(handle)
    return sorted(runs, key=lambda run: (run.since, run.run_id, run.identity))


def matching_runs(name: str) -> list[RunHandle]:
    """Return the live runs of a name, as for `find_run`.

    Raises:
        TelemetryError: the folder of the sockets is not private.
    """
    return [run for run in live_runs() if _matches(run, name)]


def find_run(name: str) -> RunHandle:
    """Return the live run of a name.

    Args:
        name: path of a run folder, name of a run, or the first digits of its identity (at least
            SHORTEST_PREFIX); `only` or an empty text: the only live run.

    Raises:
        TelemetryError: no run matches, or several do; the message lists them.
    """
    runs = live_runs()
    matching = [run for run in runs if _matches(run, name)]
    if len(matching) == 1:
        return matching[0]
    if not runs:
        named = "" if name in ONLY else f"no run {name!r} is live: "
        raise TelemetryError(f"{named}no mission is running")
    if not matching:
        raise TelemetryError(f"no run {name!r} is live; live runs:\n{run_table(runs)}")
    what = f"{len(runs)} runs are live" if name in ONLY else f"{len(matching)} runs match {name!r}"
    raise TelemetryError(f"{what}; {HOW_TO_NAME}:\n{run_table(matching)}")


def run_table(runs: Sequence[RunHandle]) -> str:
    """Return a table of runs, one per line below the headings; it asks each engine its state."""
    states = states_of(runs)
    rows = [("RUN", "NAME", "ROBOT", "MISSION", "SINCE", "STATE", "FOLDER")]
    for run in runs:
        state, since = states[run.identity], _local_time(run.since)
        rows.append(
            (run.identity[:SHOWN_DIGITS], run.run_id, run.robot, run.mission, since, state,
             run.folder or "-")
        )  # fmt: skip
    return "\n".join(columns([[_one_line(cell) for cell in row] for row in rows]))


def states_of(
    runs: Sequence[RunHandle], timeout: float = STATE_TIMEOUT,
    clock: Callable[[], float] = monotonic,
) -> dict[str, str]:  # fmt: skip
    """Ask the engines of runs for their states, all at once.

    Args:
        runs: to ask.
        timeout: wall seconds for all of them together.
        clock: returns wall seconds.

    Returns:
        State by identity; NO_ANSWER for an engine that does not answer in time.
    """
    import zmq

    states, context, poller = {run.identity: NO_ANSWER for run in runs}, zmq.Context(), zmq.Poller()
    sockets: dict[zmq.Socket[bytes], str] = {}
    for run in runs:
        socket = context.socket(zmq.DEALER)
        socket.set(zmq.LINGER, 0)
        socket.connect(run.address)
        socket.send(encode(Inquiry()))
        poller.register(socket, zmq.POLLIN)
        sockets[socket] = run.identity
    waiting, deadline = set(sockets), clock() + timeout
    while waiting and (left := deadline - clock()) > 0.0:
        for socket, _ in poller.poll(ceil(1000.0 * left)):
            states[sockets[socket]] = _state_in(socket.recv(), sockets[socket])
            socket.send(encode(Goodbye()))
            waiting.discard(socket)
            poller.unregister(socket)
    for socket in sockets:
        socket.close(linger=0 if socket in waiting else LINGER_MS)
    context.term()
    return states


def _read(file: Path) -> RunHandle | None:
    """The handle in a descriptor file; None if the file has vanished or is invalid."""
    try:
        handle = RunHandle(**json.loads(file.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return None
    values = values_of(handle)
    valid = all(type(values[item.name]).__name__ == item.type for item in fields(handle))
    return handle if valid else None


def is_alive(handle: RunHandle) -> bool:
    """Whether the process of an engine lives."""
    try:
        os.kill(handle.pid, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return False  # the pid was recycled and now belongs to another user
    return handle.process_started in (0, _process_started(handle.pid))


def _process_started(pid: int) -> int:
    """When a process started, in kernel ticks; 0 if unknown, -1 if it has ended."""
    try:
        status = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return 0
    # Fields 3 and 22 of proc(5); field 2, the name, may contain spaces and parentheses.
    fields = status.rpartition(")")[2].split()
    return -1 if fields[0] == "Z" else int(fields[19])


def _state_in(answer: bytes, identity: str) -> str:
    """Return the state that an engine has sent."""
    try:
        found = decode_one_of(answer, (RunState, Served))
    except TelemetryError:
        return "another version"
    right = isinstance(found, RunState) and found.identity == identity
    return str(found.state) if right else NO_ANSWER


def _matches(run: RunHandle, name: str) -> bool:
    if name in ONLY:
        return True
    is_folder = bool(run.folder) and Path(name).resolve() == Path(run.folder)
    if "/" in name:
        return is_folder
    is_prefix = len(name) >= SHORTEST_PREFIX and run.identity.startswith(name.lower())
    return is_folder or run.run_id == name or is_prefix


def _local_time(since: str) -> str:
    """Return a UTC time of a descriptor as local time."""
    try:
        return datetime.fromisoformat(since).astimezone().strftime("%Y-%m-%d %H:%M:%S")
    except (ValueError, OverflowError):
        return since


def _one_line(text: str) -> str:
    return printable(text).replace("\n", "\\n").replace("\t", "\\t")

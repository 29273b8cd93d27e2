"""Where engines and dashboards of one user find each other: a folder only they can enter."""

from __future__ import annotations

import json
import os
import stat
import tempfile
from contextlib import suppress
from dataclasses import asdict, dataclass, fields
from datetime import UTC, datetime
from pathlib import Path

from stack.errors import TelemetryError

MAX_SOCKET_PATH = 107
"""Bytes that a Unix socket's path may have (sun_path of Linux, less its final zero)."""


@dataclass(frozen=True, slots=True)
class RunHandle:
    """A run that is going on.

    Attributes:
        address: what TelemetryClient connects to.
        started: ISO 8601, UTC.
        process_started: start of the process in kernel ticks, so that a recycled pid does not pass
            for it; 0 where the system does not tell.
    """

    run_id: str
    mission: str
    pid: int
    address: str
    started: str
    process_started: int = 0

    @property
    def socket(self) -> Path:
        """The socket's file."""
        return Path(self.address.removeprefix("ipc://"))

    @property
    def descriptor(self) -> Path:
        """The file that tells others of this run."""
        return self.socket.with_suffix(".json")


def run_directory() -> Path:
    """The folder for sockets of this user's runs, made if need be.

    Raises:
        TelemetryError: it belongs to somebody else, others may enter it, or it is not a folder.
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
        raise TelemetryError(f"no folder for the run's socket: {error}") from None
    if not stat.S_ISDIR(found.st_mode):
        raise TelemetryError(f"{folder} is not a folder; remove it")
    if found.st_uid != os.getuid():
        raise TelemetryError(
            f"{folder} belongs to user {found.st_uid}, not to {os.getuid()}; "
            "set XDG_RUNTIME_DIR to a folder of your own"
        )
    if found.st_mode & 0o077:
        mode = stat.S_IMODE(found.st_mode)
        raise TelemetryError(f"others may enter {folder} (mode {mode:o}); run: chmod 700 {folder}")
    return folder


def announce(run_id: str, mission: str) -> RunHandle:
    """Make known that this process runs a mission, and choose the address of its socket.

    Raises:
        TelemetryError: no private folder, or its path is too long for a socket.
    """
    folder, pid = run_directory(), os.getpid()
    taken = 0
    while (folder / f"{pid}-{taken}.json").exists():
        taken += 1
    socket = folder / f"{pid}-{taken}.sock"
    if len(os.fsencode(socket)) > MAX_SOCKET_PATH:
        raise TelemetryError(
            f"{socket} is longer than the {MAX_SOCKET_PATH} bytes a socket's path may have; "
            "set XDG_RUNTIME_DIR to a shorter one"
        )
    started = datetime.now(UTC).isoformat(timespec="seconds")
    handle = RunHandle(run_id, mission, pid, f"ipc://{socket}", started, _process_started(pid))
    unfinished = handle.descriptor.with_suffix(".new")
    try:
        unfinished.write_text(json.dumps(asdict(handle)), encoding="utf-8")
        unfinished.replace(handle.descriptor)
    except OSError as error:
        raise TelemetryError(f"the run cannot be announced: {error}") from None
    return handle


def withdraw(handle: RunHandle) -> None:
    """Remove what `announce` left, and the socket. Safe to call twice."""
    for file in (handle.descriptor, handle.socket):
        with suppress(OSError):
            file.unlink()


def live_runs() -> list[RunHandle]:
    """This user's runs that are going on, oldest first; what dead ones left is removed.

    Raises:
        TelemetryError: the folder of the sockets is not private.
    """
    runs = []
    for file in sorted(run_directory().glob("*.json")):
        handle = _read(file)
        if handle is not None and handle.descriptor == file:
            if _is_alive(handle):
                runs.append(handle)
            else:
                withdraw(handle)
    return sorted(runs, key=lambda run: (run.started, run.run_id))


def find_run(name: str) -> RunHandle:
    """A live run by name or folder; the newest when the name is empty.

    Raises:
        TelemetryError: there is none; the message names those there are.
    """
    runs = live_runs()
    wanted = Path(name).name
    matching = [run for run in runs if not name or run.run_id == wanted]
    if not matching:
        live = ", ".join(run.run_id for run in runs) or "none is"
        raise TelemetryError(
            f"no run {name!r} is live; live runs: {live}" if name else "no mission is running"
        )
    return matching[-1]


def _read(file: Path) -> RunHandle | None:
    """The handle in a descriptor; None if it has just gone or is not one."""
    try:
        handle = RunHandle(**json.loads(file.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return None
    whole = all(type(getattr(handle, item.name)).__name__ == item.type for item in fields(handle))
    return handle if whole else None


def _is_alive(handle: RunHandle) -> bool:
    try:
        os.kill(handle.pid, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return False  # the pid belongs to another user now: not the process that wrote this
    return handle.process_started in (0, _process_started(handle.pid))


def _process_started(pid: int) -> int:
    try:
        status = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return 0
    # Field 22 of proc(5); the second, the command's name, may hold spaces and brackets.
    return int(status.rpartition(")")[2].split()[19])

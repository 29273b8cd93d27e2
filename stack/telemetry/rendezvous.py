"""Discovery of a user's live runs: descriptors and sockets in a private folder."""

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
"""Longest path of a Unix socket, bytes (Linux's sun_path without the final zero)."""


@dataclass(frozen=True, slots=True)
class RunHandle:
    """Descriptor of a live run.

    Attributes:
        address: for TelemetryClient.
        started: ISO 8601, UTC.
        process_started: start time of the process in kernel ticks, to detect a recycled pid; 0 if
            the system does not provide it.
    """

    run_id: str
    mission: str
    pid: int
    address: str
    started: str
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


def announce(run_id: str, mission: str) -> RunHandle:
    """Announce that this process runs a mission, and choose the address of its socket.

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
    started = datetime.now(UTC).isoformat(timespec="seconds")
    handle = RunHandle(run_id, mission, pid, f"ipc://{socket}", started, _process_started(pid))
    unfinished = handle.descriptor.with_suffix(".new")
    try:
        unfinished.write_text(json.dumps(asdict(handle)), encoding="utf-8")
        unfinished.replace(handle.descriptor)
    except OSError as error:
        raise TelemetryError(f"cannot announce the run: {error}") from None
    return handle


def withdraw(handle: RunHandle) -> None:
    """Remove the descriptor and the socket of a run. Safe to call twice."""
    for file in (handle.descriptor, handle.socket):
        with suppress(OSError):
            file.unlink()


def live_runs() -> list[RunHandle]:
    """This user's live runs, oldest first; removes the files of runs that have died.

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
    """A live run by name or folder; the newest if the name is empty.

    Raises:
        TelemetryError: no such run is live; the message lists the live runs.
    """
    runs = live_runs()
    wanted = Path(name).name
    matching = [run for run in runs if not name or run.run_id == wanted]
    if not matching:
        live = ", ".join(run.run_id for run in runs) or "none"
        raise TelemetryError(
            f"no run {name!r} is live; live runs: {live}" if name else "no mission is running"
        )
    return matching[-1]


def _read(file: Path) -> RunHandle | None:
    """The handle in a descriptor file; None if the file has vanished or is invalid."""
    try:
        handle = RunHandle(**json.loads(file.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return None
    valid = all(type(getattr(handle, item.name)).__name__ == item.type for item in fields(handle))
    return handle if valid else None


def _is_alive(handle: RunHandle) -> bool:
    try:
        os.kill(handle.pid, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return False  # the pid was recycled and now belongs to another user
    return handle.process_started in (0, _process_started(handle.pid))


def _process_started(pid: int) -> int:
    try:
        status = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return 0
    # Field 22 of proc(5); field 2, the command's name, may contain spaces and parentheses.
    return int(status.rpartition(")")[2].split()[19])

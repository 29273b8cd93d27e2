"""How recordings are seen where no window can be opened, as over SSH."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from pathlib import Path
from socket import gethostname

WEB_PORT, DATA_PORT = 9090, 9876
"""Ports of rerun's web viewer and of the recording that it shows, on the loopback device."""

WEB_ADDRESS = (
    f"http://127.0.0.1:{WEB_PORT}?url=rerun%2Bhttp%3A%2F%2F127.0.0.1%3A{DATA_PORT}%2Fproxy"
)
"""Address of the web viewer with the recording."""

DISPLAYS = ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET")
"""Variables of which a graphical session on Linux sets one."""

SSH_PORT = "22"


def has_display(environment: Mapping[str, str], platform: str) -> bool:
    """Whether a window can be opened.

    Args:
        environment: variables of the process.
        platform: as `sys.platform`.
    """
    return platform != "linux" or any(environment.get(name) for name in DISPLAYS)


def tunnel(environment: Mapping[str, str]) -> str:
    """The command on the user's computer that leads to the web viewer on this one."""
    address, port = _here(environment)
    given = [] if port == SSH_PORT else ["-p", port]
    led = [word for web in (WEB_PORT, DATA_PORT) for word in ("-L", f"{web}:127.0.0.1:{web}")]
    return shlex.join(["ssh", "-N", *led, *given, address])


def copying(file: Path, environment: Mapping[str, str]) -> str:
    """The command on the user's computer that copies a file of this one."""
    address, port = _here(environment)
    user, _, host = address.rpartition("@")
    named = f"[{host}]" if ":" in host else host
    given = [] if port == SSH_PORT else ["-P", port]
    place = f"{user}@{named}" if user else named
    return shlex.join(["scp", *given, f"{place}:{file.resolve()}", "."])


def remedies(folder: Path, recording: Path | None, environment: Mapping[str, str]) -> str:
    """What to do to see a run from another computer.

    Args:
        folder: of the run.
        recording: for rerun; None of a live run.
        environment: variables of the process.
    """
    folder = folder.resolve()
    runs, name = ["treepilot", "runs", "--folder", str(folder.parent)], folder.name
    copied = "" if recording is None else (
        "On your own computer:\n"
        f"  copy the recording:  {copying(recording, environment)}\n"
        f"  and open it:         rerun {recording.name}\n"
        "or show"
    )  # fmt: skip
    return (
        f"there is no display here: none of {', '.join(DISPLAYS)} is set. {copied or 'Show'} it in"
        " a browser on your own computer:\n"
        f"  on this machine:     {shlex.join([*runs, 'open', name, '--web'])}\n"
        f"  on your computer:    {tunnel(environment)}\n"
        f"  then open            {WEB_ADDRESS}\n"
        f"or in Foxglove:\n"
        f"  on this machine:     {shlex.join([*runs, 'open', name, '--foxglove'])}\n"
        f"or in this terminal:   {shlex.join(['treepilot', 'replay', str(folder)])}"
    )


def _here(environment: Mapping[str, str]) -> tuple[str, str]:
    """The address and port by which SSH has reached this machine, else its name."""
    connection, user = environment.get("SSH_CONNECTION", "").split(), environment.get("USER", "")
    if len(connection) != 4:
        return gethostname(), SSH_PORT
    _, _, host, port = connection
    return f"{user}@{host}" if user else host, port

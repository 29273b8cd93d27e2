"""Where a measured figure comes from: the version of the code, the date and the machine."""

from __future__ import annotations

import os
import platform
import subprocess
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]

OUTPUTS = ("docs", "README.md")
"""What `--docs` writes: a change there does not change what is measured."""


@dataclass(frozen=True)
class Version:
    """A version of the code.

    Attributes:
        commit: full hash of git's HEAD.
        dirty: whether files differ from that commit, apart from the documentation.
    """

    commit: str
    dirty: bool


def current_version(root: Path = ROOT) -> Version:
    """The checked-out version.

    Raises:
        subprocess.CalledProcessError: the folder is not in a git repository.
    """
    excluded = [f":!{name}" for name in OUTPUTS]
    changed = _git(root, "status", "--porcelain", "--", ".", *excluded)
    return Version(_git(root, "rev-parse", "HEAD"), bool(changed))


def machine() -> dict[str, Any]:
    """Processor, system and library versions. Names no host and no folder.

    `load` is the load average of the last minute. Where it is above 0.5, the times that are
    measured next are too long.
    """
    return {
        "processor": _processor(),
        "cores": os.cpu_count(),
        "load": round(os.getloadavg()[0], 2),
        "system": platform.freedesktop_os_release()["PRETTY_NAME"],
        "python": platform.python_version(),
        "numpy": version("numpy"),
        "pybullet": version("pybullet"),
    }


def today() -> str:
    """The date in UTC, as 2026-11-22."""
    return datetime.now(UTC).date().isoformat()


def _processor() -> str:
    for line in Path("/proc/cpuinfo").read_text("utf-8").splitlines():
        key, _, value = line.partition(":")
        if key.strip() == "model name":
            return value.strip()
    return platform.machine()


def _git(root: Path, *words: str) -> str:
    done = subprocess.run(["git", *words], cwd=root, capture_output=True, text=True, check=True)
    return done.stdout.strip()

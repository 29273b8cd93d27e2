"""The command that starts a module of treepilot in a child process."""

from __future__ import annotations

import sys


def command_of(module: str, *arguments: str) -> list[str]:
    """Return the command that runs a module with this process's module path.

    `python -m` would put the current folder first, and a user's `robots.py` there would hide ours.
    """
    code = (
        f"import sys; sys.path[:] = {sys.path!r}; import runpy;"
        " runpy.run_module(sys.argv.pop(1), run_name='__main__', alter_sys=True)"
    )
    return [sys.executable, "-P", "-c", code, module, *arguments]

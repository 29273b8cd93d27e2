"""Child processes that work for this one, connected by a pipe."""

from __future__ import annotations

import subprocess
import sys
from multiprocessing import Pipe
from multiprocessing.connection import Connection


def start_child(module: str) -> tuple[subprocess.Popen[bytes], Connection]:
    """Start a bare interpreter that runs `main(descriptor)` of a module; return it and our pipe.

    multiprocessing's spawn would run the caller's script again unless it is guarded by
    `if __name__ == "__main__"`. The child has its own process group, so Ctrl-C does not reach it.
    Its end of the pipe closes with ours, however this process ends; `main` must return then.

    Args:
        module: dotted name.
    """
    ours, theirs = Pipe()
    code = (
        f"import sys; sys.path[:] = {sys.path!r}; "
        f"from {module} import main; main({theirs.fileno()})"
    )
    with theirs:
        process = subprocess.Popen(
            [sys.executable, "-c", code],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            pass_fds=[theirs.fileno()],
            process_group=0,
        )
    return process, ours

"""`treepilot lsp`: the language server on standard input and output."""

from __future__ import annotations

import os
import sys

from stack.optional_packages import PYGLS


def serve() -> None:
    """Serve one editor until it sends `exit`.

    Raises:
        InputError: pygls is not installed.
    """
    PYGLS.require("the language server needs")
    from missions.editor.server import make_server

    # Only the protocol may write to standard output: prints of plugins go to standard error.
    with os.fdopen(os.dup(1), "wb") as output:
        os.dup2(2, 1)
        sys.stdout = sys.stderr
        make_server().start_io(sys.stdin.buffer, output)

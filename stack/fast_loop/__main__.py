"""Process of the fast loop: `python -m stack.fast_loop SOCKET MEMORY`, started by `FastLoop`."""

from __future__ import annotations

import sys

from stack.fast_loop.process import serve

if __name__ == "__main__":
    sys.exit(serve(int(sys.argv[1]), int(sys.argv[2])))

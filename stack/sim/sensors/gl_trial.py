"""Trial of OpenGL in a process of its own: a driver may crash, or hang.

`python -m stack.sim.sensors.gl_trial` is that process. It prints why OpenGL cannot be used.
"""

from __future__ import annotations

import subprocess
from functools import cache

from stack.child_process import run_module
from stack.errors import BodyError
from stack.optional_packages import MODERNGL

LONGEST = 30.0
"""Wall seconds after which a trial is given up."""


@cache
def opengl_problem() -> str:
    """Return why pictures cannot be drawn by OpenGL here; empty if they can."""
    if not MODERNGL.is_installed:
        return f"OpenGL needs {MODERNGL.absence}; {MODERNGL.hint}"
    try:
        child = run_module(__name__, longest=LONGEST)
    except subprocess.TimeoutExpired:
        return f"OpenGL on EGL does not answer within {LONGEST:g} s"
    if child.returncode:
        return f"OpenGL on EGL crashes (exit code {child.returncode})"
    return child.stdout.decode("utf-8", "replace").strip()


def _main() -> None:
    from stack.sim.sensors.gl_drawing import make_context

    try:
        make_context().release()
    except BodyError as error:
        print(error)


if __name__ == "__main__":
    _main()

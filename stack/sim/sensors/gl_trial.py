"""OpenGL without a window, and its trial in a process of its own: a driver may crash, or hang.

`python -m stack.sim.sensors.gl_trial` is that process. It prints why OpenGL cannot be used.
"""

from __future__ import annotations

import subprocess
from functools import cache
from typing import Any

from stack.child_process import run_module
from stack.errors import BodyError
from stack.optional_packages import MODERNGL

LONGEST = 30.0
"""Wall seconds after which a trial is given up."""


def make_context() -> Any:
    """Return a new context of moderngl, without a window.

    Raises:
        BodyError: moderngl is not installed, or EGL or its driver do not work.
    """
    if not MODERNGL.is_installed:
        raise BodyError(f"OpenGL needs {MODERNGL.absence}; {MODERNGL.hint}")
    import moderngl

    try:
        create: Any = moderngl.create_context  # its types know one backend only
        return create(standalone=True, backend="egl", require=330)
    except Exception as error:  # glcontext raises plain exceptions, moderngl its own
        raise BodyError(f"OpenGL on EGL cannot be used: {error}") from None


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
    try:
        make_context().release()
    except BodyError as error:
        print(error)


if __name__ == "__main__":
    _main()

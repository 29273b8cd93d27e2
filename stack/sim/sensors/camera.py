"""A colour camera, rendered in another process while the simulation goes on."""

from __future__ import annotations

import subprocess
import sys
from multiprocessing import Pipe
from multiprocessing.connection import Connection

import numpy as np

from stack.errors import BodyError
from stack.sim.sensors.rendering import RenderRequest, RenderSetup
from stack.types import Image

_ROUNDING = 1e-9


class Camera:
    """Takes a picture when asked and delivers it `latency` simulated seconds later.

    The renderer starts with the first picture. Rendering takes wall time, never simulated time:
    a picture that is not ready when it is due is waited for.
    """

    def __init__(self, setup: RenderSetup) -> None:
        self._setup, self._renderer = setup, _RendererProcess(setup)
        self._under_way: float | None = None
        self._last: float | None = None

    def is_ready(self, time: float) -> bool:
        """Whether a picture asked for now would be taken."""
        if self._under_way is not None:
            return False
        period = 1.0 / self._setup.camera.rate
        return self._last is None or time - self._last >= period - _ROUNDING

    def expose(self, time: float, request: RenderRequest) -> None:
        """Take a picture now."""
        self._renderer.ask(request)
        self._under_way = self._last = time

    def take(self, time: float) -> Image | None:
        """The picture that is due by now, once.

        Raises:
            BodyError: the renderer cannot make one.
        """
        stamp, camera = self._under_way, self._setup.camera
        if stamp is None or time < stamp + camera.latency - _ROUNDING:
            return None
        self._under_way = None
        shape = (camera.model.height, camera.model.width, 3)
        pixels = np.frombuffer(self._renderer.answer(), dtype=np.uint8).reshape(shape)
        return Image(stamp, pixels, camera.model)

    def close(self) -> None:
        """End the renderer. Safe to call twice."""
        self._renderer.close()


class _RendererProcess:
    """The other end of camera_worker.

    A bare interpreter and not multiprocessing's spawn, which would run a caller's own script once
    more unless that is guarded by `if __name__ == "__main__"`. In a process group of its own it
    gets no Ctrl-C, and it ends with the pipe however this process ends.
    """

    def __init__(self, setup: RenderSetup) -> None:
        self._setup = setup
        self._process: subprocess.Popen[bytes] | None = None
        self._pipe: Connection | None = None

    def ask(self, request: RenderRequest) -> None:
        """Hand over a shot; starts the process if need be."""
        pipe = self._pipe or self._start()
        try:
            pipe.send(request)
        except OSError as error:
            raise self._lost() from error

    def answer(self) -> bytes:
        """The picture asked for; waits until it is there."""
        assert self._pipe is not None
        try:
            answer = self._pipe.recv()
        except (EOFError, OSError) as error:
            raise self._lost() from error
        if isinstance(answer, str):
            raise BodyError(f"the camera cannot be simulated: {answer}")
        picture: bytes = answer
        return picture

    def close(self) -> None:
        """Close the pipe and see the process off."""
        if self._pipe is not None:
            self._pipe.close()
        if self._process is not None:
            self._process.kill()
            self._process.wait()
        self._pipe = self._process = None

    def _start(self) -> Connection:
        ours, theirs = Pipe()
        code = (
            f"import sys; sys.path[:] = {sys.path!r}; "
            f"from stack.sim.sensors.camera_worker import main; main({theirs.fileno()})"
        )
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-c", code],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                pass_fds=[theirs.fileno()],
                process_group=0,
            )
        self._pipe = ours
        ours.send(self._setup)
        return ours

    def _lost(self) -> BodyError:
        code = None if self._process is None else self._process.poll()
        return BodyError(f"the camera's renderer ended unexpectedly (exit code {code})")

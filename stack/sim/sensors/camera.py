"""Simulated cameras, rendered in another process while the simulation continues."""

from __future__ import annotations

import signal
import subprocess
from collections import deque
from math import prod
from multiprocessing.connection import Connection
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stack.child_process import start_child
from stack.drivetrain.description import DepthCameraDescription
from stack.errors import BodyError
from stack.schedule import Schedule
from stack.sim.sensors.requests import RenderRequest, RenderSetup
from stack.types import DepthImage, Image

_ROUNDING = 1e-9

MOST_LOSSES = 3
"""Renderer processes in a row that may end without a picture before the camera stays off."""


class Camera:
    """Takes a picture on request and delivers it `latency` simulated seconds later.

    The description decides whether it is a picture of colours or of distances.

    The renderer process starts with the first picture. Rendering takes wall time, never simulated
    time: `take` waits for a picture that is due and not rendered yet.

    A renderer that ends by itself costs the picture that it rendered; the next picture starts
    another one. After MOST_LOSSES in a row the camera stays off. `take_problems` tells it.
    """

    def __init__(self, setup: RenderSetup) -> None:
        self._setup, self._renderer = setup, _RendererProcess(setup)
        self._exposures: deque[float] = deque()
        self._schedule = Schedule(1.0 / setup.camera.rate)
        self._losses = 0
        self._problems: list[str] = []

    def is_ready(self, time: float) -> bool:
        """Whether the camera can take a picture now: its rate allows it."""
        return self._losses < MOST_LOSSES and self._schedule.is_due(time)

    def expose(self, time: float, request: RenderRequest) -> None:
        """Take a picture now; start rendering it."""
        self._schedule.take(time)
        self._exposures.append(time)
        try:
            self._renderer.send(request)
        except RendererLost as loss:
            self._note(loss)

    def await_picture(self, time: float, longest: float) -> bool:
        """Wait at most `longest` wall seconds for a due picture; return whether none is late."""
        if not self._is_due(time):
            return True
        return self._renderer.has_answered(longest)

    def take(self, time: float) -> Image | DepthImage | None:
        """Return the picture that is due now, once; None if none is due.

        Of several that are due it is the newest.

        Raises:
            BodyError: the renderer cannot render this world or robot.
        """
        picture: Image | DepthImage | None = None
        while self._is_due(time):
            picture = self._received() or picture
        return picture

    def _received(self) -> Image | DepthImage | None:
        """Return the oldest picture, once it is rendered; None if its renderer is lost."""
        camera = self._setup.camera
        try:
            received = self._renderer.receive()
        except RendererLost as loss:
            self._note(loss)
            return None
        stamp = self._exposures.popleft()
        self._losses, shape = 0, (camera.model.height, camera.model.width)
        if isinstance(camera, DepthCameraDescription):
            depth = _array(received, np.float32, shape)
            return DepthImage(stamp, depth, camera.model, camera.range_min, camera.range_max)
        return Image(stamp, _array(received, np.uint8, (*shape, 3)), camera.model)

    def take_problems(self) -> list[str]:
        """Return what happened to the renderer since the last call, as sentences."""
        problems, self._problems = self._problems, []
        return problems

    def _note(self, loss: RendererLost) -> None:
        self._exposures.clear()
        self._losses += 1
        is_off = self._losses >= MOST_LOSSES
        then = "the camera stays off" if is_off else "the next picture starts another one"
        self._problems.append(f"the renderer of the camera {self._setup.name} {loss}; {then}")
        self._renderer.close()

    @property
    def driver(self) -> str:
        """Driver of OpenGL that has drawn a picture; empty for PyBullet's software renderer."""
        return self._renderer.driver

    def close(self) -> None:
        """Stop the renderer process. Safe to call twice."""
        self._renderer.close()

    def _is_due(self, time: float) -> bool:
        latency = self._setup.camera.latency
        return bool(self._exposures) and time >= self._exposures[0] + latency - _ROUNDING


def _array(received: bytes, kind: type, shape: tuple[int, ...]) -> NDArray[Any]:
    """Return the pixels in a shape; a picture of another size as it is, a row of values."""
    whole = len(received) // np.dtype(kind).itemsize
    values: NDArray[Any] = np.frombuffer(received, dtype=kind, count=whole)
    return values.reshape(shape) if values.size == prod(shape) else values


class RendererLost(Exception):
    """The renderer process has ended; the text continues "the renderer …"."""


class _RendererProcess:
    """Client side of camera_worker, a child process."""

    def __init__(self, setup: RenderSetup) -> None:
        self._setup, self.driver = setup, ""
        self._process: subprocess.Popen[bytes] | None = None
        self._pipe: Connection | None = None

    def send(self, request: RenderRequest) -> None:
        """Send a request; start the process with the first one."""
        pipe = self._pipe or self._start()
        try:
            pipe.send(request)
        except OSError as error:
            raise self._lost() from error

    def has_answered(self, longest: float) -> bool:
        """Wait at most `longest` wall seconds; return whether `receive` returns at once."""
        assert self._pipe is not None
        try:
            return self._pipe.poll(longest)
        except OSError:
            return True  # `receive` reports the failure

    def receive(self) -> bytes:
        """Wait for the requested picture and return its pixels."""
        assert self._pipe is not None
        try:
            answer = self._pipe.recv()
        except (EOFError, OSError) as error:
            raise self._lost() from error
        if isinstance(answer, str):
            raise BodyError(f"the camera cannot be simulated: {answer}")
        if isinstance(answer, tuple):
            (self.driver,) = answer
            return self.receive()
        picture: bytes = answer
        return picture

    def close(self) -> None:
        """Close the pipe and end the process."""
        if self._pipe is not None:
            self._pipe.close()
        if self._process is not None:
            self._process.kill()
            self._process.wait()
        self._pipe = self._process = None

    def _start(self) -> Connection:
        self._process, self._pipe = start_child("stack.sim.sensors.camera_worker")
        self._pipe.send(self._setup)
        return self._pipe

    def _lost(self) -> RendererLost:
        assert self._process is not None
        try:
            code = self._process.wait(1.0)  # its end of the pipe is closed
        except subprocess.TimeoutExpired:
            return RendererLost("no longer answers")
        how = f"was killed ({signal.Signals(-code).name})" if code < 0 else f"ended with {code}"
        return RendererLost(how)

"""Simulated cameras, rendered in another process while the simulation continues."""

from __future__ import annotations

from collections import deque
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stack.child_process import Worker
from stack.drivetrain.description import DepthCameraDescription
from stack.errors import BodyError, WorkerError
from stack.schedule import Schedule
from stack.sim.physics.default import DEFAULT_ENGINE
from stack.sim.physics.engine import PhysicsEngine
from stack.sim.sensors.requests import RenderRequest, RenderSetup
from stack.types import CameraModel, DepthImage, Image

_ROUNDING = 1e-9

MOST_LOSSES = 3
"""Renderer processes in a row that may end without a picture before the camera stays off."""


class Camera:
    """Takes a picture on request and delivers it `latency` simulated seconds later.

    The description decides whether it is a picture of colours or of distances.

    The renderer process starts with the first picture. Rendering takes wall time, never simulated
    time: `take` waits for a picture that is due and not rendered yet.

    A renderer that ends by itself, or gives no answer, costs the picture that it rendered; the next
    picture starts another one. After MOST_LOSSES in a row the camera stays off. `take_problems`
    tells it.

    Attributes:
        driver: that has drawn a picture, see `Renderer.driver`.
    """

    def __init__(self, setup: RenderSetup, engine: type[PhysicsEngine] = DEFAULT_ENGINE) -> None:
        self._setup = setup
        name = f"the renderer of the camera {setup.name}"
        self._renderer = Worker(name, "stack.sim.sensors.rendering:renderer", (setup, engine))
        self._exposures: deque[tuple[float, CameraModel]] = deque()
        self.restart()

    def restart(self) -> None:
        """Begin again at time 0; the renderer process stays."""
        while self._exposures:
            self._received()  # of the run before
        self._schedule = Schedule(1.0 / self._setup.camera.rate)
        self._losses, self.driver = 0, ""
        self._problems: list[str] = []

    def is_ready(self, time: float) -> bool:
        """Whether the camera can take a picture now: its rate allows it."""
        return self._losses < MOST_LOSSES and self._schedule.is_due(time)

    def expose(
        self, time: float, request: RenderRequest, described: CameraModel | None = None
    ) -> None:
        """Take a picture now; start rendering it.

        Args:
            time: seconds.
            request: with the camera where it is.
            described: the camera that the picture says; None: that which takes it.
        """
        self._schedule.take(time)
        self._exposures.append((time, described or request.camera or self._setup.camera.model))
        try:
            self._renderer.send(request)
        except WorkerError as loss:
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
            received, self.driver = self._renderer.receive()
        except WorkerError as loss:
            self._note(loss)
            return None
        stamp, model = self._exposures.popleft()
        self._losses, shape = 0, (camera.model.height, camera.model.width)
        if isinstance(camera, DepthCameraDescription):
            depth = _array(received, np.float32, shape)
            return DepthImage(stamp, depth, model, camera.range_min, camera.range_max)
        return Image(stamp, _array(received, np.uint8, (*shape, 3)), model)

    def take_problems(self) -> list[str]:
        """Return what happened to the renderer since the last call, as sentences."""
        problems, self._problems = self._problems, []
        return problems

    def _note(self, loss: WorkerError) -> None:
        if loss.refusal:
            raise BodyError(f"the camera cannot be simulated: {loss.refusal}") from None
        self._exposures.clear()
        self._losses += 1
        is_off = self._losses >= MOST_LOSSES
        then = "the camera stays off" if is_off else "the next picture starts another one"
        self._problems.append(f"{loss}; {then}")
        self._renderer.close()

    def close(self) -> None:
        """Stop the renderer process. Safe to call twice."""
        self._exposures.clear()
        self._renderer.close()

    def _is_due(self, time: float) -> bool:
        latency = self._setup.camera.latency
        return bool(self._exposures) and time >= self._exposures[0][0] + latency - _ROUNDING


def _array(received: bytes, kind: type, shape: tuple[int, ...]) -> NDArray[Any]:
    """Return the pixels in a shape; a picture of another size as it is, a row of values."""
    whole = len(received) // np.dtype(kind).itemsize
    values: NDArray[Any] = np.frombuffer(received, dtype=kind, count=whole)
    return values.reshape(shape) if values.size == prod(shape) else values

"""Answers the requests of a camera in its renderer process; see `Camera`."""

from __future__ import annotations

from collections.abc import Callable

from stack.sim.physics.engine import PhysicsEngine
from stack.sim.sensors.rendering import CameraRenderer
from stack.sim.sensors.requests import RenderRequest, RenderSetup


def renderer(
    setup: tuple[RenderSetup, type[PhysicsEngine]],
) -> Callable[[RenderRequest], tuple[bytes, str]]:
    """Return a function that returns the pixels of a picture and the driver that drew it."""
    drawing = CameraRenderer(*setup)
    return lambda request: (drawing.render(request).tobytes(), drawing.driver)

"""Process that renders camera pictures: `python -c ... main(descriptor)`, see camera.py.

It reads a RenderSetup, then RenderRequests, and answers each with the bytes of a picture, the first
one after a tuple with the driver of the renderer. An error message takes the place of an answer. It
ends when its parent ends.
"""

from __future__ import annotations

import signal
from multiprocessing.connection import Connection

from stack.errors import TreepilotError
from stack.sim.sensors.rendering import CameraRenderer


def main(descriptor: int) -> None:
    """Render until the other end of the pipe closes."""
    # Ctrl-C is handled by the engine, which then closes the pipe.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with Connection(descriptor) as pipe:
        try:
            serve(pipe)
        except (EOFError, ConnectionResetError, BrokenPipeError):
            return
        except TreepilotError as error:
            pipe.send(str(error))


def serve(pipe: Connection) -> None:
    """Answer render requests. Raises EOFError when the parent has ended."""
    renderer = CameraRenderer(pipe.recv())
    try:
        picture = renderer.render(pipe.recv()).tobytes()
        pipe.send((renderer.driver,))
        while True:
            pipe.send(picture)
            picture = renderer.render(pipe.recv()).tobytes()
    finally:
        renderer.close()

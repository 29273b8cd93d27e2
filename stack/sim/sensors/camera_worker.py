"""The process that renders camera pictures: `python -c ... main(descriptor)`, see camera.py.

It reads a Studio, then Shots, and answers each with the bytes of a picture, or with a sentence
when it cannot. It ends when its parent does.
"""

from __future__ import annotations

import signal
from multiprocessing.connection import Connection

from stack.errors import TreepilotError
from stack.sim.sensors.rendering import CameraRenderer


def main(descriptor: int) -> None:
    """Render until the other end of the pipe closes."""
    # Ctrl-C is for the engine, which then closes the pipe.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with Connection(descriptor) as pipe:
        try:
            serve(pipe)
        except (EOFError, ConnectionResetError, BrokenPipeError):
            return
        except TreepilotError as error:
            pipe.send(str(error))


def serve(pipe: Connection) -> None:
    """Answer shots. Raises EOFError when the parent is gone."""
    renderer = CameraRenderer(pipe.recv())
    try:
        while True:
            pipe.send(renderer.render(pipe.recv()).tobytes())
    finally:
        renderer.close()

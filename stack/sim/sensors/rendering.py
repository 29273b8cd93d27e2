"""Pictures of a scene in colour or depth.

The same request gives the same picture in any process, with the same renderer.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from stack.drivetrain.description import CameraDescription, DepthCameraDescription
from stack.geometry.rotations import from_quaternion
from stack.sim.physics.default import DEFAULT_ENGINE
from stack.sim.physics.engine import PhysicsEngine
from stack.sim.physics.mirrors import mirror_faces
from stack.sim.sensors.exposure import automatic_gain, mean_picture, moments
from stack.sim.sensors.lens import Lens
from stack.sim.sensors.mirror_views import MirrorViews
from stack.sim.sensors.pinhole import FLIP, distances, far_plane
from stack.sim.sensors.requests import RenderRequest, RenderSetup
from stack.sim.sensors.shading import Shading
from stack.sim.worlds.world import World
from stack.streams import stream
from stack.types import FloatArray

NOTHING = 0.9999
"""Share of the far clipping plane beyond which a pixel shows nothing."""


class CameraRenderer:
    """Renders the pictures of one camera.

    Raises:
        BodyError: a marker of the world is unknown to OpenCV, or the URDF cannot be read.
    """

    def __init__(self, setup: RenderSetup, engine: type[PhysicsEngine] = DEFAULT_ENGINE) -> None:
        self._setup, self._lens = setup, Lens(setup.camera.model)
        world: World = setup.world
        self._light, faces = world.light, mirror_faces(world)
        self._mirrors = MirrorViews(setup, engine, self._lens.pinhole, faces) if faces else None
        shaded = world.shadows and isinstance(setup.camera, CameraDescription)
        self._shading = Shading(setup, self._lens.pinhole) if shaded else None
        self._drawing = engine.renderer(setup, self._lens.pinhole)

    @property
    def driver(self) -> str:
        """See `Renderer.driver`."""
        return self._drawing.driver

    def render(self, request: RenderRequest) -> NDArray[np.uint8] | NDArray[np.float32]:
        """Return the picture with its noise.

        (height, width, 3) uint8 RGB, or (height, width) float32 metres along the optical axis.
        """
        camera = self._setup.camera
        random = stream(request.seed, self._setup.name, request.step)
        if isinstance(camera, DepthCameraDescription):
            return measured_depth(self._rendered(request)[1], camera, random)
        shots = [self._rendered(moment)[0] for moment in moments(request, camera)]
        colours, light = mean_picture(shots), self._light
        gain = automatic_gain(colours, light, camera)
        if camera.noise <= 0.0 and light * gain == 1.0 and len(shots) == 1:
            return np.ascontiguousarray(shots[0])
        deviation = np.float32(camera.noise * max(1.0, gain))
        noise = random.standard_normal(colours.shape, dtype=np.float32) * deviation
        noisy = np.clip(np.rint(np.float32(light * gain) * colours + noise), 0, 255)
        picture: NDArray[np.uint8] = noisy.astype(np.uint8)
        return picture

    def _rendered(self, request: RenderRequest) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """Return colours (height, width, 3) and the depth buffer (height, width)."""
        view = self._view(request)
        colours, depth = self._drawing.draw(request, view)
        if self._shading is not None:
            colours = self._shading.darkened(colours, depth, view)
        if self._mirrors is not None:
            colours, depth = self._mirrors.add(colours, depth, request, view)
        return self._lens.seen(colours, smooth=True), self._lens.seen(depth, smooth=False)

    def close(self) -> None:
        """Disconnect. Safe to call twice."""
        self._drawing.close()
        if self._mirrors is not None:
            self._mirrors.close()

    def _view(self, request: RenderRequest) -> FloatArray:
        """Return (4, 4) OpenGL eye frame from world."""
        world_from_base = from_quaternion(request.position, request.orientation)
        camera = request.camera or self._setup.camera.model
        world_from_optical = world_from_base @ camera.base_from_optical()
        return np.linalg.inv(world_from_optical @ FLIP).astype(np.float64)


def renderer(
    setup: tuple[RenderSetup, type[PhysicsEngine]],
) -> Callable[[RenderRequest], tuple[bytes, str]]:
    """Return what the process of a `Camera` calls: pixels of a picture, and what drew it."""
    drawing = CameraRenderer(*setup)
    return lambda request: (drawing.render(request).tobytes(), drawing.driver)


def measured_depth(
    buffer: NDArray[np.float32], camera: DepthCameraDescription, random: np.random.Generator
) -> NDArray[np.float32]:
    """Return (height, width) what the camera measures, metres along the optical axis.

    Args:
        buffer: (height, width) of the renderer, 0 at the near and 1 at the far clipping plane.
        camera: with its noise, dropout and ranges.
        random: for noise and dropout.
    """
    far, true = far_plane(camera), distances(buffer, camera)
    noise = random.standard_normal(true.shape, dtype=np.float32)
    depth = true + camera.noise * true * true * noise
    lost = random.random(true.shape, dtype=np.float32) < camera.dropout
    depth[lost | (true >= NOTHING * far) | (depth > camera.range_max)] = np.inf
    depth[depth < camera.range_min] = np.nan
    return depth.astype(np.float32)

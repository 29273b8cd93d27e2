"""Pictures of a scene in colour or depth.

The same request gives the same picture in any process, with the same renderer (drawing.py).
"""

from __future__ import annotations

from pathlib import Path as FilePath
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stack.drivetrain.description import CameraDescription, DepthCameraDescription
from stack.errors import BodyError
from stack.sim.physics import bullet as loader
from stack.sim.physics.physics_robot import load_robot
from stack.sim.physics.scene import Scene
from stack.sim.sensors.drawing import TinyDrawing, drawing_of, instead, projection
from stack.sim.sensors.exposure import automatic_gain, mean_picture, moments
from stack.sim.sensors.lens import Lens
from stack.sim.sensors.requests import Position, Quaternion, RenderRequest, RenderSetup
from stack.streams import stream
from stack.types import FloatArray

NEAR = 0.02
"""Near clipping plane, metres in front of the camera."""

TINT = 0.12
"""Share of a pixel's colour that is that of the glass in front; the rest shines through."""

NOTHING = 0.9999
"""Share of the far clipping plane beyond which a pixel shows nothing."""

_FLIP = np.diag([1.0, -1.0, -1.0, 1.0])
"""Transform between OpenGL's eye frame (y up, looking along -z) and the optical frame."""


class CameraRenderer:
    """Renders pictures in a PyBullet client of its own that holds only visual shapes.

    Raises:
        BodyError: a marker of the world is unknown to OpenCV, or the URDF cannot be read.
    """

    def __init__(self, setup: RenderSetup) -> None:
        self._bullet = bullet = loader.load()
        self._setup = setup
        self._client: int = bullet.connect(bullet.DIRECT)
        with TemporaryDirectory(prefix="treepilot-") as folder:
            path = FilePath(folder)
            self._scene = Scene.with_visual_shapes(bullet, self._client, setup.world, path)
            self._robot = self._load(setup.urdf)
            self._others: list[tuple[int, Any]] = []
            self._lens = Lens(setup.camera.model)
            pinhole = self._lens.pinhole
            self._matrix = matrix = projection(pinhole, NEAR, _far(setup.camera))
            self._drawing = drawing_of(
                setup.camera.renderer, bullet, self._client, pinhole, matrix, self._scene.textures
            )

    @property
    def driver(self) -> str:
        """Driver of OpenGL that draws the pictures; empty for PyBullet's software renderer."""
        return self._drawing.driver

    def render(self, request: RenderRequest) -> NDArray[np.uint8] | NDArray[np.float32]:
        """Return the picture with its noise.

        (height, width, 3) uint8 RGB, or (height, width) float32 metres along the optical axis.
        """
        camera = self._setup.camera
        random = stream(self._setup.seed, self._setup.name, request.step)
        if isinstance(camera, DepthCameraDescription):
            return measured_depth(self._rendered(request)[1], camera, random)
        shots = [self._rendered(moment)[0] for moment in moments(request, camera)]
        colours, light = mean_picture(shots), self._setup.world.light
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
        self._place_bodies(request)
        view = self._view(request)
        colours, depth = self._drawing.draw(view)
        if self._scene.has_glass and not isinstance(self._setup.camera, DepthCameraDescription):
            self._scene.show_glass(True)
            panes, nearest = self._drawing.draw(view)
            self._scene.show_glass(False)
            colours = behind_glass(colours, panes, nearest < depth)
        return self._lens.seen(colours, smooth=True), self._lens.seen(depth, smooth=False)

    def close(self) -> None:
        """Disconnect. Safe to call twice."""
        if self._client >= 0:
            self._drawing.close()
            self._bullet.disconnect(physicsClientId=self._client)
            self._client = -1

    def _place_bodies(self, request: RenderRequest) -> None:
        self._place_robot(self._robot, request.position, request.orientation)
        if len(self._others) < len(request.robots):
            self._others += [self._load(urdf) for urdf, *_ in request.robots[len(self._others) :]]
            self._draw_new_bodies()
        for robot, (_, position, orientation) in zip(self._others, request.robots, strict=True):
            self._place_robot(robot, position, orientation)
        self._scene.place_people([(x, y) for x, y, _ in request.people.tolist()])
        for name, closed in request.doors.items():
            self._scene.place_door(name, closed)

    def _draw_new_bodies(self) -> None:
        try:
            self._drawing.add_bodies()
        except BodyError as error:
            tiny = TinyDrawing(self._bullet, self._client, self._lens.pinhole, self._matrix)
            self._drawing = instead(self._setup.camera.renderer, tiny, error)

    def _load(self, urdf: FilePath) -> tuple[int, Any]:
        """Load a robot; return its body number and the pose of its centre of mass."""
        robot = load_robot(self._bullet, self._client, urdf)
        dynamics = self._bullet.getDynamicsInfo(robot, -1, physicsClientId=self._client)
        return robot, dynamics[3:5]

    def _place_robot(
        self, robot: tuple[int, Any], position: Position, orientation: Quaternion
    ) -> None:
        body, inertial = robot
        place = self._bullet.multiplyTransforms(position, orientation, *inertial)
        self._bullet.resetBasePositionAndOrientation(body, *place, physicsClientId=self._client)

    def _view(self, request: RenderRequest) -> FloatArray:
        """Return (4, 4) OpenGL eye frame from world."""
        base = np.eye(4)
        turn = self._bullet.getMatrixFromQuaternion(request.orientation)
        base[:3, :3] = np.array(turn).reshape(3, 3)
        base[:3, 3] = request.position
        world_from_optical = base @ self._setup.camera.model.base_from_optical()
        return np.linalg.inv(world_from_optical @ _FLIP).astype(np.float64)


def behind_glass(
    colours: NDArray[np.uint8], panes: NDArray[np.uint8], covered: NDArray[np.bool_]
) -> NDArray[np.uint8]:
    """Return a picture (height, width, 3) of what is seen through glass.

    Args:
        colours: without the glass.
        panes: with the glass as if it were not transparent.
        covered: (height, width) where glass is in front.
    """
    tinted = np.rint((1.0 - TINT) * colours + TINT * panes).astype(np.uint8)
    return np.where(covered[:, :, None], tinted, colours)


def measured_depth(
    buffer: NDArray[np.float32], camera: DepthCameraDescription, random: np.random.Generator
) -> NDArray[np.float32]:
    """Return (height, width) what the camera measures, metres along the optical axis.

    Args:
        buffer: (height, width) of the renderer, 0 at the near and 1 at the far clipping plane.
        camera: with its noise, dropout and ranges.
        random: for noise and dropout.
    """
    far = _far(camera)
    true = far * NEAR / (far - (far - NEAR) * buffer.astype(np.float64))
    noise = random.standard_normal(true.shape, dtype=np.float32)
    depth = true + camera.noise * true * true * noise
    lost = random.random(true.shape, dtype=np.float32) < camera.dropout
    depth[lost | (true >= NOTHING * far) | (depth > camera.range_max)] = np.inf
    depth[depth < camera.range_min] = np.nan
    return depth.astype(np.float32)


def _far(camera: CameraDescription | DepthCameraDescription) -> float:
    """Return the distance of the far clipping plane, metres; noise may bring what is beyond."""
    beyond = 1.25 if isinstance(camera, DepthCameraDescription) else 1.0
    return beyond * camera.range_max

"""A PyBullet client that holds the visual shapes of a scene and draws pinhole pictures of it.

PyBullet's software renderer draws the same picture on every machine and is the default. OpenGL is
three to twelve times as fast; its pictures differ on edges and round shapes, and between drivers.
"""

from __future__ import annotations

import sys
from pathlib import Path as FilePath
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stack.drivetrain.description import DepthCameraDescription
from stack.errors import BodyError
from stack.sim.physics.engine import Renderer
from stack.sim.physics.mirrors import MirrorFace
from stack.sim.physics.pybullet_engine import loader
from stack.sim.physics.pybullet_engine.arm import joint_numbers
from stack.sim.physics.pybullet_engine.gl_drawing import GlDrawing
from stack.sim.physics.pybullet_engine.robot import load_robot
from stack.sim.physics.pybullet_engine.scene import HIDDEN_HEIGHT, Scene
from stack.sim.sensors.pinhole import far_plane, projection, tinted
from stack.sim.sensors.requests import Position, Quaternion, RenderRequest, RenderSetup
from stack.types import CameraModel, FloatArray

Drawn = tuple[NDArray[np.uint8], NDArray[np.float32]]
"""Colours (height, width, 3) and depths (height, width), 0 near and 1 far."""


class BulletRenderer(Renderer):
    """Draws colours and depths of a scene, as they are behind the lens.

    Args:
        setup: world, robot and camera.
        model: the pinhole camera that is drawn.
        mirror: if given, only what this face reflects is in the scene.

    Raises:
        BodyError: a marker of the world is unknown to OpenCV, the URDF cannot be read, or OpenGL
            was chosen and cannot be used.
    """

    def __init__(
        self, setup: RenderSetup, model: CameraModel, mirror: MirrorFace | None = None
    ) -> None:
        self._bullet = bullet = loader.load()
        self._setup, self._model, self._mirror = setup, model, mirror
        self._matrix = projection(model, far_plane(setup.camera))
        self._client: int = bullet.connect(bullet.DIRECT)
        with TemporaryDirectory(prefix="treepilot-") as folder:
            self._scene = Scene.with_visual_shapes(
                bullet, self._client, setup.world, FilePath(folder), mirror
            )
            self._robot = self._load(setup.model)
            self._joints = joint_numbers(bullet, self._client, self._robot[0])
            self._others: list[tuple[int, Any]] = []
            self._gl = self._opengl()

    @property
    def driver(self) -> str:
        """Driver of OpenGL that draws the pictures; empty for PyBullet's software renderer."""
        return "" if self._gl is None else self._gl.driver

    def draw(self, request: RenderRequest, view: FloatArray) -> Drawn:
        """As in `Renderer`: the depths are those of the depth buffer."""
        self._place_bodies(request)
        colours, depth = self._drawn(view)
        if self._scene.has_glass and not isinstance(self._setup.camera, DepthCameraDescription):
            self._scene.show_glass(True)
            panes, nearest = self._drawn(view)
            self._scene.show_glass(False)
            colours = tinted(colours, panes, nearest < depth)
        return colours, depth

    def close(self) -> None:
        """Disconnect. Safe to call twice."""
        if self._client >= 0:
            if self._gl is not None:
                self._gl.close()
            self._bullet.disconnect(physicsClientId=self._client)
            self._client = -1

    def _opengl(self) -> GlDrawing | None:
        """Return what draws by OpenGL, if that was chosen and works."""
        size = self._model.width, self._model.height
        if self._setup.camera.renderer == "tiny":
            return None
        try:
            return GlDrawing(self._bullet, self._client, size, self._matrix, self._scene.textures)
        except BodyError as error:
            self._refuse_or_say(error)
            return None

    def _refuse_or_say(self, error: BodyError) -> None:
        """Raise why OpenGL cannot be used, if it was chosen; else say it on standard error."""
        if self._setup.camera.renderer == "gl":
            raise error
        print(f"pictures are drawn by TinyRenderer: {error}", file=sys.stderr, flush=True)

    def _drawn(self, view: FloatArray) -> Drawn:
        if self._gl is not None:
            return self._gl.draw(view)
        width, height = self._model.width, self._model.height
        # TinyRenderer samples column i at (x + 1) width / 2 = i, and row j at (y + 1) height / 2 =
        # height - 1 - j, where the camera model has the centres of pixels at i + 0.5 and j + 0.5.
        matrix = self._matrix.copy()
        matrix[0, 2] += 1.0 / width
        matrix[1, 2] += 1.0 / height
        answer = self._bullet.getCameraImage(
            width,
            height,
            viewMatrix=view.T.ravel().tolist(),
            projectionMatrix=matrix.T.ravel().tolist(),
            shadow=0,
            renderer=self._bullet.ER_TINY_RENDERER,
            flags=self._bullet.ER_NO_SEGMENTATION_MASK,
            physicsClientId=self._client,
        )
        pixels: NDArray[np.uint8] = np.asarray(answer[2], dtype=np.uint8).reshape(height, width, 4)
        return pixels[:, :, :3], np.asarray(answer[3], dtype=np.float32).reshape(height, width)

    def _place_bodies(self, request: RenderRequest) -> None:
        for name, value in request.joints.items():
            self._bullet.resetJointState(
                self._robot[0], self._joints[name], value, physicsClientId=self._client
            )
        self._place_robot(self._robot, request.position, request.orientation)
        if len(self._others) < len(request.robots):
            self._others += [self._load(model) for model, *_ in request.robots[len(self._others) :]]
            self._draw_new_bodies()
        for robot, (_, position, orientation) in zip(self._others, request.robots, strict=True):
            self._place_robot(robot, position, orientation)
        self._scene.place_people([(x, y) for x, y, _ in request.people.tolist()])
        self._scene.place_blocks(request.blocks)
        for name, closed in request.doors.items():
            self._scene.place_door(name, closed)

    def _draw_new_bodies(self) -> None:
        if self._gl is not None:
            try:
                self._gl.add_bodies()
            except BodyError as error:
                self._gl = None
                self._refuse_or_say(error)

    def _load(self, model: str) -> tuple[int, Any]:
        """Load a robot; return its body number and the pose of its centre of mass."""
        robot = load_robot(self._bullet, self._client, model)
        dynamics = self._bullet.getDynamicsInfo(robot, -1, physicsClientId=self._client)
        return robot, dynamics[3:5]

    def _place_robot(
        self, robot: tuple[int, Any], position: Position, orientation: Quaternion
    ) -> None:
        body, inertial = robot
        if self._mirror is not None and not self._mirror.is_in_front(np.array(position)):
            position = (0.0, 0.0, HIDDEN_HEIGHT)
        place = self._bullet.multiplyTransforms(position, orientation, *inertial)
        self._bullet.resetBasePositionAndOrientation(body, *place, physicsClientId=self._client)

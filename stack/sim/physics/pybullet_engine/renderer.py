"""A PyBullet client that holds the visual shapes of a scene and draws pinhole pictures of it."""

from __future__ import annotations

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
from stack.sim.physics.pybullet_engine.drawing import TinyDrawing, drawing_of, instead
from stack.sim.physics.pybullet_engine.robot import load_robot
from stack.sim.physics.pybullet_engine.scene import HIDDEN_HEIGHT, Scene
from stack.sim.sensors.pinhole import far_plane, projection, tinted
from stack.sim.sensors.requests import Position, Quaternion, RenderRequest, RenderSetup
from stack.types import CameraModel, FloatArray


class BulletRenderer(Renderer):
    """Draws colours and depths of a scene, as they are behind the lens.

    Args:
        setup: world, robot and camera.
        model: the pinhole camera that is drawn.
        mirror: if given, only what this face reflects is in the scene.

    Raises:
        BodyError: a marker of the world is unknown to OpenCV, or the URDF cannot be read.
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
            self._others: list[tuple[int, Any]] = []
            self._drawing = drawing_of(
                setup.camera.renderer, bullet, self._client, model, self._matrix,
                self._scene.textures,
            )  # fmt: skip

    @property
    def driver(self) -> str:
        """Driver of OpenGL that draws the pictures; empty for PyBullet's software renderer."""
        return self._drawing.driver

    def draw(
        self, request: RenderRequest, view: FloatArray
    ) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """As in `Renderer`: the depths are those of the depth buffer."""
        self._place_bodies(request)
        colours, depth = self._drawing.draw(view)
        if self._scene.has_glass and not isinstance(self._setup.camera, DepthCameraDescription):
            self._scene.show_glass(True)
            panes, nearest = self._drawing.draw(view)
            self._scene.show_glass(False)
            colours = tinted(colours, panes, nearest < depth)
        return colours, depth

    def close(self) -> None:
        """Disconnect. Safe to call twice."""
        if self._client >= 0:
            self._drawing.close()
            self._bullet.disconnect(physicsClientId=self._client)
            self._client = -1

    def _place_bodies(self, request: RenderRequest) -> None:
        self._place_robot(self._robot, request.position, request.orientation)
        if len(self._others) < len(request.robots):
            self._others += [self._load(model) for model, *_ in request.robots[len(self._others) :]]
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
            tiny = TinyDrawing(self._bullet, self._client, self._model, self._matrix)
            self._drawing = instead(self._setup.camera.renderer, tiny, error)

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

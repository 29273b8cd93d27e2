"""Pictures drawn by OpenGL without a display (EGL), shaded as PyBullet's software renderer does.

moderngl is an optional dependency (`pip install 'treepilot[gl]'`). Shapes and poses come from the
PyBullet client; light and rounding are those of TinyRenderer (E. Coumans, examples/TinyRenderer).
Pictures differ from its own where a pixel lies on an edge, and on round shapes.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stack.errors import BodyError
from stack.sim.physics.pybullet_engine.shapes import Shape, shape_of
from stack.sim.sensors.gl_trial import make_context
from stack.types import FloatArray

VERTEX = """
#version 330
uniform mat4 clip_from_world;
uniform mat4 world_from_shape;
in vec3 position;
in vec3 normal;
in vec2 texel;
out vec3 towards;
out vec2 place;
void main() {
    gl_Position = clip_from_world * (world_from_shape * vec4(position, 1.0));
    towards = mat3(world_from_shape) * normal;
    place = texel;
}
"""

FRAGMENT = """
#version 330
uniform vec3 colour;
uniform vec3 light;
uniform sampler2D surface;
in vec3 towards;
in vec2 place;
layout(location = 0) out vec4 seen;
layout(location = 1) out float depth;
void main() {
    vec3 n = normalize(towards);
    float lit = dot(n, light);
    vec3 mirrored = normalize(2.0 * lit * n - light);
    float shine = pow(max(mirrored.z, 0.0), 2.0);
    vec3 base = floor(floor(255.0 * texture(surface, place).rgb + 0.5) * colour);
    vec3 level = base * (0.6 + 0.35 * max(lit, 0.0) + 0.05 * shine);
    seen = vec4(min(floor(level + 1e-3), 255.0) / 255.0, 1.0);
    depth = gl_FragCoord.z;
}
"""

LIGHT = np.array([-50.0, 30.0, 100.0])
"""Direction of TinyRenderer's light, world frame."""


class _Drawable(NamedTuple):
    body: int
    link: int
    body_from_shape: FloatArray
    colour: tuple[float, float, float]
    vertices: Any
    texture: Any


class GlDrawing:
    """Draws the bodies of a PyBullet client.

    Args:
        bullet: the pybullet module.
        client: number of the client; bodies that are added later need `add_bodies`.
        size: width and height of the pictures, pixels.
        projection: (4, 4) of the camera.
        textures: body number -> (rows, columns, 3) uint8, of textured bodies.

    Raises:
        BodyError: OpenGL cannot be used here, or a shape cannot be drawn; the text says why.
    """

    def __init__(
        self, bullet: Any, client: int, size: tuple[int, int], projection: FloatArray,
        textures: Mapping[int, NDArray[np.uint8]],
    ) -> None:  # fmt: skip
        self._bullet, self._client, self._size = bullet, client, size
        self._projection = projection
        self._context = make_context()
        self._program = self._context.program(vertex_shader=VERTEX, fragment_shader=FRAGMENT)
        self._program["light"].value = tuple(LIGHT / np.linalg.norm(LIGHT))
        self._colours = self._context.texture(size, 4)
        self._depths = self._context.texture(size, 1, dtype="f4")
        self._target = self._context.framebuffer(
            [self._colours, self._depths], self._context.depth_renderbuffer(size)
        )
        self._plain = self._texture(np.full((1, 1, 3), 255, dtype=np.uint8))
        self._drawables: list[_Drawable] = []
        self._from_inertial: dict[int, Any] = {}
        self._textures = {body: self._texture(pixels) for body, pixels in textures.items()}
        self.driver = str(self._context.info["GL_RENDERER"])
        self.add_bodies()

    def add_bodies(self) -> None:
        """Prepare the bodies of the client that are new."""
        for body in range(self._bullet.getNumBodies(physicsClientId=self._client)):
            if body not in self._from_inertial:
                self._add(body)

    def draw(self, view: FloatArray) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """Return colours (height, width, 3) and depths (height, width), 0 near and 1 far.

        Args:
            view: (4, 4) OpenGL eye frame from world.
        """
        gl, program = self._context, self._program
        self._target.use()
        gl.enable(gl.DEPTH_TEST | gl.CULL_FACE)
        # Where nothing is drawn it is white, and the depth that of the far plane, which is 1 too.
        self._target.clear(1.0, 1.0, 1.0, 1.0, depth=1.0)
        program["clip_from_world"].write(_column_major(self._projection @ view))
        for item in self._drawables:
            pose = self._pose(item.body, item.link) @ item.body_from_shape
            program["world_from_shape"].write(_column_major(pose))
            program["colour"].value = item.colour
            item.texture.use(0)
            item.vertices.render()
        width, height = self._size
        colours = np.frombuffer(self._colours.read(), dtype=np.uint8).reshape(height, width, 4)
        depths = np.frombuffer(self._depths.read(), dtype=np.float32).reshape(height, width)
        return np.ascontiguousarray(colours[::-1, :, :3]), np.ascontiguousarray(depths[::-1])

    def close(self) -> None:
        """Release the context. Safe to call twice."""
        if self._context is not None:
            self._context.release()
            self._context = None

    def _add(self, body: int) -> None:
        inertial = self._bullet.getDynamicsInfo(body, -1, physicsClientId=self._client)[3:5]
        self._from_inertial[body] = self._bullet.invertTransform(*inertial)
        flags = self._bullet.VISUAL_SHAPE_DATA_TEXTURE_UNIQUE_IDS
        found = self._bullet.getVisualShapeData(body, flags, physicsClientId=self._client)
        if body not in self._textures and any(data[8] >= 0 for data in found):
            raise BodyError("a robot with a texture cannot be drawn by OpenGL")
        for shape in (shape_of(data) for data in found):
            vertices = self._vertices(shape)
            texture = self._textures.get(body, self._plain)
            place = _transform(shape.position, self._turn(shape.orientation))
            self._drawables.append(
                _Drawable(body, shape.link, place, shape.colour, vertices, texture)
            )

    def _vertices(self, shape: Shape) -> Any:
        rows = np.hstack([shape.positions, shape.normals, shape.texels]).astype(np.float32)
        buffer = self._context.buffer(np.ascontiguousarray(rows).tobytes())
        content = [(buffer, "3f 3f 2f", "position", "normal", "texel")]
        return self._context.vertex_array(self._program, content)

    def _texture(self, pixels: NDArray[np.uint8]) -> Any:
        rows, columns, _ = pixels.shape
        flipped = np.ascontiguousarray(pixels[::-1])  # OpenGL's first row is the lowest
        texture = self._context.texture((columns, rows), 3, flipped.tobytes(), alignment=1)
        texture.filter = (self._context.NEAREST, self._context.NEAREST)
        return texture

    def _pose(self, body: int, link: int) -> FloatArray:
        """Return (4, 4) world from the frame in which PyBullet describes a link's shapes."""
        if link >= 0:
            state = self._bullet.getLinkState(
                body, link, computeForwardKinematics=1, physicsClientId=self._client
            )
            return _transform(state[4], self._turn(state[5]))
        centre = self._bullet.getBasePositionAndOrientation(body, physicsClientId=self._client)
        base = self._bullet.multiplyTransforms(*centre, *self._from_inertial[body])
        return _transform(base[0], self._turn(base[1]))

    def _turn(self, orientation: tuple[float, ...]) -> FloatArray:
        matrix: FloatArray = np.array(self._bullet.getMatrixFromQuaternion(orientation))
        return matrix.reshape(3, 3)


def _transform(position: tuple[float, ...], turn: FloatArray) -> FloatArray:
    transform = np.eye(4)
    transform[:3, :3], transform[:3, 3] = turn, position
    return transform


def _column_major(matrix: FloatArray) -> bytes:
    return np.ascontiguousarray(matrix.T, dtype=np.float32).tobytes()

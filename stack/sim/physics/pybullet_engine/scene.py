"""The bodies of a world in a PyBullet client, for the physics and for the camera renderer."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from stack.body import BlockPose
from stack.sim.physics.meshes import (
    Key,
    board_obj_text,
    file_name,
    floor,
    glass_meshes,
    obj_text,
    painted,
    pits,
    plain_meshes,
    slab,
    static_meshes,
    textured_meshes,
    tiled_obj_text,
)
from stack.sim.physics.mirrors import MirrorFace, in_front
from stack.sim.physics.textures import (
    BOARD_RATIO,
    TILE_SIDES,
    Picture,
    board_picture,
    png_of,
    poster_picture,
    texture_picture,
)
from stack.sim.worlds.world import PERSON_HEIGHT, Block, Colour, Door, World
from stack.types import FloatArray, Pose2D

HIDDEN_HEIGHT = -20.0
"""Height of an open door, metres: below the floor, out of sight and reach."""

UPRIGHT = (0.0, 0.0, 0.0, 1.0)
"""Orientation of a body that is not turned: quaternion x, y, z, w."""

PIT_COLOUR: Colour = (0.30, 0.28, 0.26)
SPINNING_FRICTION = 0.001
"""Of blocks: one that is held at two points does not spin about them for ever."""

FLOOR_COLOUR: Colour = (0.42, 0.43, 0.44)
PERSON_COLOUR: Colour = (0.20, 0.35, 0.60)
DROPPED: Colour = (0.55, 0.42, 0.32)


def static_shape(world: World) -> str:
    """Return the mesh of all static parts of a world as a Wavefront OBJ text; empty: none."""
    meshes = static_meshes(world)
    return obj_text(np.concatenate(list(meshes.values()))) if meshes else ""


class Scene:
    """All bodies of a world, in one PyBullet client.

    Attributes:
        bullet: the pybullet module.
        client: number of the PyBullet client.
        floor: body number of the floor.
        obstacles: body number -> description, of all bodies with a collision shape but the floor,
            robots included.
        hidden: body numbers of open doors and absent people, out of reach below the floor.
        textures: body number -> (rows, columns, 3) uint8, of boards, posters and textures.
    """

    def __init__(self, bullet: Any, client: int, world: World, folder: FilePath) -> None:
        self.bullet, self.client, self._folder = bullet, client, folder
        self.floor = -1
        self.obstacles: dict[int, str] = {}
        self.hidden: set[int] = set()
        self.textures: dict[int, Picture] = {}
        self._doors: dict[str, tuple[int, Pose2D, float]] = {}
        self._people: dict[int, tuple[float, float] | None] = {}  # body -> position
        self._blocks: list[int] = []
        self._glass: list[int] = []
        self._mirror: MirrorFace | None = None

    @classmethod
    def with_collision_shapes(
        cls, bullet: Any, client: int, world: World, static: str, folder: FilePath
    ) -> Scene:
        """Build a scene for the physics: one concave mesh for all static parts, doors, people.

        Args:
            bullet: the pybullet module.
            client: number of the physics client.
            world: what to build.
            static: `static_shape` of the world.
            folder: for generated files; may be deleted afterwards.
        """
        scene = cls(bullet, client, world, folder)
        plane = bullet.createCollisionShape(bullet.GEOM_PLANE, physicsClientId=client)
        scene.floor = scene._add_static_body(collision=plane)
        # Bullet multiplies the two friction coefficients: the wheels have that of the floor.
        bullet.changeDynamics(scene.floor, -1, lateralFriction=1.0, physicsClientId=client)
        if static:
            shape = bullet.createCollisionShape(
                bullet.GEOM_MESH,
                fileName=scene._write(static.encode(), "obj"),
                flags=bullet.GEOM_FORCE_CONCAVE_TRIMESH,
                physicsClientId=client,
            )
            scene.obstacles[scene._add_static_body(collision=shape)] = "a static obstacle"
        for door in world.doors:
            body = scene._add_door(door, visible=False)
            scene.obstacles[body] = f"the door {door.name}"
        for block in world.blocks:
            scene.obstacles[scene._add_block(block, visible=False)] = block.name
        for person in world.people:
            body = scene._add_person(person.radius, visible=False)
            scene.obstacles[body] = person.name
            scene._move(body, 0.0, 0.0, HIDDEN_HEIGHT, 0.0)  # until `place_people` is called
        return scene

    @classmethod
    def with_visual_shapes(
        cls, bullet: Any, client: int, world: World, folder: FilePath,
        mirror: MirrorFace | None = None,
    ) -> Scene:  # fmt: skip
        """Build a scene for rendering: a mesh per colour or texture, floor, doors, people, boards.

        Glass is hidden until `show_glass` is called: neither a lidar nor a depth camera sees it.

        Args:
            bullet: the pybullet module.
            client: number of the physics client.
            world: what to build.
            folder: for generated files; may be deleted afterwards.
            mirror: if given, only what this face reflects: obstacles behind its plane are left out.

        Raises:
            BodyError: a marker's dictionary or number is unknown to OpenCV.
        """
        scene = cls(bullet, client, world, folder)
        scene._mirror = mirror
        scene.floor = scene._add_visual_floor(world)
        for colour, corners in scene._seen(plain_meshes(world)):
            scene._add_visual_mesh(obj_text(corners), colour)
        for texture, corners in scene._seen(textured_meshes(world)):
            scene._add_tiled(corners, texture)
        for colour, corners in scene._seen(glass_meshes(world)):
            scene._glass.append(scene._add_visual_mesh(obj_text(corners), colour))
        scene.show_glass(False)
        for line in world.lines:
            scene._add_visual_mesh(obj_text(painted(line)), line.colour)
        for door in world.doors:
            scene._add_door(door, visible=True)
        for block in world.blocks:
            scene._add_block(block, visible=True)
        for person in world.people:
            scene._add_person(person.radius, visible=True)
        scene._add_boards(world)
        return scene

    @property
    def has_glass(self) -> bool:
        """Whether there are walls of glass."""
        return bool(self._glass)

    def show_glass(self, shown: bool) -> None:
        """Show the walls of glass as if they were not transparent, or hide them."""
        for body in self._glass:
            self._move(body, 0.0, 0.0, 0.0 if shown else HIDDEN_HEIGHT, 0.0)

    def place_door(self, name: str, closed: bool) -> None:
        """Move a door into its gap, or below the floor."""
        body, pose, height = self._doors[name]
        z = height / 2.0 if closed and self._shows((pose.x, pose.y)) else HIDDEN_HEIGHT
        self._move(body, pose.x, pose.y, z, pose.heading)

    def drop_box(self, pose: Pose2D, size: tuple[float, float, float]) -> None:
        """Add a box for the physics, of a size (length, width, height), metres."""
        half = [side / 2.0 for side in size]
        body = self._add_shape(False, DROPPED, self.bullet.GEOM_BOX, halfExtents=half)
        self.obstacles[body] = "a dropped box"
        self._move(body, pose.x, pose.y, half[2], pose.heading)

    def place_people(self, positions: Sequence[tuple[float, float]]) -> None:
        """Move the people to positions in metres, in the order of the world; nan: nowhere."""
        for body, position in zip(self._people, positions, strict=True):
            before = self._people[body]
            if before == position:
                continue
            self._people[body] = position
            if position[0] == position[0] and self._shows(position):
                self._move(body, *position, PERSON_HEIGHT / 2.0, 0.0)
            elif before is None or before[0] == before[0]:
                self._move(body, 0.0, 0.0, HIDDEN_HEIGHT, 0.0)

    def is_block(self, body: int) -> bool:
        """Whether a body is a block of the world."""
        return body in self._blocks

    def block_states(self) -> list[BlockPose]:
        """Return where the blocks are, in the order of the world."""
        states = (
            self.bullet.getBasePositionAndOrientation(body, physicsClientId=self.client)
            for body in self._blocks
        )
        return [BlockPose(position, orientation) for position, orientation in states]

    def place_blocks(self, states: Sequence[BlockPose]) -> None:
        """Move the blocks to poses, in the order of the world."""
        for body, (position, orientation) in zip(self._blocks, states, strict=True):
            shown = self._shows(position[:2])
            at = position if shown else (0.0, 0.0, HIDDEN_HEIGHT)
            self.bullet.resetBasePositionAndOrientation(
                body, at, orientation, physicsClientId=self.client
            )

    def _shows(self, position: Sequence[float]) -> bool:
        """Return whether a position is in the scene: in front of its mirror, if it has one."""
        return self._mirror is None or self._mirror.is_in_front(np.array(position))

    def _seen(self, meshes: dict[Key, FloatArray]) -> list[tuple[Key, FloatArray]]:
        """Return meshes without what is behind the plane of the mirror."""
        if self._mirror is None:
            return list(meshes.items())
        cut = ((key, in_front(corners, self._mirror)) for key, corners in meshes.items())
        return [(key, corners) for key, corners in cut if len(corners)]

    def _move(self, body: int, x: float, y: float, z: float, heading: float) -> None:
        if z == HIDDEN_HEIGHT:
            self.hidden.add(body)
        else:
            self.hidden.discard(body)
        turn = (0.0, 0.0, sin(heading / 2.0), cos(heading / 2.0)) if heading else UPRIGHT
        self.bullet.resetBasePositionAndOrientation(
            body, (x, y, z), turn, physicsClientId=self.client
        )

    def _write(self, content: bytes, ending: str) -> str:
        path = self._folder / file_name(content, ending)
        path.write_bytes(content)
        return str(path)

    def _add_static_body(self, *, collision: int = -1, visual: int = -1) -> int:
        """Add a body that nothing moves.

        In maximal coordinates it is a plain rigid body. As a multibody it would give the same
        contacts, and its six coordinates would cost a fifth of each physics step. The renderer
        does not draw plain rigid bodies in their own colours.
        """
        body: int = self.bullet.createMultiBody(
            0.0, collision, visual, useMaximalCoordinates=collision >= 0,
            physicsClientId=self.client,
        )  # fmt: skip
        return body

    def _add_visual_mesh(self, text: str, colour: Colour) -> int:
        """Add a mesh, given as a Wavefront OBJ text."""
        shape = self.bullet.createVisualShape(
            self.bullet.GEOM_MESH,
            fileName=self._write(text.encode(), "obj"),
            rgbaColor=(*colour, 1.0),
            specularColor=(0.0, 0.0, 0.0),
            physicsClientId=self.client,
        )
        return self._add_static_body(visual=shape)

    def _add_picture(self, text: str, picture: Picture) -> int:
        """Add a mesh with texture coordinates that shows a picture."""
        body = self._add_visual_mesh(text, (1.0, 1.0, 1.0))
        file = self._write(png_of(picture), "png")
        number = self.bullet.loadTexture(file, physicsClientId=self.client)
        self.bullet.changeVisualShape(body, -1, textureUniqueId=number, physicsClientId=self.client)
        self.textures[body] = picture
        return body

    def _add_tiled(self, corners: FloatArray, texture: str) -> int:
        """Add a mesh that a texture covers."""
        return self._add_picture(
            tiled_obj_text(corners, TILE_SIDES[texture]), texture_picture(texture)
        )

    def _add_visual_floor(self, world: World) -> int:
        x_min, y_min, x_max, y_max = world.bounds
        margin = 2.0  # the floor extends beyond the edge of the map
        bounds = (x_min - margin, y_min - margin, x_max + margin, y_max + margin)
        for pit in pits(world.drops):
            self._add_visual_mesh(obj_text(pit), PIT_COLOUR)
        ground = floor(bounds, world.drops)
        if world.floor != "plain":
            return self._add_tiled(ground, world.floor)
        return self._add_visual_mesh(obj_text(ground), FLOOR_COLOUR)

    def _add_boards(self, world: World) -> None:
        for marker in world.markers:
            if self._shows(marker.position):
                side = marker.size * BOARD_RATIO
                board = board_obj_text(marker.position, marker.heading, (side, side))
                self._add_picture(board, board_picture(marker))
        for poster in world.posters:
            if self._shows(poster.position):
                board = board_obj_text(poster.position, poster.heading, poster.size)
                self._add_picture(board, poster_picture(poster.number, poster.size))

    def add_robot(self, body: int, name: str) -> None:
        """Register a robot; it is an obstacle of the other robots."""
        self.obstacles[body] = f"the robot {name}"

    def obstacles_of(self, robot: int) -> list[int]:
        """Return the body numbers of everything that a robot can collide with now."""
        return [body for body in self.obstacles if body not in self.hidden and body != robot]

    def is_person(self, body: int) -> bool:
        """Whether a body is a person of the world."""
        return body in self._people

    def _add_door(self, door: Door, *, visible: bool) -> int:
        pose, length = slab(np.array(door.start), np.array(door.end))
        half = (length / 2.0, door.thickness / 2.0, door.height / 2.0)
        body = self._add_shape(visible, door.colour, self.bullet.GEOM_BOX, halfExtents=half)
        self._doors[door.name] = (body, pose, door.height)
        self.place_door(door.name, door.closed)
        return body

    def _add_person(self, radius: float, *, visible: bool) -> int:
        # PyBullet calls a cylinder's height `height` in collision shapes, `length` in visual ones.
        height = {"length" if visible else "height": PERSON_HEIGHT}
        cylinder = self.bullet.GEOM_CYLINDER
        body = self._add_shape(visible, PERSON_COLOUR, cylinder, radius=radius, **height)
        self._people[body] = None
        return body

    def _add_block(self, block: Block, *, visible: bool) -> int:
        """Add a block: for the physics one that gravity and other bodies move."""
        bullet, client = self.bullet, self.client
        half = [side / 2.0 for side in block.size]
        pose = block.pose
        turn = (0.0, 0.0, sin(pose.heading / 2.0), cos(pose.heading / 2.0))
        body: int = self._add_shape(
            visible, block.colour, bullet.GEOM_BOX, mass=0.0 if visible else block.mass,
            halfExtents=half,
        )  # fmt: skip
        bullet.resetBasePositionAndOrientation(
            body, (pose.x, pose.y, block.elevation + half[2]), turn, physicsClientId=client
        )
        if not visible:
            bullet.changeDynamics(
                body, -1, lateralFriction=block.friction, spinningFriction=SPINNING_FRICTION,
                physicsClientId=client,
            )  # fmt: skip
        self._blocks.append(body)
        return body

    def _add_shape(
        self, visible: bool, colour: Colour, kind: int, mass: float = 0.0, **size: Any
    ) -> int:
        if visible:
            shape = self.bullet.createVisualShape(
                kind, rgbaColor=(*colour, 1.0), physicsClientId=self.client, **size
            )
            return self._add_static_body(visual=shape)
        shape = self.bullet.createCollisionShape(kind, physicsClientId=self.client, **size)
        if mass:
            body: int = self.bullet.createMultiBody(mass, shape, physicsClientId=self.client)
            return body
        return self._add_static_body(collision=shape)

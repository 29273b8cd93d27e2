"""What a renderer is told: once what there is, and for each picture where it is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from stack.body import BlockPose
from stack.drivetrain.description import CameraDescription, DepthCameraDescription
from stack.sim.worlds.world import World
from stack.types import CameraModel, FloatArray

Position = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class RenderSetup:
    """The constant inputs of a renderer: world, robot, camera and the camera's name.

    `model` is the text of the robot's URDF.
    """

    world: World
    model: str
    camera: CameraDescription | DepthCameraDescription
    name: str = "camera"


@dataclass(frozen=True, slots=True)
class RenderRequest:
    """State of everything that moves, at the time of exposure.

    Attributes:
        step: physics step; it selects the image noise, with the seed.
        position: (x, y, z) of the base frame, world frame, metres.
        orientation: quaternion x, y, z, w of the base frame.
        people: (n, 3) x, y, radius, world frame, metres; nan: not there.
        doors: name -> closed.
        robots: (model, position, orientation) of the other robots, always in the same order.
        blocks: pose of each block of the world, in its order.
        joints: positions of the joints of the robot's arm and gripper, by name.
        velocity: of the base frame's origin, world frame, m/s.
        spin: angular velocity of the base frame, world frame, rad/s.
        seed: of the image noise.
        camera: the camera with its mount in the base frame; None: as the setup has it.
    """

    step: int
    position: Position
    orientation: Quaternion
    people: FloatArray
    doors: dict[str, bool]
    robots: tuple[tuple[str, Position, Quaternion], ...] = ()
    velocity: Position = (0.0, 0.0, 0.0)
    spin: Position = (0.0, 0.0, 0.0)
    seed: int = 0
    blocks: tuple[BlockPose, ...] = ()
    joints: Mapping[str, float] = field(default_factory=dict)
    camera: CameraModel | None = None

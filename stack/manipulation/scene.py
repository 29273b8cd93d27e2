"""What an arm must not touch: a frozen description that is copied to a planner's worker.

Poses are (4, 4) in the arm's `base_link`, lengths are metres.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from stack.types import FloatArray


@dataclass(frozen=True)
class Box:
    """A cuboid about the origin; `size` is its edges along x, y and z."""

    size: tuple[float, float, float]


@dataclass(frozen=True)
class Cylinder:
    """A cylinder about its z axis; its centre is the origin."""

    radius: float
    length: float


@dataclass(frozen=True)
class Capsule:
    """A cylinder about its z axis between two half spheres; `length` is without them."""

    radius: float
    length: float


@dataclass(frozen=True)
class Sphere:
    """A sphere about the origin."""

    radius: float


Shape = Box | Cylinder | Capsule | Sphere


@dataclass(frozen=True)
class SceneObject:
    """A body.

    Attributes:
        name: for messages; unique in a scene, and not that of a link.
        shape: in its own frame.
        pose: (4, 4) at time 0.
        velocity: (3,) m/s; zero: it stands.
    """

    name: str
    shape: Shape
    pose: FloatArray
    velocity: FloatArray = field(default_factory=lambda: np.zeros(3))


@dataclass(frozen=True)
class ScenePoints:
    """Measured points: the cells of a grid that hold one are occupied.

    Attributes:
        name: for messages.
        points: (n, 3).
        resolution: edge of a cell.
    """

    name: str
    points: FloatArray
    resolution: float = 0.02


@dataclass(frozen=True)
class Scene:
    """What surrounds an arm, and what it holds.

    Attributes:
        objects: bodies.
        points: measured.
        held: body in the hand, its pose in the frame of the tool, with which it moves; the hand
            and the fingers may touch it.
        width: between the fingers, metres; None: open.
        may_touch: pairs of names, of links or objects, whose contact is wanted.
    """

    objects: tuple[SceneObject, ...] = ()
    points: tuple[ScenePoints, ...] = ()
    held: SceneObject | None = None
    width: float | None = None
    may_touch: frozenset[frozenset[str]] = frozenset()

    def without(self, name: str) -> Scene:
        """Return the scene without an object."""
        return replace(self, objects=tuple(item for item in self.objects if item.name != name))

    def holding(self, name: str, tool: FloatArray, width: float) -> Scene:
        """Return the scene with an object in the hand.

        Args:
            name: of the object.
            tool: (4, 4) of the tool when it grasps.
            width: between the fingers.
        """
        (item,) = (item for item in self.objects if item.name == name)
        held = replace(item, pose=np.linalg.inv(tool) @ item.pose, velocity=np.zeros(3))
        return replace(self.without(name), held=held, width=width)

    def released(self, tool: FloatArray) -> Scene:
        """Return the scene with the held object where the tool (4, 4) leaves it, fingers open."""
        if self.held is None:
            return self
        placed = replace(self.held, pose=tool @ self.held.pose)
        return replace(self, objects=(*self.objects, placed), held=None, width=None)

    def touching(self, *pairs: tuple[str, str]) -> Scene:
        """Return the scene in which the pairs of names may touch too."""
        return replace(self, may_touch=self.may_touch | {frozenset(pair) for pair in pairs})

"""Score a simulated run against ground truth, and provide the truth to telemetry."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from math import atan2, hypot
from typing import Any

from missions.execution.people_measures import PeopleMeasures
from stack.body import BlockPose, SimulatedWorld, SimulationEvent
from stack.geometry.rotations import from_quaternion
from stack.sim.worlds.world import Door, Wall, World
from stack.telemetry.records import Layer, SceneShape
from stack.types import FloatArray, Footprint, Pose2D, PoseEstimate

BOARD_SCALE, BOARD_THICKNESS = 1.25, 0.01
"""Side of a marker's board as a multiple of the marker's; metres."""


class SimulationScorer:
    """Ground-truth scorer of a simulated body: localisation error, contacts, clearance, scene.

    Args:
        simulation: with the truth.
        world: that it simulates.
        footprint: of the robot.
        clock: returns the time of the truth, seconds.

    Attributes:
        among_people: measures of the drive among people.
    """

    def __init__(
        self, simulation: SimulatedWorld, world: World, footprint: Footprint,
        clock: Callable[[], float],
    ) -> None:  # fmt: skip
        self._simulation, self._world, self._clock = simulation, world, clock
        self.among_people = PeopleMeasures(footprint)
        self._error_sum, self._samples, self._worst = 0.0, 0, 0.0
        self._scene: Layer | None = None

    @property
    def truth(self) -> Pose2D:
        """True pose of the base, world frame."""
        return self._simulation.truth.pose

    @property
    def people(self) -> FloatArray:
        """Positions and radii of the people, (n, 3): x, y, radius in metres."""
        return self._simulation.people

    def score(self, estimate: PoseEstimate) -> None:
        """Add the current step to the score."""
        error = estimate.pose.distance_to(self.truth)
        self._error_sum += error
        self._samples += 1
        self._worst = max(self._worst, error)
        if self._world.people:
            truth = self._simulation.truth
            people = self._simulation.all_people
            self.among_people.update(self._clock(), truth.pose, truth.twist, people)

    def people_summary(self) -> dict[str, Any]:
        """Return the measures of the drive among people; empty in a world without any."""
        return self.among_people.summary() if self._world.people else {}

    def take_events(self) -> list[SimulationEvent]:
        """Return door changes, contacts and other world events since the last call."""
        return self._simulation.take_events()

    def counters(self) -> dict[str, float]:
        """Return contacts, clearance and localisation error so far."""
        return {
            "collisions": float(self._simulation.tally.by_robot),
            "pushed_into": float(self._simulation.tally.against_standing),
            "clearance": self._simulation.clearance,
            "localisation_error": self.mean_error,
            "localisation_error_max": self._worst,
        }

    @property
    def mean_error(self) -> float:
        """Mean distance between estimate and truth, metres."""
        return self._error_sum / max(1, self._samples)

    def layers(self) -> dict[str, Layer]:
        """Return the scene layer; its version increases when a door or a block moves."""
        version = self._simulation.scene_changes + 1
        if self._scene is None or self._scene.version != version:
            still = world_shapes(self._world, self._simulation.doors)
            moved = tuple(_blocks(self._world, self._simulation.blocks))
            self._scene = Layer(version, (*still, *moved))
        return {"scene": self._scene}


def world_shapes(world: World, doors_closed: Mapping[str, bool]) -> tuple[SceneShape, ...]:
    """Return walls, furniture, closed doors, marker boards and docks, in a fixed order."""
    return tuple(_shapes(world, doors_closed))


def _shapes(world: World, doors_closed: Mapping[str, bool]) -> Iterator[SceneShape]:
    for wall in world.walls:
        yield from _slabs(wall)
    for box in world.boxes:
        yield SceneShape("box", box.pose, box.size, box.colour, lift=box.elevation)
    for drum in world.cylinders:
        size = (2 * drum.radius, 2 * drum.radius, drum.height)
        yield SceneShape("cylinder", Pose2D(drum.x, drum.y), size, drum.colour)
    for door in world.doors:
        if doors_closed.get(door.name, door.closed):
            yield _door(door)
    for marker in world.markers:
        x, y, z = marker.position
        side = BOARD_SCALE * marker.size
        pose = Pose2D(x, y, marker.heading)
        yield SceneShape(
            "box", pose, (BOARD_THICKNESS, side, side), (0.95, 0.95, 0.9), z - side / 2
        )
    for dock in world.docks:
        size = (2 * dock.radius, 2 * dock.radius, 0.01)
        yield SceneShape("cylinder", Pose2D(dock.x, dock.y), size, (0.25, 0.65, 0.45))


def _blocks(world: World, poses: Sequence[BlockPose]) -> Iterator[SceneShape]:
    """Yield the blocks where they are, upright at their headings."""
    for block, ((x, y, z), orientation) in zip(world.blocks, poses, strict=True):
        ahead = from_quaternion((x, y, z), orientation)[:2, 0]
        pose = Pose2D(x, y, atan2(float(ahead[1]), float(ahead[0])))
        yield SceneShape("box", pose, block.size, block.colour, lift=z - block.size[2] / 2)


def _slabs(wall: Wall) -> Iterator[SceneShape]:
    for (x0, y0), (x1, y1) in zip(wall.points[:-1], wall.points[1:], strict=True):
        length = hypot(x1 - x0, y1 - y0) + wall.thickness
        pose = Pose2D(float(x0 + x1) / 2, float(y0 + y1) / 2, atan2(y1 - y0, x1 - x0))
        yield SceneShape("box", pose, (length, wall.thickness, wall.height), wall.colour)


def _door(door: Door) -> SceneShape:
    (x0, y0), (x1, y1) = door.start, door.end
    pose = Pose2D((x0 + x1) / 2, (y0 + y1) / 2, atan2(y1 - y0, x1 - x0))
    size = (hypot(x1 - x0, y1 - y0), door.thickness, door.height)
    return SceneShape("box", pose, size, door.colour)

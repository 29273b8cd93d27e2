"""Score a simulated run against ground truth, and provide the truth to telemetry."""

from __future__ import annotations

from collections.abc import Callable

from missions.execution.people_measures import PeopleMeasures
from missions.execution.world_shapes import scene_of
from stack.body import SimulatedWorld, SimulationEvent
from stack.sim.worlds.world import World
from stack.telemetry.records import Layer
from stack.types import FloatArray, Footprint, Pose2D, PoseEstimate


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
        """Return the scene layer; its version increases when a door moves."""
        version = self._simulation.scene_changes + 1
        if self._scene is None or self._scene.version != version:
            self._scene = Layer(version, scene_of(self._world, self._simulation.doors))
        return {"scene": self._scene}

"""Scores a simulated run against the truth, and hands the truth to the screen."""

from __future__ import annotations

from missions.execution.world_shapes import scene_of
from robots.simulated import SimulatedBody
from stack.sim.worlds.world import World
from stack.telemetry.records import Layer
from stack.types import FloatArray, Pose2D, PoseEstimate


class SimulationScorer:
    """The Witness of a simulated body."""

    def __init__(self, body: SimulatedBody, world: World) -> None:
        self._body, self._world = body, world
        self._errors, self._looks, self._worst = 0.0, 0, 0.0
        self._scene: Layer | None = None

    @property
    def truth(self) -> Pose2D:
        """The true pose of the base."""
        return self._body.truth.pose

    @property
    def people(self) -> FloatArray:
        """(n, 3) x, y, radius."""
        return self._body.people

    def look(self, estimate: PoseEstimate) -> None:
        """Add this moment's error to the score."""
        error = estimate.pose.distance_to(self.truth)
        self._errors += error
        self._looks += 1
        self._worst = max(self._worst, error)

    def news(self) -> list[tuple[str, str]]:
        """Doors, contacts and other happenings since the last call."""
        return self._body.news()

    def counters(self) -> dict[str, float]:
        """Contacts, clearance and localisation error so far."""
        return {
            "collisions": float(self._body.tally.by_robot),
            "pushed_into": float(self._body.tally.against_standing),
            "clearance": self._body.clearance,
            "localisation_error": self.mean_error,
            "localisation_error_max": self._worst,
        }

    @property
    def mean_error(self) -> float:
        """Mean distance between estimate and truth, metres."""
        return self._errors / max(1, self._looks)

    def layers(self) -> dict[str, Layer]:
        """The scene; its version grows when a door moves."""
        version = self._body.scene_changes + 1
        if self._scene is None or self._scene.version != version:
            self._scene = Layer(version, scene_of(self._world, self._body.doors))
        return {"scene": self._scene}

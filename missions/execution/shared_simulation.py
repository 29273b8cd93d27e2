"""One simulation for many runs, one after another."""

from __future__ import annotations

from typing import Any

from missions.execution.fit.faults import changes_world
from missions.execution.prepare import PreparedMission, RunOptions
from missions.execution.scene import OF_SCENE
from robots.bodies import BodySetup, MakeBody
from robots.simulated import SimulatedBody
from stack.body import Body
from stack.sim.simulation import Simulation


class SharedSimulation:
    """The simulation of the last run, reset for the next one of the same robot, world and start.

    After `Simulation.reset` it is bit for bit like a new one.
    """

    def __init__(self) -> None:
        self._scene: tuple[Any, ...] | None = None
        self._simulation: Simulation | None = None
        self._body: SimulatedBody | None = None

    def body_of(self, plan: PreparedMission, options: RunOptions) -> MakeBody:
        """Return what makes the body of a run. The plan's robot and world follow from the options.

        Component parameters, which are most of what varies, leave robot and world as they are;
        faults do, unless they change the world.
        """
        parameters = sorted((options.parameters or {}).items())
        own = tuple(item for item in parameters if item[0].startswith(OF_SCENE))
        moved = (options.seed, options.faults, *parameters) if changes_world(plan.faults) else ()
        scene = (
            plan.mission.source, options.robot, options.world, options.start,
            tuple(sorted((options.arguments or {}).items())), own, moved,
        )  # fmt: skip

        def make(setup: BodySetup) -> Body:
            if self._body is None or self._scene != scene:
                self.close()
                self._simulation = Simulation(setup.world)
                self._body = SimulatedBody(
                    setup.robot, setup.world, start=setup.start, seed=setup.seed,
                    simulation=self._simulation, faults=setup.faults,
                )  # fmt: skip
                self._scene = scene
            else:
                self._body.reset(setup.seed, setup.faults)
            return self._body

        return make

    def close(self) -> None:
        """Close the simulation. Safe to call twice."""
        if self._simulation is not None:
            self._simulation.close()
        self._simulation = self._body = self._scene = None

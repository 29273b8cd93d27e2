"""All people of a world, each moved by their own model."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from stack.compilation import KernelTypes
from stack.sim.people.loops import Robots, Walker
from stack.sim.people.recorded import RecordedWalker
from stack.sim.people.social_force import SocialForcePeople
from stack.sim.worlds.world import World
from stack.streams import stream
from stack.types import FloatArray

NOBODY: Mapping[str, float] = MappingProxyType({})


class People:
    """All people of a world, in the order of the world file."""

    @staticmethod
    def kernels(world: World) -> KernelTypes:
        """Return the kernels that the people of a world call."""
        if all(person.model != "social_force" for person in world.people):
            return ()
        from stack.sim.people.kernels import KERNELS  # imports numba

        return KERNELS

    def __init__(self, world: World, seed: int, robots: Robots = ()) -> None:
        """Place everyone where they are at time 0.

        Args:
            world: with the people and the walls between them.
            seed: of what people do by chance, and of when recordings begin.
            robots: pose and circumscribed radius of each robot.
        """
        people = world.people
        self._names = [person.name for person in people]
        self._radii = np.array([person.radius for person in people])
        self._by_force = [n for n, one in enumerate(people) if one.model == "social_force"]
        self._crowd = None
        if self._by_force:
            self._crowd = SocialForcePeople([people[n] for n in self._by_force], world, seed)
        shift = float(stream(seed, "recorded people").random())
        self._walkers: dict[int, Walker | RecordedWalker] = {
            n: Walker(person) if person.model == "loop"
            else RecordedWalker(person, shift * person.recorded_duration, robots)
            for n, person in enumerate(people) if person.model != "social_force"
        }  # fmt: skip
        self.positions = [(0.0, 0.0)] * len(people)
        for n, walker in self._walkers.items():
            self.positions[n] = walker.place
        self._place_crowd()
        self._places: FloatArray | None = None

    def walk(
        self, period: float, robots: Robots, closed_doors: Mapping[str, bool] | None = None,
        touched: Mapping[str, float] = NOBODY,
    ) -> bool:  # fmt: skip
        """Advance everyone by `period` seconds; return whether anyone moved.

        Args:
            period: seconds.
            robots: pose and circumscribed radius of each robot.
            closed_doors: whether each door is closed.
            touched: by name, the depth by which a robot and a person overlap whom it touches,
                metres.
        """
        names = self._names
        moved = False
        for n, walker in self._walkers.items():
            if walker.walk(period, robots, touch=touched.get(names[n])):
                self.positions[n] = walker.place
                moved = True
        if self._crowd is not None:
            touches = [touched.get(names[n]) for n in self._by_force]
            self._crowd.walk(period, robots, closed_doors or {}, touches)
            self._place_crowd()
            moved = True
        if moved:
            self._places = None
        return moved

    @property
    def places(self) -> FloatArray:
        """(n, 3) x, y and radius of each person who is there, world frame, metres."""
        if self._places is None:
            everyone = self.all_places
            self._places = everyone[~np.isnan(everyone[:, 0])]
        return self._places

    @property
    def all_places(self) -> FloatArray:
        """(n, 3) as `places`, of everyone in the order of the world; nan: not there."""
        everyone: FloatArray = np.empty((len(self.positions), 3))
        everyone[:, :2] = self.positions or np.empty((0, 2))
        everyone[:, 2] = self._radii
        return everyone

    def _place_crowd(self) -> None:
        """Copy the positions of those who walk by social forces."""
        if self._crowd is not None:
            for n, place in zip(self._by_force, self._crowd.places.tolist(), strict=True):
                self.positions[n] = (place[0], place[1])

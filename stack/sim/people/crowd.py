"""All people of a world, each moved by their own model."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from stack.compilation import KernelTypes
from stack.sim.people.loops import Robots, Walker
from stack.sim.people.recorded import RecordedWalker
from stack.sim.people.social_force import SocialForcePeople
from stack.sim.worlds.world import World
from stack.streams import stream
from stack.types import FloatArray

NOWHERE = (float("nan"), float("nan"))
"""Position of a recorded person whose track has not begun or has ended."""


class People:
    """All people of a world, in the order of the world file."""

    @staticmethod
    def kernels(world: World) -> KernelTypes:
        """Return the kernels that the people of a world call."""
        if all(person.model != "social_force" for person in world.people):
            return ()
        from stack.sim.people.kernels import KERNELS  # imports numba

        return KERNELS

    def __init__(self, world: World, seed: int) -> None:
        """Place everyone where they are at time 0.

        Args:
            world: with the people and the walls between them.
            seed: of what people do by chance, and of when recordings begin.
        """
        people = world.people
        self._names = [person.name for person in people]
        self._radii = np.array([person.radius for person in people])
        self.positions = [NOWHERE] * len(people)
        of = {
            model: [n for n, person in enumerate(people) if person.model == model]
            for model in ("loop", "social_force", "recorded")
        }
        self._loops = {n: Walker(people[n]) for n in of["loop"]}
        self._by_force = of["social_force"]
        self._crowd = None
        if self._by_force:
            self._crowd = SocialForcePeople([people[n] for n in self._by_force], world, seed)
        shift = float(stream(seed, "recorded people").random())
        self._recorded = {
            n: RecordedWalker(people[n], shift * people[n].recorded_duration)
            for n in of["recorded"]
        }
        self._place()

    def walk(
        self, period: float, robots: Robots, closed_doors: Mapping[str, bool] | None = None,
        touched: Collection[str] = (),
    ) -> bool:  # fmt: skip
        """Advance everyone by `period` seconds; return whether anyone moved.

        Args:
            period: seconds.
            robots: pose and circumscribed radius of each robot.
            closed_doors: whether each door is closed.
            touched: names of the people whom a robot touches.
        """
        names = self._names
        moved = [
            walker.walk(period, robots, touches=names[n] in touched)
            for n, walker in self._loops.items()
        ]
        moved += [
            walker.walk(period, touches=names[n] in touched) for n, walker in self._recorded.items()
        ]
        if self._crowd is not None:
            touches = [names[n] in touched for n in self._by_force]
            self._crowd.walk(period, robots, closed_doors or {}, touches)
            moved.append(True)
        if any(moved):
            self._place()
        return any(moved)

    @property
    def places(self) -> FloatArray:
        """(n, 3) x, y and radius of each person who is there, world frame, metres."""
        return self._places

    @property
    def all_places(self) -> FloatArray:
        """(n, 3) as `places`, of everyone in the order of the world; nan: not there."""
        return self._all_places

    def _place(self) -> None:
        positions = self.positions
        for n, walker in self._loops.items():
            positions[n] = (walker.x, walker.y)
        for n, recorded in self._recorded.items():
            positions[n] = (recorded.x, recorded.y) if recorded.is_present else NOWHERE
        if self._crowd is not None:
            for n, place in zip(self._by_force, self._crowd.places.tolist(), strict=True):
                positions[n] = (place[0], place[1])
        rows = np.column_stack([np.array(positions).reshape(-1, 2), self._radii])
        self._all_places: FloatArray = np.ascontiguousarray(rows, dtype=np.float64)
        self._places: FloatArray = rows[~np.isnan(rows[:, 0])] if self._recorded else rows

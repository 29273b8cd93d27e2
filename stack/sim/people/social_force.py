"""People who walk to goals and keep a distance to each other, to walls and to robots.

The social force model of D. Helbing and P. Molnár, "Social force model for pedestrian dynamics",
Physical Review E 51 (1995), with its parameters. Ways round walls come from the walking times of a
floor, since forces alone do not lead through doors. Who has something in front steps aside, as in
M. Moussaïd et al., "Experimental study of the behavioural mechanisms underlying self-organization
in human crowds", Proceedings of the Royal Society B 276 (2009), and walks slower towards a robot
to keep a time to the collision, as in M. Moussaïd, D. Helbing and G. Theraulaz, "How simple rules
determine pedestrian behavior and crowd disasters", PNAS 108 (2011).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence

import numpy as np

from stack.sim.people.bumps import Bump
from stack.sim.people.floor import Floor
from stack.sim.people.impatience import Impatience
from stack.sim.people.loops import Robots
from stack.sim.worlds.world import Door, Person, World
from stack.streams import stream
from stack.types import FloatArray

RELAXATION_TIME = 0.5
"""Seconds in which a person gets up to the wanted speed (Helbing and Molnár: 0.5 s)."""

STRIDE_TIME = 2.0
"""Seconds of the others' walk that people foresee (Helbing and Molnár: 2 s)."""

PEOPLE = (2.1, 0.3)
"""Strength, m²/s², and range, metres, of the repulsion among people (Helbing and Molnár)."""

WALLS = (10.0, 0.2)
"""The same at walls (Helbing and Molnár)."""

OUT_OF_SIGHT = 0.5
"""Weight of what is out of the field of view of 200 degrees (Helbing and Molnár)."""

SPEED_FACTOR = 1.3
"""Times the wanted speed: the highest speed (Helbing and Molnár)."""

SIDESTEP = 1.0
"""Share of the repulsion against the wanted direction that also acts to the side."""

HEADWAY = 0.5
"""Seconds to a robot that people who watch it keep by walking slower (Moussaïd et al. 2011)."""

GROUP_PULL, GROUP_DISTANCE = 1.0, 0.8
"""m/s² towards the centre of one's group, and metres from it at which that begins."""

ARRIVAL = 0.35
"""Metres to a waypoint at which it counts as reached."""

LOOK_AHEAD = 8
"""Cells of the floor along the way to the point at which people look."""

SPELL = 4.0
"""Seconds for which a person goes on watching the robots, or not watching them."""

REACTION_TIME = 0.3
"""Seconds after which people react to what a robot does."""

NOISE = 0.1
"""Standard deviation of a random acceleration, m/s²: it ends ties between equals."""


class SocialForcePeople:
    """The people of a world whose model is `social_force`, moved together.

    Attributes:
        places: (n, 2) positions, world frame, metres.
        velocities: (n, 2) m/s.
    """

    def __init__(self, people: Sequence[Person], world: World, seed: int) -> None:
        from stack.sim.people import kernels  # imports numba

        self._kernels = kernels
        self._floor = Floor(world)
        self._panels = {door.name: _panel(door) for door in world.doors}
        self._pauses = np.array([person.pause for person in people])
        self._pause_left: FloatArray = np.zeros(len(people))
        self._attention = np.array([person.attention for person in people])
        self._spell_left: FloatArray = np.zeros(len(people))
        self._bumps = [Bump() for _ in people]
        self._radii = np.array([person.radius for person in people])
        self._speeds = np.array([person.speed for person in people])
        names = sorted({person.group for person in people if person.group})
        numbers = [names.index(person.group) if person.group else -1 for person in people]
        self._groups = np.array(numbers, dtype=np.int64)
        self._random = stream(seed, "people by social forces")
        self._impatience = Impatience(len(people), stream(seed, "impatience of people"))
        self._notices = np.ones(len(people), dtype=np.bool_)
        self._seen: deque[FloatArray] = deque(maxlen=1)
        self._last: list[tuple[float, float]] = []
        self._plan_ways(people)
        self.places: FloatArray = np.array(
            [person.waypoints[_first(person)].tolist() for person in people], dtype=np.float64
        )
        self.velocities: FloatArray = np.zeros_like(self.places)
        self._waypoint = np.array([_first(person) + 1 for person in people]) % self._counts
        self._model = np.array([
            RELAXATION_TIME, STRIDE_TIME, *PEOPLE, *WALLS, OUT_OF_SIGHT, kernels.VIEW, GROUP_PULL,
            GROUP_DISTANCE, SIDESTEP,
        ])  # fmt: skip

    def walk(
        self, period: float, robots: Robots, closed_doors: Mapping[str, bool],
        touched: Sequence[float | None],
    ) -> None:  # fmt: skip
        """Advance everyone by `period` seconds.

        Args:
            period: seconds.
            robots: pose and circumscribed radius of each.
            closed_doors: whether each door of the world is closed.
            touched: for each person the depth by which a robot and they overlap, metres; None: no
                touch.
        """
        seen = self._robots_seen(robots, period)
        self._attend(period, touched)
        floor, wanted = self._floor, self._wanted(period)
        moved = self._kernels.accelerations(
            self.places, self.velocities, wanted, self._radii, self._groups, seen, self._notices,
            floor.distance, floor.resolution, *floor.origin, self._model,
            self._impatience.wall_weights,
        )  # fmt: skip
        moved += self._random.normal(0.0, NOISE, moved.shape)
        self.velocities += moved * period
        self._limit_speeds(SPEED_FACTOR)
        self._stop_at_touch(period, robots, touched)
        self._slow_down(seen)
        before = self.places.copy()
        self.places += self.velocities * period
        self._kernels.separate(
            self.places, self._radii, seen, self._notices, self._doors(closed_doors),
            floor.distance, floor.resolution, *floor.origin,
        )  # fmt: skip
        self.velocities = (self.places - before) / period
        self._limit_speeds(SPEED_FACTOR)
        self._impatience.update(period, wanted, self.velocities)

    def _plan_ways(self, people: Sequence[Person]) -> None:
        """Compute the walking times to each different waypoint."""
        radius = float(self._radii.max())
        listed = [tuple(point) for person in people for point in person.waypoints.tolist()]
        goals = sorted(set(listed))
        self._goals: FloatArray = np.array(goals)
        self._times = np.stack([self._floor.times_to(x, y, radius) for x, y in goals])
        self._counts = np.array([len(person.waypoints) for person in people])
        self._goal_numbers = np.zeros((len(people), self._counts.max()), dtype=np.int64)
        for i, person in enumerate(people):
            own = [goals.index(tuple(point)) for point in person.waypoints.tolist()]
            self._goal_numbers[i, : len(own)] = own

    def _wanted(self, period: float) -> FloatArray:
        """Return the velocity that each would have if alone; go on to the next waypoint."""
        everyone = np.arange(len(self._counts))
        current = self._goals[self._goal_numbers[everyone, self._waypoint]]
        near = np.hypot(*(current - self.places).T) < ARRIVAL
        resting = self._pause_left > 0.0
        self._pause_left[resting] -= period
        begins = near & ~resting & (self._counts > 1)
        self._pause_left[begins] = self._pauses[begins]
        goes_on = (resting | begins) & (self._pause_left <= 0.0)
        self._waypoint = np.where(goes_on, self._waypoint + 1, self._waypoint) % self._counts
        stands = (near & (self._counts == 1)) | (self._pause_left > 0.0)
        towards = (self._waypoint - self._impatience.turns_back) % self._counts
        floor, numbers = self._floor, self._goal_numbers[everyone, towards]
        wanted: FloatArray = self._kernels.directions(
            self._times, numbers, floor.resolution, *floor.origin, self._goals, self.places,
            LOOK_AHEAD,
        )  # fmt: skip
        wanted *= np.where(stands, 0.0, self._speeds)[:, None]
        return wanted

    def _attend(self, period: float, touched: Sequence[float | None]) -> None:
        """Decide who watches the robots: for spells, with each person's probability."""
        self._spell_left -= period
        over = self._spell_left <= 0.0
        if over.any():
            self._notices[over] = self._random.random(int(over.sum())) < self._attention[over]
            self._spell_left[over] = SPELL
        touching = np.array([touch is not None for touch in touched])
        if touching.any():  # nobody overlooks what they bump into
            self._notices[touching] = True
            self._spell_left[touching] = SPELL

    def _robots_seen(self, robots: Robots, period: float) -> FloatArray:
        """Return the robots as the people see them, a reaction time late: (r, 5)."""
        places = [(pose.x, pose.y) for pose, _ in robots]
        last = self._last if len(self._last) == len(places) else places
        rows = [
            (x, y, radius, (x - u) / period, (y - v) / period)
            for (x, y), (u, v), (_, radius) in zip(places, last, robots, strict=True)
        ]
        self._last = places
        now: FloatArray = np.array(rows, dtype=np.float64).reshape(-1, 5)
        length = round(REACTION_TIME / period) + 1
        if self._seen.maxlen != length:
            self._seen = deque(self._seen, maxlen=length)
        self._seen.append(now)
        late = self._seen[0]
        return late if late.shape == now.shape else now

    def _slow_down(self, robots: FloatArray) -> None:
        """Limit the speed towards watched robots: nobody walks or is pushed into one."""
        for x, y, radius, _, _ in robots:
            away = self.places - (x, y)
            distance = np.maximum(np.hypot(*away.T), 1e-9)
            away /= distance[:, None]
            nearing = -(self.velocities * away).sum(axis=1)
            allowed = np.maximum(distance - self._radii - radius, 0.0) / HEADWAY
            excess = np.where(self._notices, np.maximum(nearing - allowed, 0.0), 0.0)
            self.velocities += excess[:, None] * away

    def _stop_at_touch(
        self, period: float, robots: Robots, touched: Sequence[float | None]
    ) -> None:
        """Stop those who touch a robot; who presses it against something steps back from it."""
        shares = np.array([
            bump.share(period, touch) for bump, touch in zip(self._bumps, touched, strict=True)
        ])  # fmt: skip
        self._limit_speeds(np.where(shares < 1.0, np.maximum(shares, 0.0), SPEED_FACTOR))
        for i in np.flatnonzero(shares < 0.0):
            away = min((self.places[i] - (pose.x, pose.y) for pose, _ in robots), key=_length)
            self.velocities[i] = -shares[i] * self._speeds[i] * away / max(_length(away), 1e-9)

    def _limit_speeds(self, factor: float | FloatArray) -> None:
        """Limit the speeds to a factor of those that each wants."""
        speeds, limit = np.hypot(*self.velocities.T), factor * self._speeds
        self.velocities *= np.minimum(1.0, limit / np.maximum(speeds, 1e-9))[:, None]

    def _doors(self, closed: Mapping[str, bool]) -> FloatArray:
        rows = [panel for name, panel in self._panels.items() if closed.get(name)]
        return np.array(rows, dtype=np.float64).reshape(-1, 5)


def _length(vector: FloatArray) -> float:
    return float(np.hypot(*vector))


def _panel(door: Door) -> tuple[float, ...]:
    """Return the ends and half the thickness of a door."""
    return (*door.start, *door.end, door.thickness / 2.0)


def _first(person: Person) -> int:
    """Return the number of the waypoint at which a person begins."""
    return int(person.start * len(person.waypoints))

"""The missions of the episodes of an environment: one mission, or drives that are drawn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from math import pi
from pathlib import Path
from typing import Any

import numpy as np

from missions.execution.prepare import PreparedMission, RunOptions, diagnose, prepare
from missions.execution.resources import load_robot, load_world
from missions.language.reading.words import Draft
from stack.errors import InputError
from stack.geometry.distance_transform import distances_to_zero
from stack.sim.worlds.rasterise import RESOLUTION, covered_cells, rasterise
from stack.streams import stream
from stack.types import FloatArray, Pose2D

PLANS = 32
"""Prepared missions that an environment keeps."""

NEAREST = 1.0
"""Metres between start and goal of a drive that is drawn, at least, where there is room."""

MARGIN = 0.1
"""Metres between a robot and obstacles at starts and goals that are drawn, at least."""

ROBOT = "scout"
"""Robot of drives that are drawn, unless one is given."""

DRIVE = Path("drive.yaml")
"""Name in messages of the mission that has no file."""

OPTIONS = ("arguments", "start")
"""What an episode can have of its own."""


class Scenes:
    """Prepares the missions of episodes.

    Args:
        mission: file or name; None: drives between places that are drawn.
        options: of all episodes, without their seeds.

    Raises:
        InputError: there is neither a mission nor a world, or the mission has errors.
    """

    def __init__(self, mission: str | Path | None, options: RunOptions) -> None:
        if mission is None and not options.world:
            raise InputError(
                'an environment needs a mission or a world: MissionEnv("01_drive_to_a_point"), or '
                'MissionEnv(world="small_room", robot="scout")'
            )
        self._mission, self._options = mission, options
        self._plans = lru_cache(PLANS)(self._plan)
        self._places: FloatArray | None = None

    @property
    def first(self) -> RunOptions:
        """Options of the first episode, as far as they are known before it."""
        return self.options(0, {})

    def options(self, seed: int, given: Mapping[str, Any]) -> RunOptions:
        """Return the options of an episode.

        Args:
            seed: of the episode.
            given: `arguments` and `start` of the episode.

        Raises:
            InputError: unknown keys in `given`, or a start that is no text.
        """
        unknown = [key for key in given if key not in OPTIONS]
        if unknown:
            raise InputError(
                f"options: there is no {unknown[0]!r}; expected {' or '.join(OPTIONS)}"
            )
        common = self._options
        arguments = {**(common.arguments or {}), **given.get("arguments", {})}
        start = given.get("start", common.start)
        if not isinstance(start, str | None):
            raise InputError(
                f"options: start: expected a place or 'x,y,heading', got {start!r:.80}"
            )
        if self._mission is None:
            start, goal = self._drawn(seed, start)
            arguments.setdefault("goal", goal)
        return replace(common, seed=seed, arguments=arguments, start=start)

    def prepared(self, options: RunOptions) -> PreparedMission:
        """Return the checked mission of an episode; the newest ones are kept.

        Raises:
            InputError: it has errors.
        """
        return self._plans(tuple(sorted((options.arguments or {}).items())), options.start)

    def _plan(self, arguments: tuple[tuple[str, str], ...], start: str | None) -> PreparedMission:
        options = replace(self._options, arguments=dict(arguments), start=start)
        if self._mission is not None:
            return prepare(self._mission, options)
        text = _DRIVE_TEXT.format(robot=options.robot or ROBOT, world=options.world)
        diagnosis = diagnose(DRIVE, options, Draft(text))
        if diagnosis.plan is None:
            raise InputError(diagnosis.findings)
        return diagnosis.plan

    def _drawn(self, seed: int, start: str | None) -> tuple[str, str]:
        """Return a start, unless one is given, and a goal, both where the robot has room."""
        if self._places is None:
            self._places = self._free_places()
        rng, places = stream(seed, "episode"), self._places
        first = rng.choice(places)
        begin = _text(first, rng.uniform(-pi, pi))
        far = places[np.hypot(*(places - first).T) >= NEAREST]
        goal = _text(rng.choice(far if len(far) else places), rng.uniform(-pi, pi))
        return start or begin, f"[{goal}]"

    def _free_places(self) -> FloatArray:
        """Return (n, 2) positions, world frame, between which the robot can drive."""
        import cv2

        named, here = self._options, Path.cwd()
        world = load_world(named.world or "", here)
        radius = load_robot(named.robot or ROBOT, here).footprint.circumscribed_radius
        grid = rasterise(world)
        free = grid.free & ~covered_cells(world, RESOLUTION)
        room = distances_to_zero(free) * RESOLUTION > radius + MARGIN
        _, labels = cv2.connectedComponents(room.astype(np.uint8), connectivity=4)
        at_start = grid.cell_at(world.start.x, world.start.y)
        rows, columns = np.nonzero(room & (labels == labels[at_start]))
        if not len(rows):
            raise InputError(
                f"{world.name}: {named.robot or ROBOT} has no room to drive around the start"
            )
        middles = (np.column_stack([columns, rows]) + 0.5) * RESOLUTION
        return np.asarray(middles + np.array(grid.origin[:2]))


def _text(place: FloatArray, heading: float) -> str:
    pose = Pose2D(float(place[0]), float(place[1]), heading)
    return f"{pose.x:.2f},{pose.y:.2f},{pose.heading:.2f}"


_DRIVE_TEXT = """\
mission: drive to a goal
robot: {robot}
world: {world}
arguments:
  goal: {{type: Pose, default: [0, 0, 0]}}
run:
  navigate_to_pose: {{goal: $goal}}
"""

"""Random scenes on a bench for missions of an arm, and where their blocks belong."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import cos, degrees, pi, sin
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from stack.body import BlockPose
from stack.geometry.polygons import distances_to_edges, points_inside
from stack.streams import stream
from stack.types import FloatArray

ROOT = Path(__file__).parents[2] / "missions"

AREA = ((0.38, 0.68), (-0.42, 0.22))
"""Of the centres of blocks, x and y, metres: in view of the mast, in reach, beside the tray."""

GAP = 0.01
"""Metres between two blocks at least, and between the red one and its neighbours."""

BETWEEN = ((0.38, 0.68), (-0.24, 0.24))
"""Between two trays."""

APART = 0.03
"""Metres between two blocks if all are handled: two of one colour are then seen as two."""

BENCH, TRAY = 0.60, 0.62
"""Heights of their tops, metres."""

LIGHTS = ("dim", "bright", "shadow")

MOST_OTHERS = 5

SIZES = ((0.05, 0.05, 0.05), (0.04, 0.04, 0.08), (0.08, 0.03, 0.04))
"""Of blocks, metres."""

COLOURS = {
    "red": [0.8, 0.1, 0.1], "yellow": [0.85, 0.75, 0.1], "green": [0.1, 0.6, 0.2],
    "blue": [0.1, 0.25, 0.75],
}  # fmt: skip


@dataclass(frozen=True)
class Standing:
    """A block on the bench: x, y and heading, and its size, metres and radians."""

    x: float
    y: float
    heading: float
    size: tuple[float, float, float]

    @property
    def corners(self) -> FloatArray:
        """(4, 2) of its outline."""
        half = np.array(self.size[:2]) / 2.0
        local = half * [(1, 1), (-1, 1), (-1, -1), (1, -1)]
        c, s = cos(self.heading), sin(self.heading)
        return local @ np.array([[c, s], [-s, c]]) + (self.x, self.y)

    def gap(self, other: Standing) -> float:
        """Return the distance between two outlines, metres; 0 if they overlap."""
        mine, others = self.corners, other.corners
        if points_inside(mine, others).any() or points_inside(others, mine).any():
            return 0.0
        distances = distances_to_edges(mine, others), distances_to_edges(others, mine)
        return float(min(found.min() for found in distances))

    def entry(self, name: str, colour: str) -> dict[str, Any]:
        """Return it as a world file has it."""
        at = [round(self.x, 4), round(self.y, 4), f"{degrees(self.heading):.2f} deg"]
        return {"name": name, "at": at, "size": list(self.size), "elevation": BENCH,
                "colour": COLOURS[colour]}  # fmt: skip


@dataclass(frozen=True)
class Scene:
    """A world with a mission, and what its end must be.

    Attributes:
        mission: file.
        world: content of the world file.
        about: what is special, for the table.
        handled: numbers of the blocks that the arm shall move.
        error: of the blocks at the end: largest distance from where one belongs, metres; infinite
            if one is somewhere else.
    """

    mission: Path
    world: dict[str, Any]
    about: str
    handled: frozenset[int]
    error: Callable[[Sequence[BlockPose]], float]


def pick(seed: int) -> Scene:
    """Mission 50: a red block among up to five others, in dim, bright or uneven light."""
    draw = stream(seed, "picking")
    count, light = seed % (MOST_OTHERS + 1), LIGHTS[seed // (MOST_OTHERS + 1) % len(LIGHTS)]
    red = _anywhere(draw, [], SIZES[0])
    blocks = [red, *_neighbours(draw, red, count // 2)][: count + 1]
    while len(blocks) <= count:
        blocks.append(_anywhere(draw, blocks, _size(draw)))
    names = ["red", *(str(draw.choice(("yellow", "green", "blue"))) for _ in blocks[1:])]
    world = _bench(blocks, names) | _light(draw, light, red)
    tray = np.array([0.55, 0.40, TRAY + red.size[2] / 2.0])

    def error(found: Sequence[BlockPose]) -> float:
        return _distance(found[0], tray)

    about = f"{count} others, {light}"
    return Scene(ROOT / "50_pick_the_red_block.yaml", world, about, frozenset({0}), error)


def sort(seed: int) -> Scene:
    """Mission 51: three red and three green blocks between two trays."""
    draw = stream(seed, "sorting")
    blocks: list[Standing] = []
    for _ in range(6):
        blocks.append(_anywhere(draw, blocks, _size(draw), BETWEEN, APART))
    world = _bench(blocks, ["red"] * 3 + ["green"] * 3, "bench_two_trays")
    trays = [box for box in world["boxes"] if box["name"].endswith("tray")]

    def error(found: Sequence[BlockPose]) -> float:
        tray = [box for box in trays for _ in range(3)]
        on = all(map(_is_on, found, tray, (block.size[2] for block in blocks)))
        return 0.0 if on else float("inf")

    about = "6 blocks, 2 trays"
    return Scene(ROOT / "51_sort_by_colour.yaml", world, about, frozenset(range(6)), error)


def stack(seed: int) -> Scene:
    """Mission 52: green on red, and blue on green; their sizes are random."""
    draw = stream(seed, "stacking")
    blocks: list[Standing] = []
    for _ in range(3):
        blocks.append(_anywhere(draw, blocks, _size(draw), apart=APART))
    heights = [block.size[2] for block in blocks]

    def error(found: Sequence[BlockPose]) -> float:
        red = found[0].position
        places = [(*red[:2], BENCH + sum(heights[:n]) + heights[n] / 2.0) for n in range(3)]
        return max(map(_distance, found, map(np.array, places)))

    world = _bench(blocks, ["red", "green", "blue"])
    about = "heights " + ", ".join(f"{100.0 * height:.0f}" for height in heights) + " cm"
    return Scene(ROOT / "52_stack_three.yaml", world, about, frozenset(range(3)), error)


SCENES: dict[str, Callable[[int], Scene]] = {"pick": pick, "sort": sort, "stack": stack}


def _bench(
    blocks: Sequence[Standing], colours: Sequence[str], name: str = "bench_top"
) -> dict[str, Any]:
    """Return a shipped bench with other blocks."""
    world: dict[str, Any] = yaml.safe_load((ROOT / "worlds" / f"{name}.yaml").read_text("utf-8"))
    entries = [
        block.entry(f"{colour} block {number}", colour)
        for number, (block, colour) in enumerate(zip(blocks, colours, strict=True))
    ]
    return world | {"blocks": entries}


def _light(draw: np.random.Generator, light: str, red: Standing) -> dict[str, Any]:
    if light != "shadow":
        return {"light": {"dim": 0.35, "bright": 1.5}[light]}
    edge = round(red.x + draw.uniform(-0.02, 0.02), 3)  # it crosses the red block
    return {"shadows": [{"from": [edge, -1.0], "to": [1.2, 1.0], "light": 0.4}]}


def _size(draw: np.random.Generator) -> tuple[float, float, float]:
    return SIZES[int(draw.integers(len(SIZES)))]


def _anywhere(
    draw: np.random.Generator, others: Sequence[Standing], size: tuple[float, float, float],
    area: Sequence[tuple[float, float]] = AREA, apart: float = GAP,
) -> Standing:  # fmt: skip
    """Return a block at a random place with gaps to the others."""
    while True:
        x, y = (draw.uniform(*side) for side in area)
        block = Standing(x, y, draw.uniform(-pi, pi), size)
        if all(block.gap(other) >= apart for other in others):
            return block


def _neighbours(draw: np.random.Generator, red: Standing, count: int) -> list[Standing]:
    """Return up to two blocks along opposite sides of the red one."""
    found = []
    turned = red.heading + draw.choice([0.0, pi / 2.0])
    for side in (0.0, pi)[:count]:
        size = _size(draw)
        away = red.size[0] / 2.0 + GAP + size[0] / 2.0
        way = turned + side
        found.append(Standing(red.x + away * cos(way), red.y + away * sin(way), turned, size))
    return found


def _distance(block: BlockPose, place: FloatArray) -> float:
    """Return the horizontal distance of a block; infinite if its height is another one."""
    off = np.subtract(block.position, place)
    return float(np.hypot(*off[:2])) if abs(off[2]) < 0.003 else float("inf")


def _is_on(block: BlockPose, tray: dict[str, Any], height: float) -> bool:
    """Whether the middle of a block is over a tray, and as high as if it stood on it."""
    off = np.subtract(block.position, (*tray["at"], TRAY + height / 2.0))
    return bool(abs(off[2]) < 0.003 and (np.abs(off[:2]) < np.array(tray["size"][:2]) / 2.0).all())

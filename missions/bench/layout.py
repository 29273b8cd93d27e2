"""Generated worlds of a benchmark: obstacles in a local frame, written as world files."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import degrees
from pathlib import Path
from typing import Any

from missions.bench.generation.floor_plan import world_text
from missions.bench.goal_runs import GOAL, Case
from missions.execution.resources import load_world
from stack.documents.files import YAML_BYTES, read_bytes
from stack.errors import InputError
from stack.mapping.whole_files import replace_file
from stack.types import Pose2D

Point = tuple[float, float]


@dataclass
class Layout:
    """Obstacles, start and goal in a local frame, metres.

    Attributes:
        walls: centrelines as polylines, and whether they are closed.
        posts: x, y, radius; hidden posts are not on the map.
        crates: pose of the centre, length and width; hidden crates are not on the map.
        walkers: entries for the world file's `people`, in the world frame.
        thickness: thickness of the walls.
    """

    start: Pose2D
    goal: Pose2D
    walls: list[tuple[list[Point], bool]] = field(default_factory=list)
    posts: list[tuple[float, float, float]] = field(default_factory=list)
    crates: list[tuple[Pose2D, float, float]] = field(default_factory=list)
    hidden_posts: list[tuple[float, float, float]] = field(default_factory=list)
    hidden_crates: list[tuple[Pose2D, float, float]] = field(default_factory=list)
    walkers: list[dict[str, Any]] = field(default_factory=list)
    thickness: float = 0.1

    def mirrored(self) -> Layout:
        """Return the layout mirrored left to right, walkers excepted."""

        def flip(pose: Pose2D) -> Pose2D:
            return Pose2D(pose.x, -pose.y, -pose.heading)

        return Layout(
            flip(self.start), flip(self.goal),
            [([(x, -y) for x, y in points], closed) for points, closed in self.walls],
            [(x, -y, radius) for x, y, radius in self.posts],
            [(flip(pose), long, wide) for pose, long, wide in self.crates],
            [(x, -y, radius) for x, y, radius in self.hidden_posts],
            [(flip(pose), long, wide) for pose, long, wide in self.hidden_crates],
            self.walkers, self.thickness,
        )  # fmt: skip

    def text(self, name: str, doc: str, at: Pose2D = Pose2D(0.0, 0.0)) -> str:
        """Return the world file, with the layout's frame at a pose of the world."""
        document: dict[str, Any] = {
            "world": name,
            "format": 1,
            "doc": doc,
            "start": _pose(at.compose(self.start)),
            "places": {GOAL: _pose(at.compose(self.goal))},
            "walls": [
                {
                    "points": [_point(at, *point) for point in points],
                    "closed": closed, "thickness": self.thickness,
                }
                for points, closed in self.walls
            ],
            "boxes": _crates(at, self.crates, True) + _crates(at, self.hidden_crates, False),
            "cylinders": _posts(at, self.posts, True) + _posts(at, self.hidden_posts, False),
            "people": self.walkers,
        }  # fmt: skip
        return world_text(document)


def write_world(text: str, name: str, file: Path) -> Case:
    """Write a world file if it does not exist, and return its case.

    Raises:
        InputError: the file has other content, so existing results are of another world.
    """
    if not file.exists():
        file.parent.mkdir(parents=True, exist_ok=True)
        replace_file(file, text.encode())
    elif read_bytes(file, YAML_BYTES) != text.encode():
        raise InputError(f"{file} differs from the generated world; choose another --out")
    return Case(name, load_world(str(file.resolve()), file.parent), file)


def _posts(at: Pose2D, posts: list[tuple[float, float, float]], shown: bool) -> list[Any]:
    return [
        {"at": _point(at, x, y), "radius": round(radius, 4), "on_map": shown}
        for x, y, radius in posts
    ]


def _crates(at: Pose2D, crates: list[tuple[Pose2D, float, float]], shown: bool) -> list[Any]:
    return [
        {
            "at": _pose(at.compose(pose)),
            "size": [round(length, 4), round(width, 4), 1.0], "on_map": shown,
        }
        for pose, length, width in crates
    ]  # fmt: skip


def _point(at: Pose2D, x: float, y: float) -> list[float]:
    moved = at.compose(Pose2D(x, y))
    return [round(moved.x, 4), round(moved.y, 4)]


def _pose(pose: Pose2D) -> list[Any]:
    return [round(pose.x, 4), round(pose.y, 4), f"{degrees(pose.heading):.3f} deg"]

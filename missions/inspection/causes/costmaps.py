"""Causes in the costmaps: full of obstacles, without those that are there, or a goal in one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from missions.inspection.causes.cause import CERTAIN, LEAST, Cause, Fact, share
from missions.inspection.causes.evidence import Evidence
from missions.inspection.page.blockers import AT_PERSON, people_in
from stack.costmap.layer import Frame, sampled
from stack.geometry.connected import connected_to
from stack.geometry.distance_transform import distances_to_zero
from stack.telemetry.records import Snapshot
from stack.types import (
    FREE_COST,
    INSCRIBED_COST,
    LETHAL_COST,
    UNKNOWN,
    UNKNOWN_COST,
    CostGrid,
    FailureCode,
    FloatArray,
    Pose2D,
)
from stack.types.limitations import OBSTACLE

AROUND = 1.0
"""Metres around the robot that are looked at."""

ROOM = 2.0
"""Square metres that a robot can reach which is not enclosed."""

AHEAD = 1.5
"""Metres of the path before the robot in which something on it matters."""

NEAR = 0.15
"""Metres within which a costmap marks what it knows: its cells, and the error of the pose."""

PLANNED = frozenset({FailureCode.START_OCCUPIED, FailureCode.NO_VALID_PATH})
"""Failures that a full costmap can cause."""


def costmap_full(evidence: Evidence) -> Cause | None:
    """The costmap leaves the robot no room: it stands in an obstacle, or is enclosed."""
    grid, shot = evidence.costmap("global_costmap"), evidence.before
    if grid is None or evidence.code not in PLANNED:
        return None
    area = reachable_area(grid, shot.pose)
    certain = evidence.code == FailureCode.START_OCCUPIED
    strength = CERTAIN * evidence.trust * (1.0 if certain else 1.0 - share(area, ROOM))
    lethal = _within(grid, shot.pose, AROUND) & (grid.cells == LETHAL_COST)
    unmapped = int((lethal & ~_mapped(evidence, grid)).sum()) * grid.resolution**2
    here = shot.pose.x, shot.pose.y
    facts = (
        Fact(f"{area:.2f} m² can be reached from the robot", evidence.end, here),
        Fact(f"{lethal.sum() * grid.resolution**2:.2f} m² within {AROUND:g} m are occupied, "
             f"{unmapped:.2f} m² of them not on the map"),
    )  # fmt: skip
    return Cause(
        "costmap full", strength,
        f"the costmap leaves no room to drive at {evidence.landmarks.where(here)}", facts,
        "look at the costmap with `treepilot replay`; recover with clear_costmap or "
        "free_space_escape, and check the mounts of the sensors and the initial pose",
    )  # fmt: skip


def costmap_empty(evidence: Evidence) -> Cause | None:
    """What the robot touched, or what stands on its path, is in no costmap."""
    met = _touched(evidence) or _on_path(evidence) or _stopped_by(evidence)
    unknown = [fact for fact in met if fact.at is not None and not _is_marked(evidence, fact.at)]
    if not unknown:
        return None
    layers = ", ".join(evidence.facts.layers)
    facts = (
        unknown[0],
        Fact(f"no costmap has an obstacle within {NEAR:g} m of what the robot met, "
             f"{len(unknown)} of {len(met)} times", unknown[-1].time, unknown[-1].at),
        *([Fact(f"layers: {layers}")] if layers else []),
    )  # fmt: skip
    return Cause(
        "costmap empty", CERTAIN * evidence.trust * share(len(unknown), len(met)),
        "something that the robot met is in no costmap", facts,
        "add the layers of the sensors that see it (`navigation: {costmap: {layers: …}}`: "
        "obstacle, range, depth), or draw it into the map",
    )  # fmt: skip


def _touched(evidence: Evidence) -> list[Fact]:
    """Return the contacts with things."""
    return [
        Fact(event.text, event.time, _pair(event.fields.get("at")))
        for event in evidence.told("contact", evidence.times[0])
        if not event.fields.get("is_person")
    ]


def _on_path(evidence: Evidence) -> list[Fact]:
    """Return where the path leads through what the lidar sees, while the robot got no further."""
    facts = []
    for shot in evidence.shots[-evidence.stalled :]:
        sure = shot.health >= shot.health_thresholds.good and not shot.rivals
        if not sure or shot.path is None:
            continue
        seen, path = things_seen(shot), shot.path.points[:, :2]
        ahead = path[np.hypot(path[:, 0] - shot.pose.x, path[:, 1] - shot.pose.y) <= AHEAD]
        away = np.hypot(*(seen[:, None, :] - ahead[None, :, :]).T)
        if away.size and float(away.min()) < 0.5 * evidence.inscribed_radius:
            x, y = seen[int(np.unravel_index(int(away.argmin()), away.shape)[1])]
            text = "the path leads through what the lidar sees"
            facts.append(Fact(text, shot.time, (float(x), float(y))))
    return facts


def things_seen(shot: Snapshot) -> FloatArray:
    """Return (n, 2) what the scan shows, map frame, without people: costmaps leave them out."""
    seen = np.empty((0, 2)) if shot.scan is None else shot.pose.transform(shot.scan.points())
    for one in people_in(shot, ()):
        seen = seen[np.hypot(seen[:, 0] - one.x, seen[:, 1] - one.y) > one.radius + AT_PERSON]
    return seen


def _stopped_by(evidence: Evidence) -> list[Fact]:
    """Return the obstacles for which safety stopped the robot where it got no further."""
    return [
        Fact(limitation.text, shot.time, (there.x, there.y))
        for shot in evidence.shots[-evidence.stalled :]
        for limitation in shot.limitations
        if limitation.stands and limitation.cause == OBSTACLE and limitation.at is not None
        for there in (shot.pose.compose(Pose2D(*limitation.at)),)
    ]


def goal_occupied(evidence: Evidence) -> Cause | None:
    """The goal lies in an obstacle."""
    grid, goal = evidence.costmap("global_costmap"), evidence.before.goal
    if evidence.code != FailureCode.GOAL_OCCUPIED or evidence.failed is None:
        return None
    facts = list[Fact]()
    what = "an obstacle"
    if grid is not None and goal is not None:
        near = _within(grid, goal, 2 * NEAR) & (grid.cells >= INSCRIBED_COST)
        mapped = bool((near & _mapped(evidence, grid)).any())
        what = "an obstacle of the map" if mapped else "an obstacle that is not on the map"
        facts.append(Fact(f"{what} is at the goal", evidence.failed.time, (goal.x, goal.y)))
    strength = CERTAIN * max(LEAST, evidence.trust)
    return Cause(
        "goal in an obstacle", strength, f"the goal is in {what}, or too close to it", tuple(facts),
        f"move the goal at {evidence.failed.where}, or accept a pose near it (`accept`)",
    )  # fmt: skip


def reachable_area(grid: CostGrid, pose: Pose2D) -> float:
    """Return the square metres that the centre of a robot can reach from a pose."""
    cell = grid.cell_at(pose.x, pose.y)
    passable = grid.cells < INSCRIBED_COST
    if not grid.contains(*cell):
        return 0.0
    return float(connected_to(passable, [cell]).sum()) * grid.resolution**2


def _within(grid: CostGrid, pose: Pose2D, reach: float) -> NDArray[np.bool_]:
    frame = Frame(grid.cells.shape, grid.resolution, grid.origin)
    x, y = frame.middles(frame.everywhere)
    inside: NDArray[np.bool_] = np.hypot(x - pose.x, y - pose.y) <= reach
    return inside


def ground_of(evidence: Evidence, grid: CostGrid) -> NDArray[np.uint8]:
    """Return (rows, columns) costs of the map alone in the cells of a costmap."""
    ground = np.full(grid.cells.shape, FREE_COST, np.uint8)
    chart = evidence.story.grid
    if chart is None:
        return ground
    frame = Frame(grid.cells.shape, grid.resolution, grid.origin)
    cells = sampled(chart, frame, frame.everywhere, UNKNOWN)
    ground[cells == UNKNOWN] = UNKNOWN_COST
    ground[chart.are_occupied(cells)] = LETHAL_COST
    return ground


def _mapped(evidence: Evidence, grid: CostGrid) -> NDArray[np.bool_]:
    """Cells that are occupied on the map, or beside such a cell."""
    ground = ground_of(evidence, grid) == LETHAL_COST
    beside: NDArray[np.bool_] = distances_to_zero(~ground) <= 2.0
    return beside


def _is_marked(evidence: Evidence, at: tuple[float, float]) -> bool:
    grids = (evidence.costmap("global_costmap"), evidence.costmap("local_costmap"))
    return any(_has_lethal(grid, at) for grid in grids if grid is not None)


def _has_lethal(grid: CostGrid, at: tuple[float, float]) -> bool:
    """Whether a cell within NEAR of a place is lethal."""
    (row, column), reach = grid.cell_at(*at), round(NEAR / grid.resolution)
    top, left = max(row - reach, 0), max(column - reach, 0)
    around = grid.cells[top : max(row + reach + 1, 0), left : max(column + reach + 1, 0)]
    return bool((around == LETHAL_COST).any())


def _pair(raw: object) -> tuple[float, float]:
    x, y = raw if isinstance(raw, list | tuple) and len(raw) == 2 else (np.nan, np.nan)
    return float(x), float(y)


CAUSES = (costmap_full, costmap_empty, goal_occupied)

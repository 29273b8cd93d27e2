"""Where runs fail: a map of each world with the places at which failed runs ended."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from html import escape
from math import floor
from pathlib import Path

import numpy as np

from missions.execution.prepare import prepare
from missions.inspection.page.map_view import WIDTH, MapView
from missions.sweeps.report.results import Results
from missions.sweeps.row import SweepRow
from missions.sweeps.sweep import MISSION, WORLD
from stack.errors import InputError
from stack.types import OccupancyGrid

CELL = 0.5
"""Side of a cell in which failures are counted, metres."""

MOST_WORLDS = 6


def failure_maps(results: Results) -> Iterator[tuple[str, str]]:
    """Yield the name of each world and its map, those with most failures first."""
    failed: dict[tuple[str, ...], list[SweepRow]] = defaultdict(list)
    for row in results.counting:
        if not row.is_success and row.end_x is not None:
            names = (row.settings[name] for name in (MISSION, WORLD) if name in row.settings)
            failed[tuple(Path(name).stem for name in names)].append(row)
    ranked = sorted(failed.items(), key=lambda item: -len(item[1]))
    for names_of, rows in ranked[:MOST_WORLDS]:
        yield ", ".join(names_of), _figure(rows, _grid_of(results, rows[0]))


def _grid_of(results: Results, row: SweepRow) -> OccupancyGrid | None:
    """Return the static obstacles of a run's world; None if it cannot be read any more."""
    from stack.sim.worlds.rasterise import rasterise  # imports OpenCV

    sweep = results.sweep
    try:
        plan = prepare(sweep.mission_of(row.settings), sweep.options(row.settings, row.seed))
    except InputError:
        return None
    return rasterise(plan.world) if plan.recording is None else None


def _figure(rows: Sequence[SweepRow], grid: OccupancyGrid | None) -> str:
    """Return the map; the more runs ended in a cell, the stronger its colour."""
    places = np.array([(row.end_x, row.end_y) for row in rows], dtype=np.float64)
    cells: dict[tuple[int, int], list[SweepRow]] = defaultdict(list)
    for row, (x, y) in zip(rows, places, strict=True):
        cells[floor(x / CELL), floor(y / CELL)].append(row)
    view = MapView(grid, places[:, 0], places[:, 1])
    most = max(map(len, cells.values()))
    parts = [] if grid is None else [view.picture(grid)]
    side = CELL * view.scale
    for (column, line), inside in cells.items():
        x, y = view.pixel(column * CELL, (line + 1) * CELL)
        numbers = ", ".join(str(row.number) for row in inside[:8])
        causes = ", ".join(sorted({row.cause or row.code or row.outcome for row in inside}))
        words = escape(f"{len(inside)} runs ended here: {causes}; {numbers}")
        parts.append(
            f'<rect x="{x:.1f}" y="{y:.1f}" width="{side:.1f}" height="{side:.1f}" class="bad" '
            f'fill-opacity="{0.25 + 0.75 * len(inside) / most:.2f}"><title>{words}</title></rect>'
        )
    return (
        f'<figure class="map"><svg viewBox="0 0 {WIDTH} {view.height:.0f}" role="img" '
        f'aria-label="where runs fail">{"".join(parts)}</svg><figcaption>{len(rows)} runs that did '
        f"not succeed, counted in cells of {CELL:g} m; the strongest colour is {most}"
        "</figcaption></figure>"
    )

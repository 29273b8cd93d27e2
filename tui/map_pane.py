"""The map pane: walls, costs, robot, path, scan, particles, people and places."""

from __future__ import annotations

from collections import deque

import numpy as np
from textual.strip import Strip
from textual.widget import Widget

from stack.telemetry.records import RunInfo, Snapshot
from stack.types import CostGrid, OccupancyGrid
from tui import palette
from tui.canvas import Canvas, View, arrow, circle
from tui.strips import to_strips

TRAIL_LENGTH, TRAIL_SPACING = 4000, 0.05
PAN_SHARE = 0.25


class MapPane(Widget, can_focus=True):
    """Draws the newest snapshot; the background is kept until map, costs, view or size change."""

    BORDER_TITLE = "Map"

    def __init__(self) -> None:
        super().__init__(id="map")
        self.snapshot: Snapshot | None = None
        self.info: RunInfo | None = None
        self.view: View | None = None
        self.following = False
        self.costs_shown = True
        self._ground: Canvas | None = None
        self._ground_key: tuple[object, ...] = ()
        self._strips: list[Strip] = []
        self._trail: deque[tuple[float, float]] = deque(maxlen=TRAIL_LENGTH)

    def show(self, snapshot: Snapshot, info: RunInfo | None) -> None:
        """Draw a snapshot."""
        self.snapshot, self.info = snapshot, info
        pose = snapshot.pose
        if (
            not self._trail
            or np.hypot(pose.x - self._trail[-1][0], pose.y - self._trail[-1][1]) >= TRAIL_SPACING
        ):
            self._trail.append((pose.x, pose.y))
        self._redraw()

    def render_line(self, y: int) -> Strip:
        """One line of the picture."""
        if y < len(self._strips):
            return self._strips[y]
        return Strip.blank(self.size.width)

    def on_resize(self) -> None:
        """Fit the map to the new size unless the operator chose a view."""
        if not self.following:
            self.view = None
        self._redraw()

    def zoom(self, factor: float) -> None:
        """Nearer (above 1) or farther, following the robot once near."""
        if self.view is not None:
            self.view = self.view.zoomed(factor)
            self.following = True
            self._redraw()

    def fit(self) -> None:
        """The whole map again."""
        self.view, self.following = None, False
        self._redraw()

    def pan(self, right: int, up: int) -> None:
        """Move the view by a quarter of the pane."""
        if self.view is not None:
            step_x = self.size.width * 2 * self.view.metres_per_dot * PAN_SHARE
            step_y = self.size.height * 4 * self.view.metres_per_dot * PAN_SHARE
            dot = self.view.metres_per_dot
            self.view = View(self.view.x + right * step_x, self.view.y + up * step_y, dot)
            self.following = False
            self._redraw()

    def _redraw(self) -> None:
        grid = self._grid()
        columns, rows = self.size.width, self.size.height
        if self.snapshot is None or grid is None or columns < 4 or rows < 2:
            self._strips = self._waiting(columns, rows)
            self.refresh()
            return
        self._place_view(grid, columns, rows)
        canvas = self._background(grid, columns, rows).copy()
        self._overlays(canvas, self.snapshot)
        self._strips = to_strips(canvas.glyphs, canvas.foreground, canvas.background)
        self._label()
        self.refresh()

    def _waiting(self, columns: int, rows: int) -> list[Strip]:
        from rich.segment import Segment

        from tui.strips import ink

        text = "waiting for the map" if self.snapshot is None else "this run has no map"
        lines = [Strip.blank(columns)] * (rows // 2)
        return [*lines, Strip([Segment(text.center(columns), ink(palette.DIM, italic=True))])]

    def _grid(self) -> OccupancyGrid | None:
        layer = self.snapshot.layers.get("map") if self.snapshot is not None else None
        return layer.content if layer and isinstance(layer.content, OccupancyGrid) else None

    def _place_view(self, grid: OccupancyGrid, columns: int, rows: int) -> None:
        assert self.snapshot is not None
        if self.view is None:
            self.view = View.fitting(grid, columns, rows)
        if self.following:
            pose = self.snapshot.pose
            self.view = View(pose.x, pose.y, self.view.metres_per_dot)

    def _background(self, grid: OccupancyGrid, columns: int, rows: int) -> Canvas:
        assert self.snapshot is not None and self.view is not None
        costs = self.snapshot.layers.get("global_costmap") if self.costs_shown else None
        version = costs.version if costs is not None else 0
        key = (self.view, columns, rows, self.snapshot.layers["map"].version, version)
        if self._ground is None or key != self._ground_key:
            self._ground = Canvas(self.view, columns, rows)
            content = costs.content if costs is not None else None
            self._ground.draw_costs(grid, content if isinstance(content, CostGrid) else None)
            self._ground.draw_walls(grid)
            self._ground_key = key
        return self._ground

    def _overlays(self, canvas: Canvas, snapshot: Snapshot) -> None:
        if len(self._trail) > 1:
            canvas.draw_line(np.array(self._trail), palette.TRAIL)
        if snapshot.particles is not None and len(snapshot.particles):
            canvas.draw_points(snapshot.particles[:, :2].astype(float), palette.PARTICLE)
        if snapshot.scan is not None:
            canvas.draw_points(snapshot.pose.transform(snapshot.scan.points()), palette.SCAN)
        if snapshot.path is not None:
            canvas.draw_line(snapshot.path.points[:, :2], palette.PATH)
        if snapshot.local_plan is not None:
            canvas.draw_line(snapshot.local_plan.points[:, :2], palette.LOCAL_PLAN)
        if snapshot.people is not None:
            for x, y, radius in snapshot.people:
                canvas.draw_line(circle(x, y, radius), palette.PERSON)
        self._labels(canvas, snapshot)

    def _labels(self, canvas: Canvas, snapshot: Snapshot) -> None:
        for name, pose in (self.info.places if self.info else {}).items():
            if canvas.is_free(pose.x, pose.y, len(name) + 1):
                canvas.draw_text(pose.x, pose.y, f"◦{name}", palette.PLACE)
        for marker in self.info.markers if self.info else ():
            canvas.draw_text(marker.position[0], marker.position[1], "▪", palette.MARKER)
        if snapshot.goal is not None:
            canvas.draw_text(snapshot.goal.x, snapshot.goal.y, "⚑", palette.GOAL)
        pose = snapshot.pose
        canvas.draw_text(pose.x, pose.y, arrow(pose), palette.ROBOT_TEXT, palette.ROBOT)

    def _label(self) -> None:
        assert self.snapshot is not None
        pose = self.snapshot.pose
        where = f"x {pose.x:5.2f}  y {pose.y:5.2f}  θ {np.degrees(pose.heading):4.0f}°"
        legend = (
            f"[{palette.css(palette.PATH)}]━[/]plan [{palette.css(palette.SCAN)}]•[/]scan "
            f"[{palette.css(palette.PARTICLE)}]•[/]belief [{palette.css(palette.PERSON)}]○[/]people"
        )
        self.border_subtitle = f"{where}   {legend}" if self.size.width >= 64 else where
        self.border_title = "Map · following" if self.following else "Map"

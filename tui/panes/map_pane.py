"""Map pane: walls, costs, robot, path, scan, particles, people and places."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from typing import ClassVar

import numpy as np
from rich.segment import Segment
from textual.binding import BindingType
from textual.events import MouseDown, MouseEvent, MouseMove, MouseUp
from textual.message import Message
from textual.strip import Strip

from stack.telemetry.outlines import uncertainty_ellipse
from stack.telemetry.records import Layer, RunInfo, Snapshot
from stack.types import CostGrid, OccupancyGrid, Pose2D
from tui.drawing import palette
from tui.drawing.arm import REACH, draw_arm
from tui.drawing.canvas import Canvas, View, arrow, circle, scale_bar
from tui.drawing.scan import PastOdometry, draw_scan
from tui.drawing.strips import Lines, ink, one_line, paper, to_strips
from tui.keys import DRAFT_KEYS
from tui.panes.placing import Draft

Ends = tuple[tuple[float, float], tuple[float, float]]
"""Both ends of a door, map frame, metres."""

TRAIL_LENGTH, TRAIL_SPACING = 4000, 0.05
PAN_SHARE = 0.25

POSE_JUMP = 1.0
"""Metres between two snapshots that count as a pose jump: the trail is cleared."""

OUTLINE_FROM = 3.0
"""Smallest radius of the robot, in braille dots, at which its footprint is drawn."""

TRACK_SECONDS = 1.0
"""Time span of the line that shows the velocity of a tracked object."""

_DRAFT_ACTIONS = frozenset(key.action.partition("(")[0] for key in DRAFT_KEYS)

LEGEND = " ".join(
    f"[{palette.css(colour)}]{glyph}[/]{word}"
    for glyph, word, colour in (
        ("━", "plan", palette.PATH), ("•", "scan", palette.SCAN), ("•", "belief", palette.PARTICLE),
        ("○", "people", palette.PERSON), ("•", "unmapped", palette.BEAM_SHORT),
        ("•", "beyond", palette.BEAM_LONG),
    )
)  # fmt: skip

ARM_LEGEND = (
    f" [{palette.css(palette.ROBOT)}]━[/]arm [{palette.css(palette.PATH)}]━[/]way of the tool"
    f" [{palette.css(palette.ROBOT_TEXT)}]+[/]tool"
)
"""Of an arm that does not drive."""

DEPTH_LEGEND = f" [{palette.css(palette.DEPTH)}]•[/]depth"
"""Shown while a depth camera is used."""


class MapPane(Lines, can_focus=True):
    """Draws the newest snapshot; the background is redrawn only when its inputs change."""

    BORDER_TITLE = "Map"
    BINDINGS: ClassVar[list[BindingType]] = [key.binding() for key in DRAFT_KEYS]

    class Placed(Message):
        """A pose was placed and confirmed: the command for it, and the pose."""

        def __init__(self, kind: str, pose: Pose2D) -> None:
            super().__init__()
            self.kind, self.pose = kind, pose

    def __init__(self, *, commands: bool = True) -> None:
        """Create the pane.

        Args:
            commands: whether poses can be placed on it.
        """
        super().__init__(id="map")
        self._commands = commands
        self.draft: Draft | None = None
        self.dragging = False
        self.snapshot: Snapshot | None = None
        self.info: RunInfo | None = None
        self.view: View | None = None
        self.following = self._awaits_map = False
        self.costs_shown = True
        self._ground: Canvas | None = None
        self._ground_key: tuple[object, ...] = ()
        self._canvas: Canvas | None = None
        self._titles = ("", "")
        self._trail: deque[tuple[float, float]] = deque(maxlen=TRAIL_LENGTH)
        self._odometry = PastOdometry()
        self.doors: Sequence[tuple[Ends, bool]] = ()

    def show(self, snapshot: Snapshot, info: RunInfo | None, *, draw: bool = True) -> None:
        """Take a snapshot.

        Args:
            snapshot: to show.
            info: of its run.
            draw: whether to draw now, or with a later snapshot.
        """
        self.snapshot, self.info = snapshot, info
        self._extend_trail(snapshot)
        if draw:
            self._redraw()

    def restart(self, past: Iterable[Snapshot]) -> None:
        """Begin the driven way again, with that of the past."""
        self._trail.clear()
        self._odometry.restart()
        for snapshot in past:
            self._extend_trail(snapshot)

    def on_resize(self) -> None:
        """Fit the map to the new size unless the operator changed the view."""
        if not self.following:
            self.view = None
        self._redraw()

    def on_mouse_scroll_up(self) -> None:
        """Zoom in."""
        self.zoom(1.25)

    def on_mouse_scroll_down(self) -> None:
        """Zoom out."""
        self.zoom(0.8)

    def zoom(self, factor: float) -> None:
        """Zoom in (factor above 1) or out, and follow the robot."""
        if self.view is not None:
            self.view, self.following = self.view.zoomed(factor), True
            self._awaits_map = False
            self._redraw()

    def fit(self) -> None:
        """Show the whole map."""
        self.view, self.following = None, False
        self._redraw()

    def pan(self, right: int, up: int) -> None:
        """Move the view by a quarter of the pane."""
        if self.view is not None:
            dot = self.view.metres_per_dot
            across = round(self.size.width * PAN_SHARE) * 2 * dot
            down = round(self.size.height * PAN_SHARE) * 4 * dot
            self.view = View(self.view.x + right * across, self.view.y + up * down, dot)
            self.following = self._awaits_map = False
            self._redraw()

    def toggle_costs(self) -> None:
        """Show or hide the costmap."""
        self.costs_shown = not self.costs_shown
        self._redraw()

    def place(self, kind: str) -> None:
        """Begin to place a pose, in the middle of the view."""
        if self.view is not None:
            heading = 0.0 if self.snapshot is None else self.snapshot.pose.heading
            self._set_draft(Draft(kind, Pose2D(self.view.x, self.view.y, heading)))
            self.focus()

    def on_mouse_down(self, event: MouseDown) -> None:
        """Place a goal."""
        point = self._point_at(event)
        if self._commands and event.button == 1 and point is not None:
            heading = 0.0 if self.snapshot is None else self.snapshot.pose.heading
            kind = self.draft.kind if self.draft is not None else "set_goal"
            self._set_draft(Draft(kind, Pose2D(*point, heading)))
            self.dragging = True
            self.capture_mouse()

    def on_mouse_move(self, event: MouseMove) -> None:
        """Turn the placed pose towards the mouse."""
        point = self._point_at(event)
        if self.dragging and self.draft is not None and self.view is not None and point is not None:
            self._set_draft(self.draft.facing(*point, 4 * self.view.metres_per_dot))

    def on_mouse_up(self, event: MouseUp) -> None:
        """Ask about the placed pose; the banner does."""
        if self.dragging:
            self.dragging = False
            self.release_mouse()

    def action_move_draft(self, right: int, up: int) -> None:
        """Move the placed pose by a character."""
        if self.draft is not None and self.view is not None:
            dot = self.view.metres_per_dot
            self._set_draft(self.draft.moved(2 * right * dot, 4 * up * dot))

    def action_turn_draft(self, turns: int) -> None:
        """Turn the placed pose."""
        if self.draft is not None:
            self._set_draft(self.draft.turned(turns))

    def action_draft_kind(self, kind: str) -> None:
        """Make it a goal, or where the robot stands."""
        if self.draft is not None:
            self._set_draft(Draft(kind, self.draft.pose))

    def action_confirm_draft(self) -> None:
        """Send the command for the placed pose."""
        if self.draft is not None:
            self.post_message(self.Placed(self.draft.kind, self.draft.pose))
            self._set_draft(None)

    def action_drop_draft(self) -> None:
        """Give up the placed pose."""
        self._set_draft(None)

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Leave the keys to the dashboard while no pose is being placed."""
        return self.draft is not None or action not in _DRAFT_ACTIONS

    def _set_draft(self, draft: Draft | None) -> None:
        self.draft = draft
        self._redraw()

    def _point_at(self, event: MouseEvent) -> tuple[float, float] | None:
        """The map point under the mouse; None outside the pane and without a view."""
        offset = event.get_content_offset(self)
        if offset is None or self.view is None:
            return None
        return self.view.point(offset.x, offset.y, self.size.width, self.size.height)

    def _extend_trail(self, snapshot: Snapshot) -> None:
        self._odometry.add(snapshot)
        here = (snapshot.pose.x, snapshot.pose.y)
        if self._trail:
            moved = float(np.hypot(here[0] - self._trail[-1][0], here[1] - self._trail[-1][1]))
            if moved < TRAIL_SPACING:
                return
            if moved > POSE_JUMP * max(1.0, snapshot.speed):
                self._trail.clear()
        self._trail.append(here)

    def _redraw(self) -> None:
        columns, rows = self.size.width, self.size.height
        if self.snapshot is None or columns < 4 or rows < 2:
            self._canvas = None
            self.put([self._waiting(y) for y in range(rows)])
            return
        view = self.view = self._current_view(self.snapshot, columns, rows)
        canvas = self._background(self.snapshot, view, columns, rows).copy()
        self._overlays(canvas, self.snapshot)
        self._put_canvas(canvas)
        self._label(self.snapshot, view)

    @property
    def _drives(self) -> bool:
        return self.info is None or self.info.drives

    def _waiting(self, y: int) -> Strip:
        """Return one line of the pane without a snapshot."""
        width, is_middle = self.size.width, y == self.size.height // 2
        text = "waiting for the map".center(width) if self.snapshot is None and is_middle else ""
        strip = Strip([Segment(text.ljust(width), ink(palette.DIM, italic=True))], width)
        return strip.apply_style(paper(palette.BACKDROP))

    def _put_canvas(self, canvas: Canvas) -> None:
        """Show a canvas; only its changed rows are converted."""
        before, self._canvas = self._canvas, canvas
        rows = np.arange(canvas.rows)
        strips = list(self._strips)
        if before is not None and before.glyphs.shape == canvas.glyphs.shape:
            rows = np.flatnonzero(
                (
                    (before.glyphs != canvas.glyphs)
                    | (before.foreground != canvas.foreground)
                    | (before.background != canvas.background)
                ).any(axis=1)
            )
        else:
            strips = [Strip([])] * canvas.rows
        drawn = to_strips(canvas.glyphs[rows], canvas.foreground[rows], canvas.background[rows])
        for row, strip in zip(rows.tolist(), drawn, strict=True):
            strips[row] = strip
        self.put(strips)

    def _current_view(self, snapshot: Snapshot, columns: int, rows: int) -> View:
        grid = _occupancy(snapshot.layers.get("map"))
        view = self.view
        if view is None and not self._drives:
            return View.about(snapshot.pose, REACH, columns, rows)
        if view is None or (self._awaits_map and grid is not None):
            # Without a map to fit, follow the robot until there is one.
            self.following = self._awaits_map = grid is None
            view = (
                View.around(snapshot.pose, columns)
                if grid is None
                else View.fitting(grid, columns, rows)
            )
        return view.centred(snapshot.pose) if self.following else view

    def _background(self, snapshot: Snapshot, view: View, columns: int, rows: int) -> Canvas:
        layers = snapshot.layers
        plan = layers.get("map")
        costs = layers.get("global_costmap") or layers.get("local_costmap")
        costs = costs if self.costs_shown else None
        versions = tuple(layer.version if layer is not None else None for layer in (plan, costs))
        places = len(self.info.places) if self.info is not None else 0
        key = (view, columns, rows, versions, places)
        if self._ground is None or key != self._ground_key:
            self._ground, self._ground_key = Canvas(view, columns, rows), key
            grid = _occupancy(plan) if self._drives else None  # what an arm knows has outlines
            self._ground.draw_costs(grid, _costs(costs))
            if grid is not None:
                self._ground.draw_walls(grid)
            for name, pose in (self.info.places if self.info is not None else {}).items():
                self._ground.draw_place(pose.x, pose.y, one_line(name), palette.PLACE)
        return self._ground

    def _overlays(self, canvas: Canvas, snapshot: Snapshot) -> None:
        canvas.draw_line(np.array(self._trail).reshape(-1, 2), palette.TRAIL, below_words=True)
        if snapshot.particles is not None:
            cloud = snapshot.particles[:, :2].astype(np.float64)
            canvas.draw_points(cloud, palette.PARTICLE, below_words=True)
        if snapshot.path is not None:
            canvas.draw_line(snapshot.path.points[:, :2], palette.PATH, below_words=True)
        if snapshot.local_plan is not None:
            canvas.draw_line(snapshot.local_plan.points[:, :2], palette.LOCAL_PLAN)
        draw_scan(canvas, snapshot, self._odometry, _occupancy(snapshot.layers.get("map")))
        if snapshot.depth_points is not None:
            canvas.draw_points(snapshot.depth_points[:, :2].astype(np.float64), palette.DEPTH)
        self._moving(canvas, snapshot)
        if self._drives:
            ellipse = uncertainty_ellipse(snapshot.pose, snapshot.covariance)
            canvas.draw_line(ellipse[:, :2], palette.PARTICLE)
        draw_arm(canvas, snapshot)
        self._figures(canvas, snapshot)

    def _moving(self, canvas: Canvas, snapshot: Snapshot) -> None:
        """Draw doors, people and what the robot tracks."""
        for ends, closed in self.doors:
            canvas.draw_line(np.array(ends), palette.BAD if closed else palette.PLACE)
        if snapshot.people is not None:
            for x, y, radius in snapshot.people:
                canvas.draw_line(circle(x, y, radius), palette.PERSON)
        for track in snapshot.tracks:
            canvas.draw_line(circle(*track.position, track.radius), palette.PERSON)
            ahead = np.array([track.position, track.position_after(TRACK_SECONDS)])
            canvas.draw_line(ahead, palette.PERSON)

    def _figures(self, canvas: Canvas, snapshot: Snapshot) -> None:
        for marker in self.info.markers if self.info is not None else ():
            canvas.draw_text(marker.position[0], marker.position[1], "▪", palette.MARKER)
        if snapshot.goal is not None:
            canvas.draw_text(snapshot.goal.x, snapshot.goal.y, "⚑", palette.GOAL)
        pose = snapshot.pose
        if self.info is not None:
            footprint = self.info.footprint
            if footprint.circumscribed_radius / canvas.view.metres_per_dot >= OUTLINE_FROM:
                outline = pose.transform(footprint.points)
                canvas.draw_line(np.vstack([outline, outline[:1]]), palette.ROBOT)
        for item in snapshot.detections:
            canvas.draw_text(*item.position, f"◆{one_line(item.label)}", palette.DETECTION)
        for rival in snapshot.rivals:
            canvas.draw_text(
                rival.pose.x, rival.pose.y, f"{arrow(rival.pose)}{rival.share:.0%}", palette.RIVAL
            )
        if self._drives:
            canvas.draw_text(pose.x, pose.y, arrow(pose), palette.ROBOT_TEXT, palette.ROBOT)
        if self.draft is not None:
            self.draft.draw(canvas)

    def _label(self, snapshot: Snapshot, view: View) -> None:
        width, pose = self.size.width, snapshot.pose
        mode = "Map · following" if self.following else "Map"
        where = f"x {pose.x:.1f}  y {pose.y:.1f}  θ {np.degrees(pose.heading):.0f}°"
        if not self._drives:
            where = "the arm from above"
        title = f"{mode}  [not bold {palette.css(palette.DIM)}]{where}[/]" if width >= 44 else mode
        characters, metres = scale_bar(view, width // 5)
        scale = f"├{'─' * (characters - 2)}┤ {metres:g} m" if characters else ""
        legend = LEGEND if self._drives else ARM_LEGEND
        legend += DEPTH_LEGEND if snapshot.depth_points is not None else ""
        subtitle = f"{legend}  {scale}" if width >= 46 else scale
        if (title, subtitle) != self._titles:
            self._titles = title, subtitle
            self.border_title, self.border_subtitle = title, subtitle


def _occupancy(layer: Layer | None) -> OccupancyGrid | None:
    return layer.content if layer and isinstance(layer.content, OccupancyGrid) else None


def _costs(layer: Layer | None) -> CostGrid | None:
    return layer.content if layer and isinstance(layer.content, CostGrid) else None

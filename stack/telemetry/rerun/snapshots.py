"""Draws the snapshots of a run in rerun: what changed since the one before."""

from __future__ import annotations

from typing import Any

from stack.telemetry.records import ROUTINE, Event, RunInfo, Snapshot
from stack.telemetry.rerun.blueprint import pictures_of
from stack.telemetry.rerun.drawing import RerunDrawing
from stack.telemetry.rerun.localisation import draw_particles, draw_rivals, draw_scan
from stack.telemetry.rerun.objects import draw_detections, draw_mask
from stack.telemetry.rerun.pictures import (
    draw_colour_picture,
    draw_depth_picture,
    draw_depth_points,
)
from stack.telemetry.rerun.recording import Recording
from stack.telemetry.tree_text import activity
from stack.types import OccupancyGrid

MASK_SHOWN = 2.0
"""Seconds for which the mask of a colour is shown after the last search for it."""


class SnapshotDrawing:
    """Draws snapshots and events in order of time.

    Args:
        info: of the run.
        recording: to draw into; the caller writes it.
    """

    def __init__(self, info: RunInfo, recording: Recording) -> None:
        self._recording = recording
        self._drawing = RerunDrawing(info, recording)
        self._views: frozenset[str] | None = None
        self._drawn: dict[str, Any] = {"rivals": (), "detections": (), "goal": None}
        self._versions: dict[str, int] = {}
        self._statuses: dict[int, str] = {}
        self._mask_stamp = -MASK_SHOWN
        self._drawing.static_entities()

    def event(self, event: Event) -> None:
        """Log the text of an event unless it is routine."""
        if event.kind not in ROUTINE:
            self._recording.at(event.time)
            self._drawing.event(event)
        if event.kind in ("held", "held_end"):
            self._drawing.hold_up(event)

    def draw(self, snapshot: Snapshot) -> None:
        """Draw a snapshot."""
        drawing = self._drawing
        self._recording.at(snapshot.time)
        drawing.robot(snapshot)
        if snapshot.arm is not None:
            drawing.arm(snapshot.arm)
        drawing.moving(snapshot)
        drawing.plots(snapshot)
        self._draw_sensors(snapshot)
        self._draw_objects(snapshot)
        self._draw_plans(snapshot)
        self._draw_layers(snapshot)
        self._draw_tree(snapshot)
        if self._views is None:
            drawing.held("")
        views = pictures_of(snapshot) | (self._views or frozenset())
        if views != self._views:  # the last layout that is sent is shown, at all times
            self._views = views
            drawing.send_blueprint(snapshot, views)

    def _is_new(self, name: str, value: Any) -> bool:
        """Whether a value is not the one that was drawn last."""
        before = self._drawn.get(name)
        if value is before:
            return False
        self._drawn[name] = value
        return not isinstance(value, tuple) or value != before

    def _draw_sensors(self, snapshot: Snapshot) -> None:
        recording = self._recording
        if snapshot.scan is not None and self._is_new("scan", snapshot.scan):
            plan = snapshot.layers.get("map")
            content = plan.content if plan is not None else None
            grid = content if isinstance(content, OccupancyGrid) else None
            draw_scan(recording, snapshot.scan, snapshot.pose, grid)
        if self._is_new("rivals", snapshot.rivals):
            draw_rivals(recording, snapshot.rivals)
        if snapshot.particles is not None and self._is_new("particles", snapshot.particles):
            draw_particles(recording, snapshot.particles)
        if snapshot.image is not None and self._is_new("image", snapshot.image):
            draw_colour_picture(recording, snapshot.image)
        if snapshot.depth_image is not None and self._is_new("depth_image", snapshot.depth_image):
            draw_depth_picture(recording, snapshot.depth_image)
        points = snapshot.depth_points
        if points is not None and self._is_new("depth_points", points):
            draw_depth_points(recording, points)

    def _draw_objects(self, snapshot: Snapshot) -> None:
        if self._is_new("detections", snapshot.detections):
            draw_detections(self._recording, snapshot.detections)
        mask = snapshot.mask
        if mask is not None and self._is_new("mask", mask):
            self._mask_stamp = mask.stamp
            draw_mask(self._recording, mask)
        elif snapshot.time - self._mask_stamp > MASK_SHOWN:
            draw_mask(self._recording, None)

    def _draw_plans(self, snapshot: Snapshot) -> None:
        for name, plan in (("path", snapshot.path), ("local_plan", snapshot.local_plan)):
            if self._is_new(name, plan):
                self._drawing.plan(name, plan)
        if self._is_new("goal", snapshot.goal):
            self._drawing.goal(snapshot.goal)

    def _draw_layers(self, snapshot: Snapshot) -> None:
        layers = snapshot.layers
        for name, layer in layers.items():
            if self._versions.get(name) != layer.version:
                self._versions[name] = layer.version
                self._drawing.layer(name, layer)
        for name in [name for name in self._versions if name not in layers]:
            del self._versions[name]
            self._drawing.remove_layer(name)

    def _draw_tree(self, snapshot: Snapshot) -> None:
        is_other_state = self._is_new("state", snapshot.state)
        if is_other_state:
            self._drawing.mission_state(snapshot.state)
        if not self._is_new("tree", snapshot.tree) and not is_other_state:
            return
        for row in snapshot.tree:
            if self._statuses.get(row.id) != row.status:
                self._statuses[row.id] = row.status
                self._drawing.node_state(row)
        doing = activity(snapshot.tree)
        if self._is_new("activity", (doing,)):
            self._drawing.activity(doing)
        self._drawing.tree_document(snapshot)

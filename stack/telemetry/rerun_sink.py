"""Sink that writes a recording for rerun's viewer. It imports rerun when it opens."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from stack.telemetry.records import ROUTINE, Event, Layer, MissionState, RunInfo, Snapshot
from stack.telemetry.tree_text import activity

if TYPE_CHECKING:
    from stack.telemetry.rerun_drawing import RerunDrawing

DOCUMENT_PERIOD = 1.0
"""Seconds between two logs of the tree as text, unless a node changes its status."""


class RerunSink:
    """Records a run for rerun, on the timeline `mission_time` (robot time).

    Layers are written only when their version changes, node states only when they change. After
    kill -9 the recording lacks only the last moments; `rerun rrd optimize` repairs it.
    """

    def __init__(self, path: Path, period: float = 0.1) -> None:
        """Prepare a recording; `open` creates the file.

        Args:
            path: the .rrd file to write.
            period: robot time between two snapshots, seconds.
        """
        self.path, self.period = path, period
        self._drawing: RerunDrawing | None = None
        self._next = 0.0
        self._has_blueprint = False
        self._versions: dict[str, int] = {}
        self._statuses: dict[int, str] = {}
        self._state: MissionState | None = None
        self._activity = ""
        self._document_at = -DOCUMENT_PERIOD
        self._image_stamp = -1.0

    def open(self, info: RunInfo) -> None:
        """Create the file and draw the static entities."""
        from stack.telemetry.rerun_drawing import RerunDrawing

        self._drawing = RerunDrawing(info, self.path)
        self._drawing.static_entities()

    def event(self, event: Event) -> None:
        """Log the event unless it is routine."""
        assert self._drawing is not None
        if event.kind not in ROUTINE:
            self._drawing.at(event.time)
            self._drawing.event(event)

    def wants_snapshot(self, time: float) -> bool:
        """Whether a period of robot time has passed."""
        return time >= self._next - 1e-9

    def snapshot(self, snapshot: Snapshot) -> None:
        """Draw a snapshot."""
        assert self._drawing is not None
        drawing = self._drawing
        if not self._has_blueprint:
            self._has_blueprint = True
            drawing.send_blueprint(snapshot)
        while self._next <= snapshot.time + 1e-9:
            self._next += self.period
        drawing.at(snapshot.time)
        self._draw_layers(snapshot.layers)
        drawing.robot(snapshot)
        drawing.sensors(snapshot)
        drawing.plans(snapshot)
        drawing.plots(snapshot)
        self._draw_tree(snapshot)
        if snapshot.image is not None and snapshot.image.stamp != self._image_stamp:
            self._image_stamp = snapshot.image.stamp
            drawing.image(snapshot.image)

    def close(self, report: Mapping[str, object] | None) -> None:
        """Close the file. Safe to call twice."""
        if self._drawing is not None:
            self._drawing.close()
            self._drawing = None

    def _draw_layers(self, layers: Mapping[str, Layer]) -> None:
        assert self._drawing is not None
        for name, layer in layers.items():
            if self._versions.get(name) != layer.version:
                self._versions[name] = layer.version
                self._drawing.layer(name, layer)
        for name in [name for name in self._versions if name not in layers]:
            del self._versions[name]
            self._drawing.remove_layer(name)

    def _draw_tree(self, snapshot: Snapshot) -> None:
        assert self._drawing is not None
        changed = [row for row in snapshot.tree if self._statuses.get(row.id) != row.status]
        for row in changed:
            self._statuses[row.id] = row.status
            self._drawing.node_state(row)
        if snapshot.state is not self._state:
            self._state = snapshot.state
            self._drawing.mission_state(snapshot.state)
        doing = activity(snapshot.tree)
        if doing != self._activity:
            self._activity = doing
            self._drawing.activity(doing)
        if changed or snapshot.time - self._document_at >= DOCUMENT_PERIOD - 1e-9:
            self._document_at = snapshot.time
            self._drawing.tree_document(snapshot)

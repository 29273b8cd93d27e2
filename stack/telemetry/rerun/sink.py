"""Sink that writes a recording for rerun's viewer. It imports rerun when it opens."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from stack.schedule import Schedule
from stack.telemetry.records import ROUTINE, Event, MissionState, RunInfo, Snapshot, TreeRow
from stack.telemetry.rerun.parameters import RecordingParameters
from stack.telemetry.tree_text import activity
from stack.types import Detection, OccupancyGrid, Pose2D, RivalPose
from stack.types import Path as Plan

if TYPE_CHECKING:
    from stack.telemetry.rerun.drawing import RerunDrawing

WRITE_PERIOD = 4.0
"""Robot time between two writes to the file; a killed run loses at most this time, s."""

DOCUMENT_PERIOD = 1.0
"""Least seconds between two logs of the tree as text, unless a node changes its status."""


MASK_SHOWN = 2.0
"""Seconds for which the mask of a colour is shown after the last search for it."""


class RerunSink:
    """Records a run for rerun, on the timeline `mission_time` (robot time).

    What did not change is not written again. A killed run leaves everything up to the last write.

    Attributes:
        path: of the recording; `open` creates it.
    """

    def __init__(self, path: Path, parameters: RecordingParameters | None = None) -> None:
        self.path = path
        self._parameters = parameters or RecordingParameters()
        self._drawing: RerunDrawing | None = None
        rates = self._parameters
        self._snapshots = Schedule(1.0 / rates.rate)
        self._scans, self._particles = (
            Schedule(1.0 / rates.scan_rate), Schedule(1.0 / rates.particle_rate),
        )  # fmt: skip
        self._plans, self._pictures, self._depth_pictures, self._depth_points, self._masks = (
            Schedule(1.0 / rate) for rate in (rates.plan_rate, *4 * [rates.picture_rate])
        )
        self._costmaps = {
            "local_costmap": Schedule(1.0 / rates.local_costmap_rate),
            "global_costmap": Schedule(1.0 / rates.global_costmap_rate),
        }
        self._detections: tuple[Detection, ...] = ()
        self._mask_stamp = -MASK_SHOWN
        self._documents = Schedule(DOCUMENT_PERIOD)
        self._writes = Schedule(WRITE_PERIOD)
        self._has_blueprint = False
        self._versions: dict[str, int] = {}
        self._plan_of: dict[str, Plan | None] = {}
        self._goal: Pose2D | None = None
        self._rivals: tuple[RivalPose, ...] = ()
        self._statuses: dict[int, str] = {}
        self._state: MissionState | None = None
        self._tree: tuple[TreeRow, ...] = ()
        self._activity = ""
        self._image_stamp = self._depth_stamp = -1.0

    @property
    def record(self) -> str:
        """Name of the file in the run folder."""
        return self.path.name

    def open(self, info: RunInfo) -> None:
        """Create the file and draw the static entities."""
        from stack.telemetry.rerun.drawing import RerunDrawing

        self._drawing = RerunDrawing(info, self.path, self._parameters)
        self._drawing.static_entities()

    def event(self, event: Event) -> None:
        """Log the event unless it is routine."""
        assert self._drawing is not None
        if event.kind not in ROUTINE:
            self._drawing.at(event.time)
            self._drawing.event(event)

    def wants_snapshot(self, time: float) -> bool:
        """Whether a period of robot time has passed."""
        return self._snapshots.is_due(time)

    def snapshot(self, snapshot: Snapshot) -> None:
        """Draw a snapshot."""
        assert self._drawing is not None
        drawing, time = self._drawing, snapshot.time
        self._snapshots.take(time)
        drawing.at(time)
        drawing.robot(snapshot)
        drawing.moving(snapshot)
        drawing.plots(snapshot)
        self._draw_sensors(snapshot)
        self._draw_objects(snapshot)
        if self._plans.take(time) or snapshot.state.is_over:
            self._draw_plans(snapshot)
        self._draw_layers(snapshot)
        self._draw_tree(snapshot)
        if not self._has_blueprint:
            self._has_blueprint = True
            drawing.send_blueprint(snapshot)
            drawing.write()
        elif self._writes.take(time):
            drawing.write()

    def close(self, report: Mapping[str, object] | None) -> None:
        """Write the rest and close the file. Safe to call twice."""
        drawing, self._drawing = self._drawing, None
        if drawing is not None:
            try:
                drawing.write()
            finally:
                drawing.close()

    def _draw_sensors(self, snapshot: Snapshot) -> None:
        assert self._drawing is not None
        if snapshot.scan is not None and self._scans.take(snapshot.time):
            plan = snapshot.layers.get("map")
            grid = plan.content if plan is not None else None
            self._drawing.scan(
                snapshot.scan, snapshot.pose, grid if isinstance(grid, OccupancyGrid) else None
            )
        if snapshot.rivals != self._rivals:
            self._rivals = snapshot.rivals
            self._drawing.rivals(snapshot.rivals)
        if snapshot.particles is not None and self._particles.take(snapshot.time):
            self._drawing.particles(snapshot.particles)
        image = snapshot.image
        if image is not None and image.stamp != self._image_stamp:
            if self._pictures.take(snapshot.time):
                self._image_stamp = image.stamp
                self._drawing.image(image)
        depth = snapshot.depth_image
        if depth is not None and depth.stamp != self._depth_stamp:
            if self._depth_pictures.take(snapshot.time):
                self._depth_stamp = depth.stamp
                self._drawing.depth_image(depth)
        if snapshot.depth_points is not None and self._depth_points.take(snapshot.time):
            self._drawing.depth_points(snapshot.depth_points)

    def _draw_objects(self, snapshot: Snapshot) -> None:
        assert self._drawing is not None
        if snapshot.detections != self._detections:
            self._detections = snapshot.detections
            self._drawing.detections(snapshot.detections)
        mask = snapshot.mask
        if mask is not None and self._masks.take(snapshot.time):
            self._mask_stamp = mask.stamp
            self._drawing.mask(mask)
        elif snapshot.time - self._mask_stamp > MASK_SHOWN:
            self._drawing.mask(None)

    def _draw_plans(self, snapshot: Snapshot) -> None:
        assert self._drawing is not None
        plans = {"path": snapshot.path, "local_plan": snapshot.local_plan}
        for name, plan in plans.items():
            if plan is not self._plan_of.get(name):
                self._plan_of[name] = plan
                self._drawing.plan(name, plan)
        if snapshot.goal != self._goal:
            self._goal = snapshot.goal
            self._drawing.goal(snapshot.goal)

    def _draw_layers(self, snapshot: Snapshot) -> None:
        assert self._drawing is not None
        layers = snapshot.layers
        for name, layer in layers.items():
            clock = self._costmaps.get(name)
            is_due = clock is None or clock.take(snapshot.time) or snapshot.state.is_over
            if is_due and self._versions.get(name) != layer.version:
                self._versions[name] = layer.version
                self._drawing.layer(name, layer)
        for name in [name for name in self._versions if name not in layers]:
            del self._versions[name]
            self._drawing.remove_layer(name)

    def _draw_tree(self, snapshot: Snapshot) -> None:
        assert self._drawing is not None
        if snapshot.state is not self._state:
            self._state, self._tree = snapshot.state, ()
            self._drawing.mission_state(snapshot.state)
        if snapshot.tree is self._tree:  # the same tuple while nothing changes
            return
        self._tree = snapshot.tree
        changed = [row for row in snapshot.tree if self._statuses.get(row.id) != row.status]
        for row in changed:
            self._statuses[row.id] = row.status
            self._drawing.node_state(row)
        doing = activity(snapshot.tree)
        if doing != self._activity:
            self._activity = doing
            self._drawing.activity(doing)
        if self._documents.take(snapshot.time) or changed:
            self._drawing.tree_document(snapshot)

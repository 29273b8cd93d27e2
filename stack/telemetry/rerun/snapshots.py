"""Draws the snapshots of a run in rerun: what changed, and each at its own rate."""

from __future__ import annotations

from pathlib import Path

from stack.schedule import Schedule
from stack.telemetry.recording_parameters import RecordingParameters
from stack.telemetry.records import Event, MissionState, RunInfo, Snapshot, TreeRow
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
from stack.types import Detection, OccupancyGrid, Pose2D, RivalPose
from stack.types import Path as Plan

WRITE_PERIOD = 4.0
"""Robot time between two writes to the file; a killed run loses at most this time, s."""

SCAN_PERIOD, PLAN_PERIOD, PICTURE_PERIOD = 0.2, 0.5, 0.5
"""Robot time between two drawings, s: of scans, of plans, of what cameras and depth cameras see."""

DOCUMENT_PERIOD = 1.0
"""Least seconds between two logs of the tree as text, unless a node changes its status."""

MASK_SHOWN = 2.0
"""Seconds for which the mask of a colour is shown after the last search for it."""


class SnapshotDrawing:
    """Draws snapshots and events into one file; what did not change is not drawn again.

    Args:
        info: of the run.
        file: where the recording goes.
        parameters: rates, and the limit of the size.

    Raises:
        OSError: the file cannot be created.
    """

    def __init__(self, info: RunInfo, file: Path, parameters: RecordingParameters) -> None:
        limit = parameters.size_limit * 1e6
        self._recording = Recording(file, limit, info.run_id, info.title or info.run_id)
        self._drawing = RerunDrawing(info, self._recording)
        self._scans, self._plans = Schedule(SCAN_PERIOD), Schedule(PLAN_PERIOD)
        self._particles = Schedule(1.0 / parameters.particle_rate)
        self._pictures, self._depth_pictures, self._depth_points, self._masks = (
            Schedule(PICTURE_PERIOD) for _ in range(4)
        )
        self._costmaps = {
            "local_costmap": Schedule(1.0 / parameters.local_costmap_rate),
            "global_costmap": Schedule(1.0 / parameters.global_costmap_rate),
        }
        self._detections: tuple[Detection, ...] = ()
        self._mask_stamp = -MASK_SHOWN
        self._documents, self._writes = Schedule(DOCUMENT_PERIOD), Schedule(WRITE_PERIOD)
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
        self._drawing.static_entities()

    def event(self, event: Event) -> None:
        """Log the text of an event."""
        self._recording.at(event.time)
        self._drawing.event(event)

    def draw(self, snapshot: Snapshot) -> None:
        """Draw a snapshot.

        Raises:
            RecordFull: the file reached its size limit.
            OSError: it cannot be written.
        """
        drawing, time = self._drawing, snapshot.time
        self._recording.at(time)
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
            self._recording.write()
        elif self._writes.take(time):
            self._recording.write()

    def close(self) -> None:
        """Write the rest and close the file."""
        try:
            self._recording.write()
        finally:
            self._recording.close()

    def _draw_sensors(self, snapshot: Snapshot) -> None:
        if snapshot.scan is not None and self._scans.take(snapshot.time):
            plan = snapshot.layers.get("map")
            content = plan.content if plan is not None else None
            grid = content if isinstance(content, OccupancyGrid) else None
            draw_scan(self._recording, snapshot.scan, snapshot.pose, grid)
        if snapshot.rivals != self._rivals:
            self._rivals = snapshot.rivals
            draw_rivals(self._recording, snapshot.rivals)
        if snapshot.particles is not None and self._particles.take(snapshot.time):
            draw_particles(self._recording, snapshot.particles)
        image = snapshot.image
        if image is not None and image.stamp != self._image_stamp:
            if self._pictures.take(snapshot.time):
                self._image_stamp = image.stamp
                draw_colour_picture(self._recording, image)
        depth = snapshot.depth_image
        if depth is not None and depth.stamp != self._depth_stamp:
            if self._depth_pictures.take(snapshot.time):
                self._depth_stamp = depth.stamp
                draw_depth_picture(self._recording, depth)
        if snapshot.depth_points is not None and self._depth_points.take(snapshot.time):
            draw_depth_points(self._recording, snapshot.depth_points)

    def _draw_objects(self, snapshot: Snapshot) -> None:
        if snapshot.detections != self._detections:
            self._detections = snapshot.detections
            draw_detections(self._recording, snapshot.detections)
        mask = snapshot.mask
        if mask is not None and mask.stamp != self._mask_stamp:
            if self._masks.take(snapshot.time):
                self._mask_stamp = mask.stamp
                draw_mask(self._recording, mask)
        elif snapshot.time - self._mask_stamp > MASK_SHOWN:
            draw_mask(self._recording, None)

    def _draw_plans(self, snapshot: Snapshot) -> None:
        plans = {"path": snapshot.path, "local_plan": snapshot.local_plan}
        for name, plan in plans.items():
            if plan is not self._plan_of.get(name):
                self._plan_of[name] = plan
                self._drawing.plan(name, plan)
        if snapshot.goal != self._goal:
            self._goal = snapshot.goal
            self._drawing.goal(snapshot.goal)

    def _draw_layers(self, snapshot: Snapshot) -> None:
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

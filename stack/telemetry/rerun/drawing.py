"""Draws the entities of a run in rerun."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin
from typing import Any

import numpy as np
import rerun as rr

from stack.telemetry.outlines import at_height, largest_variance, outline, uncertainty_ellipse
from stack.telemetry.records import Event, Layer, MissionState, RunInfo, Snapshot, TreeRow
from stack.telemetry.rerun.arm import ArmDrawing
from stack.telemetry.rerun.blueprint import HELD, layout, node_path
from stack.telemetry.rerun.grids import GridDrawing, WindowDrawing
from stack.telemetry.rerun.localisation import PARTICLE_COLOUR, SCAN_COLOUR, localisation_constants
from stack.telemetry.rerun.pictures import DEPTH_COLOUR
from stack.telemetry.rerun.place import (
    draw_markers,
    draw_places,
    draw_robot_model,
    draw_scene,
    hide_scene,
)
from stack.telemetry.rerun.recording import BASE, MAP, TRUTH, Recording
from stack.telemetry.tree_text import NOTHING, tree_markdown
from stack.types import ArmView, FloatArray, Footprint, ParameterTable, Path, Pose2D, TrackedObject

Colour = tuple[int, int, int]

ROBOT_COLOUR = (94, 200, 255)
TRUTH_COLOUR = (150, 158, 170)
TRAIL_COLOUR = (60, 120, 150)
PATH_COLOUR = (70, 226, 160)
LOCAL_PLAN_COLOUR = (255, 214, 90)
GOAL_COLOUR = (255, 120, 190)
PERSON_COLOUR = (240, 176, 120)
TRACK_COLOUR = (255, 205, 60)

IDLE_COLOUR = (38, 44, 54)
HELD_COLOUR = (190, 100, 40)
ACTIVITY_COLOURS = (
    (74, 98, 160), (52, 124, 128), (118, 90, 156), (140, 112, 60), (66, 122, 86), (146, 80, 104),
)  # fmt: skip
NODE_COLOURS = {
    "running": (58, 110, 205),
    "success": (44, 150, 100),
    "failure": (196, 62, 66),
    "idle": IDLE_COLOUR,
}
MISSION_COLOURS = {
    MissionState.STARTING: (60, 68, 82),
    MissionState.RUNNING: (58, 110, 205),
    MissionState.PAUSED: (190, 140, 50),
    MissionState.EMERGENCY_STOP: (214, 48, 52),
    MissionState.SUCCESS: (44, 150, 100),
    MissionState.FAILURE: (196, 62, 66),
    MissionState.ABORTED: (176, 96, 52),
    MissionState.INTERRUPTED: (176, 96, 52),
    MissionState.ERROR: (196, 62, 66),
}
LEVELS = {"info": "INFO", "warning": "WARN", "error": "ERROR"}

TRAIL_STEP = 0.05
"""Metres between two points of the robot's trail."""

PERSON_HEIGHT = 1.7
PLAN_HEIGHTS = {"path": 0.05, "local_plan": 0.08}
"""Metres."""


class RerunDrawing:
    """Draws the robot, its plans, layers, states and plots into one recording."""

    def __init__(self, info: RunInfo, recording: Recording) -> None:
        self._info, self._recording = info, recording
        self._grids: dict[str, GridDrawing | WindowDrawing] = {}
        self._trail: Pose2D | None = None
        self._has_truth = False
        self._known_nodes: set[int] = set()
        self._activities: dict[str, Colour] = {}
        self._held: dict[str, Colour] = {}
        self._causes: set[tuple[str, str]] = set()
        self._changed = 0.0
        self._arm: ArmDrawing | None = None

    def static_entities(self) -> None:
        """Draw robot model, markers, places and the legends of the plots."""
        self._arm = ArmDrawing(self._recording, draw_robot_model(self._recording, self._info))
        draw_markers(self._recording, self._info.markers)
        draw_places(self._recording, self._info)
        self._constants()
        motion = {"commanded": LOCAL_PLAN_COLOUR, "measured": PATH_COLOUR}
        self._legend("speed", motion)
        self._legend("turning", motion)
        self._legend("error", {"error": SCAN_COLOUR, "standard deviation": ROBOT_COLOUR})
        self._legend("health", {"localisation": ROBOT_COLOUR, "battery": PATH_COLOUR})
        self._legend("joints", {"fastest": PATH_COLOUR})
        self._legend("fingers", {"width mm": ROBOT_COLOUR, "force N": GOAL_COLOUR})
        states = {str(state): MISSION_COLOURS[state] for state in MissionState}
        self._states("mission", states)

    def send_blueprint(self, snapshot: Snapshot, pictures: frozenset[str]) -> None:
        """Send the layout of the views and the viewpoint for this mission."""
        self._recording.stream.send_blueprint(layout(snapshot, self._info, pictures))

    def event(self, event: Event) -> None:
        """Log the text of an event."""
        line = rr.TextLog(event.text, level=LEVELS.get(event.level, "INFO"))
        self._recording.stream.log(f"log/{event.source}", line)

    def hold_up(self, event: Event) -> None:
        """Log the new causes that hold the robot, at an event `held` or `held_end`."""
        hold_up = str(event.fields.get("effect", "")), str(event.fields.get("cause", ""))
        time = event.time
        if event.kind == "held":
            self._causes.add(hold_up)
            time = float(event.fields.get("begin", time))
        else:
            self._causes.discard(hold_up)
        self._changed = max(time, self._changed)
        self._recording.at(self._changed)
        self.held(", ".join(sorted({cause for _, cause in self._causes})))

    def held(self, causes: str) -> None:
        """Log what holds the robot from now on; empty: nothing."""
        state = f"held: {causes}" if causes else NOTHING
        if state not in self._held:
            self._held[state] = HELD_COLOUR if causes else IDLE_COLOUR
            self._states(HELD, self._held)
        self._recording.stream.log(HELD, rr.StateChange(state=state))

    def layer(self, name: str, layer: Layer) -> None:
        """Draw a new version of a map, a costmap or the scene."""
        content = layer.content
        if isinstance(content, ParameterTable):
            return
        if isinstance(content, tuple):
            draw_scene(self._recording, name, content)
        else:
            drawing = self._grids.get(name)
            if drawing is None or not drawing.fits(content):
                self.remove_layer(name)
                kind = WindowDrawing if name == "local_costmap" else GridDrawing
                drawing = self._grids[name] = kind(self._recording, name, content)
            drawing.draw(layer)

    def remove_layer(self, name: str) -> None:
        """Remove a layer from the view."""
        hide_scene(self._recording, name)
        drawing = self._grids.pop(name, None)
        if drawing is not None:
            drawing.hide()

    def robot(self, snapshot: Snapshot) -> None:
        """Draw poses, uncertainty and trail of the robot; models and outlines follow the poses."""
        pose, truth = snapshot.pose, snapshot.truth
        self._place("world/robot_pose", pose, BASE)
        ellipse = uncertainty_ellipse(pose, snapshot.covariance)
        self._recording.show_row("world/uncertainty", rr.LineStrips3D, strips=ellipse[np.newaxis])
        if truth is not None:
            self._place("world/true_pose", truth, TRUTH)
            if not self._has_truth:
                self._has_truth = True
                self._outline("world/true_outline", TRUTH, TRUTH_COLOUR)
        self._extend_trail(truth or pose)

    def arm(self, arm: ArmView) -> None:
        """Draw the arm."""
        if self._arm is not None:
            self._arm.draw(arm)

    def moving(self, snapshot: Snapshot) -> None:
        """Draw people and tracks."""
        if snapshot.people is not None:
            self._people(snapshot.people)
        self._tracks(snapshot.tracks)

    def plan(self, name: str, plan: Path | None) -> None:
        """Draw the global plan, `path`, or the `local_plan`; hide it if there is none."""
        entity = f"world/{name}"
        if plan is None or len(plan.points) < 2:
            self._recording.hide(entity)
            return
        strip = at_height(plan.points[:, :2], PLAN_HEIGHTS[name]).astype(np.float32)
        self._recording.show_row(entity, rr.LineStrips3D, strips=[strip])

    def goal(self, goal: Pose2D | None) -> None:
        """Draw the goal; hide it if there is none."""
        if goal is None:
            self._recording.hide("world/goal")
            return
        ahead = (0.45 * cos(goal.heading), 0.45 * sin(goal.heading), 0.0)
        arrows = rr.Arrows3D.from_fields(
            origins=[(goal.x, goal.y, 0.7), (goal.x, goal.y, 0.1)],
            vectors=[(0.0, 0.0, -0.6), ahead],
        )
        self._recording.show("world/goal", arrows)

    def plots(self, snapshot: Snapshot) -> None:
        """Log the plots; the error is NaN without ground truth."""
        commanded, measured = snapshot.commanded, snapshot.measured
        truth = snapshot.truth
        error = float("nan") if truth is None else snapshot.pose.distance_to(truth)
        worst_variance = largest_variance(snapshot.covariance)
        curves = {
            "speed": (commanded.linear, measured.linear),
            "turning": (commanded.angular, measured.angular),
            "error": (error, max(0.0, worst_variance) ** 0.5),
            "health": (snapshot.health, snapshot.battery.charge),
        }
        for name, values in curves.items():
            self._recording.row(f"plots/{name}", rr.Scalars, scalars=values)

    def node_state(self, row: TreeRow) -> None:
        """Log a node's new status."""
        if row.id not in self._known_nodes:
            self._known_nodes.add(row.id)
            self._states(node_path(row), NODE_COLOURS)
        self._recording.stream.log(node_path(row), rr.StateChange(state=row.status))

    def mission_state(self, state: MissionState) -> None:
        """Log the mission's new state."""
        self._recording.stream.log("mission", rr.StateChange(state=str(state)))

    def activity(self, name: str) -> None:
        """Log the new activity: the name of the running leaf."""
        if name not in self._activities:
            shade = ACTIVITY_COLOURS[len(self._activities) % len(ACTIVITY_COLOURS)]
            self._activities[name] = IDLE_COLOUR if name == NOTHING else shade
            self._states("activity", self._activities)
        self._recording.stream.log("activity", rr.StateChange(state=name))

    def tree_document(self, snapshot: Snapshot) -> None:
        """Log the tree as text."""
        text = tree_markdown(snapshot, self._info)
        document = rr.TextDocument(text, media_type="text/markdown")
        self._recording.stream.log("tree_text", document)

    def _constants(self) -> None:
        """Log what does not change of entities: sizes and colours; and the robot's outline."""
        lines, arrows = rr.LineStrips3D.from_fields, rr.Arrows3D.from_fields
        constants = {
            "uncertainty": lines(radii=0.012, colors=PARTICLE_COLOUR[:3]),
            "trail": lines(radii=0.016, colors=TRAIL_COLOUR),
            "path": lines(radii=0.028, colors=PATH_COLOUR),
            "local_plan": lines(radii=0.02, colors=LOCAL_PLAN_COLOUR),
            "tracks": lines(radii=0.012, colors=TRACK_COLOUR),
            "tracks/velocity": arrows(radii=0.02, colors=TRACK_COLOUR),
            "depth_points": rr.Points3D.from_fields(radii=0.02, colors=DEPTH_COLOUR),
            "goal": arrows(radii=0.03, colors=GOAL_COLOUR),
            "people": rr.Capsules3D.from_fields(colors=PERSON_COLOUR, fill_mode="solid"),
        }
        for name, drawn in (constants | localisation_constants()).items():
            self._recording.fix(f"world/{name}", drawn)
        self._outline("world/outline", BASE, ROBOT_COLOUR)

    def _outline(self, path: str, frame: str, colour: Colour) -> None:
        """Draw the robot's outline at a frame."""
        strip = outline(Pose2D(0.0, 0.0), self._info.footprint.points)
        self._recording.fix(path, rr.LineStrips3D([strip], radii=0.012, colors=colour), frame)

    def _place(self, path: str, pose: Pose2D, frame: str) -> None:
        """Place a frame at a pose in the map frame."""
        half = pose.heading / 2.0
        self._recording.row(
            path,
            rr.Transform3D,
            translation=np.array([(pose.x, pose.y, 0.0)]),
            quaternion=np.array([(0.0, 0.0, sin(half), cos(half))]),
            parent_frame=[MAP],
            child_frame=[frame],
        )

    def _extend_trail(self, here: Pose2D) -> None:
        before = self._trail or here
        if self._trail is None or here.distance_to(before) >= TRAIL_STEP:
            ends = np.array([[(before.x, before.y, 0.02), (here.x, here.y, 0.02)]])
            self._recording.show_row("world/trail", rr.LineStrips3D, strips=ends)
            self._trail = here

    def _people(self, people: FloatArray) -> None:
        radii = people[:, 2]
        feet = at_height(people[:, :2], 0.0)
        feet[:, 2] = radii
        self._recording.show_row(
            "world/people",
            rr.Capsules3D,
            lengths=PERSON_HEIGHT - 2.0 * radii,
            radii=radii,
            translations=feet,
        )

    def _tracks(self, tracks: Sequence[TrackedObject]) -> None:
        """Draw tracks: outline, uncertainty of the position, and velocity as an arrow (1 s)."""
        if not tracks:
            self._recording.hide("world/tracks")
            self._recording.hide("world/tracks/velocity")
            return
        strips: list[FloatArray] = []
        for track in tracks:
            at = Pose2D(*track.position)
            strips.append(outline(at, Footprint.circle(track.radius).points))
            strips.append(uncertainty_ellipse(at, track.covariance))
        self._recording.show_row("world/tracks", rr.LineStrips3D, strips=strips)
        self._recording.show_row(
            "world/tracks/velocity",
            rr.Arrows3D,
            origins=at_height(np.array([track.position for track in tracks]), 0.06),
            vectors=at_height(np.array([track.velocity for track in tracks]), 0.0),
        )

    def _legend(self, plot: str, colours: dict[str, Any]) -> None:
        lines = rr.SeriesLines(
            names=list(colours), colors=list(colours.values()), widths=[1.5] * len(colours)
        )
        self._recording.stream.log(f"plots/{plot}", lines, static=True)

    def _states(self, path: Any, colours: dict[str, Colour]) -> None:
        names = list(colours)
        states = rr.StateConfiguration(values=names, labels=names, colors=list(colours.values()))
        self._recording.stream.log(path, states, static=True)

"""Blueprint of rerun's viewer: its views and their layout."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from stack.telemetry.records import Layer, RunInfo, Snapshot, TreeRow
from stack.telemetry.snapshots.format import PICTURES
from stack.telemetry.tree_text import depths
from stack.types import CostGrid, OccupancyGrid

Point = tuple[float, float, float]

TIMELINE = "mission_time"
HELD = "held"
"""Entity of what holds the robot."""

BACKGROUND = (11, 14, 20)
MAIN_NODES = 3
"""Nodes in the state timeline below the first lanes: mission, activity, hold-ups."""


def node_path(row: TreeRow) -> str:
    """Entity path of a node; begins with its id, so that lanes sort in the order of the tree."""
    return f"tree/{row.id:03d}_{re.sub(r'[^0-9A-Za-z]+', '_', row.name)}"


def main_nodes(rows: tuple[TreeRow, ...]) -> list[TreeRow]:
    """The topmost nodes below the root, in drawing order; the mission's lane shows the root."""
    depth_of = depths(rows)
    below = [row for row in rows if depth_of[row.id] > 0]
    topmost = sorted(below, key=lambda row: (depth_of[row.id], row.id))[:MAIN_NODES]
    return [row for row in rows if row in topmost]


def pictures_of(snapshot: Snapshot) -> frozenset[str]:
    """Names of the cameras that have taken a picture."""
    return frozenset(
        name for name, field in PICTURES.items() if getattr(snapshot, field) is not None
    )


def layout(snapshot: Snapshot, info: RunInfo, pictures: frozenset[str]) -> rrb.Blueprint:
    """Blueprint with world, pictures of these cameras, tree, states, plots and log."""
    shown = [_picture(name, name.capitalize()) for name in sorted(pictures)]
    pictures_share = 4 if info.drives else 6
    shares = [*(pictures_share / len(shown) for _ in shown), 10 - pictures_share]
    side = rrb.Vertical(*shown, _tree(), row_shares=shares)
    top = rrb.Horizontal(_world(snapshot, info), side, column_shares=[5, 2])
    curves = []
    if info.drives:
        curves += [
            _curves("speed", "Speed m/s"),
            _curves("error", "Localisation error m"),
            _curves("health", "Localisation health, battery", (0.0, 1.02)),
        ]
    if snapshot.arm is not None:
        curves += [_curves("joints", "Joints rad/s"), _curves("fingers", "Fingers")]
    log = rrb.TextLogView(origin="log", name="Log")
    bottom = rrb.Horizontal(*curves, log, column_shares=[*(2 for _ in curves), 3])
    return rrb.Blueprint(
        rrb.Vertical(top, _states(snapshot), bottom, row_shares=[5.2, 2.9, 2.1]),
        rrb.TimePanel(state="collapsed", timeline=TIMELINE),
        rrb.BlueprintPanel(state="hidden"),
        rrb.SelectionPanel(state="hidden"),
        auto_views=False,
        auto_layout=False,
    )


def _world(snapshot: Snapshot, info: RunInfo) -> rrb.Spatial3DView:
    eye, target = _eye(snapshot) if info.drives else _eye_at_arm(snapshot)
    hidden = [f"- world/{name}/**" for name in PICTURES]  # they would cover what is on the table
    everything = rr.VisibleTimeRange(
        TIMELINE,
        start=rr.TimeRangeBoundary.infinite(),
        end=rr.TimeRangeBoundary.cursor_relative(),
    )
    overrides: dict[Any, Any] = {"world/trail": rrb.VisibleTimeRanges([everything])}
    return rrb.Spatial3DView(
        origin="world",
        contents=["world/**", *([] if info.drives else hidden)],
        name="World",
        background=BACKGROUND,
        line_grid=rrb.LineGrid3D(visible=False),
        spatial_information=rrb.SpatialInformation(target_frame="map", show_axes=False),
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital, position=eye, look_target=target, eye_up=(0.0, 0.0, 1.0)
        ),
        overrides=overrides,
    )


def _picture(name: str, title: str) -> rrb.Spatial2DView:
    return rrb.Spatial2DView(
        origin=f"world/{name}",
        contents=[f"world/{name}/**"],
        name=title,
        background=BACKGROUND,
        spatial_information=rrb.SpatialInformation(target_frame=f"{name}_picture"),
    )


def _tree() -> rrb.TextDocumentView:
    return rrb.TextDocumentView(origin="tree_text", name="Tree")


def _states(snapshot: Snapshot) -> rrb.StateTimelineView:
    lanes = ["mission", "activity", HELD, *(node_path(row) for row in main_nodes(snapshot.tree))]
    return rrb.StateTimelineView(
        origin="/", contents=[f"+ /{lane}" for lane in lanes], name="Mission states"
    )


def _curves(name: str, title: str, limits: tuple[float, float] | None = None) -> Any:
    axis = rrb.ScalarAxis(range=limits) if limits else None
    return rrb.TimeSeriesView(
        origin=f"plots/{name}",
        name=title,
        axis_y=axis,
        plot_legend=rrb.PlotLegend(rrb.Corner2D.LeftTop),
    )


def _eye(snapshot: Snapshot) -> tuple[Point, Point]:
    """Eye and target that show the map."""
    (x, y), extent = _middle_and_extent(snapshot)
    return (x, y - 0.56 * extent, 0.66 * extent), (x, y - 0.07 * extent, 0.0)


def _eye_at_arm(snapshot: Snapshot) -> tuple[Point, Point]:
    """Eye and target that show an arm and what it reaches."""
    pose = snapshot.pose
    ahead = pose.transform(np.array([[0.35, 0.0], [1.2, -0.9]]))
    return (ahead[1, 0], ahead[1, 1], 1.55), (ahead[0, 0], ahead[0, 1], 0.75)


def _middle_and_extent(snapshot: Snapshot) -> tuple[tuple[float, float], float]:
    """Point on the floor (x, y) that the view centres on, and the extent to show, metres."""
    for name in ("map", "global_costmap", "local_costmap"):
        content = snapshot.layers.get(name, Layer(0, ())).content
        if isinstance(content, OccupancyGrid | CostGrid):
            rows, columns = content.cells.shape
            width, depth = columns * content.resolution, rows * content.resolution
            x, y = content.origin
            return (x + width / 2.0, y + depth / 2.0), max(width * 0.75, depth, 4.0)
    return (snapshot.pose.x, snapshot.pose.y), 10.0

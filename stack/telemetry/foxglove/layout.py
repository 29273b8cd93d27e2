"""A layout of Foxglove's panels for runs: 3-D scene, tree, states, plots and log."""

from __future__ import annotations

from typing import Literal

from foxglove import layouts

from stack.telemetry.foxglove.urdf_links import BASE, MAP

_GRIDS = ("/map", "/global_costmap", "/local_costmap")
_SCENES = ("/scene", "/places", "/robot", "/moving")
_PLANS = {"/path": "#46e2a0", "/local_plan": "#ffd65a"}

LINE = 0.05
"""Width of plans, metres."""

_PLOTS = {
    "Speed, m/s": ("/motion.commanded.linear", "/motion.measured.linear"),
    "Localisation error and deviation, m": ("/localisation.error", "/localisation.deviation"),
    "Health, battery": ("/localisation.health", "/battery.charge"),
}


def layout_json() -> str:
    """The layout as JSON, for *Import from file* in Foxglove's menu of layouts."""
    plots = [_plot(title, paths) for title, paths in _PLOTS.items()]
    side = _split("column", (3.0, _tree()), (2.0, _state()), *((1.5, plot) for plot in plots))
    main = _split("column", (4.0, _scene()), (1.0, _log()))
    return layouts.Layout(content=_split("row", (5.0, main), (3.0, side))).to_json()


def _scene() -> layouts.ThreeDeePanel:
    """The map from above, with the robot in the middle."""
    shown: dict[str, layouts.BaseRendererTopicSettings] = {
        topic: layouts.BaseRendererGridTopicSettings(
            visible=True, color_mode="rgba-fields", interpolation_method="nearestNeighbor"
        )
        for topic in _GRIDS
    }
    for topic in _SCENES:
        shown[topic] = layouts.BaseRendererSceneUpdateTopicSettings(visible=True)
    for topic, colour in _PLANS.items():
        shown[topic] = layouts.BaseRendererPosesTopicSettings(
            visible=True, type="line", line_width=LINE, gradient=(colour, colour)
        )
    shown["/particles"] = layouts.BaseRendererPosesTopicSettings(
        visible=True, type="arrow", arrow_scale=(0.1, 0.02, 0.02), gradient=("#ffb060", "#ffb060")
    )
    shown["/scan"] = layouts.BaseRendererLaserScanTopicSettings(
        visible=True, point_size=4.0, color_mode="flat", flat_color="#ff5a5a"
    )
    return layouts.ThreeDeePanel(
        config=layouts.ThreeDeeConfig(
            topics=shown, fixed_frame=MAP, follow_tf=BASE, follow_mode="follow-position",
            camera_state=layouts.ThreeDeeCameraState(distance=12.0, phi=40.0, perspective=True),
        )
    )  # fmt: skip


def _tree() -> layouts.StateTransitionsPanel:
    """The status of each node over time."""
    series = layouts.StateTransitionsSeries(
        value="/tree.nodes", dynamic_label_field="name", dynamic_value_field="status"
    )
    return layouts.StateTransitionsPanel(
        title="Tree", config=layouts.StateTransitionsConfig(paths=[series], legend_display="left")
    )


def _state() -> layouts.StateTransitionsPanel:
    """The state of the mission, what it does, and why the velocity is limited."""
    named = {"/status.state": "state", "/status.activity": "activity"}
    series = [
        layouts.StateTransitionsSeries(value=path, label=label) for path, label in named.items()
    ]
    series.append(
        layouts.StateTransitionsSeries(
            value="/status.limitations", dynamic_label_field="cause", dynamic_value_field="effect"
        )
    )
    return layouts.StateTransitionsPanel(
        title="Mission", config=layouts.StateTransitionsConfig(paths=series, legend_display="left")
    )


def _plot(title: str, paths: tuple[str, ...]) -> layouts.PlotPanel:
    series = [
        layouts.PlotSeries(value=path, label=path.rpartition("/")[2].replace(".", " "))
        for path in paths
    ]
    return layouts.PlotPanel(title=title, config=layouts.PlotConfig(paths=series))


def _log() -> layouts.LogPanel:
    return layouts.LogPanel(config=layouts.LogConfig(topic_to_render="/log", show_date=False))


def _split(
    direction: Literal["row", "column"], *items: tuple[float, layouts.Content]
) -> layouts.SplitContainer:
    return layouts.SplitContainer(
        direction=direction,
        items=[layouts.SplitItem(proportion=share, content=content) for share, content in items],
    )

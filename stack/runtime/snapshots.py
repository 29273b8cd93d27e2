"""Composes the Snapshot from the parts of the loop."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stack.body import SimulatedWorld
from stack.runtime.interfaces import Parts
from stack.telemetry.records import Debugging, Snapshot
from stack.types import DepthPoints, FloatArray

if TYPE_CHECKING:
    from stack.runtime.loop import Runtime

SHOWN_PARTICLES, SHOWN_DEPTH_POINTS, SHOWN_EVENTS = 300, 1500, 40


def compose_snapshot(runtime: Runtime) -> Snapshot:
    """Compose the snapshot of the current step. Its arrays are shared and must not be modified."""
    parts = runtime.parts
    state, estimate, body = runtime.perceived, parts.perceiver.estimator.estimate, parts.body
    return Snapshot(
        time=body.time,
        step=runtime.steps,
        state=runtime.state,
        reason=runtime.reason,
        tree=parts.tree.rows(),
        pose=estimate.pose,
        covariance=estimate.covariance,
        health=estimate.health,
        health_thresholds=estimate.thresholds,
        rivals=estimate.rivals,
        battery=state.battery,
        odometry=state.motion.pose,
        particles=_thinned(parts.perceiver.estimator.particles, SHOWN_PARTICLES),
        scan=parts.robot.perception.scan,
        path=parts.navigator.path,
        local_plan=parts.navigator.local_plan,
        goal=parts.navigator.goal,
        layers=runtime.layers(),
        commanded=runtime.command.twist,
        measured=state.motion.twist,
        stages=runtime.stages.timings(),
        speed=runtime.pace.factor,
        pace=body.pace if isinstance(body, SimulatedWorld) else 1.0,
        parameters=parts.tuning.current(),
        public_parameters=parts.tuning.public,
        image=runtime.sensing.image,
        detections=parts.robot.perception.seen_objects,
        mask=parts.robot.perception.colour_mask,
        depth_image=runtime.sensing.depth_image,
        depth_points=_depth_points(parts, state.depth),
        cameras=parts.perceiver.cameras.states,
        truth=parts.scorer.truth if parts.scorer else None,
        people=parts.scorer.people if parts.scorer else None,
        tracks=state.at(estimate).world.tracks,
        blackboard=parts.tree.blackboard(),
        counters=runtime.counters(),
        teleop=parts.navigator.base.teleoperation is not None,
        detour=runtime.is_on_detour,
        safety="; ".join(
            filter(None, (runtime.command.reason, parts.navigator.localisation_monitor.reason))
        ),
        events=parts.telemetry.recent(SHOWN_EVENTS),
        debugging=parts.debugger.view() if parts.debugger else Debugging(),
        records_lost="; ".join(record.text for record in parts.telemetry.lost),
    )


def _thinned(rows: FloatArray, most: int) -> FloatArray:
    step = max(1, -(-len(rows) // most))
    return np.asarray(rows[::step], dtype=np.float32)


def _depth_points(parts: Parts, depth: DepthPoints) -> FloatArray | None:
    """Return the obstacles of the depth cameras in the map frame; None while none is used."""
    if not parts.perceiver.depth.is_on:
        return None
    points = _thinned(depth.spatial, SHOWN_DEPTH_POINTS)
    points[:, :2] = parts.perceiver.estimator.estimate.map_from_odom.transform(points[:, :2])
    return points

"""Compose the report of a finished run from the engine's parts."""

from __future__ import annotations

import resource
from dataclasses import asdict, replace
from typing import Any

from missions.execution.build import Engine
from missions.execution.prepare import PreparedMission, RunOptions
from missions.execution.report import Report
from missions.execution.resources import versions
from stack.body import Body, FastLoopBody, LinkedBody
from stack.runtime.holdups import held_seconds, holds_of
from stack.runtime.loop import Runtime
from stack.sim.battery import START_CHARGE
from stack.telemetry.recorder import RunFolder
from stack.telemetry.records import Event, StageTiming
from stack.telemetry.sinks import Sink
from stack.types import Pose2D


class Milestones(Sink):
    """A telemetry sink that keeps the few events the report needs."""

    def __init__(self) -> None:
        self.relocalisations: list[dict[str, Any]] = []
        self.links_lost: list[dict[str, Any]] = []
        self.held: list[Event] = []

    def event(self, event: Event) -> None:
        """Keep `relocalised` events, `link_lost`, and those of hold-ups."""
        if event.kind == "relocalised":
            self.relocalisations.append({"time": event.time, **event.fields})
        elif event.kind == "link_lost":
            self.links_lost.append({"time": event.time, **event.fields})
        elif event.kind in ("held", "held_end"):
            self.held.append(event)


def unstarted_report(
    plan: PreparedMission, options: RunOptions, folder: RunFolder | None
) -> Report:
    """Return the report of a run that ends before its parts are built: an error, without figures.

    Args:
        plan: the mission.
        options: of the run.
        folder: the run folder, or None.
    """
    return Report(
        mission=plan.mission.name, status="error", reason="", seed=options.seed,
        robot=plan.robot.name, world=plan.world.name, versions=versions(),
        cpu_features=cpu_features(), simulated_seconds=0.0, wall_seconds=0.0, real_time_factor=0.0,
        time_to_first_tick=0.0, ticks=0, distance_m=0.0, recoveries=0, replans=0, collisions=None,
        pushed_into=None, min_clearance_m=None, localisation_error=None, relocalised_by="",
        relocalisations=[], battery=START_CHARGE, stages={}, final_pose={}, blackboard={},
        peak_memory_mb=0.0, log_sha256="", folder=str(folder.path) if folder is not None else "",
        arguments=dict(options.arguments or {}),
    )  # fmt: skip


def compose_report(
    unstarted: Report, engine: Engine, milestones: Milestones, *, wall_seconds: float,
    first_tick: float,
) -> Report:  # fmt: skip
    """Return the report of a run.

    Args:
        unstarted: of the same run.
        engine: the engine after the last step.
        milestones: events of the run that the report names.
        wall_seconds: wall seconds from the first to the last step.
        first_tick: wall seconds from building the run to its first tick.
    """
    relocalisations = milestones.relocalisations
    runtime, scorer, simulation = engine.runtime, engine.scorer, engine.simulation
    counters, navigator = runtime.counters(), runtime.parts.navigator
    simulated, moves = engine.body.time, engine.body.description.drivetrain.moves
    return replace(
        unstarted,
        status=str(runtime.state),
        reason=runtime.reason,
        simulated_seconds=round(simulated, 6),
        wall_seconds=wall_seconds,
        real_time_factor=simulated / max(wall_seconds, 1e-9),
        time_to_first_tick=first_tick,
        ticks=engine.tree.ticks,
        distance_m=runtime.distance if moves else None,
        recoveries=engine.tree.recoveries,
        replans=int(counters.get("replans", 0)),
        collisions=None if simulation is None else simulation.tally.by_robot,
        pushed_into=None if simulation is None else simulation.tally.against_standing,
        min_clearance_m=None if simulation is None or not moves else simulation.clearance,
        localisation_error=None
        if scorer is None or not moves
        else {"mean": scorer.mean_error, "max": counters["localisation_error_max"]},
        relocalised_by=_confirmed(relocalisations, runtime),
        relocalisations=relocalisations,
        battery=runtime.perceived.battery.charge,
        stages={name: _timing(stage) for name, stage in runtime.stages.timings().items()},
        final_pose={
            "estimate": _pose(runtime.parts.perceiver.estimator.estimate.pose),
            "truth": None if scorer is None else _pose(scorer.truth),
        },
        blackboard=engine.tree.blackboard(),
        peak_memory_mb=resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0,
        log_sha256=engine.telemetry.log_sha256,
        records_lost=[asdict(record) for record in engine.telemetry.lost],
        doubt={
            "lost_seconds": round(navigator.lost_seconds, 3),
            "obscured_metres": round(navigator.obscured_metres, 3),
        },
        held=held_seconds(holds_of(milestones.held, simulated)),
        links_lost=milestones.links_lost,
        scans_dropped=runtime.sensing.dropped_scans,
        people={} if scorer is None else scorer.people_summary(),
        fast_loop=_loop_timing(engine.body),
        body_link=(dict(engine.body.link_figures) if isinstance(engine.body, LinkedBody) else {}),
    )


def _loop_timing(body: Body) -> dict[str, Any]:
    """Return the timing of a body's fast loop; empty without one."""
    if not isinstance(body, FastLoopBody):
        return {}
    timing = body.loop_statistics
    return {
        "rate": timing.rate, "cycles": timing.cycles, "overruns": timing.overruns,
        "late_median": timing.percentile(0.5), "late_999": timing.percentile(0.999),
        "late_worst": timing.worst, "work_mean": timing.work, "work_worst": timing.worst_work,
        "lacks": list(timing.lacks),
    }  # fmt: skip


def _confirmed(relocalisations: list[dict[str, Any]], runtime: Runtime) -> str:
    """Return the source of the last relocalisation, if the scans fit the map at the end."""
    lost = runtime.parts.perceiver.estimator.estimate.is_lost
    return str(relocalisations[-1]["by"]) if relocalisations and not lost else ""


def cpu_features() -> str:
    """Return the instruction sets of numpy: results are bit-identical on equal sets."""
    import numpy as np

    shown: Any = np.show_config(mode="dicts") or {}
    extensions = shown.get("SIMD Extensions", {})
    return " ".join([*extensions.get("baseline", ()), *extensions.get("found", ())])


def _pose(pose: Pose2D) -> dict[str, float]:
    return {"x": pose.x, "y": pose.y, "heading": pose.heading}


def _timing(stage: StageTiming) -> dict[str, Any]:
    return {
        "mean_ms": stage.mean * 1e3,
        "worst_ms": stage.worst * 1e3,
        "count": stage.count,
        "overruns": stage.overruns,
    }

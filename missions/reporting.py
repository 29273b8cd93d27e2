"""Composes the report of a finished run from its parts."""

from __future__ import annotations

from typing import Any

from missions.assembly import Plan, RunOptions
from missions.report import Report
from missions.resources import versions
from missions.wiring import Wiring
from stack.telemetry.recorder import RunFolder
from stack.telemetry.records import StageTiming
from stack.types import Pose2D


def compose_report(  # noqa: PLR0913 - the measured figures, by keyword
    plan: Plan, options: RunOptions, wiring: Wiring, *, wall_seconds: float, first_tick: float,
    peak_memory_mb: float, folder: RunFolder | None, relocalisations: list[dict[str, Any]],
) -> Report:  # fmt: skip
    """The report. `wall_seconds` is first to last step, `first_tick` from start to first tick."""
    runtime, witness = wiring.runtime, wiring.witness
    counters = runtime.counters()
    pilot = runtime.parts.pilot
    simulated = wiring.body.time
    return Report(
        mission=plan.mission.name,
        status=str(runtime.state),
        reason=runtime.reason,
        seed=options.seed,
        robot=plan.robot.name,
        world=plan.world.name,
        versions=versions(),
        cpu_features=cpu_features(),
        simulated_seconds=round(simulated, 6),
        wall_seconds=wall_seconds,
        real_time_factor=simulated / max(wall_seconds, 1e-9),
        time_to_first_tick=first_tick,
        ticks=wiring.tree.ticks,
        distance_m=runtime.distance,
        recoveries=wiring.tree.recoveries,
        replans=int(counters.get("replans", 0)),
        collisions=wiring.body.tally.by_robot,
        pushed_into=wiring.body.tally.against_standing,
        min_clearance_m=wiring.body.clearance,
        localisation_error={
            "mean": witness.mean_error,
            "max": counters["localisation_error_max"],
        },
        relocalised_by=_confirmed(relocalisations, runtime.parts.localiser.estimate.quality),
        relocalisations=relocalisations,
        battery=pilot.battery.charge,
        stages={name: _timing(stage) for name, stage in runtime.stages.timings().items()},
        final_pose={
            "estimate": _pose(runtime.parts.localiser.estimate.pose),
            "truth": _pose(witness.truth),
        },
        blackboard=wiring.tree.blackboard(),
        peak_memory_mb=peak_memory_mb,
        log_sha256=wiring.telemetry.log_sha256,
        folder=str(folder.path) if folder is not None else "",
        arguments=dict(options.arguments or {}),
    )


def _confirmed(relocalisations: list[dict[str, Any]], quality: float) -> str:
    """What found the pose again, if the scans still fit the map at the end."""
    return str(relocalisations[-1]["by"]) if relocalisations and quality >= 0.3 else ""


def cpu_features() -> str:
    """The instruction sets numpy dispatches to: results are bit-identical per such set."""
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

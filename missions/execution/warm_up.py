"""Compile the kernels of a run before its first step, once per installed copy."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter
from typing import Any

from missions.execution.fit.steps import every_leaf
from missions.execution.people_measures import PeopleMeasures
from missions.execution.prepare import PreparedMission, RunOptions
from stack.compilation import KernelTypes, compile_kernel, missing
from stack.components import DEFAULTS
from stack.control.evasion.evasion import Evasion
from stack.costmap.costmap import Costmap
from stack.frames.links import LinkChain
from stack.navigation.navigator import Navigator
from stack.navigation.plans.arm_plans import ArmPlans
from stack.perception.obstacle_memory import ObstacleMemory
from stack.perception.tracking.tracker import Tracker
from stack.safety.safety import Safety

SECONDS_EACH = 1.5
"""Typical wall seconds to compile a kernel, for the announcement."""


def warm_up(
    plan: PreparedMission,
    options: RunOptions,
    show: Callable[[str], None],
    interrupted: Callable[[], bool] = lambda: False,
) -> None:
    """Compile the kernels that the mission needs and that are not in numba's cache.

    It changes no result, only when the time is spent. With a warm cache it shows nothing.

    Args:
        plan: the mission with its components.
        options: of the run.
        show: receives a line at the beginning, for each part and at the end.
        interrupted: called between two kernels; True leaves the others to the run.
    """
    parts = _missing(plan, options)
    count = sum(len(kernels) for kernels in parts.values())
    if not count:
        return
    began = perf_counter()
    show(f"compiling {count} kernels, for the first run only (about {count * SECONDS_EACH:.0f} s)")
    for part, kernels in parts.items():
        show(f"  {part}: {len(kernels)}")
        for kernel, types in kernels:
            if interrupted():
                return
            compile_kernel(kernel, types)
    show(f"compiled {count} kernels in {perf_counter() - began:.0f} s")


def _missing(plan: PreparedMission, options: RunOptions) -> dict[str, KernelTypes]:
    """Return the kernels to compile by part; each stands with the first part that needs it."""
    found: dict[str, KernelTypes] = {}
    known: set[Any] = set()
    for part, kernels in kernels_of(plan, replayed=plan.recording is not None).items():
        own = tuple(dict.fromkeys(kernel for kernel in kernels if kernel not in known))
        known.update(own)
        absent = missing(own)
        if absent:
            found[part] = absent
    return found


def kernels_of(plan: PreparedMission, *, replayed: bool = False) -> dict[str, KernelTypes]:
    """Return the kernels that a run of a mission calls, by the part that calls them.

    Args:
        plan: the mission with its components.
        replayed: whether a recording replaces the simulated sensors.
    """
    choices = plan.choices
    costs, safety = choices["costmap"], choices["safety"]
    memory = ObstacleMemory.kernels(plan.robot)
    sensors = () if replayed else _sensor_kernels(plan)
    has_arm = plan.robot.arm is not None
    arm = (*LinkChain.kernels(), *ArmPlans.kernels()) if has_arm else ()
    if not plan.robot.drivetrain.moves:
        return {"sensors": sensors, "perception": memory, "arm": arm}
    found: dict[str, KernelTypes] = {
        "arm": arm,
        "sensors": sensors,
        "costmap": Costmap.kernels(costs.parameters, costs.parts),
        "perception": (*(Tracker.kernels() if plan.robot.all_lidars else ()), *memory),
        "safety": Safety.kernels(safety.parts, blind=bool(memory)),
        "navigation": (*Navigator.kernels(), *Evasion.kernels()),
    }
    names = {leaf.behaviour.name for leaf in every_leaf(plan.mission)}
    if "explore" in names:
        from stack.mapping.exploration.kernels import EXPLORATION

        found["exploration"] = EXPLORATION
    return {**found, **{kind: choices[kind].kernels(plan.robot) for kind in DEFAULTS}}


def _sensor_kernels(plan: PreparedMission) -> KernelTypes:
    """Return the kernels of simulated wheels, sensors and people, and of measures of these."""
    from stack.sim.people import People
    from stack.sim.sensors.lidar import Lidar
    from stack.sim.sensors.sonar import Sonar
    from stack.sim.wheel_controller import WheelController

    lidars = (Lidar.kernels(lidar, plan.world) for lidar in plan.robot.real_lidars.values())
    sonars = Sonar.kernels() if plan.robot.sonars else ()
    measures = PeopleMeasures.kernels() if plan.world.people else ()
    walkers = (*People.kernels(plan.world), *measures)
    wheels = WheelController.kernels()
    return (*(kernel for kernels in lidars for kernel in kernels), *sonars, *walkers, *wheels)

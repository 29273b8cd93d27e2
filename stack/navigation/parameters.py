"""Settings of navigation: tolerances, patience, planning and the recoveries."""

from __future__ import annotations

from dataclasses import dataclass

from stack.parameters import parameter


@dataclass(frozen=True)
class NavigationParameters:
    """Settings of `Navigation`."""

    goal_position: float = parameter(
        0.15, "m", above=0.0, help="how near counts as there, where a task does not say"
    )
    goal_heading: float = parameter(0.15, "rad", above=0.0, help="heading error that counts as 0")
    goal_settle: float = parameter(
        2.0, "s", at_least=0.0, help="a goal counts after this long within, standing or not"
    )
    via_radius: float = parameter(0.4, "m", above=0.0, help="how near a pose on the way is passed")
    progress_distance: float = parameter(0.3, "m", above=0.0, help="moving this far is progress")
    progress_angle: float = parameter(0.4, "rad", above=0.0, help="turning this far is progress")
    progress_time: float = parameter(8.0, "s", above=0.0, help="a drive without progress fails")
    planning_latency: float = parameter(
        0.1, "s", at_least=0.0, help="a plan is used this long after it was asked for"
    )
    wait_for_plan: bool = parameter(
        True, help="simulation: wait for a late plan; hardware: drive on until it comes"
    )
    replan_period: float = parameter(2.0, "s", above=0.0, help="looks for a better path this often")
    replan_interval: float = parameter(0.5, "s", above=0.0, help="plans at most this often")
    replan_gain: float = parameter(
        0.1, at_least=0.0, at_most=1.0, help="share by which a new path must be cheaper to be taken"
    )
    look_ahead: float = parameter(
        3.0, "m", above=0.0, help="path ahead that is watched for being blocked"
    )
    off_path: float = parameter(
        0.5, "m", above=0.0, help="plans anew when farther from the path than this"
    )
    patience: float = parameter(
        2.0, "s", at_least=0.0, help="standing still, tries this long before no path is a failure"
    )
    collision_patience: float = parameter(
        5.0, "s", at_least=0.0, help="waits this long before something in the way is a failure"
    )
    lost_health: float = parameter(
        0.3, at_least=0.0, at_most=1.0, help="localisation health below which the pose is doubted"
    )
    lost_time: float = parameter(1.5, "s", at_least=0.0, help="doubt this long is a failure")
    spin_speed: float = parameter(1.0, "rad/s", above=0.0, help="turning speed of spins")
    back_up_speed: float = parameter(0.15, "m/s", above=0.0, help="speed of backing up")
    straight_speed: float = parameter(
        0.25, "m/s", above=0.0, help="speed of driving straight on a heading"
    )
    escape_speed: float = parameter(
        0.15, "m/s", above=0.0, help="speed of driving out of a tight spot"
    )
    recovery_padding: float = parameter(
        0.05, "m", at_least=0.0, help="stays free round the footprint in spins and backing up"
    )
    escape_padding: float = parameter(
        0.03, "m", at_least=0.0, help="stays free round the footprint on the way out, if it is now"
    )
    recovery_patience: float = parameter(
        2.0, "s", at_least=0.0, help="a spin or backing up waits this long for its way to clear"
    )
    stall_time: float = parameter(
        3.0, "s", above=0.0, help="a spin or backing up that does not move for this long fails"
    )

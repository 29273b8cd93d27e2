"""Parameters of navigation: patience, planning and recoveries."""

from __future__ import annotations

from dataclasses import dataclass

from stack.parameters import parameter


@dataclass(frozen=True)
class NavigationParameters:
    """Parameters of `Navigator`."""

    planning_latency: float = parameter(
        0.1, "s", at_least=0.0, help="time from the request of a plan to its use"
    )
    replan_period: float = parameter(
        2.0, "s", above=0.0, public=True, help="time between two searches for a better path"
    )
    look_ahead: float = parameter(
        3.0, "m", above=0.0, help="length of path ahead that is checked for obstacles"
    )
    patience: float = parameter(
        2.0, "s", at_least=0.0, public=True,
        help="a standing robot without a path fails after this time",
    )  # fmt: skip
    replan_patience: float = parameter(
        1.0, "s", at_least=0.0, public=True,
        help="waits this long in front of an obstacle, then replans",
    )  # fmt: skip
    collision_patience: float = parameter(
        5.0, "s", at_least=0.0, public=True, help="waits this long after that, then fails"
    )
    person_patience: float = parameter(
        20.0, "s", at_least=0.0, public=True,
        help="waits this long instead while a person is in the way, then fails",
    )  # fmt: skip
    person_clearance: float = parameter(
        0.05, "m", at_least=0.0,
        help="distance at which the robot stands before a person on its path: it can still turn",
    )  # fmt: skip
    give_way_after: float = parameter(
        4.0, "s", at_least=0.0,
        help="a drive that faces a person this long leaves the way for them to pass, twice as long "
        "while they still move; it does so at once where it would meet somebody in a corridor too "
        "narrow for two",
    )  # fmt: skip
    give_way_time: float = parameter(
        15.0, "s", at_least=0.0, help="longest time that leaving the way and waiting there takes"
    )
    give_way_attempts: int = parameter(
        3, at_least=0, at_most=100, help="how often a drive does so before it only waits; 0: never"
    )
    ambiguous_goals: str = parameter(
        "disambiguate", one_of=("disambiguate", "refuse", "drive"), public=True,
        help="what a goal does while other poses explain the scans as well: first drive to where "
        "they differ, fail with AMBIGUOUS, or ignore them",
    )  # fmt: skip
    view_attempts: int = parameter(
        8, at_least=1, at_most=100,
        help="number of places to which the robot drives to tell such poses apart",
    )  # fmt: skip
    lost_time: float = parameter(
        1.5, "s", at_least=0.0,
        help="a drive stands this long while the robot is lost, then fails with LOST",
    )  # fmt: skip
    lost_motions: str = parameter(
        "refuse", one_of=("refuse", "drive"), public=True,
        help="what motions without a path do while the robot is lost (spin, back up, escape, "
        "velocities of behaviours): fail with LOST, or drive",
    )  # fmt: skip
    obscured_speed: float = parameter(
        0.2, "m/s", at_least=0.0,
        help="top speed while the robot counts as lost only because unmapped things hide the map; "
        "0: it stands, as everywhere else where it is lost",
    )  # fmt: skip
    obscured_distance: float = parameter(
        5.0,
        "m",
        at_least=0.0,
        help="distance driven by odometry while the map is hidden; then the robot stops",
    )
    spin_speed: float = parameter(
        1.0, "rad/s", above=0.0, robot_limit="angular_speed", public=True,
        help="turning speed of spins",
    )  # fmt: skip
    back_up_speed: float = parameter(
        0.15, "m/s", above=0.0, robot_limit="reverse_speed", public=True, help="speed of backing up"
    )
    straight_speed: float = parameter(
        0.25, "m/s", above=0.0, robot_limit="linear_speed",
        help="speed of driving straight on a heading",
    )  # fmt: skip
    escape_speed: float = parameter(
        0.15, "m/s", above=0.0, help="speed of driving out of a tight spot"
    )

    def plan_due(self, requested: float) -> float:
        """Return the time from which a plan is used, given that of its request, seconds.

        It is never used in the step that requests it: the loop waits for plans between two steps.
        """
        return requested + max(self.planning_latency, 1e-6)

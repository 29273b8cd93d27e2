"""Parameters of navigation: patience, planning and recoveries."""

from __future__ import annotations

from dataclasses import dataclass

from stack.parameters import parameter


@dataclass(frozen=True)
class NavigationParameters:
    """Parameters of `Navigator`."""

    via_radius: float = parameter(
        0.4, "m", above=0.0, help="distance within which a via pose is passed"
    )
    turning_distance: float = parameter(
        0.25, "m", at_least=0.0, at_most=1.0,
        help="where there is no room to turn to the goal's heading, turn at a place within this "
        "distance of the goal, unless the task sets its tolerance; 0: only at the goal",
    )  # fmt: skip
    planning_latency: float = parameter(
        0.1, "s", at_least=0.0, help="time from the request of a plan to its use"
    )
    replan_period: float = parameter(
        2.0, "s", above=0.0, help="time between two searches for a better path"
    )
    replan_interval: float = parameter(
        0.5, "s", above=0.0, help="minimum time between two plan requests"
    )
    replan_gain: float = parameter(
        0.1, at_least=0.0, at_most=1.0, help="share by which a better path must be cheaper"
    )
    look_ahead: float = parameter(
        3.0, "m", above=0.0, help="length of path ahead that is checked for obstacles"
    )
    off_path: float = parameter(
        0.5, "m", above=0.0, help="distance to the path above which the robot replans"
    )
    patience: float = parameter(
        2.0, "s", at_least=0.0, help="a standing robot without a path fails after this time"
    )
    replan_patience: float = parameter(
        1.0, "s", at_least=0.0, help="waits this long in front of an obstacle, then replans"
    )
    collision_patience: float = parameter(
        5.0, "s", at_least=0.0, help="waits this long after that, then fails"
    )
    person_patience: float = parameter(
        20.0, "s", at_least=0.0,
        help="waits this long instead while a person is in the way, then fails",
    )  # fmt: skip
    person_distance: float = parameter(
        1.5, "m", at_least=0.0, help="a person this close ahead is in the way"
    )
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
    blockage_time: float = parameter(
        10.0, "s", at_least=0.0,
        help="how long a place that was found blocked is avoided; doubles each time it is again",
    )  # fmt: skip
    blockage_radius: float = parameter(
        0.6, "m", above=0.0, help="paths this close to such a place lead through it"
    )
    search_scans: int = parameter(
        3, at_least=1, at_most=100,
        help="number of scans that a search of the whole map for the pose matches together",
    )  # fmt: skip
    search_time: float = parameter(
        5.0, "s", above=0.0, help="that search fails if the scans do not arrive within this time"
    )
    ambiguous_goals: str = parameter(
        "disambiguate", one_of=("disambiguate", "refuse", "drive"),
        help="what a goal does while other poses explain the scans as well: first drive to where "
        "they differ, fail with AMBIGUOUS, or ignore them",
    )  # fmt: skip
    ambiguous_distance: float = parameter(
        1.5, "m", at_least=0.0, at_most=10.0,
        help="a drive goes on past another pose that is nearer than this, and than half of the way "
        "to its goal: the drive resolves it on the way; 0: any other pose ends a drive",
    )  # fmt: skip
    view_attempts: int = parameter(
        8, at_least=1, at_most=100,
        help="number of places to which the robot drives to tell such poses apart",
    )  # fmt: skip
    view_time: float = parameter(
        0.5, "s", at_least=0.0, help="how long it stands and looks at each of them"
    )
    view_tolerance: float = parameter(0.3, "m", above=0.0, help="goal tolerance at such a place")
    jump_distance: float = parameter(
        0.3, "m", at_least=0.0,
        help="a new pose farther away than this clears the sensed obstacles",
    )  # fmt: skip
    jump_angle: float = parameter(
        0.2, "rad", at_least=0.0, help="a new heading farther off than this clears them too"
    )
    teleop_timeout: float = parameter(
        0.5, "s", above=0.0, help="how long one velocity command of the operator is driven"
    )
    lost_time: float = parameter(
        1.5, "s", at_least=0.0,
        help="a drive stands this long while the robot is lost, then fails with LOST",
    )  # fmt: skip
    lost_motions: str = parameter(
        "refuse", one_of=("refuse", "drive"),
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
        1.0, "rad/s", above=0.0, robot_limit="angular_speed", help="turning speed of spins"
    )
    back_up_speed: float = parameter(
        0.15, "m/s", above=0.0, robot_limit="reverse_speed", help="speed of backing up"
    )
    straight_speed: float = parameter(
        0.25, "m/s", above=0.0, robot_limit="linear_speed",
        help="speed of driving straight on a heading",
    )  # fmt: skip
    escape_speed: float = parameter(
        0.15, "m/s", above=0.0, help="speed of driving out of a tight spot"
    )
    recovery_padding: float = parameter(
        0.05, "m", at_least=0.0, help="distance kept around the footprint in recoveries"
    )
    escape_padding: float = parameter(
        0.03, "m", at_least=0.0, help="distance kept around the footprint in an escape, if free now"
    )
    recovery_patience: float = parameter(
        2.0, "s", at_least=0.0, help="a blocked recovery waits this long, then fails"
    )
    stall_time: float = parameter(
        3.0, "s", above=0.0, help="a recovery that does not move for this long fails"
    )

    def plan_due(self, requested: float) -> float:
        """Return the time from which a plan is used, given that of its request, seconds.

        It is never used in the step that requests it: the loop waits for plans between two steps.
        """
        return requested + max(self.planning_latency, 1e-6)

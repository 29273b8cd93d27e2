"""Parameters of evasion."""

from __future__ import annotations

from dataclasses import dataclass

from stack.parameters import parameter


@dataclass(frozen=True)
class EvasionParameters:
    """Parameters of `Evasion`."""

    when: str = parameter(
        "driving", one_of=("driving", "always", "never"), public=True,
        help="when the robot predicts how people walk and keeps clear of them: during drives (also "
        "while it waits for a plan or stands before an obstacle), whenever the mission runs, or "
        "never: then a person is an obstacle like others",
    )  # fmt: skip
    horizon: float = parameter(
        2.5, "s", above=0.0, at_most=10.0, help="how far ahead robot and people are predicted"
    )
    time_to_meeting: float = parameter(
        2.0, "s", at_least=0.0, at_most=10.0,
        help="time to a meeting below which the robot leaves its path for a lane beside it",
    )  # fmt: skip
    retreat_time: float = parameter(
        2.0, "s", at_least=0.0, at_most=10.0,
        help="the robot backs or turns away only if it would be met within this time while "
        "standing; otherwise it uses lanes. Shorter: fewer retreats, more contacts",
    )  # fmt: skip
    padding: float = parameter(
        0.05, "m", at_least=0.0, at_most=1.0, help="distance to a person that counts as a meeting"
    )
    growth: float = parameter(
        0.05, "m/s", at_least=0.0, at_most=1.0,
        help="increase of that distance with the time ahead: predictions become less certain",
    )  # fmt: skip
    headway: float = parameter(
        0.1, "s", at_least=0.0, at_most=1.0,
        help="increase of that distance with the robot's speed towards the person: only a slow "
        "robot passes closely",
    )  # fmt: skip
    passing_speed: float = parameter(
        0.05, "m/s", at_least=0.0, at_most=5.0,
        help="speed limit beside a person at distance 0, see passing_time",
    )  # fmt: skip
    passing_time: float = parameter(
        0.5, "s", at_least=0.0, at_most=10.0,
        help="the speed limit before and beside a person is passing_speed + distance / "
        "passing_time: a person who walks outward may turn back; 0: no limit",
    )  # fmt: skip
    meeting_weight: float = parameter(
        8.0, at_least=0.0, help="cost of a meeting now, in metres of deviation"
    )
    closeness_weight: float = parameter(
        1.0, at_least=0.0, help="cost of a second without any distance, in metres of deviation"
    )
    rest: float = parameter(
        0.5, "s", at_least=0.0,
        help="after an evasive motion, the wanted one must be clear for this long",
    )  # fmt: skip

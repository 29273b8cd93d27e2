"""The brain's side of the link to a rover: a fast loop with the driver `mavlink`."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Any

from robots.mavlink.autopilots import BY_NAME
from robots.mavlink.driver import (
    ESTIMATE,
    FRAMES,
    packed_engagement,
    unpacked_frames,
)
from robots.mavlink.estimates import SentEstimate
from robots.mavlink.hearing import Hearing, Rover
from robots.mavlink.parameters import MavlinkParameters
from robots.mavlink.rover_link import Phase
from stack.body import DEAD_MAN, FAST_LOOP, LINK, PILOT
from stack.drivetrain.description import RobotDescription
from stack.drivetrain.wheel_loop import loop_plan
from stack.fast_loop.client import FastLoop, LoopSetup
from stack.mavlink.link import Received
from stack.types import LoopStatistics, Twist

RATE = 100.0
"""Cycles per second: a message waits at most 10 ms for its time of arrival."""

TORQUE_OFF = 2.0
"""Seconds without a command after which the loop lets go; the rover stands by then."""


class LoopLink:
    """A rover, driven by a process of its own.

    Args:
        robot: with the limits that the process keeps.
        parameters: of the body.

    Attributes:
        heard: what the rover has told.
        phase: how far the link has got.
        state: further numbers of the link.

    Raises:
        BodyError: the process does not begin.
    """

    def __init__(self, robot: RobotDescription, parameters: MavlinkParameters) -> None:
        from pymavlink.dialects.v20 import all as dialect

        self._codec: Any = dialect.MAVLink(None)
        self._codec.robust_parsing = True
        self.heard = Hearing(
            parameters.own_system, parameters.system, BY_NAME.get(parameters.autopilot),
            lambda ack: None,
        )  # fmt: skip
        self.phase, self.state = Phase.SEARCHING, dict[str, Any]()
        self._engagement, self._is_stopped = 0, False
        plan = loop_plan(robot.drivetrain, DEAD_MAN, TORQUE_OFF)
        self._loop = FastLoop(LoopSetup(plan, "mavlink", asdict(parameters), RATE))

    @property
    def rover(self) -> Rover | None:
        """The rover; None until it is found."""
        return self.heard.rover

    @property
    def problem(self) -> str:
        """Why the rover does not obey; empty while it does, or is on the way to."""
        return self._loop.problem or str(self.state.get("problem", "not heard yet"))

    @property
    def fault(self) -> str:
        """Kind of the problem, as `BodyHealth.fault`."""
        if self._loop.problem:
            return FAST_LOOP
        return PILOT if self.phase is Phase.TAKEN_OVER else LINK

    @property
    def statistics(self) -> LoopStatistics:
        """Timing of the process."""
        return self._loop.statistics()

    def figures(self, seconds: float) -> dict[str, Any]:
        """Latency and rates of the link, for the report.

        Args:
            seconds: for which the rover has been known.
        """
        figures = self.heard.figures
        trips = sorted(figures.round_trips)
        span = max(seconds, 1e-3)
        return {
            "rates": {kind: round(n / span, 2) for kind, n in sorted(figures.kinds.items())},
            "setpoints": round(self.state.get("setpoints", 0) / span, 2),
            "round_trip_median": _share(trips, 0.5), "round_trip_99": _share(trips, 0.99),
            "missed": self.state.get("missed", 0), "losses": self.state.get("losses", 0),
        }  # fmt: skip

    def drive(self, twist: Twist, *, emergency_stop: bool = False) -> None:
        """Drive a velocity for the next DEAD_MAN seconds; not while an emergency stop stands."""
        if emergency_stop != self._is_stopped:
            self._is_stopped = emergency_stop
            (self._loop.emergency_stop if emergency_stop else self._loop.release)()
        self._loop.command(twist)

    def engage(self) -> None:
        """Ask for the driving mode, and to be armed."""
        self._engagement += 1
        self._loop.send(packed_engagement(self._engagement))

    def tell_estimate(self, estimate: SentEstimate) -> None:
        """Let the rover know an estimate of its pose."""
        self._loop.send(ESTIMATE + estimate.packed())

    def take(self) -> list[Received]:
        """Return the rover's messages since the last call."""
        found: list[Received] = []
        for content in self._loop.messages():
            if content[:1] == FRAMES:
                for at, frame in unpacked_frames(content):
                    messages = self._codec.parse_buffer(frame) or []
                    found += [Received(message, at) for message in messages]
            else:
                self.state = json.loads(content[1:])
                self.phase = Phase(self.state["phase"])
        return [item for item in found if self.heard.takes(item)]

    def close(self) -> None:
        """Stop and disarm the rover, and end the process. Safe to call twice."""
        self._loop.close()


def _share(ordered: list[float], share: float) -> float | None:
    """The value below which this share of ordered values is; None without any."""
    return round(ordered[min(int(share * len(ordered)), len(ordered) - 1)], 5) if ordered else None

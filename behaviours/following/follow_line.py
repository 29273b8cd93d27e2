"""Line following with a camera."""

from __future__ import annotations

from math import copysign
from typing import cast

import numpy as np
from py_trees.common import Status

from behaviours._line.steering import KEPT_BEHIND, CentreLine, Sweep, approach, extended, steer
from behaviours._line.trace import LineEnd, LineTrace, Sector, trace_line
from behaviours._motion.driving import TIME_TO_LIVE
from behaviours._motion.following import FollowingBehaviour
from behaviours.base import DRIVE_FAILURES, output, port
from stack.types import (
    LINE_COLOURS,
    STANDSTILL,
    FailureCode,
    FloatArray,
    FloorLines,
    LineColour,
    Pose2D,
    Twist,
    wrap_angle,
)

BLIND_TIME = 2.0
COMMAND_LAG = 0.1
"""Seconds from a command to its effect; the robot steers for its pose after it."""

SECTOR, SEARCH = Sector(2.2, 1.0, along=False), Sector(1.1, 1.0, along=False)
"""Where a line is looked for at the start, and when it is lost: another one may be farther away."""

AHEAD_ANGLE = 0.5
"""Radians to both sides of the line's direction, in which it is looked for beyond its end."""

FIRST_LOOK = 1.0
"""Seconds for which the robot stands at the start. The gyro's bias is measured at standstill: what
is left of it turns the remembered line. Without a line in sight, the robot then turns to look."""

LEAST_SEEN = 6
"""Points of a line that is new, at least: 10 cm."""

CHOICE_FINAL_AT = 0.8
"""Metres before a junction at which the choice is final."""

SAME_JUNCTION = 0.3
"""Metres between two sightings of one junction, at most."""

ON_LINE = 0.15
"""Metres from the robot to the nearest part of the line that was seen, while it is on it."""

SLOWER, SLOWEST, SLOWEST_ON = 0.8, 0.05, 0.15
"""1/s, speed per distance to the end of the line; m/s at the end mark and at other ends."""

MARK_KNOWN, AT_END = 0.4, 0.02
"""Metres before the end mark from which on it is not looked for again; where the robot stops."""


class FollowLine(FollowingBehaviour):
    """Drive along a line on the floor that the camera sees, across gaps and junctions.

    Drives to the line first, if it begins within 2 m ahead. Succeeds at the end mark, a short bar
    across the line, or at the first `until_…` that is reached. Where the line ends without a mark,
    it goes on for the length of `gap` and then turns to both sides; fails with NO_LINE if it finds
    none, with NO_IMAGE if the camera stops, and with NO_PROGRESS if the robot is stuck.
    """

    colour: str = port(
        "colour of the line; dark and light: than the floor", default="dark", one_of=LINE_COLOURS
    )
    width: float = port("width of the line", unit="m", default=0.05, at_least=0.02, at_most=0.3)
    speed: float = port("speed along the line", unit="m/s", default=0.4, above=0.0, at_most=2.0)
    at_junction: list[str] = port(
        "branch to follow at each junction in turn; the last one also at all later ones",
        default=["straight"], one_of=("left", "straight", "right"),
    )  # fmt: skip
    gap: float = port(
        "longest gap that is crossed", unit="m", default=0.5, at_least=0.0, at_most=1.5
    )
    until_mark: bool = port("end at the end mark", default=True)
    travelled: float = output("distance along the line", unit="m")
    junctions: int = output("junctions passed")
    error_rms: float = output("RMS distance from the seen line", unit="m")

    needs = ("camera",)
    claims = ("base",)
    takes_time = True
    fails_with = (*DRIVE_FAILURES, FailureCode.NO_LINE, FailureCode.NO_IMAGE)

    def initialise(self) -> None:
        super().initialise()
        self._since_seen = self.start_timer()
        self._stamp = self.robot.time
        self._since_start = self.start_timer()
        self._line: CentreLine | None = None
        self._end, self._is_on_line = LineEnd.OPEN, False
        self._sweep: Sweep | None = None
        self._decided: list[FloatArray] = []

    def update(self) -> Status:
        robot = self.robot
        self.record_way()
        lines = robot.perception.floor_lines(cast(LineColour, self.colour), self.width)
        if lines is not None and lines.stamp > self._stamp:
            self._stamp = lines.stamp
            self._since_seen.restart()
            self._look(lines)
        self._record_progress()
        if self._is_over():
            return Status.SUCCESS
        if self._sweep is None and self.is_stuck:
            return self.no_progress()
        if self._since_seen.is_over(BLIND_TIME):
            return self.fail(
                FailureCode.NO_IMAGE, f"the camera gave no picture for {BLIND_TIME:g} s"
            )
        command = self._command()
        if command is None:
            return self.fail(FailureCode.NO_LINE, self._where_lost())
        robot.base.drive_for(command, TIME_TO_LIVE)
        return Status.RUNNING

    def _look(self, lines: FloorLines) -> None:
        """Trace the line again from where the robot is on it, or look for one."""
        here, line = self.robot.base.odometry, self._line
        if line is not None and self._end is LineEnd.MARK and line.remaining < MARK_KNOWN:
            return
        if line is None or self._sweep is not None:
            old, sector = (None, SECTOR) if line is None else (line.points, SEARCH)
            trace = self._traced(lines, np.array([here.x, here.y]), here.heading, sector, old)
            if trace is not None and len(trace.points) >= LEAST_SEEN:
                self._follow(approach(here, trace.points)[:-1], trace)
            return
        ahead = Sector(self.gap + ON_LINE, AHEAD_ANGLE)
        trace = self._traced(lines, line.here, line.heading(), ahead)
        self._is_on_line = False
        if trace is not None:
            behind = line.passed[-KEPT_BEHIND:-1]
            self._is_on_line = bool(np.linalg.norm(trace.points[0] - line.here) < ON_LINE)
            self._follow(behind if self._is_on_line else approach(here, trace.points)[:-1], trace)

    def _traced(
        self, lines: FloorLines, start: FloatArray, heading: float, sector: Sector,
        passed: FloatArray | None = None,
    ) -> LineTrace | None:  # fmt: skip
        ahead = len(self._decided)

        def choose(corner: FloatArray, turns: FloatArray, tips: FloatArray) -> int:
            """Return the branch to follow: at a decided junction the one followed so far."""
            nonlocal ahead
            if self._line is not None and self._is_decided(corner):
                return int(np.argmin([self._line.distance(tip) for tip in tips]))
            word = self.at_junction[min(ahead, len(self.at_junction) - 1)]
            ahead += 1
            return int(np.argmin({"left": -turns, "right": turns}.get(word, np.abs(turns))))

        return trace_line(
            lines, start, heading, sector, choose, width=self.width, gap=self.gap, passed=passed
        )

    def _is_decided(self, corner: FloatArray) -> bool:
        return any(np.linalg.norm(one - corner) < SAME_JUNCTION for one in self._decided)

    def _follow(self, before: FloatArray, trace: LineTrace) -> None:
        """Follow a traced line, which comes after points `before` it."""
        here = self.robot.base.odometry
        points = np.concatenate([before, trace.points])
        is_marked = trace.end is LineEnd.MARK and self.until_mark
        if not is_marked:
            corners = [*self._decided[-1:], *trace.junctions]
            is_open = trace.end is LineEnd.OPEN
            points = extended(points, self.gap, curved=is_open, corners=corners)
        self._line = CentreLine(points)
        self._line.advance(here)
        self._end = LineEnd.MARK if is_marked else LineEnd.OPEN
        if self._sweep is not None:
            self._sweep = None
            self.expect_motion()
        for corner in trace.junctions:
            is_near = np.hypot(corner[0] - here.x, corner[1] - here.y) < CHOICE_FINAL_AT
            if is_near and not self._is_decided(corner):
                self._decided.append(corner)

    def _command(self) -> Twist | None:
        """Return the velocity; None if there is no line."""
        here, line = self.robot.base.odometry, self._line
        if self._sweep is not None:
            self.feedback_message = "turning, looking for the line"
            return self._sweep.command(here.heading)
        is_waiting = not self._since_start.is_over(FIRST_LOOK)
        if line is None or is_waiting:
            self.feedback_message = "looking for the line"
            if not is_waiting:
                self._sweep = Sweep(here.heading, 1)
            return STANDSTILL
        if line.remaining <= AT_END:
            side = copysign(1.0, wrap_angle(line.heading() - line.heading(-2.0 * self.gap)))
            self._sweep = Sweep(here.heading, round(side))
            return STANDSTILL
        slowest = SLOWEST if self._end is LineEnd.MARK else SLOWEST_ON
        speed = min(self.speed, line.speed_limit(), max(slowest, SLOWER * line.remaining))
        moving = self.robot.base.speed
        soon = here.compose(Pose2D(moving.linear * COMMAND_LAG, 0.0, moving.angular * COMMAND_LAG))
        return steer(line.offset(soon, moving.linear), speed)

    def _record_progress(self) -> None:
        line = self._line
        if line is None:
            self.travelled, self.junctions, self.error_rms = 0.0, 0, 0.0
            return
        line.advance(self.robot.base.odometry)
        if self._is_on_line:
            if self._start is None:
                self.begin_here()
            error = line.offset(self.robot.base.odometry, 0.0).error
            self._errors.add(error)
            self.feedback_message = f"{100 * error:.0f} cm beside the line"
        self.travelled = self.way_followed
        self.junctions, self.error_rms = len(self._decided), self._errors.value

    def _is_over(self) -> bool:
        line = self._line
        if line is None or self._start is None:
            return False
        at_mark = self._end is LineEnd.MARK and line.remaining <= AT_END
        return at_mark or self.is_limit_reached

    def _where_lost(self) -> str:
        if self._start is None:
            return f"no {self.colour} line of {100 * self.width:g} cm in sight"
        return f"the line was lost after {self.travelled:.1f} m"

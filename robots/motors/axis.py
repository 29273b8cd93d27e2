"""One axis of a motor drive, as heard on the bus."""

from __future__ import annotations

from math import tau

from robots.motors.can_simple import (
    AxisState,
    EncoderEstimates,
    Errors,
    Heartbeat,
    Message,
    error_names,
    result_name,
    state_name,
)

FASTEST = 1000.0
"""Turns per second of a motor; what claims to be faster is not a measurement."""


class Axis:
    """State of an axis, in units of its wheel.

    A fault stands until `forget`, also when its cause is gone.

    Args:
        node: on the bus.
        turns: of the motor for one of the wheel; negative: it turns the other way.

    Attributes:
        heartbeat: the last one; None before the first.
        angle: of the wheel since the first estimate, radians.
        speed: of the wheel, rad/s.
        heard_at: when the last heartbeat came, seconds; -inf before the first.
        estimated_at: when the last estimates came.
        jumps: of the position that no motor can do, as after a restart of the drive.
    """

    def __init__(self, node: int, turns: float) -> None:
        self.node, self._per_turn = node, tau / turns
        self.heartbeat: Heartbeat | None = None
        self.angle = self.speed = 0.0
        self.heard_at = self.estimated_at = float("-inf")
        self.jumps = 0
        self._position: float | None = None
        self._faults, self._reason, self._lost, self._dropped = 0, 0, "", False

    def take(self, message: Message, now: float) -> None:
        """Take a message of this axis."""
        if isinstance(message, Heartbeat):
            self.heartbeat, self.heard_at = message, now
        elif isinstance(message, EncoderEstimates):
            self._take_estimates(message, now)
        elif isinstance(message, Errors):
            self._reason = message.disarmed_by

    @property
    def is_closed_loop(self) -> bool:
        """Whether it obeys velocities."""
        beat = self.heartbeat
        return beat is not None and beat.state == AxisState.CLOSED_LOOP_CONTROL and not beat.error

    @property
    def error(self) -> int:
        """Active errors: bits of `AxisError`."""
        return 0 if self.heartbeat is None else self.heartbeat.error

    @property
    def has_left(self) -> bool:
        """Whether it has left closed loop control while it was driven."""
        return self._dropped

    def watch(
        self, now: float, since: float, silent_after: float, *, driven: bool, settled: bool
    ) -> None:
        """Notice faults.

        Args:
            now: seconds.
            since: when somebody began to listen.
            silent_after: longest time between two messages of a kind, seconds.
            driven: whether it must be in closed loop control.
            settled: whether its errors count: not while they are being cleared.
        """
        for what, at in (("heartbeat", self.heard_at), ("encoder estimate", self.estimated_at)):
            if now - max(at, since) > silent_after and not self._lost:
                self._lost = f"no {what} for more than {silent_after:g} s"
        if settled:
            self._faults |= self.error
        if driven and not self.is_closed_loop:
            self._dropped = True

    def forget(self) -> None:
        """Forget all faults."""
        self._faults, self._reason, self._lost, self._dropped = 0, 0, "", False

    @property
    def problem(self) -> str:
        """What is wrong, with the drive's own names; empty if nothing is."""
        if self._faults:
            return f"node {self.node}: {error_names(self._faults)}"
        if self._lost:
            return f"node {self.node}: {self._lost}; look at its cable, power and bit rate"
        if self._dropped:
            reason = f", disarmed by {error_names(self._reason)}" if self._reason else ""
            return f"node {self.node} has left closed loop control: {self._state}{reason}"
        return ""

    @property
    def refusal(self) -> str:
        """Why it does not enter closed loop control."""
        what = f"node {self.node} does not enter closed loop control: {self._state}"
        beat = self.heartbeat
        if beat is not None and beat.error:
            return f"{what}, {error_names(beat.error)}"
        return what if beat is None else f"{what}, {result_name(beat.result)}"

    @property
    def _state(self) -> str:
        return "no heartbeat" if self.heartbeat is None else state_name(self.heartbeat.state)

    def to_motor(self, speed: float, effort: float) -> tuple[float, float]:
        """Return turns per second and newton metres of the motor, from rad/s and N m of the wheel.

        The gear is taken to have no losses.
        """
        return speed / self._per_turn, effort * self._per_turn / tau

    def _take_estimates(self, message: EncoderEstimates, now: float) -> None:
        if abs(message.velocity) > FASTEST:
            return
        before, self._position = self._position, message.position
        if before is not None:
            step, most = message.position - before, FASTEST * (now - self.estimated_at) + 1.0
            if abs(step) > most:
                self.jumps += 1
            else:
                self.angle += self._per_turn * step
        self.speed = self._per_turn * message.velocity
        self.estimated_at = now

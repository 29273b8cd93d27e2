"""Safety stage: limits the commanded velocity.

Stages in order: emergency stop, age of the measurements, blind sectors, unseen ground, safety
zones, collision monitor, speed limit, velocity smoother, and a final check: of the smoothed
velocity for unseen ground and collisions, of the measured one for collisions. It uses the obstacle
points of the range sensors and the tracks of moving objects, which are expected where their
velocity takes them, both relative to the robot: a wrong pose or a wrong costmap does not affect it
(except for speed zones, which are on the map). It does not protect against obstacles that no sensor
can see; towards a sector that none covers, and where the outline enters ground that none has seen,
it limits the speed.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, hypot, inf, isfinite
from typing import NamedTuple

from stack.compilation import KernelTypes
from stack.drivetrain.description import RobotDescription
from stack.drivetrain.kinematics import scaled
from stack.safety.monitor import NOTHING_NEAR, CollisionMonitor, Contact, UnseenGroundLimit
from stack.safety.parameters import SafetyParameters
from stack.safety.smoother import (
    VelocitySmoother,
    arc_beyond_dead_band,
    are_close,
    beyond_dead_band,
    within_limits,
)
from stack.safety.stage import LimitedTwist, SafetyStage
from stack.safety.zones import SafetyZone, ZoneMonitor
from stack.types import (
    NOTHING_MOVES,
    STANDSTILL,
    ContactZone,
    FloatArray,
    Limitation,
    ObstaclePoints,
    Perceived,
    SeenGround,
    Twist,
)
from stack.types.limitations import (
    BLIND_SECTOR,
    BRAKING,
    EMERGENCY_STOP,
    NOT_FINITE,
    OBSTACLE,
    OLD_MEASUREMENT,
    PERSON,
    SLOWER,
    SPEED_LIMIT,
    STOPPED,
    UNSEEN_GROUND,
)

CONTACT_SPEED = 0.1
"""Speed limit while the robot may touch something, m/s."""

LEVELS = (0.75, 0.5, 0.25, 0.0)
"""Levels of padding, from 0, tight_padding, to 1, padding, that are tried in turn: the lower, the
slower."""


class _Around(NamedTuple):
    """What the robot could touch: (m, 2) points, and (k, 5) moving discs; base frame."""

    points: FloatArray
    moving: FloatArray

    @property
    def is_empty(self) -> bool:
        return not len(self.points) and not len(self.moving)


class Safety(SafetyStage):
    """Limits the velocity that navigation commands.

    Attributes:
        parameters: may be replaced between steps.
    """

    @staticmethod
    def kernels(zones: Sequence[SafetyZone], *, blind: bool = False) -> KernelTypes:
        """Return the kernels of the stage with these zones, and for a robot with blind sectors."""
        from stack.safety import kernels

        found = (*kernels.CONTACT, *kernels.ZONES) if zones else kernels.CONTACT
        return (*found, *kernels.UNSEEN) if blind else found

    def __init__(
        self, robot: RobotDescription, parameters: SafetyParameters, period: float,
        zones: Sequence[SafetyZone] = (),
    ) -> None:  # fmt: skip
        self.parameters = parameters
        self._robot, self._limits = robot, robot.limits
        self._radius = robot.footprint.circumscribed_radius
        self._monitor = CollisionMonitor(robot)
        self._unseen = UnseenGroundLimit(robot)
        self._zones = ZoneMonitor(zones, robot.footprint)
        self._smoother = VelocitySmoother(robot, period)

    def configure(self, parameters: SafetyParameters) -> None:
        """Apply new parameters, from the next step on."""
        self.parameters = parameters

    def limit(
        self, twist: Twist, perceived: Perceived, *, emergency_stop: str = "",
        contact: ContactZone | None = None,
    ) -> LimitedTwist:  # fmt: skip
        """Return the limited twist for this step, as `SafetyStage`."""
        if emergency_stop:
            self._smoother.continue_from(STANDSTILL)
            return LimitedTwist(STANDSTILL, Limitation(STOPPED, EMERGENCY_STOP, emergency_stop))
        motion, obstacles, world = perceived.motion, perceived.obstacles, perceived.world
        points, speed_limit = obstacles.points, world.speed_limit
        if contact is not None:
            points = points[~contact.contains(motion.pose.transform(points))]
            speed_limit = min(speed_limit, CONTACT_SPEED)
        around = _Around(points, world.moving if self.parameters.predict_motion else NOTHING_MOVES)
        found = self._feasible(twist)
        for stage in (self._unless_stale, self._limited_where_blind, self._limited_where_unseen):
            found = found.then(stage(found.twist, obstacles))
        if not around.is_empty and found.twist != STANDSTILL:
            found = found.then(LimitedTwist(*self._zones.limited(found.twist, around.points)))
            found = found.then(self._collision_limited(found.twist, around))
        found = self._speed_limited(found, speed_limit)
        wanted = found.twist
        if self.parameters.closed_loop:
            self._smoother.continue_from(motion.twist)
        smooth = self._slowed_where_unseen(self._smoother.towards(wanted), obstacles)
        found = found.then(smooth)
        if not around.is_empty:
            found = found.then(self._braked(smooth.twist, wanted, motion.twist, around))
        self._smoother.continue_from(found.twist)
        return LimitedTwist(self._beyond_dead_band(found.twist, wanted), found.limitation)

    def _beyond_dead_band(self, smooth: Twist, wanted: Twist) -> Twist:
        p = self.parameters
        if self._robot.drivetrain.turns_in_place:
            return beyond_dead_band(smooth, wanted, p.dead_band, p.turning_dead_band)
        return arc_beyond_dead_band(smooth, wanted, p.dead_band)

    def _feasible(self, twist: Twist) -> LimitedTwist:
        if all(map(isfinite, (twist.linear, twist.angular, twist.lateral))):
            return LimitedTwist(self._robot.drivetrain.feasible(twist))
        return LimitedTwist(
            STANDSTILL, Limitation(STOPPED, NOT_FINITE, f"not a finite velocity: {twist}")
        )

    def _unless_stale(self, twist: Twist, obstacles: ObstaclePoints) -> LimitedTwist:
        """Return standstill when the measurement of a sensor is missing or too old.

        A depth camera first limits the speed: its points are remembered, and reach farther than
        what the robot drives meanwhile.
        """
        if twist == STANDSTILL:
            return LimitedTwist(twist)
        p, aged = self.parameters, None
        for name, age in obstacles.ages.items():
            is_picture = self._robot.delivers_pictures(name)
            longest = p.picture_stop_after if is_picture else p.stale_after
            slows = is_picture and age > p.picture_slow_after + 1e-9
            if age <= longest + 1e-9 and not slows:
                continue
            what = f"{name} {self._robot.word_for_measurement(name)}"
            if age > longest + 1e-9:
                old = f"no {what} yet" if age == inf else f"the newest {what} is {age:.2f} s old"
                return LimitedTwist(STANDSTILL, Limitation(STOPPED, OLD_MEASUREMENT, old))
            aged = Limitation(SLOWER, OLD_MEASUREMENT, f"the newest {what} is {age:.2f} s old")
        speed = self._rim_speed(twist)
        if aged is None or speed <= p.picture_slow_speed:
            return LimitedTwist(twist)
        return LimitedTwist(scaled(twist, p.picture_slow_speed / speed), aged)

    def _limited_where_blind(self, twist: Twist, obstacles: ObstaclePoints) -> LimitedTwist:
        """Return the same arc, at most at the blind speed if it leads to a blind sector."""
        speed, limit = hypot(twist.linear, twist.lateral), self.parameters.blind_speed
        if speed <= limit or not obstacles.is_blind(atan2(twist.lateral, twist.linear)):
            return LimitedTwist(twist)
        return LimitedTwist(scaled(twist, limit / speed), _BLIND)

    def _limited_where_unseen(self, twist: Twist, obstacles: ObstaclePoints) -> LimitedTwist:
        """Return the same arc, slow enough where the outline enters ground that was never seen.

        The speed of each point that enters is limited, so that turning is limited like driving.
        """
        if obstacles.ground is None or twist == STANDSTILL:
            return LimitedTwist(twist)
        share = self._share_where_unseen(twist, obstacles.ground)
        if share == 1.0:
            return LimitedTwist(twist)
        if share * self._rim_speed(twist) < self.parameters.creep_speed:
            return LimitedTwist(STANDSTILL, _unseen(STOPPED))
        return LimitedTwist(scaled(twist, share), _unseen(SLOWER))

    def _share_where_unseen(self, twist: Twist, ground: SeenGround) -> float:
        """Share of a twist at which the outline enters unseen ground no faster than allowed."""
        p = self.parameters
        return self._unseen.share(
            twist, ground, p.reaction_time, self._braking_time(twist), p.blind_speed
        )

    def _slowed_where_unseen(self, smooth: Twist, obstacles: ObstaclePoints) -> LimitedTwist:
        """Return the smoothed twist, slowed down where the outline enters unseen ground too fast.

        It is slowed down on its own arc. If that is not reached at once, the robot is slowed down
        on the arc that it is on where more of that is allowed: between two arcs a robot that brakes
        may still turn too fast for the new one.
        """
        slow, limitation = self._limited_where_unseen(smooth, obstacles)
        if slow == smooth or obstacles.ground is None:
            return LimitedTwist(smooth, limitation)
        reached = self._smoother.towards(slow)
        if not are_close(reached, slow):
            braked = self._smoother.braked()
            better = self._share_where_unseen(braked, obstacles.ground)
            if better > self._share_where_unseen(reached, obstacles.ground):
                reached = braked
        return LimitedTwist(reached, limitation)

    def _speed_limited(self, found: LimitedTwist, speed_limit: float) -> LimitedTwist:
        """Scale a twist to the limits of the robot, the parameters and the position."""
        twist, limitation = found
        top = min(self.parameters.top_speed, speed_limit)
        speed = hypot(twist.linear, twist.lateral)
        binding = min(self.parameters.top_speed, self._limits.linear_speed, speed)
        if speed_limit < binding and limitation is None:
            here = f"the speed limit here is {speed_limit:.2f} m/s"
            limitation = Limitation(SLOWER, SPEED_LIMIT, here)
        return LimitedTwist(within_limits(twist, self._robot, top), limitation)

    def _collision_limited(self, twist: Twist, around: _Around) -> LimitedTwist:
        """Return the same arc at a safe speed, a turn in place, or standstill."""
        p = self.parameters
        horizon = max(p.slow_time, self._stopping_time(twist))
        contact = self._contact(twist, around, horizon, p.padding)
        if contact.time == inf:
            return LimitedTwist(twist)
        share = min(1.0, contact.time / p.slow_time)
        share = max(share, self._tight_share(twist, around))
        if share * self._rim_speed(twist) >= p.creep_speed:
            return LimitedTwist(scaled(twist, share), _near(SLOWER, contact))
        turn = self._robot.drivetrain.feasible(Twist(angular=twist.angular))
        if turn in (twist, STANDSTILL) or (
            self._contact(turn, around, p.slow_time, p.padding).time < inf
        ):
            turn = STANDSTILL
        return LimitedTwist(turn, _near(STOPPED, contact))

    def _contact(self, twist: Twist, around: _Around, horizon: float, padding: float) -> Contact:
        beside = self.parameters.moving_padding if padding else 0.0
        return self._monitor.contact(twist, around.points, horizon, padding, around.moving, beside)

    def _tight_share(self, twist: Twist, around: _Around) -> float:
        """Share of a twist's speed at which the robot may pass obstacles within the padding.

        The slower it is, the more exactly the robot follows its arc, and the less room it needs to
        the side. An obstacle ahead still limits the speed as usual; a turn in place slows down in
        proportion to the time until the smallest room is used up, so that it may end before.
        """
        p = self.parameters
        speed = self._rim_speed(twist)
        if speed == 0.0 or p.tight_speed == 0.0 or p.tight_padding >= p.padding:
            return 0.0
        own = self._level(speed)
        share, time = 1.0, inf
        for level in ([own] if own < 1.0 else []) + [lower for lower in LEVELS if lower < own]:
            share = min(1.0, self._speed_at(level) / speed)
            time = self._contact(
                scaled(twist, share), around, p.slow_time, self._padding_at(level)
            ).time
            if time == inf:
                return share
        turns = twist.linear == twist.lateral == 0.0
        return share * time / p.slow_time if turns else 0.0

    def _level(self, speed: float) -> float:
        """Padding that a speed of the outline needs: 0 is tight_padding, 1 is padding."""
        over = speed - self.parameters.tight_speed
        span = self.parameters.padding_speed - self.parameters.tight_speed
        if over <= 1e-9:
            return 0.0
        return min(1.0, over / span) if span > 0.0 else 1.0

    def _speed_at(self, level: float) -> float:
        """Speed of the outline that is allowed at a level of padding, m/s."""
        p = self.parameters
        return p.tight_speed + level * max(0.0, p.padding_speed - p.tight_speed)

    def _padding_at(self, level: float) -> float:
        """Distance kept free at a level of padding, metres."""
        p = self.parameters
        return p.tight_padding + level * (p.padding - p.tight_padding)

    def _padding(self, twist: Twist) -> float:
        """Distance kept free at a twist's speed, metres."""
        p = self.parameters
        if p.tight_speed == 0.0 or p.tight_padding >= p.padding:
            return p.padding
        return self._padding_at(self._level(self._rim_speed(twist)))

    def _braked(
        self, smooth: Twist, wanted: Twist, measured: Twist, around: _Around
    ) -> LimitedTwist:
        """Return the smoothed twist, or full braking when it leads to a contact before a stop.

        Between two arcs the robot drives on neither of them, so a result that differs from the
        wanted twist is checked again. If it leads to a contact, the robot gathers speed on the
        wanted arc instead. The measured motion is checked too: a drive lags behind its commands,
        and while it still turns, an arc that is clear is not yet the one it drives. A velocity from
        which the robot cannot stop in time is not admissible (D. Fox, W. Burgard and S. Thrun,
        "The dynamic window approach to collision avoidance", IEEE RAM 4(1), 1997).
        """
        contact = NOTHING_NEAR
        if smooth not in (wanted, STANDSTILL):
            time = self._stopping_time(smooth)
            contact = self._contact(smooth, around, time, self._padding(smooth))
            along = self._smoother.along(wanted) if contact.time < inf else None
            if along is not None and along != STANDSTILL:
                smooth, time = along, self._stopping_time(along)
                contact = self._contact(along, around, time, self._padding(along))
        if contact.time == inf:
            contact = self._contact(measured, around, self._stopping_time(measured), 0.0)
        if contact.time == inf:
            return LimitedTwist(smooth)
        braked = self._smoother.towards(STANDSTILL)
        return LimitedTwist(braked, _near(BRAKING, contact))

    def _stopping_time(self, twist: Twist) -> float:
        """Time in seconds at this twist that covers its stopping distance.

        Braking and turning share the grip of the tyres (the friction ellipse of vehicle dynamics):
        a robot that does both takes longer than for either.
        """
        return self.parameters.reaction_time + self._braking_time(twist)

    def _braking_time(self, twist: Twist) -> float:
        """Time in seconds at this twist that covers its braking distance."""
        speed = hypot(twist.linear, twist.lateral) / self._limits.linear_deceleration
        turn = abs(twist.angular) / self._limits.angular_acceleration
        return 0.5 * hypot(speed, turn)

    def _rim_speed(self, twist: Twist) -> float:
        return hypot(twist.linear, twist.lateral) + abs(twist.angular) * self._radius


_BLIND = Limitation(SLOWER, BLIND_SECTOR, "no sensor covers this direction")


def _unseen(effect: str) -> Limitation:
    return Limitation(effect, UNSEEN_GROUND, "no sensor has seen this ground")


def _near(effect: str, contact: Contact) -> Limitation:
    what = f"obstacle {contact.place}, contact in {contact.time:.1f} s"
    cause = PERSON if contact.moves else OBSTACLE
    return Limitation(effect, cause, what, (float(contact.x), float(contact.y)))

"""Why a robot drives slower than it wants to, or stands."""

from __future__ import annotations

from dataclasses import dataclass

SLOWER, STOPPED, BRAKING = "slower", "stopped", "braking"

OBSTACLE, PERSON, ZONE, SPEED_LIMIT = "obstacle", "person", "zone", "speed limit"
OLD_MEASUREMENT, BLIND_SECTOR, UNSEEN_GROUND = "old measurement", "blind sector", "unseen ground"
EMERGENCY_STOP, LOST, OBSCURED, NOT_FINITE = "emergency stop", "lost", "obscured", "not finite"
ARM = "arm"

CAUSES = (
    OBSTACLE, PERSON, ZONE, SPEED_LIMIT, OLD_MEASUREMENT, BLIND_SECTOR, UNSEEN_GROUND,
    EMERGENCY_STOP, LOST, OBSCURED, NOT_FINITE, ARM,
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Limitation:
    """Why a robot drives slower than it wants to, or stands.

    Attributes:
        effect: slower | stopped | braking.
        cause: one of CAUSES. A person is something that the robot has seen moving.
        detail: for people, as in: obstacle 0.3 m ahead.
        at: where the cause is, x and y in the base frame, metres; None if it is nowhere.
    """

    effect: str
    cause: str
    detail: str
    at: tuple[float, float] | None = None

    @property
    def text(self) -> str:
        """The sentence, as in: stopped: obstacle 0.3 m ahead."""
        if self.cause == EMERGENCY_STOP:
            return f"{EMERGENCY_STOP}: {self.detail}"
        return f"{self.effect}: {self.detail}"

    @property
    def stands(self) -> bool:
        """Whether the robot must stand."""
        return self.effect == STOPPED

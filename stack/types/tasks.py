"""Outcomes: task status, failure codes and failures."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, StrEnum, auto


class TaskStatus(Enum):
    """Status of a task of the robot."""

    RUNNING = auto()
    SUCCEEDED = auto()
    FAILED = auto()
    CANCELLED = auto()


class FailureCode(StrEnum):
    """Codes of failures; mission files compare `error` with them."""

    NO_VALID_PATH = "NO_VALID_PATH"
    START_OCCUPIED = "START_OCCUPIED"
    GOAL_OCCUPIED = "GOAL_OCCUPIED"
    START_OUTSIDE_MAP = "START_OUTSIDE_MAP"
    GOAL_OUTSIDE_MAP = "GOAL_OUTSIDE_MAP"
    BLOCKED_BY_PERSON = "BLOCKED_BY_PERSON"
    NO_PROGRESS = "NO_PROGRESS"
    COLLISION_AHEAD = "COLLISION_AHEAD"
    LOST = "LOST"
    CANCELLED = "CANCELLED"
    TIMED_OUT = "TIMED_OUT"
    AMBIGUOUS = "AMBIGUOUS"
    NO_WALL = "NO_WALL"
    NO_LINE = "NO_LINE"
    OBJECT_NOT_FOUND = "OBJECT_NOT_FOUND"
    PERSON_LOST = "PERSON_LOST"
    MARKER_NOT_FOUND = "MARKER_NOT_FOUND"
    DOOR_CLOSED = "DOOR_CLOSED"
    DOCK_NOT_FOUND = "DOCK_NOT_FOUND"
    NOT_CHARGING = "NOT_CHARGING"
    UNREACHABLE = "UNREACHABLE"
    NO_MOTION_PLAN = "NO_MOTION_PLAN"
    ARM_COLLISION = "ARM_COLLISION"
    MISSED = "MISSED"
    SLIPPED = "SLIPPED"
    NO_IMAGE = "NO_IMAGE"
    BAD_IMAGE = "BAD_IMAGE"
    CHECK_FAILED = "CHECK_FAILED"
    NOT_SET = "NOT_SET"
    DIVISION_BY_ZERO = "DIVISION_BY_ZERO"
    OVERFLOW = "OVERFLOW"
    OUT_OF_RANGE = "OUT_OF_RANGE"
    UNSUPPORTED = "UNSUPPORTED"
    EXCEPTION = "EXCEPTION"
    FAILED = "FAILED"


@dataclass(frozen=True, slots=True)
class Failure:
    """Why something failed: a code for machines and a sentence for people.

    Attributes:
        place: (x, y) in the map frame, metres: of a goal that cannot be reached, the nearest
            reachable place; None if it is unknown.
    """

    code: str
    sentence: str
    place: tuple[float, float] | None = None

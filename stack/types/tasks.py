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
    """Codes of failures; mission files compare `error` with them.

    Attributes:
        meaning: what has happened.
        remedy: what helps.
    """

    meaning: str
    remedy: str

    def __new__(cls, code: str, meaning: str = "", remedy: str = "") -> FailureCode:
        """Make a member whose value is its code."""
        member = str.__new__(cls, code)
        member._value_, member.meaning, member.remedy = code, meaning, remedy
        return member

    NO_VALID_PATH = (
        "NO_VALID_PATH",
        "no path leads to the goal",
        "look at what closes the way: the message names it",
    )
    START_OCCUPIED = (
        "START_OCCUPIED",
        "the robot or its arm touches something where it begins",
        "drive or move it away, or correct the map or the scene",
    )
    GOAL_OCCUPIED = (
        "GOAL_OCCUPIED",
        "the goal is in something, or the robot or its arm would touch something there",
        "choose another goal, or move what is there",
    )
    START_OUTSIDE_MAP = (
        "START_OUTSIDE_MAP",
        "the robot is outside the map",
        "correct its pose, or use a larger map",
    )
    GOAL_OUTSIDE_MAP = (
        "GOAL_OUTSIDE_MAP",
        "the goal is outside the map",
        "choose another goal, or use a larger map",
    )
    BLOCKED_BY_PERSON = (
        "BLOCKED_BY_PERSON",
        "a person stays in the way",
        "wait longer (`navigator.person_patience`), or ask the person: `say` in a recovery",
    )
    NO_PROGRESS = (
        "NO_PROGRESS",
        "a motion does not come nearer to its goal, or does not begin or end in time",
        "look at what holds the robot: the message and the events `held` name it",
    )
    COLLISION_AHEAD = (
        "COLLISION_AHEAD",
        "something is, or moves, into the way",
        "wait and try again",
    )
    LOST = (
        "LOST",
        "the robot does not know where it is",
        "use `relocalise`, or set its pose",
    )
    CANCELLED = (
        "CANCELLED",
        "a newer motion, an operator or an emergency stop has ended it",
        "look at the events before it",
    )
    TIMED_OUT = (
        "TIMED_OUT",
        "the node has run longer than its `timeout`",
        "give it more time, or find out what took so long",
    )
    AMBIGUOUS = (
        "AMBIGUOUS",
        "several places fit what the robot sees",
        "use `disambiguate`, or set its pose",
    )
    NO_WALL = (
        "NO_WALL",
        "no wall is beside the robot",
        "begin nearer to the wall, on the given side",
    )
    NO_LINE = (
        "NO_LINE",
        "no line of the colour and width is seen on the floor",
        "begin over the line; compare colour and width",
    )
    OBJECT_NOT_FOUND = (
        "OBJECT_NOT_FOUND",
        "what was looked for is not in sight or not known",
        "detect it first, from where the cameras see it; compare colour and place",
    )
    PERSON_LOST = (
        "PERSON_LOST",
        "the person who was followed is not seen any more",
        "wait, or begin again when the person is in view",
    )
    MARKER_NOT_FOUND = (
        "MARKER_NOT_FOUND",
        "no such marker is in sight",
        "turn the camera to it; compare number, dictionary and size",
    )
    DOOR_CLOSED = (
        "DOOR_CLOSED",
        "a door is closed",
        "open it, or plan another way",
    )
    DOCK_NOT_FOUND = (
        "DOCK_NOT_FOUND",
        "no dock is seen where it should be",
        "drive to the place in front of it; look at the dock of the world or the map",
    )
    NOT_CHARGING = (
        "NOT_CHARGING",
        "the robot is in the dock but is not charged",
        "look at contacts and power",
    )
    UNREACHABLE = (
        "UNREACHABLE",
        "the arm cannot reach the pose, or not along the line",
        "choose another pose or turn, or move the base",
    )
    NO_MOTION_PLAN = (
        "NO_MOTION_PLAN",
        "the arm has no free motion, or no grasp or place",
        "move to another posture, or move what is in the way: the message names it",
    )
    ARM_COLLISION = (
        "ARM_COLLISION",
        "the arm has stopped by itself: something holds it, or stays in its way",
        "look at it, take it away, then use `home_arm`",
    )
    MISSED = (
        "MISSED",
        "the fingers have closed on nothing, or the hand holds no block",
        "detect the blocks again",
    )
    SLIPPED = (
        "SLIPPED",
        "the block in the hand was lost",
        "open the gripper, and detect the blocks again",
    )
    NO_IMAGE = (
        "NO_IMAGE",
        "the camera gives no pictures",
        "look at the camera and its cable: `treepilot doctor`",
    )
    BAD_IMAGE = (
        "BAD_IMAGE",
        "the picture cannot be used: too dark, too bright or covered",
        "change light or exposure, or clean the lens",
    )
    CHECK_FAILED = (
        "CHECK_FAILED",
        "a condition is false, or an inverted node has succeeded",
        "look at the condition: the message has its values",
    )
    NOT_SET = (
        "NOT_SET",
        "an expression reads a key that has no value",
        "set it before, or test it with `is set`",
    )
    DIVISION_BY_ZERO = (
        "DIVISION_BY_ZERO",
        "an expression divides by zero",
        "test the divisor before",
    )
    OVERFLOW = (
        "OVERFLOW",
        "the value of an expression is too large",
        "use smaller numbers",
    )
    OUT_OF_RANGE = (
        "OUT_OF_RANGE",
        "a value is outside the range of its port",
        "limit it, or correct the expression",
    )
    UNSUPPORTED = (
        "UNSUPPORTED",
        "the robot, or a part of it, cannot do this",
        "use another behaviour or robot",
    )
    EXCEPTION = (
        "EXCEPTION",
        "a behaviour or a plugin raised an exception",
        "read the traceback in the log of the run",
    )
    FAILED = (
        "FAILED",
        "a node has failed without another code",
        "read the message of the node",
    )


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

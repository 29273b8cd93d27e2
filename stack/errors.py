"""Failures that a caller may want to catch.

TreepilotError
├── InputError          a file or an option is wrong: carries findings, each with its position
├── ParameterError      one value is wrong: names the parameter, the value and what was expected
├── NavigationError     a planner or controller gives up: carries a FailureCode
├── BodyError           the robot, real or simulated, stopped answering or cannot be built
└── TelemetryError      no engine answers, or it speaks another version
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from stack.types import Failure, FailureCode


@dataclass(frozen=True, slots=True, order=True)
class Mark:
    """A position in a file; line and column count from 1."""

    file: str
    line: int = 1
    column: int = 1

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}"


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing wrong with a file: `file:line:column error[E012] sentence; hint`."""

    mark: Mark
    code: str
    sentence: str
    hint: str = ""
    severity: str = "error"

    def __str__(self) -> str:
        hint = f"; {self.hint}" if self.hint else ""
        return f"{self.mark} {self.severity}[{self.code}] {self.sentence}{hint}"


class TreepilotError(Exception):
    """Base class of the errors treepilot raises on purpose."""


class InputError(TreepilotError):
    """What the user gave is wrong. Nothing has moved; the command line exits with 2."""

    def __init__(self, findings: Sequence[Finding] | str) -> None:
        self.findings: tuple[Finding, ...] = () if isinstance(findings, str) else tuple(findings)
        text = findings if isinstance(findings, str) else "\n".join(map(str, findings))
        super().__init__(text)


class ParameterError(TreepilotError):
    """A value that a parameter or port cannot take; the sentence quotes both."""

    def __init__(self, name: str, sentence: str, hint: str = "") -> None:
        self.name, self.sentence, self.hint = name, sentence, hint
        super().__init__(f"{name}: {sentence}" if name else sentence)


class NavigationError(TreepilotError):
    """A planner or controller cannot go on; `failure` says why."""

    def __init__(self, code: FailureCode, sentence: str) -> None:
        self.failure = Failure(code, sentence)
        super().__init__(f"{code}: {sentence}")


class BodyError(TreepilotError):
    """The robot, real or simulated, stopped answering or cannot be built."""


class TelemetryError(TreepilotError):
    """No engine answers, or it speaks another version."""

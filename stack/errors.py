"""Exceptions of treepilot, and sentences for those of plugins. Texts have no control characters.

TreepilotError
├── InputError          a file or an option is wrong: has findings, each with its position
├── ParameterError      one value is wrong: names the parameter, the value and what was expected
├── NavigationError     a planner or controller fails: has a FailureCode
├── EvaluationError     an expression of a mission has no value: has a FailureCode
├── FrameError          a stamp is outside the transform buffer
├── BodyError           the robot, real or simulated, does not respond or cannot be created
├── WorkerError         a process or thread that works for the step loop failed or does not answer
└── TelemetryError      no engine responds, or it has another version
"""

from __future__ import annotations

import sysconfig
import traceback
from collections.abc import Sequence
from copyreg import __newobj__  # type: ignore[attr-defined]
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Self

if TYPE_CHECKING:
    from stack.types import FailureCode

LONGEST = 1000
"""Characters of a sentence in the text of a finding."""


@dataclass(frozen=True, slots=True, order=True)
class Mark:
    """A position in a file; line and column count from 1."""

    file: str
    line: int = 1
    column: int = 1

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}"


class Hint(str):
    """A suggestion for people, and the text that replaces the wrong one, if it is known."""

    __slots__ = ("fix",)
    fix: str

    def __new__(cls, text: str = "", fix: str = "") -> Self:
        hint = super().__new__(cls, text)
        hint.fix = fix
        return hint

    def __add__(self, more: str) -> Hint:
        return Hint(super().__add__(more), self.fix)


@dataclass(frozen=True, slots=True)
class Finding:
    """An error or warning about a file: `file:line:column error[E012] sentence; hint`.

    Sentence and hint are for people. A program that fixes the file uses `mark` and `fix`.
    """

    mark: Mark
    code: str
    sentence: str
    hint: str = ""

    @property
    def fix(self) -> str:
        """The text that replaces the word at the mark; "" if none is known."""
        return self.hint.fix if isinstance(self.hint, Hint) else ""

    @property
    def severity(self) -> Literal["error", "warning"]:
        """Follows from the letter of the code: E error, W warning."""
        return "warning" if self.code.startswith("W") else "error"

    def __str__(self) -> str:
        hint = f"; {_shortened(self.hint)}" if self.hint else ""
        text = f"{self.mark} {self.severity}[{self.code}] {_shortened(self.sentence)}{hint}"
        return _printable(text)


def _printable(text: str) -> str:
    from stack.types.printable import printable  # imports NumPy with its package

    return printable(text)


def _shortened(text: str) -> str:
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}…"


class TreepilotError(Exception):
    """Base class of treepilot's exceptions."""

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle text and attributes: the constructors of subclasses take other arguments."""
        return __newobj__, (type(self), *self.args), self.__dict__


class InputError(TreepilotError):
    """The user's input is wrong. No robot has moved; the command line exits with 2.

    Attributes:
        findings: what is wrong, each with its position; empty if constructed from a sentence.
        sentence, hint: what is wrong and a suggestion, without a position; else empty.
    """

    def __init__(self, findings: Sequence[Finding] | str, hint: str = "") -> None:
        self.findings: tuple[Finding, ...] = () if isinstance(findings, str) else tuple(findings)
        self.sentence, self.hint = findings if isinstance(findings, str) else "", hint
        text = self.sentence or "\n".join(map(str, self.findings))
        super().__init__(_printable(f"{text}; {hint}" if hint else text))


class ParameterError(TreepilotError):
    """The value of a parameter or port is wrong.

    Attributes:
        name: of the parameter; may be empty.
        sentence: quotes the value and what was expected.
        hint: suggested fix; may be empty.
    """

    def __init__(self, name: str, sentence: str, hint: str = "") -> None:
        self.name, self.sentence, self.hint = name, sentence, hint
        super().__init__(_printable(f"{name}: {sentence}" if name else sentence))


class NavigationError(TreepilotError):
    """A planner, controller or drive cannot continue; `failure` has the reason."""

    def __init__(self, code: str, sentence: str, place: tuple[float, float] | None = None) -> None:
        from stack.types import Failure  # imports NumPy

        self.failure = Failure(code, sentence, place)
        super().__init__(f"{code}: {sentence}")


class EvaluationError(TreepilotError):
    """An expression or a port has no value: an unset key, a division by zero, an overflow.

    The node that needs the value fails with `code` and `sentence`.
    """

    def __init__(self, code: FailureCode, sentence: str) -> None:
        self.code, self.sentence = code, sentence
        super().__init__(_printable(sentence))


class FrameError(TreepilotError):
    """A pose was requested for a stamp outside the transform buffer, or before the first pose."""


class BodyError(TreepilotError):
    """The robot, real or simulated, does not respond or cannot be created."""


class WorkerError(TreepilotError):
    """A process or thread that works for the step loop failed, ended or does not answer.

    Attributes:
        refusal: the sentence of the error of treepilot that it raised; empty for other failures.
    """

    def __init__(self, sentence: str, refusal: str = "") -> None:
        self.refusal = refusal
        super().__init__(_printable(sentence))


class TelemetryError(TreepilotError):
    """No engine responds, or it has another version."""


_LIBRARIES = tuple(sysconfig.get_path(name) for name in ("stdlib", "purelib", "platlib"))
_OWN = tuple(
    str(Path(__file__).parents[1] / package)
    for package in ("stack", "behaviours", "missions/execution", "missions/trees")
)


def exception_sentence(error: BaseException) -> str:
    """Describe an exception with the line that caused it: `KeyError: 'x' (my_planner.py:12)`.

    The line is the innermost one of the plugin, not of a library or of treepilot that it calls.
    Only the name of the file is given: the sentence is part of the hashed event log.
    """
    text = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
    line = plugin_line(error) or _line_of(error, _LIBRARIES)
    return f"{text} ({line})" if line else text


def plugin_line(error: BaseException) -> str:
    """Innermost line of a plugin in the traceback, `my_planner.py:12`; empty if there is none."""
    return _line_of(error, (*_LIBRARIES, *_OWN))


def _line_of(error: BaseException, without: tuple[str, ...]) -> str:
    frames = [
        frame
        for frame in traceback.extract_tb(error.__traceback__)
        if not frame.filename.startswith(("<", *without))
    ]
    return f"{Path(frames[-1].filename).name}:{frames[-1].lineno}" if frames else ""


def traceback_text(what: str, error: BaseException) -> str:
    """The traceback of an exception below a line that says what raised it, for a run's log."""
    return f"{what}\n{''.join(traceback.format_exception(error))}"

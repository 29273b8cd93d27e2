"""What is wrong with files: where, which code, a sentence and the likely fix."""

from __future__ import annotations

from dataclasses import dataclass, field

from stack.errors import InputError


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


@dataclass
class Findings:
    """Collects everything wrong, so that one reading reports it all."""

    items: list[Finding] = field(default_factory=list)
    _noted: set[Finding] = field(default_factory=set)

    def error(self, code: str, mark: Mark, sentence: str, hint: str = "") -> None:
        """Note something that makes the file unusable."""
        self._add(Finding(mark, code, sentence, hint))

    def warning(self, code: str, mark: Mark, sentence: str, hint: str = "") -> None:
        """Note something that is probably not meant."""
        self._add(Finding(mark, code, sentence, hint, "warning"))

    @property
    def errors(self) -> list[Finding]:
        """Only the errors, by position."""
        return sorted((f for f in self.items if f.severity == "error"), key=lambda f: f.mark)

    def raise_errors(self) -> None:
        """Raise InputError with every error, if there is one."""
        if self.errors:
            raise InputError(self.errors)

    def _add(self, finding: Finding) -> None:
        if finding not in self._noted:
            self._noted.add(finding)
            self.items.append(finding)

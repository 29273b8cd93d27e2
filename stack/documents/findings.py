"""What is wrong with files: where, which code, a sentence and the likely fix."""

from __future__ import annotations

from dataclasses import dataclass, field

from stack.errors import Finding, InputError, Mark

__all__ = ["Finding", "Findings", "Mark"]


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

"""Findings about files: position, code, sentence and suggested fix."""

from __future__ import annotations

from dataclasses import dataclass, field

from stack.errors import Finding, InputError, Mark

__all__ = ["Finding", "Findings", "Mark"]


@dataclass
class Findings:
    """Collects findings, so that one run reports all of them."""

    items: list[Finding] = field(default_factory=list)
    _noted: set[Finding] = field(default_factory=set)

    def add(self, code: str, mark: Mark, sentence: str, hint: str = "") -> None:
        """Add a finding; the letter of its code says whether the file can still be used."""
        finding = Finding(mark, code, sentence, hint)
        if finding not in self._noted:
            self._noted.add(finding)
            self.items.append(finding)

    @property
    def errors(self) -> list[Finding]:
        """The errors, sorted by position."""
        return sorted((f for f in self.items if f.severity == "error"), key=lambda f: f.mark)

    @property
    def warnings(self) -> list[Finding]:
        """The warnings, in the order in which they were added."""
        return [f for f in self.items if f.severity == "warning"]

    def raise_errors(self) -> None:
        """Raise InputError with all errors, if there are any."""
        if self.errors:
            raise InputError(self.errors)

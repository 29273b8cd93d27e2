"""The probe table: wrong and unusual right missions in probes/*.yaml.

A probe is `wrong: title` or `right: title` with the `text` of a mission. In a wrong one, the lines
that must be reported, and no others, end with `#! CODE` or `#! CODE CODE`; `says` is a part of one
of the messages. Missing required keys are put behind the text.
"""

import re
from dataclasses import dataclass
from pathlib import Path

import yaml

FOLDER = Path(__file__).parent / "probes"
HEAD = {"mission": "probe", "robot": "scout", "world": "office"}
_EXPECTED = re.compile(r"#! (\w+(?: \w+)*)$")


@dataclass(frozen=True)
class Probe:
    """One mission with the findings that it must cause, as `(code, line)`."""

    file: str
    title: str
    text: str
    is_wrong: bool
    says: str = ""

    @property
    def expected(self) -> set[tuple[str, int]]:
        lines = enumerate(self.text.splitlines(), 1)
        found = ((_EXPECTED.search(line), number) for number, line in lines)
        return {(code, number) for match, number in found if match for code in match[1].split()}

    def mission(self) -> str:
        """The text of the mission file, complete."""
        absent = [
            f"{key}: {value}\n"
            for key, value in HEAD.items()
            if not re.search(rf"^{key}\s*:", self.text, re.MULTILINE)
        ]
        return self.text + "".join(absent)


def probes() -> list[Probe]:
    """Return every probe of the table."""
    return [
        Probe(
            file.stem,
            entry.get("wrong") or entry["right"],
            entry["text"],
            "wrong" in entry,
            entry.get("says", ""),
        )
        for file in sorted(FOLDER.glob("*.yaml"))
        for entry in yaml.safe_load(file.read_text())
    ]

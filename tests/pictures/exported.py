"""The list of topics in docs/runs.md, of an office patrol as `treepilot export` writes it."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path

from missions.inspection.exchange.exporting import export_mcap, summary_lines
from tests.benchmarks.origin import ROOT

PAGE = ROOT / "docs" / "runs.md"
LIST = re.compile(r"(?<=```text\n)TOPIC +SCHEMA.*?(?=```)", re.DOTALL)


def write_topics(run: Path) -> None:
    """Export a run, and write the list of its topics into the page."""
    with tempfile.TemporaryDirectory() as folder:
        topics = export_mcap(run, Path(folder, "office.mcap"))
    found = "\n".join(summary_lines(topics)) + "\n"
    text, count = LIST.subn(lambda _: found, PAGE.read_text("utf-8"))
    if count != 1:
        raise RuntimeError(f"{PAGE}: expected one list of topics, found {count}")
    PAGE.write_text(text, "utf-8")

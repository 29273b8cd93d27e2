"""The examples of docs/python.md, from top to bottom, with its mission in a terminal."""

from __future__ import annotations

import pytest

from missions.execution.supervision.launch import LaunchOptions
from missions.run_options import RunOptions
from tests.missions.execution.test_engine import supervised
from tests.stack.telemetry.conftest import runtime_directory  # noqa: F401 - a fixture
from tests.test_docs import ROOT, blocks_of, parse

PAGE = ROOT / "docs" / "python.md"


@pytest.mark.slow
@pytest.mark.usefixtures("runtime_directory")
def test_the_examples_work_from_top_to_bottom(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    blocks = blocks_of(PAGE)
    assert [block.language for block in blocks].count("sh") == 1
    before = blocks[: [block.language for block in blocks].index("sh")]
    command = blocks[len(before)].text.split()
    parse(command[1:])
    for block in before:
        execute(block)
    assert capsys.readouterr().out.startswith("success")
    options = LaunchOptions((command[2],), RunOptions(out=tmp_path / "live"), speed="16")
    with supervised(options):
        for block in blocks[len(before) + 1 :]:
            execute(block)
    said = capsys.readouterr().out
    assert "no place 'dok'; did you mean 'dock'?" in said
    assert "FAILED as an example" in said


def execute(block):
    """Run a block as a program of its own."""
    code = compile(block.text, f"{block.page.name}:{block.line}", "exec", dont_inherit=True)
    exec(code, {"__name__": "__main__"})

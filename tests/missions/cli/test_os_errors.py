"""Errors of the operating system are the user's, with the name of the file."""

import pytest

from missions.cli.app import main
from stack.types.printable import printable


@pytest.mark.parametrize(
    "words", [["check"], ["show"], ["run", "--headless"], ["trace"], ["doctor"]]
)
def test_a_name_that_is_too_long_is_an_error_of_the_user(words, monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["treepilot", *words, "w" * 5000])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    assert ": File name too long\n" in capsys.readouterr().err


@pytest.mark.parametrize("words", [["check"], ["show"], ["check", "--json"], ["describe"]])
def test_control_characters_in_a_name_are_escaped(words, monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["treepilot", *words, "\x1b[2J\x9b\u202e.yaml"])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    output = "".join(capsys.readouterr())
    assert "[2J" in output
    assert printable(output) == output

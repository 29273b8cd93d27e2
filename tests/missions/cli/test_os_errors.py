"""Errors of the operating system are the user's, with the name of the file."""

import pytest

from missions.cli.app import main


@pytest.mark.parametrize(
    "words", [["check"], ["show"], ["run", "--headless"], ["trace"], ["doctor"]]
)
def test_a_name_that_is_too_long_is_an_error_of_the_user(words, monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["treepilot", *words, "w" * 5000])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    assert capsys.readouterr().err.endswith("www: File name too long\n")


def test_control_characters_in_a_name_are_escaped(monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["treepilot", "run", "--headless", "\x1b[2J.yaml"])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    assert "\\x1b[2J.yaml:1:1 error[E001]" in capsys.readouterr().err

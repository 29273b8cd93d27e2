"""The command line of the benchmarks: what may be chosen, and one bench from end to end."""

from __future__ import annotations

import pytest

from tests.benchmarks.__main__ import BENCHMARKS, main, parsed
from tests.benchmarks.benchmark import benches


def test_every_file_of_the_package_is_found():
    found = benches()
    assert {"barn", "dyna", "docking", "flats", "follow", "line", "people"} <= {*found}
    assert {*found} <= {*BENCHMARKS}


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ("doking", "no benchmark 'doking'"),
        ("barn", "barn needs --barn FOLDER"),
        ("docking --seed 0 --docs", "need one NAME, and no --docs"),
        ("docking line --robots scout", "need one NAME, and no --docs"),
    ],
)
def test_wrong_words_end_with_exit_code_2(words, sentence, capsys):
    with pytest.raises(SystemExit) as ended:
        parsed(words.split())
    assert ended.value.code == 2
    assert sentence in capsys.readouterr().err


def test_one_bench_measures_what_is_chosen(tmp_path, monkeypatch, capsys):
    words = f"x docking --starts 1 --seed 0 --robots scout --out {tmp_path}".split()
    monkeypatch.setattr("sys.argv", words)
    main()
    shown, told = capsys.readouterr()
    assert "scout  1/1" in shown
    assert "scout, seed 0" in told
    assert (tmp_path / "docking" / "runs.jsonl").exists()
    main()
    assert "1 of 1 runs are already in" in capsys.readouterr().err

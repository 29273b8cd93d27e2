"""Foreign files: regular ones of limited size, never a device, a pipe or a folder."""

import os
import socket

import pytest

from missions.inspection.check import check_files
from robots.load import read_robot
from stack.documents import read_file, read_text
from stack.documents.files import (
    YAML_BYTES,
    TooLargeError,
    open_regular,
    read_bytes,
    read_input,
)
from stack.errors import InputError
from stack.planning.routes.geojson import read_route_graph
from stack.sim.import_world import read_any_world
from stack.telemetry.sensor_log import read_about

MISSION = "mission: m\nrobot: scout\nworld: small_room\nrun: {say: hello}\n"
SECRET = "hunter2"


@pytest.fixture
def pipe(tmp_path):
    os.mkfifo(tmp_path / "pipe.yaml")
    return tmp_path / "pipe.yaml"


READERS = [read_file, read_robot, read_any_world, read_route_graph, read_about]


@pytest.mark.parametrize("read", READERS)
def test_a_pipe_is_refused_at_once(read, pipe):
    with pytest.raises(InputError, match="not a regular file but a pipe"):
        read(pipe)


@pytest.mark.parametrize("read", READERS)
def test_a_device_is_refused(read):
    from pathlib import Path

    with pytest.raises(InputError, match="not a regular file but a device"):
        read(Path("/dev/zero"))


def test_sockets_folders_and_strange_names_are_refused(tmp_path):
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(tmp_path / "s"))
        with pytest.raises(OSError, match="No such device or address"):
            open_regular(tmp_path / "s")
    with pytest.raises(IsADirectoryError):
        open_regular(tmp_path)
    with pytest.raises(OSError, match="null character"):
        open_regular(tmp_path / "a\0b")
    with pytest.raises(InputError, match="cannot be read: File name too long"):
        read_input(tmp_path / ("x" * 300), "file")


def test_a_large_file_is_not_read(tmp_path):
    """500 MB, without blocks on the disk: refused by its size."""
    file = tmp_path / "big.yaml"
    with file.open("wb") as content:
        content.truncate(500_000_000)
    with pytest.raises(InputError, match=r"500000000 bytes or more; at most 1000000 are read of a"):
        read_input(file, "mission")


def test_no_more_than_the_limit_is_read_of_a_file_whose_size_is_wrong(tmp_path, monkeypatch):
    """As of files that grow, and of those in /proc, whose size is 0."""
    file = tmp_path / "grows"
    file.write_bytes(b"x" * 101)
    real = os.fstat
    monkeypatch.setattr(
        os, "fstat", lambda number: os.stat_result((real(number).st_mode, *[0] * 9))
    )
    assert read_bytes(file, 101) == b"x" * 101
    with pytest.raises(TooLargeError):
        read_bytes(file, 100)


def test_files_named_in_a_mission_are_checked_too(tmp_path, pipe):
    (tmp_path / "map.yaml").write_text(
        "image: pipe.yaml\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.2\n"
    )
    for number, (line, code) in enumerate(
        [
            ("include: [pipe.yaml]", "E113"),
            ("parameters: [pipe.yaml]", "E110"),
            ("navigation: {nav2_params: pipe.yaml}", "E"),
            ("map: ./map.yaml", "E402"),
            ("navigation: {planner: {use: route, graph: pipe.yaml}}", "E"),
        ]
    ):
        file = tmp_path / f"m{number}.yaml"
        file.write_text(MISSION + line)
        lines = [item.text for item in check_files([str(file)]) if item.is_error]
        assert any(f"error[{code}" in text and "a pipe" in text for text in lines), (line, lines)


NOT_OURS = [
    f"root:x:0:0:{SECRET}:/root:/bin/sh\n",
    f"{SECRET}\n",
    f"- {SECRET}\n",
    f"password: {SECRET}\n",
    f"a: [{SECRET}\n",
    f'"{SECRET}\n',
    f"a: b: {SECRET}\n",
    f"<secret>{SECRET}</secret>",
    f'{{"{SECRET}": 1}}',
    f"# {SECRET}\n\n",
    f"a: *{SECRET}\n",
]


@pytest.mark.parametrize("text", NOT_OURS)
@pytest.mark.parametrize("role", ["mission", "world", "robot", "map", "include", "route", "urdf"])
def test_errors_do_not_quote_files_of_another_kind(role, text, tmp_path):
    """`treepilot check /etc/passwd` names the file and what is expected, nothing that it holds."""
    secret = tmp_path / "secret"
    secret.write_text(text)
    file = tmp_path / "m.yaml"
    if role == "mission":
        file = secret
    elif role == "urdf":
        (tmp_path / "r.yaml").write_text("robot: r\nurdf: secret\n")
        file.write_text(MISSION.replace("scout", "./r.yaml"))
    elif role in ("world", "robot"):
        name = {"world": "small_room", "robot": "scout"}[role]
        file.write_text(MISSION.replace(name, "./secret"))
    else:
        extra = {
            "map": "map: ./secret",
            "include": "include: [secret]",
            "route": "navigation: {planner: {use: route, graph: secret}}",
        }[role]
        file.write_text(f"{MISSION}{extra}\n")
    lines = [item.text for item in check_files([str(file)])]
    assert any("secret" in line for line in lines), lines
    assert not [line for line in lines if SECRET in line]


def test_a_mission_s_own_lines_are_shown(tmp_path):
    file = tmp_path / "m.yaml"
    file.write_text(MISSION + "colour: red\n")
    (line,) = check_files([str(file)])
    assert "the mission has no key 'colour'" in line.text
    assert "    5 | colour: red" in line.text


def test_a_long_line_is_shown_around_the_fault(tmp_path):
    file = tmp_path / "m.yaml"
    file.write_text(MISSION + "doc: " + "x" * 5000 + ": y\n")
    (line,) = check_files([str(file)])
    assert len(line.text) < 600
    _, source, caret = line.text.splitlines()
    assert source[caret.index("^")] == ":"


CONTROL = "\x1b[2J"


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ('a: "\\e[2J"', "1:4"),
        ('"\\x9b": 1', "1:1"),
        ("a: x\u202ey", "1:4"),
        ('a: ["ok", "\\u2028"]', "1:11"),
    ],
)
def test_control_characters_in_texts_are_errors(text, place):
    with pytest.raises(InputError) as caught:
        read_text(text, "f.yaml")
    (finding,) = caught.value.findings
    assert str(finding).startswith(f"f.yaml:{place} error[E013] the text '")
    assert str(finding).isprintable()


def test_lines_and_tabs_in_texts_are_allowed():
    assert read_text('a: "b\\n\\tc"', "f.yaml").plain() == {"a": "b\n\tc"}


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("a: " + "[" * 100_000, "nested more than 60 deep"),
        ("- " * 100_000, "nested more than 60 deep"),
        (
            "a0: &a0 [x]\n" + "".join(f"a{n}: &a{n} [*a{n - 1}]\n" for n in range(1, 70)),
            "nested more than 60 deep after expanding aliases",
        ),
        ("a: 0x" + "f" * 5000, "the number 0xffffffffffffffffff... is too large"),
        ("a: 1e999", "is too large"),
    ],
)
def test_deep_and_huge_values_are_refused(text, sentence):
    """Before, explaining 8000 brackets took a minute: quadratic in the depth."""
    assert len(text) < YAML_BYTES
    with pytest.raises(InputError, match=sentence):
        read_text(text, "f.yaml")

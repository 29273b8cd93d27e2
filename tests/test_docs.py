"""Every fenced block, command and link of README.md and docs/*.md works.

A test follows one page from top to bottom in a folder of its own, as a reader would:

* `python` with `file=NAME` is saved as NAME. Tests among these files pass; the others load as
  plugins. Other `python` blocks are executed.
* `yaml` is read by its first key: `mission`, `world`, `robot` or `runs` is a whole file and has no
  findings. Anything else is a snippet: its keys complete the page's mission, a list of nodes is a
  `run`. A snippet without `run` stays in force for the rest of the page. Cases under `tests` pass.
* `sh` lines are executed. OPTIONS and PARSED_ONLY say which `treepilot` lines are shortened. The
  targets of `make` exist, and so do the names and options of `python -m tests.benchmarks`.
* `json` is a route graph, `toml` and `lua` name entry points and commands that exist.
* `text` is output, compared by a function of its own in OUTPUTS.

The page's mission is `my_mission.yaml`: the first whole mission of the page, otherwise a shipped
one.
"""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import radians
from pathlib import Path
from pkgutil import resolve_name
from shutil import copytree
from textwrap import indent
from xml.etree import ElementTree

import pytest
import typer
import yaml
from distributed.cli import dask_scheduler, dask_worker
from py_trees.common import Status
from typer.main import get_command
from typer.testing import CliRunner

from behaviours.catalogue import GROUP, find_behaviours
from behaviours.kind import build
from behaviours.testing import ScriptedRobot, tick
from missions.cli.app import app
from missions.execution.resources import MISSIONS, find_mission
from missions.inspection.check import check_files
from missions.testing.session import run_files
from robots.bodies import GROUP as BODY_GROUP
from robots.load import find_robot, read_robot
from stack.components import GROUPS
from stack.documents import read_text
from stack.fast_loop.driver import GROUP as DRIVER_GROUP
from stack.mapping.marker_maps import read_marker_map
from stack.planning.routes.geojson import read_route_graph
from tests.benchmarks.__main__ import parsed
from tests.missions.learning.policies import save_affine

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
COMMAND = get_command(app)
SHORT = "01_drive_to_a_point"
"""A shipped mission of ten simulated seconds."""

LONG = ("README", "benchmarks", "tuning")
"""Pages whose commands take more than five seconds."""

SHIPPED = {"routes.md": "12_route_graph"}
"""The shipped mission that a page's snippets complete; SHORT on other pages."""

DRAWINGS = {"architecture.md"}
"""Pages whose fences without a language are drawings."""

OPTIONS = {
    "run": ["--headless", "--speed", "max"],
    "tune": [
        *("--set", "goal=[2.6, 2.2, 45 deg]", "--samples", "3", "--seeds", "1"),
        *("--confirm", "0", "--jobs", "1"),
    ],
    "bench missions": [SHORT, "--seeds", "1"],
    "bench courses": ["--course", "door", "--robots", "scout", "--trials", "1"],
    "bench flats": ["--worlds", "1", "--seed", "2", "--people", "none", "--jobs", "1"],
}
"""What is added to a command: the last of two equal options counts. `run` gets FIRST and, for
a second mission, BESIDE in place of what is named; `tune` gets SHORT."""

FIRST = """\
mission: first
robot: scout
world: small_room
start: dock
run: {wait: 1 s}
"""
BESIDE = FIRST.replace("first", "beside").replace("dock", "[1.0, 3.2, 0 deg]")
"""Run in place of missions that take minutes; robots that begin side by side."""

TIME_LIMIT, RULES = "missions.bench.people_runs.TIME_LIMIT", "missions.bench.course_bench.RULES"
"""Limits of the runs of benches. They end after BRIEF simulated seconds here: a command only has to
write its table. Outcomes of whole runs are tested in tests/missions/bench."""

BRIEF = 3.0

PARSED_ONLY = {
    "watch": "needs a terminal and a mission that runs",
    "replay": "needs a terminal",
    "lsp": "serves until its input ends",
    "calibrate": "needs pictures of a printed board",
    "jitter": "takes two minutes",
    "sweep": "takes hundreds of runs",
    "falsify": "takes hundreds of runs",
}
"""Commands whose words and options are checked but not carried out."""

ABSENT = ("stable_baselines3", "torch")
"""Libraries that the tests do not have: programs that use them are only compiled."""

PLACEHOLDERS = {"COMMAND": "run", "TICKS": "5", "OUTCOME": "success"}
"""What stands for a word in capitals where any word would not do."""

UNUSED = ("W102", "W103", "W129")
"""Warnings of unused names: the rest of a completed mission may use less than before."""

USAGE_ERROR = typer.BadParameter.__mro__[1]


def length_of(value):
    """Metres of a length in cm, or of a bare number."""
    text = f"{value}"
    return float(text.removesuffix(" cm")) / 100 if text.endswith(" cm") else float(text)


def _add_mass(link):
    inertial = ElementTree.SubElement(link, "inertial")
    ElementTree.SubElement(inertial, "mass", value="1")
    ElementTree.SubElement(inertial, "inertia", ixx="0.1", iyy="0.1", izz="0.1")


@dataclass(frozen=True)
class Block:
    """One fenced block: where it stands, its language and the file that it is."""

    page: Path
    line: int
    language: str
    file: str
    text: str


def blocks_of(page: Path) -> list[Block]:
    text = page.read_text("utf-8")
    return [
        Block(page, text[: found.start()].count("\n") + 1, found[1], found[2] or "", found[3])
        for found in re.finditer(
            r"^```(\w*)(?: file=(\S+))?\n(.*?)^```$", text, re.MULTILINE | re.DOTALL
        )
    ]


def prose_of(page: Path) -> str:
    """The page without its fenced blocks, on one line."""
    text = re.sub(r"^```.*?^```$", "", page.read_text("utf-8"), flags=re.MULTILINE | re.DOTALL)
    return " ".join(text.split())


class Follower:
    """Carries out the blocks of a page in a folder."""

    def __init__(self, page: Path, folder: Path) -> None:
        self.blocks, self.folder = blocks_of(page), folder
        copytree(MISSIONS / "routes", folder / "routes")
        shipped = find_mission(SHIPPED.get(page.name, SHORT))
        whole = [block.text for block in self.blocks if first_key(block) == "mission"]
        self.mission_file = folder / "my_mission.yaml"
        self.mission_file.write_text(whole[0] if whole else shipped.read_text("utf-8"), "utf-8")
        self.mission = plain(self.mission_file.read_text("utf-8"))
        for block in self.blocks:
            if block.file:
                (folder / block.file).parent.mkdir(parents=True, exist_ok=True)
                (folder / block.file).write_text(block.text, "utf-8")

    def follow(self, block: Block) -> None:
        drawing = block.page.name in DRAWINGS and block.language == "text"
        if not drawing:
            known = {
                "python": self.python, "yaml": self.yaml, "sh": self.sh, "json": self.json,
                "toml": self.toml, "lua": self.lua, "text": self.text,
            }  # fmt: skip
            assert block.language in known, f"nothing checks the language {block.language!r}"
            known[block.language](block)

    def python(self, block: Block) -> None:
        if not block.file:
            code = compile(block.text, f"{block.page.name}:{block.line}", "exec", dont_inherit=True)
            if not any(name in block.text for name in ABSENT):
                exec(code, {"__name__": "x"})
        elif Path(block.file).name.startswith("test_"):
            self.pytest(block.file)
        else:
            folder = Path(block.file).parent
            assert find_behaviours([f"./{folder}"], self.folder).problems == ()

    def yaml(self, block: Block) -> None:
        key = first_key(block)
        if key == "mission":
            assert findings(self.mission_file) == []
        elif key == "world":
            (self.folder / "my_world.yaml").write_text(block.text, "utf-8")
            assert findings(self.folder / "my_world.yaml") == []
        elif key == "robot":
            self.robot(block)
        elif key == "runs":
            (self.folder / "my_sweep.yaml").write_text(block.text, "utf-8")
            command = ["sweep", str(self.folder / "my_sweep.yaml"), "--dry-run"]
            assert CliRunner().invoke(app, command, catch_exceptions=False).exit_code == 0
        elif key == "body":
            self.robot_part(block)
        elif key == "markers":
            assert read_marker_map(self.folder / "markers.yaml", block.text)
        else:
            self.snippet(block)

    def robot(self, block: Block) -> None:
        """The robot file beside a URDF with the joints that it names; of a package as it is."""
        robot = plain(block.text)
        if robot["urdf"].startswith("package://"):
            (self.folder / "arm.yaml").write_text(block.text, "utf-8")
            assert findings(self.folder / "arm.yaml") == []
            return
        tree = ElementTree.Element("robot", name=robot["robot"])
        base = ElementTree.SubElement(tree, "link", name="base")
        _add_mass(base)
        radius = length_of(robot["wheels"]["radius"])
        for mount in robot["wheels"]["mounts"]:
            wheel = ElementTree.SubElement(tree, "link", name=f"{mount['joint']}_wheel")
            _add_mass(wheel)
            geometry = ElementTree.SubElement(
                ElementTree.SubElement(wheel, "collision"), "geometry"
            )
            ElementTree.SubElement(geometry, "sphere", radius=f"{radius}")
            joint = ElementTree.SubElement(tree, "joint", name=mount["joint"], type="continuous")
            ElementTree.SubElement(joint, "parent", link="base")
            ElementTree.SubElement(joint, "child", link=f"{mount['joint']}_wheel")
            x, y, heading = mount["at"]
            yaw = radians(float(f"{heading}".removesuffix(" deg")))
            at = f"{length_of(x)} {length_of(y)} {radius}"
            ElementTree.SubElement(joint, "origin", xyz=at, rpy=f"0 0 {yaw}")
            ElementTree.SubElement(joint, "axis", xyz="0 1 0")
        ElementTree.ElementTree(tree).write(self.folder / robot["urdf"])
        (self.folder / "robot.yaml").write_text(block.text, "utf-8")
        assert read_robot(self.folder / "robot.yaml").name == robot["robot"]

    def robot_part(self, block: Block) -> None:
        """Keys of a robot file, in place of those of a shipped robot."""
        scout = find_robot("scout", self.folder).parent
        robot = plain((scout / "robot.yaml").read_text("utf-8")) | {
            "urdf": str(scout / "scout.urdf")
        }
        file = self.folder / "robot.yaml"
        file.write_text(yaml.safe_dump(robot | plain(block.text), allow_unicode=True), "utf-8")
        assert read_robot(file).warnings == ()

    def snippet(self, block: Block) -> None:
        given = plain(block.text)
        mission = dict(self.mission)
        for key, value in given.items():
            both = isinstance(value, dict) and isinstance(mission.get(key), dict) and key != "run"
            mission[key] = {**mission[key], **value} if both else value
        if "run" not in given:
            self.mission = mission
        file = self.folder / "completed.yaml"
        file.write_text(yaml.safe_dump(mission, allow_unicode=True, sort_keys=False), "utf-8")
        assert findings(file, but=UNUSED) == []
        if "tests" in given:
            session = run_files([str(file)])
            assert session.exit_code == 0, session.text

    def sh(self, block: Block) -> None:
        for line in block.text.replace("\\\n", " ").splitlines():
            words = shlex.split(line, comments=True)
            if words[:1] == ["treepilot"]:
                self.treepilot(words[1:])
            elif words[:1] == ["make"]:
                assert words[1] in make_targets(), line
            elif words[:3] == ["python", "-m", "tests.benchmarks"]:
                parsed(words[3:])
            elif words[:1] == ["dask"]:
                {"scheduler": dask_scheduler, "worker": dask_worker}[words[1]].main.make_context(
                    words[1], words[2:]
                )
            elif words[:3] == ["python", "-m", "pytest"]:
                self.pytest(*words[3:])
            elif words[:2] == ["pip", "install"]:
                name, extra = re.fullmatch(r"(\w+)\[(\w+)\]", words[2]).groups()
                project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
                assert name == project["name"] and extra in project["optional-dependencies"]
            else:
                assert not words, f"nothing carries out {line!r}"

    def treepilot(self, words: list[str]) -> None:
        parse(words)
        name = " ".join(words[: 2 if words[0] == "bench" else 1])
        if name in PARSED_ONLY:
            return
        if name in ("run", "tune"):
            find_mission(words[1])  # in the folder or shipped
            rest = words[2:]
            if name == "run" and rest and not rest[0].startswith("-"):
                find_mission(rest[0])
                rest[0] = self.written("beside.yaml", BESIDE)
            mission = self.written("first.yaml", FIRST) if name == "run" else SHORT
            words = [name, mission, *rest]
        done = CliRunner().invoke(app, [*words, *OPTIONS.get(name, [])], catch_exceptions=False)
        assert done.exit_code == 0, done.output
        self.output = done.stdout

    def written(self, name: str, mission: str) -> str:
        """Write a mission into the folder of the page; return its path."""
        (self.folder / name).write_text(mission, "utf-8")
        return str(self.folder / name)

    def pytest(self, *words: str) -> None:
        done = subprocess.run(
            [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *words],
            cwd=self.folder, capture_output=True, text=True, check=False,
            env={"PYTHONPATH": str(ROOT), "PATH": "/usr/bin:/bin"},
        )  # fmt: skip
        assert done.returncode == 0, done.stdout + done.stderr

    def json(self, block: Block) -> None:
        file = self.folder / "lanes.geojson"
        file.write_text(block.text, "utf-8")
        assert read_route_graph(file).warnings == ()

    def toml(self, block: Block) -> None:
        content = tomllib.loads(block.text)
        groups = content.get("project", {}).get("entry-points", {})
        servers = content.get("language-server", {})
        assert groups or servers, "neither entry points nor a language server"
        assert set(groups) <= {GROUP, BODY_GROUP, DRIVER_GROUP, *GROUPS.values()}
        for server in servers.values():
            assert server["command"] == "treepilot"
            parse(server["args"])

    def lua(self, block: Block) -> None:
        command = re.search(r"cmd = \{(.*?)\}", block.text)[1]
        name, *words = re.findall(r'"(.*?)"', command)
        assert name == "treepilot"
        parse(words)

    def text(self, block: Block) -> None:
        OUTPUTS[block.page.name](self, block)


def plugin_problems(follower: Follower, block: Block) -> None:
    """Three faulty plugins, and what is said of each; … stands for any words."""
    folder = follower.folder / "faulty"
    folder.mkdir()
    head = "from behaviours.base import RobotBehaviour, port\n\n\nclass "
    body = "    def update(self):\n        return self.fail('NO', 'no')\n"
    (folder / "look_around.py").write_text("\n\nimport maths\n")
    (folder / "spin.py").write_text(f"{head}Spin(RobotBehaviour):\n{body}")
    (folder / "fetch.py").write_text(
        f"{head}Fetch(RobotBehaviour):\n    what: dict = port('what')\n\n{body}"
    )
    said = [
        f"{Path(problem.file).name}: {problem.sentence}"
        for problem in find_behaviours(["./faulty"], follower.folder).problems
    ]
    shown = [re.escape(line.removeprefix("my_behaviours/")) for line in block.text.splitlines()]
    assert len(said) == len(shown)
    for line in shown:
        pattern = line.replace("…", ".*")
        assert any(re.fullmatch(pattern, one) for one in said), (line, said)


def tuning_table(follower: Follower, block: Block) -> None:
    """The header has the columns of the real table, the verdict its words; the figures differ."""
    shown, real = block.text.splitlines()[0].split(), follower.output.splitlines()[0].split()
    assert shown[-1] == "…"
    assert shown[:-1] == real[: len(shown) - 1]
    verdict = r"^best of \d+ settings on \w+ seeds?: cost [-+]\d"
    assert re.search(verdict, block.text, re.MULTILINE)
    assert re.search(verdict, follower.output, re.MULTILINE)


def topics(follower: Follower, block: Block) -> None:
    """The topics of an exported run and their schemas, as the page lists them."""
    command = ["export", str(follower.folder / "runs/one"), "--mcap"]
    printed = CliRunner().invoke(app, command).output.splitlines()
    listed, found = (
        {tuple(line.split()[:2]) for line in lines if line.startswith("/")}
        for lines in (block.text.splitlines(), printed[:-1])
    )
    assert found <= listed, found - listed
    assert len(found) > 20


def diagnosis(follower: Follower, block: Block) -> None:
    """It has the shape of the real output, and its causes are in the table below it."""
    told, page = block.text.splitlines(), block.page.read_text("utf-8")
    for line in told:
        assert re.match(r"\w+: \w+ after [\d.]+ s: |  |\d\. [a-z ]+ \(\d+%\): |   |$", line), line
    for cause in re.findall(r"^\d\. ([a-z ]+) \(", block.text, re.MULTILINE):
        assert f"| `{cause}` |" in page


def runs_page(follower: Follower, block: Block) -> None:
    """The topics of an export, or the output of `diagnose`."""
    (topics if "\n/" in block.text else diagnosis)(follower, block)


def policy_snippet(follower: Follower, block: Block) -> None:
    """The controller of a policy completes the page's mission: there is such a policy."""
    sizes = {"observation": (24,)}  # 5 points, 12 sectors, 2 parts of the velocity
    save_affine(follower.folder / "policy.onnx", [[0.0] * 24] * 2, [0.0, 0.0], sizes)
    follower.snippet(replace(block, language="yaml"))


OUTPUTS = {
    "learning.md": policy_snippet, "runs.md": runs_page, "behaviours.md": plugin_problems,
    "tuning.md": tuning_table,
}  # fmt: skip


def first_key(block: Block) -> str:
    """The first top-level key of a YAML block; '-' of a list, '' of a comment."""
    found = re.search(r"^(\w+|-)", block.text, re.MULTILINE) if block.language == "yaml" else None
    return found[1] if found else ""


def plain(text: str):
    """The content of a YAML block; a list becomes the children of `run`."""
    if text.startswith("- "):
        text = "run:\n  sequence:\n" + indent(text, "    ")
    return read_text(text, "block.yaml").plain()


def findings(file: Path, but: tuple[str, ...] = ()) -> list[str]:
    lines = check_files([str(file)])
    return [line.text for line in lines if not (line.finding and line.finding.code in but)]


def make_targets() -> set[str]:
    makefile = (ROOT / "Makefile").read_text("utf-8")
    return set(re.findall(r"^([a-z-]+):", makefile, re.MULTILINE))


def parse(words: list[str], *, partial: bool = False) -> None:
    """Parse words as the command line does, without carrying them out.

    Args:
        words: behind `treepilot`.
        partial: whether required arguments and options may be missing.
    """
    command, context = COMMAND, None
    words = list(words)
    name = "treepilot"
    while words:
        try:
            context = command.make_context(name, words, parent=context)
        except typer.Exit:  # --help
            return
        except USAGE_ERROR as error:
            if partial and type(error).__name__ == "MissingParameter":
                return
            raise AssertionError(f"{name}: {error.format_message()}") from None
        if not hasattr(command, "commands"):
            return
        rest = [*context._protected_args, *context.args]
        if not rest:
            return
        assert rest[0] in command.commands, f"{name} has no command {rest[0]!r}"
        name, command, words = rest[0], command.commands[rest[0]], rest[1:]


def every_option(command=COMMAND) -> Iterator[str]:
    for parameter in command.params:
        yield from parameter.opts
    for inner in getattr(command, "commands", {}).values():
        yield from every_option(inner)


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, marks=[pytest.mark.slow] * (page.stem in LONG))
        for page in PAGES
        if page.stem not in ("tutorial", "python")  # test_tutorial.py, test_python_page.py
    ],
    ids=lambda page: page.stem,
)
def test_every_block_of_the_page_works(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(TIME_LIMIT, BRIEF)
    monkeypatch.setattr(RULES, replace(resolve_name(RULES), time_limit=BRIEF))
    follower = Follower(page, tmp_path)
    for block in follower.blocks:
        try:
            follower.follow(block)
        except BaseException as error:
            error.add_note(f"in the block at {page.name}:{block.line}")
            raise


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_fence_is_found(page):
    fences = re.findall(r"^\s*```", page.read_text("utf-8"), re.MULTILINE)
    assert len(fences) == 2 * len(blocks_of(page))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_command_in_the_prose_exists(page):
    options = {*every_option(), "-h", "--help"}
    for code in re.findall(r"`([^`]+)`", prose_of(page)):
        words = [PLACEHOLDERS.get(word, word) for word in code.replace("\\|", "|").split()]
        if words[0] == "treepilot":
            parse(words[1:], partial=True)
        elif words[0] in COMMAND.commands and words[1:2] and words[1].startswith("--"):
            parse(words, partial=True)
        elif words[0] == "make" and len(words) > 1:
            assert words[1] in make_targets(), code
        elif words[0].startswith("--"):
            assert words[0] in options, code


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_link_leads_somewhere(page):
    for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", prose_of(page)):
        if not target.startswith("http"):
            assert (page.parent / target).exists(), target


def test_the_behaviour_of_the_readme_beeps_once_per_second(tmp_path):
    text = next(block.text for block in blocks_of(PAGES[0]) if "class Honk" in block.text)
    (tmp_path / "my_behaviours").mkdir()
    (tmp_path / "my_behaviours" / "honk.py").write_text(text, "utf-8")
    catalogue = find_behaviours(["./my_behaviours"], tmp_path)
    honk, robot = build(catalogue.get("honk"), "honk", {"times": 3}), ScriptedRobot()
    assert tick(honk, robot, 1.5) is Status.RUNNING
    assert robot.said == ["beep", "beep"]  # at 0 s and 1 s
    assert tick(honk, robot, 1.0) is Status.SUCCESS
    assert robot.said == ["beep", "beep", "beep"]
    assert honk.honked == 3

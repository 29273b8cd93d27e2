"""Writes the beginnings of a new behaviour: a plugin file that works, and its test."""

from __future__ import annotations

import keyword
import re
from collections.abc import Mapping
from pathlib import Path

from behaviours.catalogue import MISSION_WORDS, find_behaviours
from stack.errors import InputError

LONGEST_NAME = 40
"""Letters; longer ones do not fit on the dashboard, or on a line of the file written here."""

BEHAVIOUR = '''"""{Sentence}."""

from __future__ import annotations

from py_trees.common import Status

from behaviours.base import RobotBehaviour, output, port
from stack.types import FailureCode


class {Class}(RobotBehaviour):
    """{Sentence}.

    What it does stands in for your own: it waits until the robot has stood still. In a mission:

        plugins: [./{folder}]
        run:
          - {name}: {{still_for: 2 s}}
    """

    still_for: float = port("how long the robot must stand still", unit="s", default=1.0, above=0.0)
    patience: float = port("how long to wait for that", unit="s", default=10.0, above=0.0)
    waited: float = output("how long it took", unit="s")

    def initialise(self) -> None:
        """Called when the tree comes to this node: begin afresh."""
        self._started = self._moved = self.robot.time

    def update(self) -> Status:
        """Called on every tick: look, perhaps command something, and answer at once."""
        now = self.robot.time
        if abs(self.robot.speed.linear) > 0.01 or abs(self.robot.speed.angular) > 0.01:
            self._moved = now
        self.waited = now - self._started
        if now - self._moved >= self.still_for:
            return Status.SUCCESS
        if self.waited >= self.patience:
            return self.fail(
                FailureCode.TIMED_OUT, f"did not stand still within {{self.patience:g}} s"
            )
        self.feedback_message = f"stood still for {{now - self._moved:.1f}} s"
        return Status.RUNNING
'''

TEST = """from pathlib import Path

import pytest
from py_trees.common import Status

from behaviours.catalogue import build, find_behaviours
from behaviours.testing import ScriptedRobot, tick
from stack.types import Twist

NAME = "{name}"


@pytest.fixture
def kind():
    catalogue = find_behaviours([f"./{{NAME}}.py"], Path(__file__).parent)
    assert catalogue.problems == ()
    return catalogue.get(NAME)


def test_succeeds_when_the_robot_has_stood_still(kind):
    behaviour = build(kind, "wait for it", {{"still_for": "2 s"}})
    robot = ScriptedRobot(speed=Twist(0.3))
    assert tick(behaviour, robot, 1.0) is Status.RUNNING
    robot.speed = Twist()
    assert tick(behaviour, robot, 1.8) is Status.RUNNING
    assert tick(behaviour, robot, 0.3) is Status.SUCCESS
    assert behaviour.waited == pytest.approx(3.0, abs=0.15)


def test_fails_with_a_reason_when_it_never_does(kind):
    behaviour = build(kind, "wait for it", {{"patience": "3 s"}})
    robot = ScriptedRobot(speed=Twist(0.3))
    assert tick(behaviour, robot, 5.0) is Status.FAILURE
    assert behaviour.failure.code == "TIMED_OUT"
    assert behaviour.failure.sentence == "did not stand still within 3 s"
"""


def new_behaviour(name: str, folder: Path) -> list[Path]:
    """Write `<name>.py` and `test_<name>.py` into a plugin folder, made if need be.

    Args:
        name: as a mission will write it, e.g. close_gripper.
        folder: where plugins are; a mission names it under `plugins`.

    Returns:
        The files written.

    Raises:
        InputError: the name will not do, or a file of that name is there already.
    """
    check_name(name, "a behaviour")
    taken = find_behaviours().get(name)
    if taken is not None:
        raise InputError(f"{name!r} is taken: {taken.summary} Choose another name")
    words = {
        "name": name,
        "Class": "".join(word.capitalize() for word in name.split("_")),
        "Sentence": name.replace("_", " ").capitalize(),
        "folder": folder.name or "my_behaviours",
    }
    texts = {folder / f"{name}.py": BEHAVIOUR, folder / f"test_{name}.py": TEST}
    return write_new({file: text.format(**words) for file, text in texts.items()})


def write_new(texts: Mapping[Path, str]) -> list[Path]:
    """Write files that are not there yet, all or none; their folders are made.

    Raises:
        InputError: one of them is there already.
    """
    for file in texts:
        if file.exists():
            raise InputError(f"{file} is there already; choose another name, or delete it first")
    for file, text in texts.items():
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    return list(texts)


def check_name(name: str, what: str) -> None:
    """Raise InputError unless a plugin's class and file may have this name in missions."""
    if not re.fullmatch(r"[a-z][a-z0-9]*(_[a-z][a-z0-9]*)*", name):
        raise InputError(
            f"{name!r} cannot name {what}: use lower-case words joined by underscores, "
            "e.g. close_gripper"
        )
    if len(name) > LONGEST_NAME:
        raise InputError(f"{name!r} is too long: at most {LONGEST_NAME} letters")
    if name in MISSION_WORDS or keyword.iskeyword(name):
        raise InputError(f"{name!r} is a word of the mission language or of Python; choose another")
    if name.startswith("test_"):
        raise InputError(f"{name!r} would be taken for a test; choose a name without test_")

"""Templates for a new behaviour: a working plugin file and its test."""

from __future__ import annotations

import keyword
import re
from collections.abc import Collection, Mapping
from pathlib import Path

from behaviours.catalogue import find_behaviours
from stack.errors import InputError

LONGEST_NAME = 40
"""Characters; a longer name does not fit in the dashboard or in a line of the template."""

BEHAVIOUR = '''"""{Sentence}."""

from __future__ import annotations

from treepilot import Behaviour, FailureCode, Status, output, port


class {Class}(Behaviour):
    """{Sentence}.

    Example to replace: it waits until the robot has not moved for a time. In a mission:

        plugins: [./{folder}]
        run:
          - {name}: {{still_for: 2 s}}
    """

    still_for: float = port("time without motion", unit="s", default=1.0, above=0.0)
    patience: float = port("time limit", unit="s", default=10.0, above=0.0)
    waited: float = output("time waited", unit="s")

    def initialise(self) -> None:
        """Called when the node starts: reset the state."""
        self._since_start, self._since_motion = self.start_timer(), self.start_timer()

    def update(self) -> Status:
        """Called on every tick: read, command, and return at once."""
        speed = self.robot.base.speed
        if abs(speed.linear) > 0.01 or abs(speed.angular) > 0.01:
            self._since_motion.restart()
        self.waited = self._since_start.elapsed
        if self._since_motion.is_over(self.still_for):
            return Status.SUCCESS
        if self._since_start.is_over(self.patience):
            return self.fail(FailureCode.TIMED_OUT, f"no standstill within {{self.patience:g}} s")
        self.feedback_message = f"no motion for {{self._since_motion.elapsed:.1f}} s"
        return Status.RUNNING
'''

TEST = """from pathlib import Path

import pytest

from treepilot import Status, Twist
from treepilot.testing import ScriptedRobot, make_behaviour, tick

PLUGIN = Path(__file__).with_name("{name}.py")


def test_succeeds_after_a_time_without_motion():
    behaviour = make_behaviour(PLUGIN.stem, {{"still_for": "2 s"}}, plugin=PLUGIN)
    robot = ScriptedRobot(speed=Twist(0.3))
    assert tick(behaviour, robot, 1.0) is Status.RUNNING
    robot.speed = Twist()
    assert tick(behaviour, robot, 1.8) is Status.RUNNING
    assert tick(behaviour, robot, 0.3) is Status.SUCCESS
    assert behaviour.waited == pytest.approx(3.0, abs=0.15)


def test_fails_when_the_robot_keeps_moving():
    behaviour = make_behaviour(PLUGIN.stem, {{"patience": "3 s"}}, plugin=PLUGIN)
    robot = ScriptedRobot(speed=Twist(0.3))
    assert tick(behaviour, robot, 5.0) is Status.FAILURE
    assert behaviour.failure.code == "TIMED_OUT"
    assert behaviour.failure.sentence == "no standstill within 3 s"
"""


def new_behaviour(name: str, folder: Path, reserved: Collection[str] = ()) -> list[Path]:
    """Write `<name>.py` and `test_<name>.py` to a plugin folder; create the folder if necessary.

    Args:
        name: name of the behaviour in missions, e.g. ring_bell.
        folder: plugin folder; missions list it under `plugins`.
        reserved: the words of the mission language.

    Returns:
        The files written.

    Raises:
        InputError: the name is invalid or taken, or one of the files exists.
    """
    check_name(name, "a behaviour", reserved)
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
    """Write new files, all or none, and create their folders.

    Raises:
        InputError: one of the files exists.
    """
    for file in texts:
        if file.exists():
            raise InputError(
                f"{file} already exists; delete it, or choose another folder: --in FOLDER"
            )
    for file, text in texts.items():
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    return list(texts)


def check_name(name: str, what: str, reserved: Collection[str]) -> None:
    """Raise InputError if a plugin cannot have this name in missions, or one that is reserved."""
    if not re.fullmatch(r"[a-z][a-z0-9]*(_[a-z][a-z0-9]*)*", name):
        raise InputError(
            f"{name!r} cannot name {what}: use lower-case words joined by underscores, "
            "e.g. ring_bell"
        )
    if len(name) > LONGEST_NAME:
        raise InputError(f"{name!r} is too long: {len(name)} characters, at most {LONGEST_NAME}")
    if name in reserved or keyword.iskeyword(name):
        raise InputError(f"{name!r} is a word of the mission language or of Python; choose another")
    if name.startswith("test_"):
        raise InputError(f"{name!r} is the name of a test; choose a name without test_")

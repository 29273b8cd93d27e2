"""Missions of the shipped behaviours on the scripted robot, with a log of what they did."""

from dataclasses import dataclass, field
from pathlib import Path
from textwrap import dedent

import numpy as np

from behaviours import testing
from behaviours.catalogue import find_behaviours
from missions.language.model import Resources
from missions.language.reading.mission import read_mission
from missions.trees.compiler import compile_mission
from stack.types import CameraModel, Image, Pose2D

_LEAVES = Path(__file__).with_name("scripted_leaves.py").read_text("utf-8").splitlines()
BURST_AT = next(
    f"(scripted_leaves.py:{number})"
    for number, line in enumerate(_LEAVES, 1)
    if "# BURST_AT" in line
)
"""File and line of the exception of a broken leaf, as failures name it."""

CATALOGUE = find_behaviours(["tests.missions.scripted_leaves"])
"""Every shipped behaviour, and the leaves that follow a script."""

CAMERA = CameraModel(1, 1, 1.0, (0.0, 0.0, 0.0), 0.0, 0.0)


@dataclass
class ScriptedRobot(testing.ScriptedRobot):
    """The scripted robot, whose tasks succeed at once and whose camera always has a picture.

    Attributes:
        log: what it was told to say, the goals it was sent to, and what scripted leaves did.
        answers: scripts of those leaves by name; `shut`: x of the goals that it does not reach.
        lasting: its tasks go on until the test ends them.
    """

    log: list = field(default_factory=list)
    answers: dict = field(default_factory=dict)
    lasting: bool = False

    def image(self):
        return Image(self.time, np.zeros((1, 1, 3), np.uint8), CAMERA)

    def say(self, text):
        super().say(text)
        self.log.append(text)

    def _request(self, name, **arguments):
        task = super()._request(name, **arguments)
        if name == "navigate_to":
            self.log.append(arguments["goal"])
        if not self.lasting:
            self.end(task, arguments.get("goal"))
        return task

    def end(self, task, goal):
        """As a drive ends: at the goal, or with no way to it."""
        if goal is not None and goal.x in self.answers.get("shut", ()):
            task.fail("NO_VALID_PATH", f"no way to x = {goal.x:g}")
        else:
            task.succeed()


HEAD = "mission: test\nrobot: scout\nworld: office\n"
PLACES = {"lobby": Pose2D(9.0, 9.0)}


def read_text(folder, text, resources=None, **overrides):
    """The mission in a text; HEAD is put behind it, so that lines count as written."""
    file = folder / "mission.yaml"
    body = dedent(text)
    missing = [line for line in HEAD.splitlines() if f"{line.split(':')[0]}:" not in body]
    file.write_text("\n".join([body.rstrip("\n"), *missing, ""]))
    resources = resources or Resources(world_places=lambda name, beside: PLACES)
    return read_mission(file, lambda plugins, beside, findings: CATALOGUE, resources, overrides)


class Ran:
    """A compiled mission with a scripted robot and everything it emitted."""

    def __init__(self, mission, robot=None):
        self.tree = compile_mission(mission)
        self.robot = robot or ScriptedRobot()
        self.events, self.tracebacks = [], []
        self.tree.setup(self.robot, self.emit, self.tracebacks.append)

    def emit(self, **event):
        self.events.append(event)

    def ticks(self, count=1):
        """Tick, then let a period pass, as often as said; the log."""
        for _ in range(count):
            self.tree.tick()
            self.robot.advance(testing.TICK_PERIOD)
        return self.robot.log

    def changes(self):
        """`name: from > to` of every change of status."""
        return [
            f"{event['fields']['name']}: {event['fields']['from']} > {event['fields']['to']}"
            for event in self.events
            if event["kind"] == "node_status"
        ]


def ran(folder, text, **overrides):
    """A mission text, compiled and set up."""
    return Ran(read_text(folder, text, **overrides))

"""A scripted robot of plain attributes, small behaviours and a catalogue for mission tests."""

from dataclasses import dataclass, field
from textwrap import dedent

import numpy as np
import py_trees
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from behaviours.base import RobotBehaviour, output, port
from behaviours.catalogue import BehaviourKind
from missions.language.model import Resources
from missions.language.reading.mission import read_mission
from missions.trees.compiler import compile_mission
from stack.parameters import Declaration
from stack.types import Assignments, Battery, Expression, Pose2D, PoseEstimate, Twist


@dataclass
class ScriptedRobot:
    """What a mission may look at; tests set it."""

    time: float = 0.0
    battery: Battery = field(default_factory=lambda: Battery(1.0))
    speed: Twist = Twist()
    localisation_health: float = 1.0
    pose: Pose2D = Pose2D(0.0, 0.0)
    log: list = field(default_factory=list)
    answers: dict = field(default_factory=dict)

    @property
    def estimate(self):
        return PoseEstimate(self.pose, np.diag([0.04, 0.01, 0.0]), self.localisation_health)


class Check(RobotBehaviour):
    """Succeed when the condition holds, fail when not."""

    condition: Expression = port("what must hold")

    def update(self):
        if self.condition():
            return Status.SUCCESS
        return self.fail("CHECK_FAILED", self.condition.explain())


class WaitUntil(RobotBehaviour):
    """Wait until the condition holds."""

    can_fail = False

    condition: Expression = port("what must hold")

    def update(self):
        return Status.SUCCESS if self.condition() else Status.RUNNING


class Set(RobotBehaviour):
    """Write blackboard keys."""

    writes: Assignments = port("keys with expressions")

    def update(self):
        for _, expression, write in self.writes.writes:
            write(expression())
        return Status.SUCCESS


class Wait(RobotBehaviour):
    """Wait."""

    takes_time = True
    can_fail = False

    time: float = port("how long", unit="s", at_least=0.0)

    def initialise(self):
        self.until = self.robot.time + self.time

    def update(self):
        return Status.SUCCESS if self.robot.time >= self.until - 1e-9 else Status.RUNNING


class Say(RobotBehaviour):
    """Tell the operator."""

    can_fail = False

    text: str = port("what to say")

    def update(self):
        self.robot.log.append(self.text)
        return Status.SUCCESS


class Act(RobotBehaviour):
    """Do what the robot's script says: `answers[who]` is a list of s, f, r; the last one stays."""

    who: str = port("its name in the log")

    def initialise(self):
        self.robot.log.append(f"{self.who} starts")

    def update(self):
        script = self.robot.answers.get(self.who, "s")
        self.robot.answers[self.who] = script[1:] or script
        if script[0] == "f":
            return self.fail("NO_WALL", f"{self.who} found no wall")
        return Status.SUCCESS if script[0] == "s" else Status.RUNNING

    def terminate(self, new_status):
        words = {Status.SUCCESS: "done", Status.FAILURE: "failed", Status.INVALID: "halted"}
        self.robot.log.append(f"{self.who} {words[new_status]}")


class Drive(Act):
    """Act that moves the robot."""

    uses_wheels = True


class NavigateToPose(RobotBehaviour):
    """Drive to a pose."""

    goal: Pose2D = port("where to go")
    tolerance: float = port("how near", unit="m", default=0.25, above=0.0)
    path_length: float = output("length driven", unit="m")
    uses_wheels = True

    def initialise(self):
        self.robot.log.append(self.goal)

    def update(self):
        self.path_length = 2.5
        return Status.SUCCESS


class Spin(RobotBehaviour):
    """Turn in place."""

    angle: float = port("how far", unit="rad", default=1.57)
    uses_wheels = True

    def update(self):
        return Status.SUCCESS


class BackUp(RobotBehaviour):
    """Drive back."""

    distance: float = port("how far", unit="m", above=0.0)
    speed: float = port("how fast", unit="m/s", default=0.1)
    uses_wheels = True

    def update(self):
        return Status.SUCCESS


class ClearCostmap(RobotBehaviour):
    """Forget obstacles."""

    which: str = port("which", default="both", one_of=("local", "global", "both"))

    def update(self):
        return Status.SUCCESS


class TakePhoto(RobotBehaviour):
    """Keep a picture."""

    image: str = output("path of the picture")

    def update(self):
        self.image = "a.jpg"
        return Status.SUCCESS


class Visit(RobotBehaviour):
    """Visit poses."""

    goals: list[Pose2D] = port("where to go")
    speeds: list[float] = port("how fast", unit="m/s", default=[])

    def update(self):
        self.robot.log.append(list(self.goals))
        return Status.SUCCESS


class Broken(RobotBehaviour):
    """Raise in the method that is named."""

    where: str = port("initialise, update, terminate, halt, setup or status")

    def setup(self, **resources):
        super().setup(**resources)
        self.burst("setup")

    def initialise(self):
        self.burst("initialise")

    def update(self):
        self.burst("update")
        if self.where == "status":
            return None
        return Status.RUNNING if self.where == "halt" else Status.SUCCESS

    def terminate(self, new_status):
        self.burst("halt" if new_status is Status.INVALID else "terminate")

    def burst(self, place):
        if self.where == place:
            raise ValueError(f"burst in {place}")


class Plain(Behaviour):
    """A plain py_trees behaviour."""

    def __init__(self, name, ticks: int = 1):
        super().__init__(name)
        self.ticks = ticks

    def update(self):
        self.ticks -= 1
        return Status.RUNNING if self.ticks > 0 else Status.SUCCESS


CLASSES = {
    "check": Check, "wait_until": WaitUntil, "set": Set, "wait": Wait, "say": Say, "act": Act,
    "drive": Drive, "navigate_to_pose": NavigateToPose, "spin": Spin, "back_up": BackUp,
    "clear_costmap": ClearCostmap, "take_photo": TakePhoto, "visit": Visit, "broken": Broken,
}  # fmt: skip


class FakeCatalogue:
    """The behaviours above."""

    def names(self):
        return list(CLASSES)

    def get(self, name):
        if name == "plain.Plain":
            return kind(name, Plain, {"ticks": Declaration("ticks", int, default=1)}, {})
        if name == "plain.Running":
            return kind(name, py_trees.behaviours.Running, {}, {})
        if name not in CLASSES:
            return None
        return kind(name, CLASSES[name], CLASSES[name].ports(), CLASSES[name].outputs())

    def why_not(self, name):
        return f"there is no class {name!r}"


def kind(name, cls, ports, outputs):
    return BehaviourKind(name, cls, ports, outputs, "", "", "", False)


HEAD = "mission: test\nrobot: scout\nworld: office\n"
PLACES = {"lobby": Pose2D(9.0, 9.0)}


def read_text(folder, text, resources=None, **overrides):
    """The mission in a text; HEAD is put behind it, so that lines count as written."""
    file = folder / "mission.yaml"
    body = dedent(text)
    missing = [line for line in HEAD.splitlines() if f"{line.split(':')[0]}:" not in body]
    file.write_text("\n".join([body.rstrip("\n"), *missing, ""]))
    resources = resources or Resources(world_places=lambda name, beside: PLACES)
    return read_mission(
        file, lambda plugins, beside, findings: FakeCatalogue(), resources, overrides
    )


class Ran:
    """A compiled mission with a scripted robot and everything it emitted."""

    def __init__(self, mission, period=0.1):
        self.tree = compile_mission(mission, FakeCatalogue())
        self.robot, self.period = ScriptedRobot(), period
        self.events, self.tracebacks = [], []
        self.tree.setup(self.robot, self.emit, self.tracebacks.append)

    def emit(self, **event):
        self.events.append(event)

    def ticks(self, count=1):
        """Tick, then let a period pass, as often as said; the log."""
        for _ in range(count):
            self.tree.tick()
            self.robot.time = round(self.robot.time + self.period, 9)
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

"""A plugin for mission tests: leaves that do what the test has written for them.

The other leaves of these tests are the shipped behaviours.
"""

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from behaviours.base import RobotBehaviour, port
from stack.types import Pose2D


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

    claims = ("base",)


class Pausable(RobotBehaviour):
    """Answer as Act does; log pauses only."""

    who: str = port("its name in the log")

    def update(self):
        script = self.robot.answers.get(self.who, "s")
        self.robot.answers[self.who] = script[1:] or script
        return Status.SUCCESS if script[0] == "s" else Status.RUNNING

    def pause(self, now):
        super().pause(now)
        self.robot.log.append(("pause", self.who, now))

    def resume(self, now):
        super().resume(now)
        self.robot.log.append(("resume", self.who, now))


class Visit(RobotBehaviour):
    """Log lists of poses and numbers, as no shipped behaviour takes them both."""

    goals: list[Pose2D] = port("where to go")
    speeds: list[float] = port("how fast", unit="m/s", default=[])

    def update(self):
        self.robot.log.append(list(self.goals))
        return Status.SUCCESS


class Broken(RobotBehaviour):
    """Raise in the method that is named."""

    where: str = port("initialise, update, terminate, halt, pause, setup or status")

    def setup(self, **resources):
        super().setup(**resources)
        self.burst("setup")

    def initialise(self):
        self.burst("initialise")

    def update(self):
        self.burst("update")
        if self.where == "status":
            return None
        return Status.RUNNING if self.where in ("halt", "pause") else Status.SUCCESS

    def pause(self, now):
        self.burst("pause")

    def terminate(self, new_status):
        self.burst("halt" if new_status is Status.INVALID else "terminate")

    def burst(self, place):
        if self.where == place:
            raise ValueError(f"burst in {place}")  # BURST_AT


class FailsTwice(RobotBehaviour):
    """Fails with a reason, then without one; it has nothing but `update`."""

    terminate = Behaviour.terminate

    def update(self):
        self.robot.log.append(self.failure)
        return self.fail("NO_WALL", "no wall") if len(self.robot.log) == 1 else Status.FAILURE


class Stray(RobotBehaviour):
    """Start to turn, then raise before it follows its task."""

    who: str = port("its name in the log")
    claims = ("base",)

    def initialise(self):
        self.robot.base.spin(1.0)
        raise ValueError("burst after the start of a task")

    def update(self):
        return Status.RUNNING


class Stubborn(RobotBehaviour):
    """Turn, and raise when the tree ends it."""

    who: str = port("its name in the log")
    claims = ("base",)

    def initialise(self):
        self._task = self.robot.base.spin(1.0)

    def update(self):
        return self.follow(self._task)

    def terminate(self, new_status):
        raise ValueError("burst in terminate")

"""An arm on its column before a bench, and motions for it without a planner."""

import numpy as np

from robots.load import HERE, read_robot
from robots.simulated import SimulatedBody
from stack.body import BodyCommand
from stack.frames.links import RobotLinks
from stack.sim.worlds.world import Block, Box, Wall, World
from stack.types import GripperCommand, JointTrajectory, Pose2D

PANDA = read_robot(HERE / "panda_table" / "robot.yaml")
ARM = PANDA.arm
HOME = ARM.postures["home"]
LINKS = RobotLinks(PANDA.links, "base")
TOP = 0.6
PERIOD = 0.05


def bench(*blocks, walls=()):
    """A table whose top is TOP high, before the arm, with blocks on it."""
    table = Box(Pose2D(0.6, 0.0), (0.7, 1.2, 0.04), elevation=TOP - 0.04, name="the bench")
    points = np.array([(-3.0, -3.0), (3.0, -3.0)])
    return World(
        "bench", (-3.0, -3.0, 3.0, 3.0), walls=(Wall(points),), boxes=(table, *walls),
        blocks=blocks,
    )  # fmt: skip


def block(name="red", x=0.5, y=0.0, heading=0.0, size=(0.05, 0.05, 0.05), mass=0.1):
    return Block(name, Pose2D(x, y, heading), size, elevation=TOP, mass=mass)


def simulated(world, seed=1):
    return SimulatedBody(PANDA, world, start=Pose2D(0.0, 0.0), seed=seed)


def tool_at(positions):
    return LINKS.chain(ARM.tool_link).pose(positions)


def looking_down(x, y, z, begin=HOME):
    """Positions that put the tool at a place, metres, looking down with its y along the base's."""
    wanted = np.eye(4)
    wanted[:3, :3] = np.diag([1.0, -1.0, -1.0])
    wanted[:3, 3] = x, y, z
    q = begin.copy()
    for _ in range(200):
        error = _off(tool_at(q), wanted)
        if np.abs(error).max() < 1e-7:
            break
        jacobian = np.column_stack(
            [(_off(tool_at(q + step), wanted) - error) / 1e-6 for step in 1e-6 * np.eye(len(q))]
        )
        q = q - jacobian.T @ np.linalg.solve(jacobian @ jacobian.T + 1e-6 * np.eye(6), error)
    assert np.abs(_off(tool_at(q), wanted)).max() < 1e-5
    return q


def _off(pose, wanted):
    """Difference of two poses: position, and axis times angle for small angles."""
    turn = pose[:3, :3] @ wanted[:3, :3].T
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    return np.concatenate([pose[:3, 3] - wanted[:3, 3], axis / 2.0])


def motion(begin, end, seconds=2.0, samples=41):
    """A trajectory along a straight line in joint space, at rest at both ends: a quintic."""
    u = np.linspace(0.0, 1.0, samples)
    share = 10 * u**3 - 15 * u**4 + 6 * u**5
    rate = (30 * u**2 - 60 * u**3 + 30 * u**4) / seconds
    rate[-1] = 0.0
    step = np.asarray(end) - np.asarray(begin)
    return JointTrajectory(seconds * u, begin + np.outer(share, step), np.outer(rate, step))


def carry_out(body, seconds, **command):
    """Command something and let time pass; return the observations."""
    seen = []
    for number in range(round(seconds / PERIOD)):
        new = command if number == 0 else {k: v for k, v in command.items() if k.startswith("hold")}
        body.command(BodyCommand(**new))
        body.wait(PERIOD)
        seen.append(body.sense())
    return seen


def grip(body, width, seconds=1.0, force=40.0):
    return carry_out(body, seconds, gripper=GripperCommand(width, force))[-1]

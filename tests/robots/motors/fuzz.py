"""Random and mutated CAN frames at the driver `odrive_can` while it drives.

    python -m tests.robots.motors.fuzz [COUNT]

does so on the virtual clock, and then with a real fast loop, whose timing it prints.
"""

from __future__ import annotations

import socket
import sys
import time
from collections import Counter
from math import tau
from random import Random

import can
import numpy as np

from robots.motors.can_bus import MOST_FRAMES
from robots.motors.can_simple import (
    MESSAGES,
    EncoderEstimates,
    Heartbeat,
    decode,
    encode,
    identifier,
)
from robots.motors.odrive import CLEAR
from stack.drivetrain.wheel_loop import MEASURED_SPEEDS, block
from stack.fast_loop.client import FastLoop, LoopSetup
from stack.types import Twist
from tests.robots.motors.axes_process import axes_process
from tests.robots.motors.virtual import RADIUS, World

BLOCK, CALM = 400, 320
"""Cycles from one CLEAR to the next; in the first ones of them no frame comes that must stop the
robot: an error, a heartbeat of an axis, or an error frame."""

TWIST, BURST, LIMIT = 0.3, 15, 1e4
"""Of the robot, m/s; frames before each cycle at most; wheel speeds beyond it are no measurement:
rad/s, of motors of at most 1000 turns/s."""


def frames(random: Random):
    """Yield frames: random ones, and mutations of what the axes send."""
    while True:
        node = random.choice((0, 1, 1, random.randrange(64)))
        kind = random.choice([Heartbeat, EncoderEstimates, *MESSAGES.values()])
        number, content = identifier(node, kind), random.randbytes(random.randrange(9))
        if random.random() < 0.5:
            beat = Heartbeat(0, random.choice((1, 8)), 0)
            likely = EncoderEstimates(random.gauss(0.0, 100.0), random.gauss(0.0, 10.0))
            content = encode(random.choice((beat, likely)))
        if random.random() < 0.5:
            number ^= 1 << random.randrange(11)
        if content and random.random() < 0.5:
            place = random.randrange(len(content))
            flipped = content[place] ^ 1 << random.randrange(8)
            content = content[:place] + bytes([flipped]) + content[place + 1 :]
        if random.random() < 0.2:
            content = content[: random.randrange(len(content) + 1)]
        odd = random.random()
        yield can.Message(
            arbitration_id=number, data=None if odd < 0.05 else content,
            is_remote_frame=odd < 0.05, is_error_frame=0.05 < odd < 0.07,
            is_extended_id=0.07 < odd < 0.15, is_fd=0.15 < odd < 0.2,
        )  # fmt: skip


def fuzz(count: int, seed: int = 0) -> Counter:
    """Send frames to a driving robot; check each cycle. Return what happened, counted."""
    random = Random(seed)
    world, source = World(), frames(Random(seed + 1))
    happened = Counter()
    try:
        world.twist = TWIST
        while happened["frames"] < count:
            is_calm = happened["cycles"] % BLOCK < CALM
            for _ in range(random.randrange(BURST)):
                frame = next(source)
                if not (is_calm and _stops(frame)):
                    world.bus.send(frame)
                    happened["frames"] += 1
            world.cycle()
            list(world.driver.messages())
            happened["cycles"] += 1
            happened["fast"] += _check(world)
            happened["stopped"] += bool(world.feedback.problem)
            if happened["cycles"] % BLOCK == 0:
                world.driver.receive(CLEAR)
        happened["ignored"] = world.driver._bus.ignored
        world.driver.receive(CLEAR)  # the bus is quiet again: it drives as before
        world.run(1.5)
        assert world.feedback.problem == ""
        assert [round(speed, 2) for speed in world.speeds] == [TWIST, TWIST]
    finally:
        world.close()
    return happened


def _stops(frame: can.Message) -> bool:
    is_data = not (frame.is_extended_id or frame.is_remote_frame or frame.is_fd)
    read = decode(frame.arbitration_id, bytes(frame.data)) if is_data else None
    ours = read is not None and read[0] in (0, 1) and isinstance(read[1], Heartbeat)
    return ours or frame.is_error_frame


def _check(world: World) -> bool:
    """No axis is told anything but to go ahead, at most as fast as commanded.

    Returns whether it has that speed.
    """
    for axis in world.axes:
        for told in axis.obeyed:
            assert 0.0 <= told.velocity <= TWIST / (tau * RADIUS) * (1.0 + 1e-6)
            assert told.torque == 0.0
        axis.obeyed.clear()
    assert np.isfinite(world.state).all()
    assert abs(block(world.state, MEASURED_SPEEDS)).max() < LIMIT
    return min(world.speeds) > 0.95 * TWIST


def flood(seconds: float, rate: int) -> None:
    """Print the timing of a real fast loop, alone and while frames and noise come at a rate."""
    from stack.drivetrain.wheel_loop import loop_plan

    with axes_process() as axes:
        plan = loop_plan(_drive(), 0.3, 2.0)
        for name in ("quiet", "flooded"):
            loop = FastLoop(LoopSetup(plan, "odrive_can", axes.driver, 500.0))
            try:
                sent = _run(loop, seconds, rate if name == "flooded" else 0, axes.channel)
                timing = loop.statistics()
                print(
                    f"{name:8} {sent:7} frames, {timing.cycles} cycles, {timing.overruns} missed;"
                    f" late {1e3 * timing.percentile(0.5):.2f} ms median,"
                    f" {1e3 * timing.percentile(0.99):.2f} ms p99; work"
                    f" {1e3 * timing.work:.2f} ms mean; fault: {loop.fault or 'none'}",
                    flush=True,
                )
            finally:
                loop.close()


def _drive():
    from stack.drivetrain.differential import Wheels
    from stack.drivetrain.limits import Limits

    return Wheels(("l",), ("r",), RADIUS, 0.4).drivetrain(Limits())


def _run(loop: FastLoop, seconds: float, rate: int, channel: str) -> int:
    address, port = channel.split(":")
    source, random, sent = frames(Random(2)), Random(3), 0
    bus = can.Bus(interface="udp_multicast", channel=address, port=int(port), hop_limit=0)
    noise = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    noise.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
    began = time.monotonic()  # noqa: TID251
    while (now := time.monotonic() - began) < seconds:  # noqa: TID251
        loop.command(Twist(TWIST))
        while sent < rate * now:
            sent += 1
            if random.random() < 0.3:
                noise.sendto(random.randbytes(random.randrange(60)), (address, int(port)))
            else:
                bus.send(next(source))
        time.sleep(0.01)  # noqa: TID251
    bus.shutdown()
    noise.close()
    return sent


def main(count: int) -> None:
    """Run all of it."""
    import resource

    began = time.perf_counter()
    happened = fuzz(count)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(dict(happened), f"{time.perf_counter() - began:.0f} s, {memory:.0f} MB at most")
    assert BURST < MOST_FRAMES
    flood(10.0, 2000)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000)

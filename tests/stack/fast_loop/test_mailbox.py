"""The mailbox: what is torn, forged, old or from another brain is never obeyed."""

import os
import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.fast_loop.mailbox import HEADER, LoopCommand, Mailbox

KEY = bytes(range(32))


@pytest.fixture
def boxes():
    """Mailboxes of a brain, a loop, a stranger: mappings of one file."""
    made = []

    def make(key=KEY):
        descriptor = made[0].descriptor if made else Mailbox.new_file(2)
        made.append(Mailbox(os.dup(descriptor) if made else descriptor, 2, key))
        return made[-1]

    yield make
    for box in made:
        box.close()


def test_the_latest_command_is_read_once(boxes):
    brain, loop = boxes(), boxes()
    assert loop.command.read() is None
    for speed in (0.1, 0.2, 0.3):
        brain.command.write(LoopCommand((speed, 0.0, 0.0)).packed())
    assert LoopCommand.unpacked(loop.command.read()).twist == (0.3, 0.0, 0.0)
    assert loop.command.read() is None


@given(
    at=st.integers(0, HEADER + struct.calcsize("=dddQQQQ") - 1), noise=st.binary(min_size=1),
    whole=st.binary(min_size=HEADER + 56, max_size=HEADER + 56),
)  # fmt: skip
@settings(max_examples=300, deadline=None)
def test_random_bytes_are_never_obeyed(at, noise, whole):
    descriptor = Mailbox.new_file(2)
    brain, loop = Mailbox(descriptor, 2, KEY), Mailbox(os.dup(descriptor), 2, KEY)
    try:
        good = LoopCommand((0.5, 0.0, 0.0), stops=1).packed()
        brain.command.write(good)
        memory = brain.command._memory
        valid = bytes(memory)
        memory[at : at + len(noise)] = noise[: len(memory) - at]
        assert loop.command.read() in (None, good)
        memory[:] = whole
        assert loop.command.read() in (None, good)
        memory[:] = valid  # the writer's own bytes again: read, unless they were read before
        assert loop.command.read() in (None, good)
        assert loop.command.number == 2
    finally:
        brain.close()
        loop.close()


def test_a_write_that_was_interrupted_is_not_read(boxes):
    """A killed writer leaves an odd number; one that tore leaves an old signature."""
    brain, loop = boxes(), boxes()
    brain.command.write(LoopCommand((0.1, 0.0, 0.0)).packed())
    loop.command.read()
    brain.command.write(LoopCommand((0.2, 0.0, 0.0)).packed())
    memory, complete = brain.command._memory, bytes(brain.command._memory)
    memory[:8] = struct.pack("=Q", 3)
    assert loop.command.read() is None
    assert loop.command.refused == 0
    memory[:] = complete
    memory[HEADER : HEADER + 8] = struct.pack("=d", 0.8)
    assert loop.command.read() is None
    assert loop.command.refused == 1


def test_a_command_that_was_seen_is_not_obeyed_again(boxes):
    brain, loop = boxes(), boxes()
    brain.command.write(LoopCommand((0.1, 0.0, 0.0)).packed())
    old = bytes(brain.command._memory)
    loop.command.read()
    brain.command.write(LoopCommand((0.0, 0.0, 0.0)).packed())
    loop.command.read()
    brain.command._memory[:] = old
    assert loop.command.read() is None
    assert loop.command.refused == 1


def test_another_brain_s_command_is_refused(boxes):
    loop, stranger = boxes(), boxes(bytes(32))
    stranger.command.write(LoopCommand((0.8, 0.0, 0.0)).packed())
    assert loop.command.read() is None
    assert loop.command.refused == 1

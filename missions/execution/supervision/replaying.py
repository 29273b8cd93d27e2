"""`treepilot replay`: the dashboard on a recorded run."""

from __future__ import annotations

import sys
from pathlib import Path

from missions.execution.records.plan_facts import read_facts
from missions.execution.report import INTERNAL_ERROR
from stack.errors import InputError
from stack.telemetry.snapshots.recording import SnapshotRecording
from tui.replay.app import seconds_of
from tui.replay.player import Player
from tui.viewer import show_recording


def time_of(at: str) -> float:
    """Return the seconds of the value of `--at`.

    Raises:
        InputError: it is no time.
    """
    time = seconds_of(at)
    if time is None:
        raise InputError(f"--at {at}: expected seconds, minutes:seconds or hours:minutes:seconds")
    return time


def player_of(folder: Path, at: str, factor: float) -> Player:
    """Return a player of a run folder.

    Args:
        folder: of the run.
        at: time at which it begins, paused; empty: it plays from the beginning.
        factor: robot seconds per second.

    Raises:
        InputError: the folder has no snapshots, or `at` is no time.
    """
    begin = time_of(at) if at else None
    doors = {door.name: (door.start, door.end) for door in read_facts(folder).doors}
    player = Player(SnapshotRecording(folder), factor=factor, doors=doors)
    if begin is not None:
        player.toggle()
        player.seek(begin)
    return player


def replay_run(player: Player) -> int:
    """Show a recorded run until the operator leaves; return the exit code."""
    outcome = show_recording(player)
    if outcome.name == "crashed":
        print(f"the dashboard crashed: {outcome.trouble}", file=sys.stderr)
        return INTERNAL_ERROR
    return 0

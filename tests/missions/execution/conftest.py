"""Runs in the hands of a test that are closed at its end."""

from __future__ import annotations

from contextlib import ExitStack

import pytest

from tests.missions.execution.live_run import LiveRun


@pytest.fixture
def live_run():
    """live_run(folder, text, …): a `LiveRun`, closed when the test ends."""
    with ExitStack() as runs:

        def begin(*given, **options) -> LiveRun:
            run = LiveRun(*given, **options)
            runs.callback(run.close)
            return run

        yield begin

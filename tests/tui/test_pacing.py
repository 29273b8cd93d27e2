"""How often a live dashboard draws, counted in refreshes."""

from dataclasses import replace

from stack.telemetry.records import MissionState
from tests.tui.sample_source import SampleSource
from tui.pacing import Pacing

FIRST = SampleSource().poll()


def turns(pacing, count, snapshots):
    """Refreshes made, drawings of the map and of the figures, in `count` turns."""
    made = maps = figures = 0
    for number in range(count):
        if not pacing.begin_turn():
            continue
        made += 1
        pacing.take(snapshots(number))
        maps += pacing.draws_map
        figures += pacing.draws_figures
    return made, maps, figures


def test_of_a_run_that_goes_on_every_second_refresh_draws_the_map():
    moving = turns(Pacing(), 100, lambda number: replace(FIRST, step=number, time=number / 10))
    # The first is drawn at once; of the other 99, every 2nd and every 4th.
    assert moving == (100, 50, 25)


def test_a_frozen_run_is_drawn_once_and_asked_for_less_often():
    pacing = Pacing()
    turns(pacing, 10, lambda number: replace(FIRST, step=number))
    made, maps, figures = turns(pacing, 100, lambda number: replace(FIRST, step=9))
    assert maps <= 1 and figures <= 1
    assert made < 45  # 2 s at the full rate, then a quarter
    pacing.hurry()
    assert turns(pacing, 10, lambda number: replace(FIRST, step=9))[0] == 10


def test_a_new_state_is_drawn_at_once():
    pacing = Pacing()
    turns(pacing, 3, lambda number: replace(FIRST, step=number))
    pacing.begin_turn()
    pacing.take(replace(FIRST, step=2, state=MissionState.EMERGENCY_STOP))
    assert pacing.draws_map and pacing.draws_figures

"""How often the dashboard draws what: it follows the run without flooding the terminal."""

from __future__ import annotations

from stack.telemetry.records import Snapshot

MAP_EVERY, FIGURES_EVERY = 2, 4
"""Refreshes from one drawing of map, tree and status, and of figures and charts, to the next."""

QUIET_AFTER, QUIET_EVERY = 20, 4
"""Refreshes without news, after which only every fourth is made."""


class Pacing:
    """Decides which refreshes are made, and what they draw.

    Args:
        everything: draw everything at each refresh.

    Attributes:
        draws_map: whether to draw map, tree and status now.
        draws_figures: whether to draw figures and charts now.
    """

    def __init__(self, everything: bool = False) -> None:
        self.draws_map = self.draws_figures = self._everything = everything
        self._turn = self._last_news = 0
        self._shown: tuple[object, ...] = ()
        self._headline: tuple[object, ...] = ()
        self._map_due = self._figures_due = False
        self._map_drawn = self._figures_drawn = 0

    def begin_turn(self) -> bool:
        """Begin a refresh; return whether to make it."""
        self._turn += 1
        self.draws_map = self.draws_figures = False
        is_quiet = self._turn - self._last_news > QUIET_AFTER
        return not is_quiet or self._turn % QUIET_EVERY == 0

    def hurry(self) -> None:
        """Return to the full rate: the operator or the engine did something."""
        self._last_news = self._turn

    def take(self, snapshot: Snapshot) -> bool:
        """Decide what is drawn of a snapshot; return whether it differs from the last one.

        While a simulation is frozen nothing changes but with an event. A new state of the mission
        is drawn at once.
        """
        newest = snapshot.events[-1].number if snapshot.events else -1
        shown = (snapshot.step, snapshot.time, snapshot.state, newest)
        headline = (snapshot.state, snapshot.reason, snapshot.teleop, snapshot.debugging)
        is_new, at_once = shown != self._shown, headline != self._headline
        self._shown, self._headline = shown, headline
        if is_new or at_once:
            self._last_news = self._turn
            self._map_due = self._figures_due = True
        since_map, since_figures = self._turn - self._map_drawn, self._turn - self._figures_drawn
        if self._everything:
            return True
        self.draws_map = self._map_due and (at_once or since_map >= MAP_EVERY)
        self.draws_figures = self._figures_due and (at_once or since_figures >= FIGURES_EVERY)
        if self.draws_map:
            self._map_due, self._map_drawn = False, self._turn
        if self.draws_figures:
            self._figures_due, self._figures_drawn = False, self._turn
        return is_new or self.draws_map or self.draws_figures

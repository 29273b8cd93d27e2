"""Commands for debugging a mission: breakpoints, single steps, forced outcomes.

A tick that reaches a breakpoint is completed, then the mission pauses: the robot stops and its
clock stands still, as with `pause`. A step is one tick and the control periods until the next
tick, so that the robot moves as far as without stepping; then the mission pauses again.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from stack.errors import InputError
from stack.runtime.command_schema import (
    BreakArguments,
    ForceArguments,
    NoArguments,
    StepArguments,
    UnbreakArguments,
)
from stack.runtime.interfaces import Debugger, LoopParts
from stack.runtime.mission_state import MissionEvent, MissionStateMachine
from stack.telemetry.records import MissionState


class DebugCommands:
    """Applies debugging commands and pauses the mission at breakpoints and after steps.

    Attributes:
        actions: by kind of command; each returns a description of its effect, and raises
            InputError with the reason if it refuses.
    """

    def __init__(
        self, parts: LoopParts, mission: MissionStateMachine, resume: Callable[[], None]
    ) -> None:
        """Prepare the actions.

        Args:
            parts: of the loop; `parts.debugger` may be None.
            mission: its state.
            resume: ends a pause; raises InputError if it cannot.
        """
        self._parts, self._mission, self._resume = parts, mission, resume
        self._ticks_left: int | None = None
        self.actions: dict[str, Callable[[Any], str]] = {
            "break": self._break,
            "unbreak": self._unbreak,
            "force": self._force,
            "step": self._step,
            "continue": self._continue,
        }

    def forget_steps(self) -> None:
        """Cancel the remaining ticks of a `step`, after a pause or resume."""
        self._ticks_left = None

    def may_tick(self) -> bool:
        """Whether the tree may be ticked now; pauses the mission after the last tick of a step."""
        if self._ticks_left is None:
            return True
        if self._ticks_left == 0:
            self._ticks_left = None
            self._pause("all ticks of the step are done; step or continue")
            return False
        self._ticks_left -= 1
        return True

    def after_tick(self) -> None:
        """Pause when the tick reached a breakpoint."""
        debugger = self._parts.debugger
        hits = debugger.pop_breakpoint_hits() if debugger is not None else ()
        if not hits or self._mission.state is not MissionState.RUNNING:
            return
        self._ticks_left = None
        where = ", ".join(hits)
        self._pause(f"stopped at breakpoint: before {where}")
        self._parts.telemetry.emit(
            "breakpoint", f"stopped before the start of {where}; step or continue", source="tree",
            level="warning", nodes=list(self._debugger.view().held),
        )  # fmt: skip

    def _pause(self, why: str) -> None:
        self._mission.send(MissionEvent.PAUSE, why)

    def _break(self, arguments: BreakArguments) -> str:
        return f"breakpoint set before {self._debugger.set_breakpoint(self._node(arguments))}"

    def _unbreak(self, arguments: UnbreakArguments) -> str:
        cleared = self._debugger.clear_breakpoint(self._node(arguments))
        return f"breakpoint removed: {cleared}"

    def _force(self, arguments: ForceArguments) -> str:
        status = arguments.status
        found = self._debugger.force(self._node(arguments), status, arguments.code)
        return f"{found}: {'no longer forced' if status == 'off' else status}"

    def _step(self, arguments: StepArguments) -> str:
        ticks = arguments.ticks
        state = self._mission.state
        if state is MissionState.PAUSED:
            self._resume()
        elif state not in (MissionState.STARTING, MissionState.RUNNING):
            raise InputError(f"cannot step: the mission is {state}")
        self._ticks_left = ticks
        return f"{ticks} tick{'' if ticks == 1 else 's'}"

    def _continue(self, _: NoArguments) -> str:
        self._resume()
        return "the mission continues"

    def _node(self, arguments: BreakArguments | UnbreakArguments | ForceArguments) -> str:
        """The named node; refused if its number is from a tree that was replaced since."""
        generation = arguments.generation
        if generation is not None and generation != self._debugger.view().generation:
            raise InputError("the tree was replaced; choose the node again")
        return arguments.node

    @property
    def _debugger(self) -> Debugger:
        if self._parts.debugger is None:
            raise InputError("this run has no debugger")
        return self._parts.debugger

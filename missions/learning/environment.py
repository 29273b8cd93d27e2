"""A mission as an environment of Gymnasium."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from gymnasium import Env, spaces
from numpy.typing import NDArray

from missions.execution.prepare import PreparedMission, RunOptions
from missions.execution.run import Run
from missions.execution.shared_simulation import SharedSimulation
from missions.learning.agent import Agent, AgentParameters, with_agent
from missions.learning.rewards import Rewards, Standing, terms_of
from missions.learning.safety import NoSafety
from missions.learning.scenes import Scenes
from missions.learning.top_view import TopView
from robots.bodies import Simulated, body_kind
from stack.control.policy.observations import Actions, Field, Observations, Values, flat
from stack.errors import InputError, ParameterError, TreepilotError
from stack.parameters import build
from stack.telemetry.records import MissionState

Observed = Values | dict[str, Values]
LARGEST_SEED = 2**31


class MissionEnv(Env[Any, Any]):
    """A mission as an environment: the agent's velocity takes the place of the controller's.

    Everything else is as in a run: the tree, the planner, the safety stage, the simulation. A step
    ends when the controller is asked for its next decision, or the mission is over. While nothing
    is driven (a plan is awaited, a behaviour waits) time passes without the agent.

    Args:
        mission: the mission file, or the name of a shipped one; None: drives between places that
            are drawn at each reset, in `world`.
        rewards: name -> weight of the terms of the reward, as in `Rewards`.
        flat: whether the observation is one vector, in the order of `observations`.
        safety: whether the safety stage limits the agent's velocity.
        time_limit: seconds after which an episode is truncated.
        collision_ends: whether a contact while the robot drives terminates the episode.
        render_mode: `rgb_array` or None.
        arguments: values for the mission's arguments, as text.
        robot: replaces the mission's robot: a name or the path of a robot.yaml.
        world: replaces the mission's world: a name or a path.
        start: replaces the mission's start: a place or "x,y,heading" (metres, radians).
        parameters: `safety.padding` -> value as text; overrides all files.
        **policy: observations, actions and their sizes, as those of the controller `onnx_policy`.

    Raises:
        InputError: the mission or an argument is wrong; nothing has moved.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"]}  # noqa: RUF012 - Gymnasium's

    def __init__(  # noqa: PLR0913 - the settings of an environment, by keyword
        self, mission: str | Path | None = None, *, rewards: Mapping[str, Any] | None = None,
        flat: bool = False, safety: bool = True, time_limit: float = 60.0,
        collision_ends: bool = False, render_mode: str | None = None,
        arguments: Mapping[str, str] | None = None, robot: str | None = None,
        world: str | None = None, start: str | None = None,
        parameters: Mapping[str, str] | None = None, **policy: Any,
    ) -> None:  # fmt: skip
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise InputError(f"render_mode: {render_mode!r} is not one of rgb_array, None")
        if not time_limit > 0.0:  # NaN is no limit
            raise InputError(f"time_limit: expected more than 0 s, got {time_limit:g}")
        options = RunOptions(
            serve=False, arguments=dict(arguments or {}), robot=robot, world=world, start=start,
            parameters=dict(parameters or {}),
        )  # fmt: skip
        self._scenes = Scenes(mission, options)
        self._agent = Agent()
        self._policy = replace(_built(AgentParameters, policy), agent=self._agent)
        self._rewards = _built(Rewards, dict(rewards or {}))
        self._is_flat, self._has_safety = flat, safety
        self._time_limit, self._collision_ends = time_limit, collision_ends
        self.render_mode = render_mode
        plan = self._planned(self._scenes.first)
        observations = Observations(self._policy, plan.robot)
        self.fields: tuple[Field, ...] = observations.fields
        if flat:
            observations.check_flat()
        self.observation_space = _space(self.fields, flat=flat)
        actions = Actions(self._policy, plan.robot)
        self.action_space = spaces.Box(actions.low, actions.high, dtype=np.float32)
        self.metadata = {
            **self.metadata,
            "render_fps": plan.choices["loop"].parameters.control_rate / self._policy.repeat,
        }
        self._simulations = SharedSimulation()
        self._run: Run | None = None
        self._view = TopView()

    @property
    def run(self) -> Run:
        """The run of the present episode.

        Raises:
            InputError: there is none before the first `reset`.
        """
        if self._run is None:
            raise InputError("there is no episode: call reset()")
        return self._run

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observed, dict[str, Any]]:
        """Begin an episode; return the first observation and facts.

        Args:
            seed: of the run and of all later episodes; the same one gives the same episode, bit for
                bit. None: the next one of the sequence.
            options: `arguments` and `start` of this episode, as those of the environment.

        Raises:
            InputError: the options are wrong, or the mission drives nowhere.
        """
        super().reset(seed=seed)
        run_seed = int(self.np_random.integers(LARGEST_SEED)) if seed is None else seed
        run_options = self._scenes.options(run_seed, options or {})
        plan = self._planned(run_options)
        self._end_run()
        self._agent.forget()
        make_body = self._simulations.body_of(plan, run_options)
        self._run = run = Run(plan, run_options, make_body=make_body)
        if not self._has_safety:
            run.engine.runtime.parts.safety = NoSafety(plan.robot)
        self._seed = run_seed
        self._go_on(run)
        if not self._agent.is_asked:
            self._end_run()
            raise InputError(
                f"{plan.mission.name}: in the first {run.engine.body.time:.0f} s it drives "
                f"nowhere ({run.engine.runtime.reason or run.state}): a policy has nothing to "
                "decide; use a mission with a drive"
            )
        self._standing = Standing.of(run)
        return self._observation(), self._facts(run, {})

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[Observed, float, bool, bool, dict[str, Any]]:
        """Drive an action until the next decision; return what follows.

        Raises:
            InputError: there is no episode, or the action is not as many finite numbers as the
                action space has.
            TreepilotError: a part of the run has failed.
        """
        run = self.run
        if not self._agent.is_asked:
            raise InputError("the episode is over: call reset()")
        values = np.ravel(action)
        if values.shape != self.action_space.shape or not np.isfinite(values).all():
            raise InputError(f"step: expected an action of {self.action_space}, got {action!r:.80}")
        self._agent.act(values.astype(np.float32))
        self._go_on(run)
        standing = Standing.of(run)
        terms = terms_of(self._rewards, self._standing, standing)
        touched = standing.collisions > self._standing.collisions
        self._standing = standing
        terminated = run.state.is_over or (touched and self._collision_ends)
        truncated = not terminated and self._is_late(run)
        return (
            self._observation(), float(sum(terms.values())), terminated, truncated,
            self._facts(run, terms),
        )  # fmt: skip

    def render(self) -> NDArray[np.uint8] | None:
        """Return a picture from above, (rows, columns, 3) uint8 RGB; None without a render mode."""
        if self.render_mode is None or self._run is None:
            return None
        return self._view.draw(self._run)

    def close(self) -> None:
        """Close the run and the simulation. Safe to call twice."""
        self._end_run()
        self._simulations.close()

    def _go_on(self, run: Run) -> None:
        """Step the run until a decision is due, or the episode ends."""
        while not (self._agent.is_asked or run.state.is_over or self._is_late(run)):
            if run.is_ready():
                run.step()
            else:
                run.serve()
        if run.state is MissionState.ERROR:
            raise TreepilotError(run.engine.runtime.reason)

    def _is_late(self, run: Run) -> bool:
        return run.engine.body.time >= self._time_limit - 1e-9

    def _observation(self) -> Observed:
        observed = self._agent.observed
        return flat(observed) if self._is_flat else dict(observed)

    def _facts(self, run: Run, terms: dict[str, float]) -> dict[str, Any]:
        """Return what is known besides the observation; `rewards` are the terms of the reward."""
        runtime = run.engine.runtime
        return {
            "time": run.engine.body.time, "seed": self._seed, "status": str(run.state),
            "reason": runtime.reason, "distance": runtime.distance,
            "collisions": self._standing.collisions, "rewards": terms,
        }  # fmt: skip

    def _planned(self, options: RunOptions) -> PreparedMission:
        plan = self._scenes.prepared(options)
        if plan.recording is not None or body_kind(plan.robot.body) is not Simulated:
            raise InputError(f"{plan.mission.name}: an environment needs a simulated robot")
        if not plan.robot.drivetrain.moves:
            raise InputError(f"{plan.robot.name} does not drive: a policy has nothing to decide")
        return with_agent(plan, self._policy)

    def _end_run(self) -> None:
        if self._run is not None:
            self._run.close()
        self._run = None


def _space(fields: tuple[Field, ...], *, flat: bool) -> spaces.Space[Any]:
    """Return the space of observations: a Dict by name, or a Box of all numbers in order."""
    if not flat:
        return spaces.Dict(
            {one.name: spaces.Box(one.low, one.high, dtype=one.low.dtype.type) for one in fields}
        )
    low, high = (
        np.concatenate([np.ravel(bound) for bound in bounds])
        for bounds in ([one.low for one in fields], [one.high for one in fields])
    )
    return spaces.Box(low, high, dtype=np.float32)


T = TypeVar("T")


def _built(kind: type[T], values: Mapping[str, Any]) -> T:
    """Return a dataclass of parameters.

    Raises:
        InputError: a name or a value is wrong.
    """
    try:
        return build(kind, values)
    except ParameterError as error:
        hint = f"; {error.hint}" if error.hint else ""
        raise InputError(f"MissionEnv: {error.name}: {error.sentence}{hint}") from None

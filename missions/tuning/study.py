"""Optuna's study of a tuning: it proposes settings, prunes them, and says what matters.

The study is kept in a journal file. Its trials hold parameters and values; the runs are in the
journal of the folder, like those of a sweep.

T. Akiba et al., "Optuna: A Next-generation Hyperparameter Optimization Framework", KDD 2019.
Settings are proposed by the tree-structured Parzen estimator (J. Bergstra et al., NIPS 2011), with
several objectives by its extension (Y. Ozaki et al., GECCO 2020). Importance is PED-ANOVA
(S. Watanabe, A. Bansal, F. Hutter, IJCAI 2023).
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from missions.sweeps.factors import LOGUNIFORM, Factor
from missions.tuning.objectives import Means, Objective
from stack.optional_packages import OPTUNA
from stack.streams import stream

JOURNAL = "study.journal"

DIGITS = 4
"""Significant digits of a tried value; runs do not resolve finer differences."""

REFERENCE = "reference"
"""Attribute of the study."""

AGAIN = "again"
"""Attribute of a trial that takes the place of an interrupted one."""


class Study:
    """A study in a folder: a new one, or the one that is there.

    A folder has one for each choice of objectives, weights and seeds. A new one begins with the
    settings that were tried before: their runs are there already.

    Args:
        folder: of the tuning.
        factors: what is tried.
        objectives: what is better.
        seeds: runs of each setting.
        sampling_seed: of the proposals.
        known: settings that were tried before, as text.

    Raises:
        InputError: Optuna is not installed.
    """

    def __init__(  # noqa: PLR0913 - what a study depends on
        self, folder: Path, factors: Sequence[Factor], objectives: Sequence[Objective], seeds: int,
        sampling_seed: int, known: Iterable[Mapping[str, str]],
    ) -> None:  # fmt: skip
        OPTUNA.require("`treepilot tune` needs")
        import optuna
        from optuna.storages.journal import JournalFileBackend, JournalFileOpenLock

        optuna.logging.set_verbosity(optuna.logging.WARNING)
        self._optuna, self._factors, self._seed = optuna, factors, sampling_seed
        self._objectives = objectives
        self._distributions = {factor.name: self._distribution(factor) for factor in factors}
        file, name = folder / JOURNAL, _name(objectives, seeds)
        backend = JournalFileBackend(str(file), JournalFileOpenLock(str(file)))
        directions: Any = ["maximize" if one.maximises else "minimize" for one in objectives]
        storage = optuna.storages.JournalStorage(backend)
        is_new = name not in optuna.get_all_study_names(storage)
        self._study = optuna.create_study(
            study_name=name, storage=storage, directions=directions, load_if_exists=True,
            pruner=optuna.pruners.MedianPruner(),
        )  # fmt: skip
        if is_new:
            for settings in known:
                self._study.enqueue_trial(self._parameters(settings))
        else:
            self._continue_interrupted()

    @property
    def reference(self) -> Means | None:
        """Means by which values are judged, once they are known."""
        found: Means | None = self._study.user_attrs.get(REFERENCE)
        return found

    def keep_reference(self, means: Means) -> None:
        """Keep the means by which values are judged."""
        self._study.set_user_attr(REFERENCE, dict(means))

    def settings_of(self, trial: Any) -> dict[str, str]:
        """Return the settings of a trial, as text."""
        return {factor.name: _text(factor, trial.params[factor.name]) for factor in self._factors}

    def ask(self) -> Any:
        """Return a new trial; it depends on the seed, its number and the trials before.

        An interruption changes nothing: the trials that it has ended do not count.
        """
        every = self._study.get_trials(deepcopy=False)
        number = sum(AGAIN not in trial.user_attrs for trial in every)
        seed = int(stream(self._seed, "tune", number).integers(2**32))
        self._study.sampler = self._optuna.samplers.TPESampler(seed=seed)
        return self._study.ask(self._distributions)

    def is_hopeless(self, trial: Any, value: float, step: int) -> bool:
        """Whether a trial need not go on: its best value so far is worse than the others' median.

        Args:
            trial: of a study with one objective; those with several ones are never pruned.
            value: mean over the seeds so far.
            step: their number, less one.
        """
        if len(self._objectives) > 1:
            return False
        trial.report(value, step)
        return bool(trial.should_prune())

    def tell(self, trial: Any, values: Sequence[float]) -> None:
        """End a trial with the values of the objectives."""
        self._study.tell(trial, values)

    def prune(self, trial: Any) -> None:
        """End a trial before its last seed."""
        self._study.tell(trial, state=self._optuna.trial.TrialState.PRUNED)

    def refuse(self, trial: Any) -> None:
        """End a trial whose settings the mission does not accept."""
        self._study.tell(trial, state=self._optuna.trial.TrialState.FAIL)

    def ended(self) -> list[tuple[dict[str, str], bool]]:
        """Return the settings of all trials that are over, and whether they were pruned."""
        states = self._optuna.trial.TrialState
        trials = self._study.get_trials(deepcopy=False, states=(states.COMPLETE, states.PRUNED))
        return [(self.settings_of(trial), trial.state == states.PRUNED) for trial in trials]

    def importances(self) -> list[dict[str, float]]:
        """Return the importance of each factor for each objective, from 0 to 1; {} if unknown."""
        from optuna.importance import PedAnovaImportanceEvaluator, get_param_importances

        found = []
        for number, objective in enumerate(self._objectives):
            sign = objective.sign

            def target(trial: Any, number: int = number, sign: float = sign) -> float:
                value: float = sign * trial.values[number]
                return value

            try:
                with warnings.catch_warnings():  # `target` is right: less is better
                    warnings.simplefilter("ignore", UserWarning)
                    found.append(get_param_importances(
                        self._study, evaluator=PedAnovaImportanceEvaluator(), target=target
                    ))  # fmt: skip
            except (RuntimeError, ValueError):  # too few trials, or all are equal
                found.append({})
        return found

    def _parameters(self, settings: Mapping[str, str]) -> dict[str, Any]:
        """Return settings as Optuna has them."""
        return {
            factor.name: settings[factor.name] if factor.is_list
            else factor.typed(settings[factor.name])
            for factor in self._factors
        }  # fmt: skip

    def _distribution(self, factor: Factor) -> Any:
        distributions = self._optuna.distributions
        if factor.is_list:
            return distributions.CategoricalDistribution(factor.values)
        low, high = factor.ends
        is_log = factor.kind == LOGUNIFORM
        if factor.whole:
            return distributions.IntDistribution(int(low), int(high), log=is_log)
        return distributions.FloatDistribution(low, high, log=is_log)

    def _continue_interrupted(self) -> None:
        """Propose the settings of interrupted trials again, before new ones."""
        running = self._study.get_trials(
            deepcopy=False, states=(self._optuna.trial.TrialState.RUNNING,)
        )
        for trial in running:
            self._study.tell(trial.number, state=self._optuna.trial.TrialState.FAIL)
            self._study.enqueue_trial(trial.params, user_attrs={AGAIN: True})


def _name(objectives: Sequence[Objective], seeds: int) -> str:
    """Return the name of a study: what the values of its trials depend on, besides the runs."""
    words = [f"{'maximise' if one.maximises else 'minimise'} {one.name}" for one in objectives]
    weights = ", ".join(f"{name} {weight:g}" for name, weight in objectives[0].weights.items())
    return f"{', '.join(words)}; weights: {weights}; seeds: {seeds}"


def _text(factor: Factor, value: Any) -> str:
    """Return a proposed value as text."""
    if factor.is_list:
        return str(value)
    return factor.text(value if factor.whole else float(f"{value:.{DIGITS}g}"))

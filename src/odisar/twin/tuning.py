"""Search the twin's shape and learning rate with Optuna, by validation forecast error alone.

Trial 0 is the configured (published) values. Resuming gives what an unbroken search gives: the
sampler of a trial is seeded by how many trials have finished before it.
"""

import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import optuna
from optuna.storages import JournalStorage
from optuna.storages.journal import JournalFileBackend
from optuna.trial import FrozenTrial, TrialState
from optuna_integration import PyTorchLightningPruningCallback

from odisar.config.learning import TrainingConfig, TuningConfig, TwinConfig
from odisar.errors import OdisarError
from odisar.seeding import derive_seed
from odisar.twin.lightning_module import VALIDATION_METRIC
from odisar.twin.plan import TrainingPlan
from odisar.twin.progress import EpochHistory
from odisar.twin.training import build_data, build_module, build_trainer
from odisar.windows.window_set import WindowSet

_FINISHED = (TrialState.COMPLETE, TrialState.PRUNED)


@dataclass(frozen=True)
class TuningResult:
    """The chosen values, by dotted parameter name, and every trial that led to them."""

    best: dict[str, Any]
    best_validation_loss: float
    trials: list[dict[str, Any]]


def tune_twin(
    plan: TrainingPlan,
    tuning: TuningConfig,
    windows: tuple[WindowSet, WindowSet],
    storage: str,
    study_name: str,
) -> TuningResult:
    """Finish the study ``study_name`` in ``storage`` and return its best trial.

    ``windows`` are the training and the validation windows. Several processes may call this on the
    same storage at once; each takes trials until enough have finished (the order of finishing then
    decides what the sampler knows, so only a single process is repeatable).
    """
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    study = optuna.create_study(
        storage=open_storage(storage),
        study_name=study_name,
        load_if_exists=True,
        pruner=optuna.pruners.MedianPruner(n_startup_trials=tuning.pruner_warmup_trials),
    )
    if not study.trials:
        study.enqueue_trial(_configured_values(plan), skip_if_exists=True)
    while (finished := _count_finished(study)) < tuning.trials:
        _requeue_interrupted(study, plan)
        study.sampler = optuna.samplers.TPESampler(
            seed=derive_seed(plan.seed, "sampler", finished) % 2**32,
            n_startup_trials=max(2, tuning.trials // 2),
        )
        study.optimize(lambda trial: _objective(trial, plan, tuning, windows), n_trials=1)
        _show_progress(study, study_name, tuning.trials)
    if not study.get_trials(deepcopy=False, states=(TrialState.COMPLETE,)):
        raise OdisarError(
            f"study {study_name}: every trial diverged or was pruned; lower "
            "training.learning_rate and tuning.learning_rate"
        )
    return TuningResult(
        best=study.best_params,
        best_validation_loss=study.best_value,
        trials=[_trial_row(trial) for trial in study.trials if trial.state in _FINISHED],
    )


def tuned_plan(plan: TrainingPlan, values: dict[str, Any]) -> TrainingPlan:
    """Return the plan with tuned values in place of the configured ones."""
    twin = {k.removeprefix("twin."): v for k, v in values.items() if k.startswith("twin.")}
    training = {
        k.removeprefix("training."): v for k, v in values.items() if k.startswith("training.")
    }
    return TrainingPlan(
        TwinConfig.model_validate({**plan.twin.model_dump(), **twin}),
        TrainingConfig.model_validate({**plan.training.model_dump(), **training}),
        plan.seed,
        plan.accelerator,
    )


def open_storage(storage: str) -> optuna.storages.BaseStorage | str:
    """Return a journal for a file path, or the URL of a database (for several hosts) as it is."""
    if "://" in storage:
        return storage
    Path(storage).parent.mkdir(parents=True, exist_ok=True)
    return JournalStorage(JournalFileBackend(storage))


def _objective(
    trial: optuna.Trial,
    plan: TrainingPlan,
    tuning: TuningConfig,
    windows: tuple[WindowSet, WindowSet],
) -> float:
    values = {
        "twin.model_dim": trial.suggest_categorical("twin.model_dim", tuning.model_dim),
        "twin.layers": trial.suggest_categorical("twin.layers", tuning.layers),
        "twin.feedforward_dim": trial.suggest_categorical(
            "twin.feedforward_dim", tuning.feedforward_dim
        ),
        "training.learning_rate": trial.suggest_float(
            "training.learning_rate", tuning.learning_rate.low, tuning.learning_rate.high, log=True
        ),
        "training.epochs": tuning.reports_per_trial,
        "training.steps_per_epoch": tuning.steps_per_trial // tuning.reports_per_trial,
    }
    trial_plan = tuned_plan(plan, values)
    history = EpochHistory(f"trial {trial.number}", 0, quiet=True)
    pruning = PyTorchLightningPruningCallback(trial, monitor=VALIDATION_METRIC)
    trainer = build_trainer(trial_plan, [history, pruning])
    trainer.fit(build_module(trial_plan, windows[0]), datamodule=build_data(trial_plan, *windows))
    error = min(row[VALIDATION_METRIC] for row in history.rows)
    if not math.isfinite(error):  # diverged: a finished trial, or it would be tried for ever
        raise optuna.TrialPruned
    return error


def _configured_values(plan: TrainingPlan) -> dict[str, Any]:
    return {
        "twin.model_dim": plan.twin.model_dim,
        "twin.layers": plan.twin.layers,
        "twin.feedforward_dim": plan.twin.feedforward_dim,
        "training.learning_rate": plan.training.learning_rate,
    }


def _count_finished(study: optuna.Study) -> int:
    return len(study.get_trials(deepcopy=False, states=_FINISHED))


def _requeue_interrupted(study: optuna.Study, plan: TrainingPlan) -> None:
    """Give a killed run's trial 0 another chance; later ones are simply sampled again."""
    states = [trial.state for trial in study.trials]
    if states and TrialState.WAITING not in states and not _count_finished(study):
        study.enqueue_trial(_configured_values(plan))


def _show_progress(study: optuna.Study, name: str, trials: int) -> None:
    last = study.trials[-1]
    error = "-" if last.value is None else f"{last.value:.4f}"
    state = last.state.name.lower()
    sys.stderr.write(
        f"{name}: trial {_count_finished(study)}/{trials}, validation {error} ({state})\n"
    )


def _trial_row(trial: FrozenTrial) -> dict[str, Any]:
    return {
        "number": trial.number,
        "state": trial.state.name.lower(),
        "validation_loss": trial.value,
        **trial.params,
    }

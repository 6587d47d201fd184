"""How well everything forecasts: tables by state and step, the paper's pilot, training time."""

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from odisar.artifacts import Workspace, read_json, write_json, write_table
from odisar.config.loader import ConfigView
from odisar.evaluation.forecasts import ForecastErrors, forecast_errors, forecast_table
from odisar.evaluation.nonlinearity import Residuals, TreePlan, nonlinearity_table
from odisar.forecasters.closed_form import ClosedForm, design
from odisar.forecasters.interface import fit_timed
from odisar.seeding import derive_seed
from odisar.stages.members import Member, MemberData, load_member
from odisar.stages.parallel import run_jobs
from odisar.stages.tune import training_plan
from odisar.study.forecast_models import (
    TWINS,
    TwinForecaster,
    pilot_forecasters,
    simple_forecasters,
    twin_forecaster,
)
from odisar.study.places import study_folder
from odisar.twin.devices import use_one_thread
from odisar.windows.window_set import WindowSet

PARAMS = ("seed", "pipeline", "setups", "cases", "twin", "training", "evaluation", "study")

_VALIDATION_STRIDE = 30
_PILOT_TRANSFORMER = "paper-transformer"
_TREES = TreePlan(rows=20_000, trees=200, learning_rate=0.1, leaves=31, rows_per_leaf=40)
#: Names of the tables by the budget their forecasters have.
_KINDS = ("forecasters", "pilot")


@dataclass(frozen=True)
class _Job:
    config: ConfigView
    root: Path
    setup: str
    kind: str
    name: str
    known_ahead: bool


def run(config: ConfigView, workspace: Workspace, setup: str) -> None:
    """Fit what a killed run has not finished, and write the set-up's tables."""
    commands = bool(config.case_of(setup).command_indices)
    pilot = [*pilot_forecasters(config, config.study.pilot), _PILOT_TRANSFORMER]
    data = load_member(config, workspace, Member(setup, None))
    simple = list(simple_forecasters(config, data, config.study.forecasters))
    wanted = [("pilot", name, False) for name in pilot]
    wanted += [("forecasters", name, False) for name in [*TWINS, *simple]]
    if commands:
        wanted += [("forecasters", name, True) for name in ["residual-transformer", *simple]]
    jobs = [_Job(config, workspace.root, setup, *one) for one in wanted]
    run_jobs(_fit, jobs, config.pipeline.workers)
    seed = derive_seed(config.seed, "bootstrap", config.setups[setup].case)
    for kind, file in zip(_KINDS, ("forecast", "pilot"), strict=True):
        own = [job for job in jobs if job.kind == kind]
        parts = [
            _table(config, workspace, data, [job for job in own if job.known_ahead == ahead], seed)
            for ahead in sorted({job.known_ahead for job in own})
        ]
        write_table(workspace.study_results / f"{file}-{setup}.csv", pd.concat(parts))
    times = _training_times(workspace, [job for job in jobs if job.kind == "forecasters"])
    write_table(workspace.study_results / f"training-time-{setup}.csv", times)
    table = _nonlinearity(config, data, setup, seed)
    write_table(workspace.study_results / f"nonlinearity-{setup}.csv", table)


def _fit(job: _Job) -> None:
    use_one_thread()
    workspace, config = Workspace(job.root), job.config
    path = _path(workspace, job)
    if path.with_suffix(".json").exists():
        return
    data = load_member(config, workspace, Member(job.setup, None))
    data = data.knowing_commands(data.spec.commands if job.known_ahead else ())
    train = data.windows("train")
    validation = data.windows("validation", stride_steps=_VALIDATION_STRIDE)
    fit = config.study.forecasters if job.kind == "forecasters" else config.study.pilot
    facts: dict[str, Any] = {}
    made = simple_forecasters(config, data, fit) | pilot_forecasters(config, fit)
    if job.name in TWINS:
        scratch = workspace.scratch / f"forecast-{path.name}"
        shutil.rmtree(scratch, ignore_errors=True)
        plan = training_plan(config, Member(job.setup, None))
        twin: TwinForecaster = twin_forecaster(job.name, plan, fit, scratch)
        twin.fit(train, validation)
        forecast = twin.forecast
        facts = {"cpu_s": twin.cpu_s, "history": twin.history}
        shutil.rmtree(scratch, ignore_errors=True)
    else:
        forecaster = made[job.name]()
        facts = {"cpu_s": fit_timed(forecaster, train, validation)}
        forecast = forecaster.forecast
    clean = [item for item in data.splits["test"] if not item.info.is_disturbed]
    errors = forecast_errors(clean, data.scaler, data.spec, {job.name: forecast})
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez(path.with_suffix(".npz"), squares=errors.squares[job.name], windows=errors.windows)
    write_json(path.with_suffix(".json"), {**facts, "clusters": list(errors.clusters)})


def _path(workspace: Workspace, job: _Job) -> Path:
    ahead = "known-ahead" if job.known_ahead else "unknown"
    return study_folder(workspace) / "forecasts" / f"{job.setup}_{job.kind}_{job.name}_{ahead}"


def _table(
    config: ConfigView, workspace: Workspace, data: MemberData, jobs: Sequence[_Job], seed: int
) -> pd.DataFrame:
    squares, windows, clusters = {}, np.zeros(0), ()
    for job in jobs:
        path = _path(workspace, job)
        with np.load(path.with_suffix(".npz"), allow_pickle=False) as stored:
            squares[job.name], windows = stored["squares"], stored["windows"]
        clusters = tuple(read_json(path.with_suffix(".json"))["clusters"])
    ahead = "known-ahead" if jobs[0].known_ahead else "unknown"
    scale = np.tile(data.scaler.target_std, (len(windows), 1))
    errors = ForecastErrors(squares, windows, clusters, scale, ahead)
    names = data.case.output_names
    return forecast_table(jobs[0].setup, errors, names, config.evaluation, seed)


def _training_times(workspace: Workspace, jobs: Sequence[_Job]) -> pd.DataFrame:
    """Return CPU seconds of each twin: in all, and until it forecast as well as the paper's.

    "As well" is the paper twin's lowest plain validation error; empty where it wasn't reached.
    """
    facts = {
        job.name: read_json(_path(workspace, job).with_suffix(".json"))
        for job in jobs
        if job.name in TWINS and not job.known_ahead
    }
    errors = {
        name: np.array([row["validation_forecast_mse"] for row in one["history"]])
        for name, one in facts.items()
    }
    goal = errors[_PILOT_TRANSFORMER].min()
    rows = []
    for name, one in facts.items():
        reached = np.flatnonzero(errors[name] <= goal)
        share = (reached[0] + 1) / len(errors[name]) if len(reached) else float("nan")
        rows.append(
            {
                "setup": jobs[0].setup,
                "twin": name,
                "cpu_s": one["cpu_s"],
                "epochs": len(errors[name]),
                "best_validation_mse": errors[name].min(),
                "cpu_s_to_papers_error": one["cpu_s"] * share,
            }
        )
    return pd.DataFrame(rows)


def _nonlinearity(config: ConfigView, data: MemberData, setup: str, seed: int) -> pd.DataFrame:
    """Return what trees still find in the residuals of the closed form of the next sample."""
    train = data.windows("train")
    states = list(data.spec.state_features(train.channels))
    lags = config.twin.closed_form_lags
    closed = ClosedForm(train.samples.shape[1], lags, len(states))
    closed.fit(train, lambda batch: batch.next_sample[:, states])
    parts = tuple(
        _residuals(data.splits[split], data, closed, states) for split in ("train", "validation")
    )
    names = _feature_names(data, states)
    return nonlinearity_table(setup, (parts[0], parts[1]), names, _TREES, config.evaluation, seed)


def _residuals(
    recordings: Sequence[Any], data: MemberData, closed: ClosedForm, states: list[int]
) -> Residuals:
    designs, left, clusters = [], [], []
    for item in recordings:
        windows = WindowSet([item], data.scaler, data.spec)
        batch = windows.gather(_all(windows))
        designs.append(design(batch.context, closed.lags).numpy())
        left.append((batch.next_sample[:, states] - closed(batch.context)).numpy())
        clusters += [item.info.base_seed or item.name] * len(windows)
    return Residuals(
        np.concatenate(designs).astype(np.float64),
        np.concatenate(left).astype(np.float64),
        np.array(clusters),
    )


def _all(windows: WindowSet) -> Any:
    return windows.issues.new_tensor(range(len(windows)))


def _feature_names(data: MemberData, states: list[int]) -> list[str]:
    """Return names of the state features: channels, or the rates of a relative pose first."""
    names = data.case.channel_names
    pose = data.spec.pose
    if pose is None:
        return [names[i] for i in states]
    others = [names[i] for i in range(len(names)) if i not in pose.positions]
    every = ["rate along", "rate across", "turn rate", *others]
    return [every[i] for i in states]

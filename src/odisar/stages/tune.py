"""Search shape and learning rate, for each member by its own validation recordings.

A cross-fitted set-up has a study for each fold: one study for all would have seen, in its training
and validation blocks, the blocks that other folds are tested on.
"""

import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from odisar.artifacts import Workspace, write_json
from odisar.config.loader import ConfigView
from odisar.seeding import derive_seed
from odisar.stages.members import Member, MemberData, load_member, pipeline_members
from odisar.stages.parallel import run_jobs
from odisar.tracking import TrackedRun, content_key
from odisar.twin.devices import use_one_thread
from odisar.twin.plan import TrainingPlan
from odisar.twin.tuning import TuningResult, tune_twin

PARAMS = ("seed", "pipeline", "setups", "cases", "twin", "training", "tuning")


@dataclass(frozen=True)
class _Job:
    config: ConfigView
    root: Path
    member: Member
    storage: str


def run(config: ConfigView, workspace: Workspace, tracked: TrackedRun) -> None:
    """Run the stage; a killed search goes on where it was."""
    key = content_key(workspace.root)
    scratch = workspace.scratch / f"tune-{key}"
    storage = config.tuning.storage
    jobs = []
    for member in pipeline_members(config):
        journal = str(scratch / f"{member.name}.journal") if storage == "journal" else storage
        jobs.append(_Job(config, workspace.root, member, journal))
    results = run_jobs(_tune, jobs, config.pipeline.workers)
    for setup in config.pipeline.setups:
        studies = {
            job.member.name: result
            for job, result in zip(jobs, results, strict=True)
            if job.member.setup == setup
        }
        content = {name: _described(result) for name, result in studies.items()}
        write_json(workspace.tuned(setup), {"members": content})
        tracked.artifact(workspace.tuned(setup))
        for name, result in studies.items():
            tracked.metrics({f"{name}.best_validation_loss": result.best_validation_loss})
            _track_trials(tracked, name, result)
    shutil.rmtree(scratch, ignore_errors=True)


def _described(result: TuningResult) -> dict[str, Any]:
    return {
        "configured": result.trials[0],
        "tuned": result.best,
        "best_validation_loss": result.best_validation_loss,
        "trials": result.trials,
    }


def training_plan(config: ConfigView, member: Member) -> TrainingPlan:
    """Return the configured plan of a member."""
    seed = derive_seed(config.seed, "training", member.name)
    return TrainingPlan(config.twin, config.training, seed, config.pipeline.accelerator)


def _tune(job: _Job) -> TuningResult:
    use_one_thread()
    data: MemberData = load_member(job.config, Workspace(job.root), job.member)
    stride = job.config.training.validation_stride_steps
    windows = data.windows("train"), data.windows("validation", stride_steps=stride)
    study = f"{job.member.name}-{content_key(job.root)}"
    plan = training_plan(job.config, job.member)
    return tune_twin(plan, job.config.tuning, windows, job.storage, study)


def _track_trials(tracked: TrackedRun, member: str, result: TuningResult) -> None:
    for trial in result.trials:
        name = f"{member} trial {trial['number']}"
        with tracked.child(name, {"member": member, "trial.state": trial["state"]}) as run:
            run.params({k: v for k, v in trial.items() if "." in k})
            if trial["validation_loss"] is not None:
                run.metrics({"validation_loss": trial["validation_loss"]})

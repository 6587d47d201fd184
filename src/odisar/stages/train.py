"""Train every member's twin, side by side; a killed training goes on from its last epoch."""

import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from odisar.artifacts import Workspace, read_json, write_json
from odisar.config.loader import ConfigView
from odisar.seeding import derive_seed
from odisar.stages.members import Member, load_member, pipeline_members
from odisar.stages.parallel import run_jobs
from odisar.stages.tune import training_plan
from odisar.tracking import TrackedRun, content_key
from odisar.twin.bundle import TrainedTwin, write_twin
from odisar.twin.devices import use_one_thread
from odisar.twin.mc_dropout import draw_masks
from odisar.twin.training import TrainingResult, train_twin
from odisar.twin.tuning import tuned_plan

PARAMS = ("seed", "pipeline", "setups", "cases", "twin", "monte_carlo", "training")


@dataclass(frozen=True)
class _Job:
    config: ConfigView
    root: Path
    member: Member
    position: int
    scratch: Path


def run(config: ConfigView, workspace: Workspace, tracked: TrackedRun) -> None:
    """Run the stage."""
    scratch = workspace.scratch / f"train-{content_key(workspace.root)}"
    workers = config.pipeline.workers
    jobs = [
        _Job(config, workspace.root, member, number % workers, scratch)
        for number, member in enumerate(pipeline_members(config))
    ]
    summaries = run_jobs(_train, jobs, workers)
    for job, summary in zip(jobs, summaries, strict=True):
        name = job.member.name
        for row in summary["history"]:
            values = {f"{name}.{k}": v for k, v in row.items() if k != "epoch"}
            tracked.metrics(values, step=int(row["epoch"]))
        tracked.metrics({f"{name}.windows_seen": summary["windows_seen"]})
        tracked.artifact(workspace.twin(name), name)
    names = [job.member.name for job in jobs]
    write_json(workspace.train / "training.json", dict(zip(names, summaries, strict=True)))
    shutil.rmtree(scratch, ignore_errors=True)


def _train(job: _Job) -> dict[str, Any]:
    use_one_thread()
    workspace, member, config = Workspace(job.root), job.member, job.config
    data = load_member(config, workspace, member)
    tuned = read_json(workspace.tuned(member.setup))["members"][member.name]["tuned"]
    plan = tuned_plan(training_plan(config, member), tuned)
    validation = data.windows("validation", stride_steps=config.training.validation_stride_steps)
    train = data.windows("train")
    result: TrainingResult = train_twin(
        plan, train, validation, job.scratch / member.name, name=member.name, position=job.position
    )
    masks = draw_masks(
        result.network,
        config.monte_carlo.draws,
        config.monte_carlo.dropout_scope,
        derive_seed(config.seed, "masks", member.name),
    )
    twin = TrainedTwin(
        result.network, plan.twin, data.spec, data.scaler, masks, tuple(data.case.channel_names)
    )
    write_twin(workspace.twin(member.name), twin)
    return {
        "history": result.history,
        "best_validation_loss": result.best_validation_loss,
        "windows_seen": result.windows_seen,
        "training_windows": len(train),
        "validation_windows": len(validation),
    }

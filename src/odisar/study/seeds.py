"""Train the twins again from other seeds: how far results depend on the one of the default run."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from odisar.artifacts import Workspace, write_table
from odisar.baselines.interface import at_samples
from odisar.capability.scoring import DETECTORS, Scorer
from odisar.config.judging import Judging
from odisar.config.loader import ConfigView
from odisar.evaluation.cells import OVERALL
from odisar.evaluation.paired import seed_spread_table
from odisar.evaluation.tables import detection_table
from odisar.recordings.schema import Recording
from odisar.seeding import derive_seed
from odisar.stages.members import Member, load_member
from odisar.stages.parallel import run_jobs
from odisar.study.places import study_folder
from odisar.study.rescored import Judged, judge_scores, read_judged, read_scored, write_judged
from odisar.study.trainings import Variant, fitted_scorer, variant_twin
from odisar.twin.devices import use_one_thread

PARAMS = (
    "seed",
    "pipeline",
    "setups",
    "cases",
    "monte_carlo",
    "twin",
    "training",
    "capability",
    "evaluation",
    "study",
)


@dataclass(frozen=True)
class _Job:
    config: ConfigView
    root: Path
    setup: str
    seed: int


def run(config: ConfigView, workspace: Workspace, setup: str) -> None:
    """Train, calibrate and score the other seeds, and write the spread over all of them."""
    others = range(1, config.study.seeds)
    run_jobs(
        _score_seed,
        [_Job(config, workspace.root, setup, seed) for seed in others],
        config.pipeline.workers,
    )
    data = load_member(config, workspace, Member(setup, None))
    cfg = Judging.of(config.evaluation, data.case)
    base_seed = derive_seed(config.seed, "bootstrap", config.setups[setup].case)
    scored = read_scored(config, workspace, setup, data)
    by_name = {item.name: item for item in data.splits["test"]}
    tables = []
    for seed in (None, *others):
        judged = None if seed is None else read_judged(_folder(workspace, setup, seed))
        of_seed = []
        for item in scored:
            at = np.searchsorted(by_name[item.name].time_s, item.time_s)
            scores = {name: item.scores[name] for name in DETECTORS}
            limits = (item.thresholds, item.operating_thresholds)
            if judged is not None:
                scores = {name: judged[name].scores[item.name][at] for name in DETECTORS}
                limits = (
                    {name: judged[name].sigma for name in DETECTORS},
                    {name: judged[name].operating for name in DETECTORS},
                )
            of_seed.append(
                replace(item, scores=scores, thresholds=limits[0], operating_thresholds=limits[1])
            )
        table = detection_table(
            {setup: of_seed}, data.case.groups, cfg, data.case.persistence_s, base_seed, {}
        )
        tables.append(table[table.evaluated_on == OVERALL])
    write_table(workspace.study_results / f"seeds-{setup}.csv", seed_spread_table(tables))


def _score_seed(job: _Job) -> None:
    use_one_thread()
    workspace, config = Workspace(job.root), job.config
    folder = _folder(workspace, job.setup, job.seed)
    if folder.is_dir() and set(read_judged(folder)) >= set(DETECTORS):
        return
    data = load_member(config, workspace, Member(job.setup, None))
    variant = Variant(f"seed-{job.seed}", job.seed, None, config.monte_carlo.draws)
    twin = variant_twin(config, workspace, job.setup, data, variant)
    scorer = fitted_scorer(config, data, twin)
    calibration = [_all_scores(scorer, item, data.case.short_lead_steps)
                   for item in data.splits["calibration"]]  # fmt: skip
    test = [_all_scores(scorer, item, data.case.short_lead_steps) for item in data.splits["test"]]
    found: dict[str, Judged] = {
        name: judge_scores(
            config, data, [item[name] for item in calibration], [item[name] for item in test]
        )
        for name in DETECTORS
    }
    write_judged(folder, found)


def _all_scores(
    scorer: Scorer, item: Recording, short_lead_steps: int
) -> dict[str, NDArray[np.float64]]:
    """Return (sample,) scores by detector."""
    scores = scorer.score(item, short_lead_steps=short_lead_steps)
    return {
        name: at_samples(values.astype(np.float64), scores.positions, len(item.time_s))
        for name, values in scores.scores.items()
    }


def _folder(workspace: Workspace, setup: str, seed: int) -> Path:
    return study_folder(workspace) / "seeds" / f"{setup}-{seed}"

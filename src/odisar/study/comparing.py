"""Every detector on the same test recordings: one table, pairs, and a range-aware measure."""

from dataclasses import replace

import numpy as np
import pandas as pd

from odisar.artifacts import Workspace, write_table
from odisar.baselines.neural.registry import NOT_DEPLOYABLE
from odisar.capability.combined import ODISAR
from odisar.config.cases import Groups
from odisar.config.judging import Judging
from odisar.config.loader import ConfigView
from odisar.evaluation.cells import OVERALL, describe, disturbed_cells
from odisar.evaluation.paired import Comparison, paired_table
from odisar.evaluation.range_aware import vus_pr_table
from odisar.evaluation.scored import ScoredRecording
from odisar.evaluation.tables import detection_table, operating_table
from odisar.seeding import derive_seed
from odisar.stages.members import Member, load_member
from odisar.study.places import alternatives_folder
from odisar.study.rescored import read_judged, read_scored, with_detectors

PARAMS = ("seed", "pipeline", "setups", "cases", "capability", "evaluation", "study")


def run(config: ConfigView, workspace: Workspace) -> None:
    """Write detection.csv, operating.csv, paired.csv and vus.csv."""
    tables: dict[str, list[pd.DataFrame]] = {}
    for setup in config.study.setups:
        data = load_member(config, workspace, Member(setup, None))
        case = data.case
        cfg = Judging.of(config.evaluation, case)
        seed = derive_seed(config.seed, "bootstrap", config.setups[setup].case)
        judged = read_judged(alternatives_folder(workspace, setup))
        scored = with_detectors(read_scored(config, workspace, setup, data), data, judged)
        scored = [item for item in scored if _is_judged(item, case.groups)]
        published = {setup: config.setups[setup].published_as}
        together = {setup: scored}
        deployable = {setup: [_without(item, NOT_DEPLOYABLE) for item in scored]}
        comparison = Comparison(ODISAR, protocols=("P2", "P2-guarded"), cells=(OVERALL,))
        thinned = [_thinned(item, config.study.vus_stride) for item in deployable[setup]]
        buffer_s = config.study.vus_buffer_steps / case.rate_hz
        persistence_s = case.persistence_s
        made = {
            "detection": detection_table(
                together, case.groups, cfg, persistence_s, seed, published
            ),
            "operating": operating_table(together, case.groups, cfg, persistence_s),
            "paired": paired_table(deployable, case.groups, cfg, persistence_s, seed, comparison),
            "vus": vus_pr_table({setup: thinned}, case.groups, cfg, buffer_s, seed),
        }
        for name, table in made.items():
            tables.setdefault(name, []).append(table)
    for name, parts in tables.items():
        write_table(workspace.study_results / f"{name}.csv", pd.concat(parts, ignore_index=True))


def _is_judged(item: ScoredRecording, groups: Groups) -> bool:
    """Whether a recording is undisturbed or counts overall: scenarios are the pipeline's table."""
    if not item.info.is_disturbed:
        return True
    description = describe(item.info, groups)
    return any(cell.evaluated_on == OVERALL for cell in disturbed_cells([description], groups))


def _without(item: ScoredRecording, left_out: tuple[str, ...]) -> ScoredRecording:
    return replace(item, scores={k: v for k, v in item.scores.items() if k not in left_out})


def _thinned(item: ScoredRecording, stride: int) -> ScoredRecording:
    """Return every so many scores of each gapless run: the measure's cost grows with them."""
    kept = np.concatenate([np.arange(start, stop, stride) for start, stop in item.runs()])
    return replace(
        item,
        time_s=item.time_s[kept],
        scores={name: scores[kept] for name, scores in item.scores.items()},
    )

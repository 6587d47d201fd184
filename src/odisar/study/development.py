"""Scores on development recordings: what the default was chosen by, and what else there was.

The rule: by the mean over cells (kind and strength) of (AUROC + TNR@TPR95) / 2, protocol P2. Of the
candidates that can be chosen and are level with the highest, or nearly, a case's is the one with
the highest F1. That is at mu + k sigma of validation recordings: those that calibrate thresholds
have no part in it, nor has any test recording. Those can be chosen that use the twin and have one
sensor's noise and shift beside: the ferry's development recordings hold weather alone, and by them
a detector had better not listen to its sensors.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from odisar.artifacts import Workspace, write_table
from odisar.capability.innovations import FloatArray, LogScale
from odisar.capability.scoring import RecordingScores, Scorer
from odisar.capability.thresholds import sigma_threshold
from odisar.config.loader import ConfigView
from odisar.errors import OdisarError
from odisar.evaluation.labels import label_active
from odisar.evaluation.metrics import (
    auroc,
    confusion_of_counts,
    count_confusion,
    tnr_at_tpr95,
)
from odisar.recordings.schema import Recording
from odisar.stages.detectors import fit_relations
from odisar.stages.members import Member, MemberData, load_member
from odisar.study.candidates import NOISE, SHIFT, Candidate, Statistics, candidates, shipped
from odisar.study.fitted_statistics import fit_statistics
from odisar.twin.bundle import read_twin
from odisar.twin.devices import pick_device

PARAMS = ("seed", "pipeline", "setups", "cases", "capability", "study")

_CANDIDATE = ("setup", "candidate", "parts", "can_be_chosen", "ships")
_MEASURES = ("auroc", "tnr_at_tpr95", "f1_ood")
#: Means that differ by no more are level: trainings from other seeds differ by more.
_LEVEL = 0.0005
#: Of so many candidates, the first of a set-up, the cells are shown.
_FIRST = 5


def run(config: ConfigView, workspace: Workspace) -> None:
    """Write what every candidate has by the rule, and cell by cell what the first have."""
    rows = []
    for setup in config.study.setups:
        data = load_member(config, workspace, Member(setup, None))
        twin = read_twin(workspace.twin(setup))
        device = pick_device(config.pipeline.accelerator)
        scorer = Scorer(twin, config.capability.scoring_batch, device)
        rows += _setup_rows(setup, data, scorer, config.capability.threshold_sigmas)
    if not rows:
        raise OdisarError(
            "the development recordings of study.setups hold no disturbance to choose a score by; "
            "add some (simulators.*.fleet.disturbed.development)"
        )
    cells = pd.DataFrame(rows)
    table = ranked(cells)
    write_table(workspace.study_results / "development.csv", table)
    write_table(workspace.study_results / "development-cells.csv", cells_of_first(cells, table))


def ranked(cells: pd.DataFrame) -> pd.DataFrame:
    """Return a row for each candidate: means over its cells, the rule's mean, its rank.

    By set-up, the first on top; those that can't be chosen have no rank, and come last.
    """
    table = cells.groupby([*_CANDIDATE], sort=False, as_index=False)[[*_MEASURES]].mean()
    table["rule_mean"] = (table.auroc + table.tnr_at_tpr95) / 2
    ordered = [_in_order(table[table.setup == setup]) for setup in table.setup.unique()]
    return pd.concat(ordered, ignore_index=True)


def _in_order(table: pd.DataFrame) -> pd.DataFrame:
    """Return the candidates of one set-up by rank."""
    offered = table[table.can_be_chosen]
    is_level = offered.rule_mean >= offered.rule_mean.max() - _LEVEL
    level = offered[is_level].sort_values("f1_ood", ascending=False, kind="stable")
    rest = offered[~is_level].sort_values("rule_mean", ascending=False, kind="stable")
    chosen = pd.concat([level, rest])
    rank = pd.array([*range(1, len(chosen) + 1)], dtype="Int64")
    ordered: pd.DataFrame = pd.concat([chosen.assign(rank=rank), table[~table.can_be_chosen]])
    return ordered


def cells_of_first(cells: pd.DataFrame, table: pd.DataFrame) -> pd.DataFrame:
    """Return the cells of a set-up's first candidates, of what ships, of the best beside them."""
    unranked = table[table["rank"].isna()]
    unranked = unranked.sort_values("rule_mean", ascending=False, kind="stable")
    best = unranked.groupby("setup").head(1).index
    shown = table[(table["rank"] <= _FIRST) | table.ships | table.index.isin(best)]
    named = shown[["setup", "candidate", "rank"]]
    other = cells.drop(columns=["parts", "can_be_chosen"])
    found: pd.DataFrame = named.merge(other, on=["setup", "candidate"])
    return found


def _setup_rows(
    setup: str, data: MemberData, scorer: Scorer, sigmas: float
) -> list[dict[str, object]]:
    lead = data.case.short_lead_steps
    held_out = [(i, scorer.score(i, short_lead_steps=lead)) for i in data.splits["validation"]]
    makers = fit_statistics(data, scorer, held_out)

    def seen(item: Recording, scores: RecordingScores) -> Seen:
        labels = label_active(item.time_s[scores.positions], item.intervals)
        made = {name: make(item, scores) for name, make in makers.items()}
        return Seen(made, labels, scores.runs)

    cells: dict[tuple[str, float], list[Seen]] = {}
    for item in data.splits["development"]:
        if item.info.is_disturbed:
            # On a ship the parts of the weather that are disturbed, on a robot the kind of fault.
            info = item.info
            kind = info.components if data.case.pose is None else info.disturbance
            found = seen(item, scorer.score(item, short_lead_steps=lead))
            cells.setdefault((kind, info.strength or 0.0), []).append(found)
    usual = [seen(*one) for one in held_out]
    relations = fit_relations(data, scorer.twin)
    share = relations.share_holding(np.concatenate([scores.samples for _, scores in held_out]))
    offered = [Offered.fit(one, usual, sigmas) for one in candidates(share)]
    ours = shipped(data.case.score)
    return [
        {
            "setup": setup,
            "candidate": one.candidate.name,
            "parts": one.candidate.parts,
            "can_be_chosen": one.candidate.can_be_chosen,
            "ships": one.candidate.name == ours,
            "kind": kind,
            "strength": strength,
            "recordings": len(members),
            **_judged(one, members, data.spec.horizon_steps),
        }
        for one in offered
        for (kind, strength), members in sorted(cells.items())
    ]


@dataclass
class Seen:
    """A recording: statistics and labels (time,), and its gapless runs.

    ``last`` holds the mean that was asked for last: many candidates in a row share one.
    """

    statistics: Statistics
    labels: NDArray[np.bool_]
    runs: tuple[tuple[int, int], ...]
    last: tuple[Callable[[Statistics], FloatArray], FloatArray] | None = None

    def mean(self, one: Candidate) -> FloatArray:
        """Return (time,) what a candidate makes of the statistics."""
        if self.last is None or self.last[0] is not one.of:
            self.last = (one.of, one.of(self.statistics))
        return self.last[1]


@dataclass(frozen=True)
class Offered:
    """A candidate, what puts its mean on the scale of noise and shift, and its threshold.

    One without noise and shift beside needs no ``scale``.
    """

    candidate: Candidate
    scale: LogScale | None
    threshold: float

    @classmethod
    def fit(cls, one: Candidate, usual: Sequence[Seen], sigmas: float) -> Self:
        """Fit on held-out recordings; the threshold is mu + ``sigmas`` sigma."""
        scale = None
        if one.margins is not None:
            means = np.concatenate([seen.mean(one) for seen in usual])
            scale = LogScale.fit(np.exp(means))
        unset = cls(one, scale, np.inf)
        said = np.concatenate([unset.said(seen) for seen in usual])
        return replace(unset, threshold=sigma_threshold(np.exp(said), sigmas))

    def said(self, seen: Seen) -> FloatArray:
        """Return (time,) scores of a recording, on the log scale."""
        one, statistics = self.candidate, seen.statistics
        mean = seen.mean(one)
        if self.scale is None or one.margins is None:
            return mean
        noise, shift = statistics[NOISE] - one.margins[0], statistics[SHIFT] - one.margins[1]
        heard = np.maximum(self.scale.of(np.exp(mean)), noise)
        heard = np.maximum(heard, np.nan_to_num(shift, nan=-np.inf))
        if one.release is None:
            return heard
        return np.concatenate([one.release.of(heard[start:stop]) for start, stop in seen.runs])


def _judged(one: Offered, members: list[Seen], horizon_steps: int) -> dict[str, float]:
    # As in the pipeline's tables, time before a forecast error could be known is left out.
    logs = np.concatenate([one.said(seen)[horizon_steps:] for seen in members])
    labels = np.concatenate([seen.labels[horizon_steps:] for seen in members])
    known = np.isfinite(logs)
    logs, labels = logs[known], labels[known]
    confusion = confusion_of_counts(count_confusion(np.exp(logs) > one.threshold, labels))
    return {
        "auroc": auroc(logs, labels),
        "tnr_at_tpr95": tnr_at_tpr95(logs, labels),
        "f1_ood": float(confusion.f1_ood()),
    }

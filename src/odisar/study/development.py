"""Scores on development recordings: what the default was chosen by, and what else there was.

The rule: of the candidates that can be chosen, a case's is the one with the highest mean over cells
(kind and strength) of (AUROC + TNR@TPR95) / 2 by protocol P2. No test recording has a part in it.
Those can be that use the twin and have one sensor's noise and shift beside: the ferry's development
recordings hold weather alone, and by them a detector had better not listen to its sensors.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from odisar.artifacts import Workspace, write_table
from odisar.capability.combined import ODISAR, InnovationScores
from odisar.capability.consistency import Consistency
from odisar.capability.innovations import (
    FloatArray,
    InnovationLimit,
    InnovationSize,
    LogScale,
    MeanInnovation,
    fit_precision,
    moving_mean,
    squared_distance,
)
from odisar.capability.scoring import RECONSTRUCTION, RecordingScores, Scorer
from odisar.config.loader import ConfigView
from odisar.errors import OdisarError
from odisar.evaluation.labels import label_active
from odisar.evaluation.metrics import auroc, tnr_at_tpr95
from odisar.recordings.schema import Recording
from odisar.stages.detectors import fit_relations, score_steps
from odisar.stages.members import Member, MemberData, load_member
from odisar.study.candidates import (
    CLOSED,
    LEADS,
    LIMITED,
    NOISE,
    PARITY,
    RECENT,
    SHIFT,
    SIZES,
    WEIGHTS,
    WINDOWS,
    Candidate,
    Statistics,
    candidates,
    many_steps,
    of_limited,
)
from odisar.study.statistics import exponential_mean, lead_errors, log_sizes, regime_distance
from odisar.twin.bundle import read_twin
from odisar.twin.devices import pick_device

PARAMS = ("seed", "pipeline", "setups", "cases", "capability", "study")


def run(config: ConfigView, workspace: Workspace) -> None:
    """Write development.csv: every candidate on every cell, with the rule's mean and rank."""
    rows = []
    for setup in config.study.setups:
        data = load_member(config, workspace, Member(setup, None))
        twin = read_twin(workspace.twin(setup))
        device = pick_device(config.pipeline.accelerator)
        scorer = Scorer(twin, config.capability.scoring_batch, device)
        rows += _setup_rows(setup, data, scorer)
    if not rows:
        raise OdisarError(
            "the development recordings of study.setups hold no disturbance to choose a score by; "
            "add some (simulators.*.fleet.disturbed.development)"
        )
    table = pd.DataFrame(rows)
    write_table(workspace.study_results / "development.csv", ranked(table))


def ranked(table: pd.DataFrame) -> pd.DataFrame:
    """Return the table with each candidate's mean by the rule, and its rank in its set-up.

    Only candidates that can be chosen have one.
    """
    half = (table.auroc + table.tnr_at_tpr95) / 2
    mean = half.groupby([table.setup, table.candidate], sort=False).transform("mean")
    table = table.assign(rule_mean=mean, rank=pd.array([pd.NA] * len(table), dtype="Int64"))
    for _, own in table.groupby("setup", sort=False):
        first = own[own.can_be_chosen].drop_duplicates("candidate")
        first = first.sort_values("rule_mean", ascending=False, kind="stable")
        place = {name: number for number, name in enumerate(first.candidate, start=1)}
        table.loc[own.index, "rank"] = own.candidate.map(place)
    return table


def _setup_rows(setup: str, data: MemberData, scorer: Scorer) -> list[dict[str, object]]:
    lead = data.case.short_lead_steps
    held_out = [(i, scorer.score(i, short_lead_steps=lead)) for i in data.splits["validation"]]
    makers = fit_statistics(data, scorer, held_out)
    cells: dict[tuple[str, float], list[_Seen]] = {}
    for item in data.splits["development"]:
        if item.info.is_disturbed:
            scores = scorer.score(item, short_lead_steps=lead)
            made = {name: make(item, scores) for name, make in makers.items()}
            labels = label_active(item.time_s[scores.positions], item.intervals)
            # On a ship the parts of the weather that are disturbed, on a robot the kind of fault.
            info = item.info
            kind = info.components if data.case.pose is None else info.disturbance
            seen = _Seen(made, labels, scores.runs)
            cells.setdefault((kind, info.strength or 0.0), []).append(seen)
    usual = [{name: make(item, s) for name, make in makers.items()} for item, s in held_out]
    offered = [(one, _scale(one, usual)) for one in candidates()]
    return [
        {
            "setup": setup,
            "candidate": one.name,
            "parts": one.parts,
            "can_be_chosen": one.can_be_chosen,
            "kind": kind,
            "strength": strength,
            "recordings": len(members),
            **_judged(one, scale, members, data.spec.horizon_steps),
        }
        for one, scale in offered
        for (kind, strength), members in sorted(cells.items())
    ]


@dataclass(frozen=True)
class _Seen:
    """A development recording: statistics and labels (time,), and its gapless runs."""

    statistics: Statistics
    labels: NDArray[np.bool_]
    runs: tuple[tuple[int, int], ...]


def _scale(one: Candidate, usual: Sequence[Statistics]) -> LogScale | None:
    """Return what puts a candidate on the scale of noise and shift, of held-out recordings.

    One without noise and shift beside needs none.
    """
    if one.margins is None:
        return None
    return LogScale.fit(np.exp(np.concatenate([one.of(made) for made in usual])))


def _said(one: Candidate, scale: LogScale | None, seen: _Seen) -> FloatArray:
    mean = one.of(seen.statistics)
    if scale is None or one.margins is None:
        return mean
    noise, shift = seen.statistics[NOISE] - one.margins[0], seen.statistics[SHIFT] - one.margins[1]
    heard = np.maximum(scale.of(np.exp(mean)), noise)
    heard = np.maximum(heard, np.nan_to_num(shift, nan=-np.inf))
    if one.release is None:
        return heard
    return np.concatenate([one.release.of(heard[start:stop]) for start, stop in seen.runs])


def _judged(
    one: Candidate, scale: LogScale | None, members: list[_Seen], horizon_steps: int
) -> dict[str, float]:
    # As in the pipeline's tables, time before a forecast error could be known is left out.
    scores = np.concatenate([_said(one, scale, seen)[horizon_steps:] for seen in members])
    labels = np.concatenate([seen.labels[horizon_steps:] for seen in members])
    known = np.isfinite(scores)
    return {
        "auroc": auroc(scores[known], labels[known]),
        "tnr_at_tpr95": tnr_at_tpr95(scores[known], labels[known]),
    }


HeldOut = list[tuple[Recording, RecordingScores]]
Maker = Callable[[Recording, RecordingScores], FloatArray]


def fit_statistics(data: MemberData, scorer: Scorer, held_out: HeldOut) -> dict[str, Maker]:
    """Return, by name, what makes (time,) of each statistic on its log scale."""
    runs = [s.innovations[a + 1 : b] for _, s in held_out for a, b in s.runs]
    raw: dict[str, Maker] = {}
    for steps in WINDOWS:
        mean = MeanInnovation.fit(runs, steps, None)
        raw[f"T2 of mean over {steps}"] = _along(mean.statistic)
    for weight in WEIGHTS:
        raw[f"T2 of exponential mean, weight {weight:g}"] = _along(_exponential(runs, weight))
    for steps in SIZES:
        raw[f"log NIS over {steps}"] = _along(log_sizes(runs, steps))
    for name, statistic in _limited_statistics(runs).items():
        raw[name] = _along(statistic)
    closed = [s.closed_form_innovations[a + 1 : b] for _, s in held_out for a, b in s.runs]
    for name, statistic in _limited_statistics(closed).items():
        raw[f"{CLOSED}{name}"] = _along(statistic, lambda s: s.closed_form_innovations)
    relations = fit_relations(data, scorer.twin)
    residuals = [relations.residuals(s.samples[a + 1 : b]) for _, s in held_out for a, b in s.runs]
    for name, statistic in _limited_statistics(residuals).items():
        raw[f"{PARITY}{name}"] = _along(statistic, lambda s: relations.residuals(s.samples))
    by_regime = regime_distance(data, held_out)
    raw["log NIS over 5, by regime"] = lambda item, s: moving_mean(np.log1p(by_regime(item, s)), 5)
    for lead in LEADS:
        raw[f"T2 of errors {lead} ahead, mean over 10"] = lead_errors(
            data, scorer, [item for item, _ in held_out], lead, 10
        )
    raw[RECONSTRUCTION] = lambda _, s: s.scores[RECONSTRUCTION].astype(np.float64)
    made = {name: _scaled(make, held_out) for name, make in raw.items()}
    return made | _beside(data, scorer, held_out, relations)


def _beside(
    data: MemberData, scorer: Scorer, held_out: HeldOut, relations: Consistency
) -> dict[str, Maker]:
    """Return what makes the noise of one sensor, and its shift, without a margin."""
    runs = [run for item, scores in held_out for run in scorer.runs(item, scores)]
    asked = score_steps(data.case.score)
    steps = replace(
        asked,
        noise=replace(asked.noise, margin=0.0),
        shift=None if asked.shift is None else replace(asked.shift, margin=0.0),
    )
    fitted = InnovationScores.fit(runs, relations, steps)
    precision = fitted.parts.closed_form.size.precision

    def noise(item: Recording, scores: RecordingScores) -> FloatArray:
        found = [fitted.noise.score(run.outliers(precision)) for run in scorer.runs(item, scores)]
        return np.concatenate(found)

    def shift(item: Recording, scores: RecordingScores) -> FloatArray:
        found = [fitted.shifts(run) for run in scorer.runs(item, scores)]
        unknown = [np.full(stop - start, np.nan) for start, stop in scores.runs]
        # Where none is sought, none is heard.
        return np.concatenate([f.get(ODISAR, none) for f, none in zip(found, unknown, strict=True)])

    return {NOISE: noise, SHIFT: shift}


def _limited_statistics(
    runs: list[FloatArray],
) -> dict[str, Callable[[FloatArray], FloatArray]]:
    """Return what ``of_limited`` names, fitted on runs of innovations."""
    limit = InnovationLimit.fit(runs)
    fitted = [MeanInnovation.fit(runs, k, limit).statistic for k in LIMITED]
    fitted += [InnovationSize.fit(runs, k).statistic for k in (*SIZES, *many_steps())]
    fitted += [MeanInnovation.fit(runs, k, None).statistic for k in RECENT]
    return dict(zip(of_limited(), fitted, strict=True))


def _exponential(runs: list[FloatArray], weight: float) -> Callable[[FloatArray], FloatArray]:
    precision = fit_precision(np.concatenate([exponential_mean(run, weight) for run in runs]))
    return lambda innovations: squared_distance(exponential_mean(innovations, weight), precision)


def _along(
    statistic: Callable[[FloatArray], FloatArray],
    values_of: Callable[[RecordingScores], FloatArray] = lambda scores: scores.innovations,
) -> Maker:
    def make(_: Recording, scores: RecordingScores) -> FloatArray:
        found = values_of(scores)
        return np.concatenate([statistic(found[a:b]) for a, b in scores.runs])

    return make


def _scaled(make: Maker, held_out: HeldOut) -> Maker:
    scale = LogScale.fit(np.concatenate([make(item, scores) for item, scores in held_out]))
    return lambda item, scores: scale.of(make(item, scores))

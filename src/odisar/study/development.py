"""Scores on development recordings: what the default was chosen by, and what else there was.

The rule: of the candidates, the one with the highest mean over set-ups of the mean over cells (kind
and strength) of (AUROC + TNR@TPR95) / 2 by protocol P2. No test recording has a part in it.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from odisar.artifacts import Workspace, write_table
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
from odisar.stages.members import Member, MemberData, load_member
from odisar.study.statistics import exponential_mean, lead_errors, log_sizes, regime_distance
from odisar.twin.bundle import read_twin
from odisar.twin.devices import pick_device

PARAMS = ("seed", "pipeline", "setups", "cases", "capability", "study")

#: Steps of the windows that are tried, and leads of forecasts that are compared with now.
_WINDOWS, _LEADS = (1, 3, 5, 10, 20), (5, 10)
_WEIGHTS, _SIZES, _LIMITED = (0.1, 0.3), (3, 5, 10), (10, 20)

#: Before the name of a statistic of the closed form's innovations.
_CLOSED = "closed form's "

#: (time,) statistics of one recording by name, on their log scale.
Statistics = Mapping[str, FloatArray]


@dataclass(frozen=True)
class Candidate:
    """A score to choose from: ``of`` makes it of statistics, ``parts`` counts those."""

    name: str
    parts: int
    of: Callable[[Statistics], FloatArray]


def candidates() -> list[Candidate]:
    """Return every candidate, in the order of the table."""
    singles = [f"T2 of mean over {k}" for k in _WINDOWS]
    singles += [f"T2 of limited mean over {k}" for k in _LIMITED]
    singles += [f"T2 of exponential mean, weight {a:g}" for a in _WEIGHTS]
    singles += [f"log NIS over {k}" for k in _SIZES] + ["log NIS over 5, by regime"]
    singles += [f"size of one state over {k}" for k in _SIZES]
    singles += [f"T2 of errors {lead} ahead, mean over 10" for lead in _LEADS]
    singles += [RECONSTRUCTION, *(f"{_CLOSED}{name}" for name in _of_limited())]
    made = [Candidate(name, 1, lambda s, n=name: s[n]) for name in singles]  # type: ignore[misc]
    for label, size in (("", "log NIS over 5"), (" of one state", "size of one state over 10")):
        made += _combined(label, "T2 of mean over 10", size)
    return made + [one for k in _LIMITED for size in _SIZES for one in _limited(k, size)]


def _of_limited() -> list[str]:
    """Return the statistics that candidates with a limited mean are made of."""
    means = [f"T2 of limited mean over {k}" for k in _LIMITED]
    return [*means, *(f"size of one state over {k}" for k in _SIZES), "T2 of mean over 5"]


def _limited(steps: int, size: int) -> list[Candidate]:
    """Return the largest of three, of a mean that single innovations can't rule.

    Alone, and averaged with what the innovations of the closed form say.
    """
    two = (f"T2 of limited mean over {steps}", f"size of one state over {size}")
    recent = "T2 of mean over 5"
    name = f"largest of limited mean over {steps}, size of one state over {size}, reconstruction"
    name += "; recent mean over 5 (.7, .3)"

    def alone(s: Statistics) -> FloatArray:
        return 0.7 * _largest(s, (*two, RECONSTRUCTION)) + 0.3 * s[recent]

    def closed(s: Statistics) -> FloatArray:
        lasting = _largest(s, tuple(f"{_CLOSED}{name}" for name in two))
        return 0.7 * lasting + 0.3 * s[f"{_CLOSED}{recent}"]

    return [
        Candidate(name, 4, alone),
        Candidate(f"{name}; mean with closed form", 7, lambda s: (alone(s) + closed(s)) / 2),
    ]


def _combined(label: str, mean: str, size: str) -> list[Candidate]:
    """Return candidates that take the largest of several statistics, without and with recent ones.

    Recent ones let go sooner when a disturbance has ended.
    """
    both, three = (mean, size), (mean, size, RECONSTRUCTION)
    recent = ("T2 of mean over 3",)
    sizes = ("T2 of mean over 3", "size of one state over 3")
    name = f"largest of mean, size{label}, reconstruction"

    def mixed(share: float, last: tuple[str, ...]) -> Callable[[Statistics], FloatArray]:
        return lambda s: (1 - share) * _largest(s, three) + share * _largest(s, last)

    return [
        Candidate(f"larger of mean and size{label}", 2, lambda s: _largest(s, both)),
        Candidate(name, 3, lambda s: _largest(s, three)),
        Candidate(f"{name}; recent mean (.7, .3)", 4, mixed(0.3, recent)),
        Candidate(f"{name}; recent mean (.5, .5)", 4, mixed(0.5, recent)),
        Candidate(f"{name}; larger recent (.7, .3)", 5, mixed(0.3, sizes)),
    ]


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
    """Return the table with each candidate's mean by the rule, and its rank, 1 for the chosen."""
    half = (table.auroc + table.tnr_at_tpr95) / 2
    by_setup = half.groupby([table.candidate, table.setup], sort=False).mean()
    mean = by_setup.groupby("candidate", sort=False).mean()
    order = mean.sort_values(ascending=False, kind="stable").index
    place = {name: number for number, name in enumerate(order, start=1)}
    return table.assign(rule_mean=table.candidate.map(mean), rank=table.candidate.map(place))


def _setup_rows(setup: str, data: MemberData, scorer: Scorer) -> list[dict[str, object]]:
    lead = data.case.short_lead_steps
    held_out = [(i, scorer.score(i, short_lead_steps=lead)) for i in data.splits["validation"]]
    makers = fit_statistics(data, scorer, held_out)
    cells: dict[tuple[str, float], list[tuple[Statistics, NDArray[np.bool_]]]] = {}
    for item in data.splits["development"]:
        if item.info.is_disturbed:
            scores = scorer.score(item, short_lead_steps=lead)
            made = {name: make(item, scores) for name, make in makers.items()}
            labels = label_active(item.time_s[scores.positions], item.intervals)
            key = (item.info.disturbance, item.info.strength or 0.0)
            key = ("all", key[1]) if data.case.pose is None else key
            cells.setdefault(key, []).append((made, labels))
    return [
        {
            "setup": setup,
            "candidate": one.name,
            "parts": one.parts,
            "kind": kind,
            "strength": strength,
            "recordings": len(members),
            **_judged(one, members, data.spec.horizon_steps),
        }
        for one in candidates()
        for (kind, strength), members in sorted(cells.items())
    ]


def _judged(
    one: Candidate, members: list[tuple[Statistics, NDArray[np.bool_]]], horizon_steps: int
) -> dict[str, float]:
    # As in the pipeline's tables, time before a forecast error could be known is left out.
    scores = np.concatenate([one.of(made)[horizon_steps:] for made, _ in members])
    labels = np.concatenate([labels[horizon_steps:] for _, labels in members])
    known = np.isfinite(scores)
    return {
        "auroc": auroc(scores[known], labels[known]),
        "tnr_at_tpr95": tnr_at_tpr95(scores[known], labels[known]),
    }


def _largest(statistics: Statistics, names: tuple[str, ...]) -> FloatArray:
    return np.asarray(np.max([statistics[name] for name in names], axis=0))


HeldOut = list[tuple[Recording, RecordingScores]]
Maker = Callable[[Recording, RecordingScores], FloatArray]


def fit_statistics(data: MemberData, scorer: Scorer, held_out: HeldOut) -> dict[str, Maker]:
    """Return, by name, what makes (time,) of each statistic on its log scale."""
    runs = [s.innovations[a + 1 : b] for _, s in held_out for a, b in s.runs]
    raw: dict[str, Maker] = {}
    for steps in _WINDOWS:
        mean = MeanInnovation.fit(runs, steps, None)
        raw[f"T2 of mean over {steps}"] = _along(mean.statistic)
    for weight in _WEIGHTS:
        raw[f"T2 of exponential mean, weight {weight:g}"] = _along(_exponential(runs, weight))
    for steps in _SIZES:
        raw[f"log NIS over {steps}"] = _along(log_sizes(runs, steps))
    for name, statistic in _limited_statistics(runs).items():
        raw[name] = _along(statistic)
    closed = [s.closed_form_innovations[a + 1 : b] for _, s in held_out for a, b in s.runs]
    for name, statistic in _limited_statistics(closed).items():
        raw[f"{_CLOSED}{name}"] = _along(statistic, of_closed_form=True)
    by_regime = regime_distance(data, held_out)
    raw["log NIS over 5, by regime"] = lambda item, s: moving_mean(np.log1p(by_regime(item, s)), 5)
    for lead in _LEADS:
        raw[f"T2 of errors {lead} ahead, mean over 10"] = lead_errors(
            data, scorer, [item for item, _ in held_out], lead, 10
        )
    raw[RECONSTRUCTION] = lambda _, s: s.scores[RECONSTRUCTION].astype(np.float64)
    return {name: _scaled(make, held_out) for name, make in raw.items()}


def _limited_statistics(
    runs: list[FloatArray],
) -> dict[str, Callable[[FloatArray], FloatArray]]:
    """Return what ``_of_limited`` names, fitted on runs of innovations."""
    limit = InnovationLimit.fit(runs)
    fitted = [MeanInnovation.fit(runs, k, limit).statistic for k in _LIMITED]
    fitted += [InnovationSize.fit(runs, k).statistic for k in _SIZES]
    fitted += [MeanInnovation.fit(runs, 5, None).statistic]
    return dict(zip(_of_limited(), fitted, strict=True))


def _exponential(runs: list[FloatArray], weight: float) -> Callable[[FloatArray], FloatArray]:
    precision = fit_precision(np.concatenate([exponential_mean(run, weight) for run in runs]))
    return lambda innovations: squared_distance(exponential_mean(innovations, weight), precision)


def _along(statistic: Callable[[FloatArray], FloatArray], *, of_closed_form: bool = False) -> Maker:
    def make(_: Recording, scores: RecordingScores) -> FloatArray:
        found = scores.closed_form_innovations if of_closed_form else scores.innovations
        return np.concatenate([statistic(found[a:b]) for a, b in scores.runs])

    return make


def _scaled(make: Maker, held_out: HeldOut) -> Maker:
    scale = LogScale.fit(np.concatenate([make(item, scores) for item, scores in held_out]))
    return lambda item, scores: scale.of(make(item, scores))

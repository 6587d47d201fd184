"""What candidates for the monitor's score are made of, fitted on held-out recordings."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

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
from odisar.recordings.schema import Recording
from odisar.stages.detectors import fit_relations, score_steps
from odisar.stages.members import MemberData
from odisar.study.candidates import (
    CLOSED,
    LEADS,
    NOISE,
    PARITY,
    SHIFT,
    SIZES,
    WEIGHTS,
    WINDOWS,
    limited_steps,
    of_limited,
    recent_steps,
    size_steps,
)
from odisar.study.statistics import exponential_mean, lead_errors, log_sizes, regime_distance

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
    residuals = [relations.residuals(s.samples[a:b]) for _, s in held_out for a, b in s.runs]
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
    fitted = [MeanInnovation.fit(runs, k, limit).statistic for k in limited_steps()]
    fitted += [InnovationSize.fit(runs, k).statistic for k in size_steps()]
    fitted += [MeanInnovation.fit(runs, k, None).statistic for k in recent_steps()]
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

"""Statistics that were tried and are not in the monitor's score."""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.signal import lfilter

from odisar.capability.innovations import (
    FloatArray,
    fit_precision,
    moving_mean,
    squared_distance,
)
from odisar.capability.scoring import RecordingScores, Scorer
from odisar.recordings.schema import Recording
from odisar.stages.members import MemberData
from odisar.windows.coordinates import features
from odisar.windows.targets import horizon_targets

#: A sample is moving where its fastest state is above this share of its standard deviation ...
_MOVING_SHARE = 0.2
#: ... and starts or stops where that has changed within so many samples.
_CHANGE_STEPS = 10


def exponential_mean(values: FloatArray, weight: float) -> FloatArray:
    """Return (time, state) exponentially weighted means of innovations (time, state), from zero.

    A missing first innovation counts as zero.
    """
    return np.asarray(lfilter([weight], [1.0, weight - 1.0], np.nan_to_num(values), axis=0))


def log_sizes(runs: Sequence[FloatArray], steps: int) -> Callable[[FloatArray], FloatArray]:
    """Return what makes (time,) means of the log normalised innovation squared, all states at once.

    As the monitor's size of innovations, but not state by state; fitted on gapless ``runs`` (time,
    state) of held-out innovations.
    """
    precision = fit_precision(np.concatenate(list(runs)))
    return lambda run: moving_mean(np.log1p(squared_distance(run, precision)), steps)


def lead_errors(
    data: MemberData, scorer: Scorer, held_out: Sequence[Recording], lead: int, steps: int
) -> Callable[[Recording, RecordingScores], FloatArray]:
    """Return what makes (time,) T2 of the mean error of forecasts ``lead`` steps ahead of now.

    The forecast issued at t - lead is compared with what is observed at t; the covariance is that
    of held-out recordings.
    """

    def errors(item: Recording) -> list[FloatArray]:
        found = []
        for start, stop in item.segments:
            positions = data.spec.issue_positions((start, stop), 1, horizon_steps=0)
            if not len(positions):
                continue
            forecast = scorer.forecast(item, positions).forecast.numpy()[:, lead - 1]
            truth = horizon_targets(item.values[:stop], positions, data.spec)[:, lead - 1]
            late = np.full(forecast.shape, np.nan)
            late[lead:] = (data.scaler.scale_targets(truth) - forecast)[:-lead]
            found.append(moving_mean(late, steps))
        return found

    precision = fit_precision(np.concatenate([run for item in held_out for run in errors(item)]))
    return lambda item, _: np.concatenate(
        [squared_distance(run, precision) for run in errors(item)]
    )


def regime_distance(
    data: MemberData, held_out: Sequence[tuple[Recording, RecordingScores]]
) -> Callable[[Recording, RecordingScores], FloatArray]:
    """Return what makes (time,) normalised innovations squared with a covariance by regime.

    Regimes are standing, moving, and about a change between them: starts and stops make tails
    heavy. A regime with too few held-out samples takes the covariance of all.
    """
    regimes = [_regimes(data, item, scores) for item, scores in held_out]
    innovations = np.concatenate([scores.innovations for _, scores in held_out])
    everything = fit_precision(innovations)
    joined = np.concatenate(regimes)
    precisions = []
    for regime in range(3):
        own = innovations[joined == regime]
        enough = np.isfinite(own).all(axis=1).sum() > 20 * innovations.shape[1]
        precisions.append(fit_precision(own) if enough else everything)

    def distance(item: Recording, scores: RecordingScores) -> FloatArray:
        found = np.stack([squared_distance(scores.innovations, p) for p in precisions])
        regime = _regimes(data, item, scores)
        return np.asarray(found[regime, np.arange(len(regime))])

    return distance


def _regimes(data: MemberData, item: Recording, scores: RecordingScores) -> FloatArray:
    """Return (window,) 0 standing, 1 moving, 2 about a change, from states up to the sample."""
    states = list(data.spec.state_features(item.values.shape[1]))
    scaled = features(item, data.spec.pose)[:, states] / data.scaler.std[states]
    moving = np.asarray((np.abs(np.nan_to_num(scaled)) > _MOVING_SHARE).any(axis=1))
    changed = np.concatenate([[False], moving[1:] != moving[:-1]]).astype(np.float64)
    recent = np.convolve(changed, np.ones(_CHANGE_STEPS))[: len(changed)] > 0
    return np.where(recent, 2, moving.astype(np.int64))[scores.positions]

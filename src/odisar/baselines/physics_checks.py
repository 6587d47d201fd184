"""Checks an engineer would write in a line: does the pose move as its velocities say, and so on.

All are known with the sample itself. They are scored only where a context is whole, so that every
detector is judged on the same samples.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from odisar.baselines.interface import Reference, at_samples, context_positions
from odisar.baselines.velocities import compare_pose, segment_samples
from odisar.config.cases import Case
from odisar.errors import OdisarError
from odisar.recordings.schema import Recording
from odisar.windows.windowing import WindowSpec

FloatArray = NDArray[np.float64]

# What never changes in training has no spread; any later change then shows as large.
_SMALLEST_SPREAD = 1e-6

# The usual is what 999 of 1,000 training samples stay below.
_USUAL_SHARE = 0.999

# Steps below this share of a channel's standard deviation are rounding, not resolution.
_ROUNDING = 1e-9


class _SampleCheck(ABC):
    """A check of single samples, from a segment's samples up to that one."""

    def __init__(self) -> None:
        self._spec: WindowSpec | None = None

    def fit(self, reference: Reference) -> None:
        """Learn what is usual on the reference's recordings."""
        self._learn(reference)
        self._spec = reference.spec

    def score(self, recordings: Sequence[Recording]) -> list[FloatArray]:
        """Return for each recording (sample,) scores, NaN before the first whole context.

        Raises OdisarError if nothing was fitted.
        """
        if self._spec is None:
            raise OdisarError(
                f"{type(self).__name__} knows no normal yet; call fit() before score()"
            )
        return [self._score_recording(recording, self._spec) for recording in recordings]

    def _score_recording(self, recording: Recording, spec: WindowSpec) -> FloatArray:
        values = np.full(len(recording.time_s), np.nan)
        for start, stop in recording.segments:
            values[start:stop] = self._score_segment(
                recording.time_s[start:stop], recording.values[start:stop]
            )
        positions = context_positions(recording, spec)
        return at_samples(values[positions], positions, len(recording.time_s))

    @abstractmethod
    def _learn(self, reference: Reference) -> None:
        """Learn what is usual."""

    @abstractmethod
    def _score_segment(self, time_s: FloatArray, values: FloatArray) -> FloatArray:
        """Return (sample,) scores of (sample,) times and (sample, channel) values without a gap.

        They count from 1 where what is compared can be exactly as it should, not from 0: a floor
        near zero would be far from everything else on a logarithmic scale.
        """


class PoseVelocity(_SampleCheck):
    """1 and how far the pose's rates are from the logged velocities, in units of the usual.

    The largest over the rates that have a velocity (``velocities.compare_pose``), as a mean over
    the case's persistence; the unit is each rate's root mean square on held-out recordings.
    """

    def _learn(self, reference: Reference) -> None:
        """Raise NoVelocityError if no velocity of a relative pose is logged."""
        self._comparison = compare_pose(reference)
        residuals = np.concatenate(
            [
                self._comparison.residuals(time_s, values)[1:]
                for time_s, values in segment_samples(reference.held_out)
            ]
        )
        rms = np.sqrt(np.mean(residuals**2, axis=0))
        self._usual = np.maximum(rms, _SMALLEST_SPREAD)
        self._mean_steps = min(_persistence_steps(reference.case), reference.spec.context_steps)

    def _score_segment(self, time_s: FloatArray, values: FloatArray) -> FloatArray:
        residuals = self._comparison.residuals(time_s, values)
        largest = np.max(np.abs(residuals) / self._usual, axis=1)
        means = np.full(len(largest), np.nan)
        if len(largest) >= self._mean_steps:
            views = np.lib.stride_tricks.sliding_window_view(largest, self._mean_steps)
            means[self._mean_steps - 1 :] = 1 + views.mean(axis=-1)
        return means


class RateOfChange(_SampleCheck):
    """1 and the largest first difference of a state, in units of its 99.9 % quantile on train.

    A heading is left out: it jumps where the angle wraps, or the quaternion changes its sign.
    """

    def _learn(self, reference: Reference) -> None:
        headings = reference.case.pose.heading if reference.case.pose else []
        self._states = [i for i, name in _states(reference.case) if name not in headings]
        changes = [self._changes(values) for _, values in segment_samples(reference.train)]
        quantiles = np.quantile(np.concatenate(changes), _USUAL_SHARE, axis=0)
        self._usual = np.maximum(quantiles, _SMALLEST_SPREAD)

    def _changes(self, values: FloatArray) -> FloatArray:
        """Return (sample - 1, state) absolute first differences."""
        return np.asarray(np.abs(np.diff(values[:, self._states], axis=0)))

    def _score_segment(self, time_s: FloatArray, values: FloatArray) -> FloatArray:
        largest = np.full(len(time_s), np.nan)
        largest[1:] = 1 + np.max(self._changes(values) / self._usual, axis=1)
        return largest


class Stuck(_SampleCheck):
    """For how long a state has read the same, relative to its longest such run on train.

    The same is what differs by less than half the smallest change seen on train: a reading's
    resolution. A run counts its own first sample as a sampling period, so no score is zero.
    """

    def _learn(self, reference: Reference) -> None:
        self._states = [i for i, _ in _states(reference.case)]
        self._period_s = 1 / reference.case.rate_hz
        segments = segment_samples(reference.train)
        self._resolution = _resolution([values[:, self._states] for _, values in segments])
        runs_s = [self._runs_s(time_s, values) for time_s, values in segments]
        self._longest_s = np.concatenate(runs_s).max(axis=0)

    def _runs_s(self, time_s: FloatArray, values: FloatArray) -> FloatArray:
        """Return (sample, state) for how long the state has read the same [s]."""
        states = values[:, self._states]
        last_change = np.zeros(states.shape, dtype=np.int64)
        changed = np.abs(np.diff(states, axis=0)) > self._resolution
        last_change[1:] = changed * np.arange(1, len(states))[:, None]
        last_change = np.maximum.accumulate(last_change, axis=0)
        return np.asarray(time_s[:, None] - time_s[last_change] + self._period_s)

    def _score_segment(self, time_s: FloatArray, values: FloatArray) -> FloatArray:
        return np.asarray(np.max(self._runs_s(time_s, values) / self._longest_s, axis=1))


def _states(case: Case) -> list[tuple[int, str]]:
    """Return position and name of the channels that are states."""
    return [(i, channel.name) for i, channel in enumerate(case.channels) if channel.role == "state"]


def _persistence_steps(case: Case) -> int:
    return max(1, round(case.persistence_s * case.rate_hz))


def _resolution(segments: Sequence[FloatArray]) -> FloatArray:
    """Return (state,) half the smallest change in (sample, state) values that is no rounding."""
    changes = np.concatenate([np.abs(np.diff(values, axis=0)) for values in segments])
    rounding = _ROUNDING * np.concatenate(segments).std(axis=0)
    smallest = np.where(changes > rounding, changes, np.inf).min(axis=0)
    return np.where(np.isfinite(smallest), smallest / 2, 0.0)

"""Which state to blame for innovations: the one whose fault would explain most of them.

For every state three kinds of fault are held against the innovations, from any moment at which the
current alarm may have begun: a shift that lasts, a drift, and noise. Each says by a generalised
likelihood ratio (Willsky and Jones, IEEE Trans. Automatic Control 1976) how much better it explains
them than no fault does. A shift is sought along its *signature*: in its first sample it shows in
its own state alone; afterwards forecasts are made from faulty samples, and what shows is the shift
less what the closed form, linearised where the machine is, carries on of it. What stays can be
nearly the same for two states that physics ties (a velocity that reads too high, a position that
creeps); the first sample isn't, and all of them together tell.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from odisar.capability.innovations import FloatArray, InnovationScore
from odisar.capability.responses import StepResponse
from odisar.twin.bundle import TrainedTwin

#: A direction that is not seen at all explains nothing; keeps 0 / 0 out.
_SMALLEST = 1.0e-12
#: An onset is sought no further back, in samples: a bound for time and memory.
_LONGEST = 1000


@dataclass(frozen=True)
class Signatures:
    """Attribution of an innovation score: whose fault would explain the innovations."""

    score: InnovationScore
    response: StepResponse

    @classmethod
    def of(cls, twin: TrainedTwin, score: InnovationScore) -> "Signatures":
        """Return the signatures of a twin."""
        return cls(score, StepResponse.of(twin))

    def blame(
        self,
        innovations: FloatArray,
        samples: NDArray[np.floating],
        windows: NDArray[np.int64],
        directions: FloatArray,
        is_rare: NDArray[np.bool_],
    ) -> FloatArray:
        """Return (window, state) how much of what is seen each state explains, in std deviations.

        ``innovations`` (time, state feature) and ``samples`` (time, feature) are of one gapless
        run, ``windows`` which of its times are asked for, ascending, ``directions`` (time, state,
        state feature) those of ``state_directions``, ``is_rare`` (time,) whether the monitor's
        score is: it may remember what these innovations no longer show. What is returned is the
        root of twice the log likelihood ratio of the state's best fault, a shift, a drift or noise,
        at the best of its possible onsets.
        """
        # What is rare now may have set in when the oldest sample of these statistics came. Scatter
        # may have been adding up for longer; of what is so weak more samples tell no more.
        memory = max(self.score.mean.steps, self.score.size.steps)
        lead_in = memory + len(self.response.linear) - 1
        is_rare = is_rare | (self.score.parts(innovations).max(axis=0) >= 1)
        starts = alarm_starts(is_rare, memory)
        first = np.maximum(np.maximum(starts[windows] - lead_in, windows - _LONGEST), 0)
        found = np.zeros((len(windows), directions.shape[1]))
        for piece in _pieces(windows):
            rows = slice(int(first[piece].min()), int(windows[piece].max()) + 1)
            seen = _Seen.of(self, np.nan_to_num(innovations[rows]), samples[rows], directions[rows])
            for row in np.arange(len(windows))[piece]:
                ends = int(first[row]) - rows.start, int(windows[row]) - rows.start
                kinds = (seen.shifts(*ends), seen.drifts(*ends), seen.noises(*ends))
                found[row] = np.max(kinds, axis=0)
        return np.sqrt(found)


def _pieces(windows: NDArray[np.int64]) -> Iterator[slice]:
    """Yield slices of ascending windows, none of which spans more than ``_LONGEST`` samples."""
    start = 0
    while start < len(windows):
        stop = int(np.searchsorted(windows, windows[start] + _LONGEST, side="right"))
        yield slice(start, stop)
        start = stop


@dataclass(frozen=True)
class _Seen:
    """A run of innovations against every state's signature, in sums that any onset is read from.

    ``shift`` and ``drift`` hold two arrays (age, time, state) each: the products of a signature of
    that age with the innovation and with itself, in the metric of single innovations. A drift is
    the sum of the shifts that set in at each of its samples. ``later`` (term, time + 1, state) sums
    over time what both are made of at greater ages, ``fresh`` (time + 1, state) the squares along
    the first signature, in variances.
    """

    shift: tuple[FloatArray, FloatArray]
    drift: tuple[FloatArray, FloatArray]
    later: FloatArray
    fresh: FloatArray

    @classmethod
    def of(
        cls,
        signatures: Signatures,
        innovations: FloatArray,
        samples: NDArray[np.floating],
        directions: FloatArray,
    ) -> "_Seen":
        precision = signatures.score.size.precision

        def product(one: FloatArray, other: FloatArray) -> FloatArray:
            return np.asarray(np.einsum("...sf,...sf->...s", one @ precision, other))

        seen = innovations[:, None, :]
        shown = np.einsum("tsf,atgf->atsg", directions, signatures.response.at(samples))
        grown = np.cumsum(shown, axis=0)
        shift = (product(shown, seen), product(shown, shown))
        drift = (product(grown, seen), product(grown, grown))
        both, time = product(grown[-1], shown[-1]), np.arange(len(innovations))[:, None]
        along, size = shift[0][-1], shift[1][-1]
        terms = [along, time * along, size, time * size, time**2 * size, both, time * both]
        terms += [drift[0][-1], drift[1][-1]]
        squares = shift[0][0] ** 2 / np.maximum(shift[1][0], _SMALLEST)
        return cls(shift, drift, _summed(np.stack(terms)), _summed(squares))

    def shifts(self, first: int, last: int) -> FloatArray:
        """Return (state,) the most that a shift explains which set in from ``first`` to ``last``.

        Twice its log likelihood ratio: the square along the signature over the signature's own.
        """
        later = self._later(first, last)
        return _explained(self.shift, (later[0], later[2]), first, last)

    def drifts(self, first: int, last: int) -> FloatArray:
        """Return (state,) the most that a drift explains which set in from ``first`` to ``last``.

        At age n, beyond the oldest of the response, its signature is the oldest one's and so many
        times more what stays of a shift.
        """
        along, t_along, size, t_size, tt_size, both, t_both, drifted, own = self._later(first, last)
        since = (np.arange(first, last + 1) + len(self.shift[0]) - 1)[:, None]
        later = (
            drifted + t_along - since * along,
            own + 2 * (t_both - since * both) + tt_size - 2 * since * t_size + since**2 * size,
        )
        return _explained(self.drift, later, first, last)

    def _later(self, first: int, last: int) -> FloatArray:
        """Return (term, onset, state) sums up to ``last`` of what is as old as can be told."""
        oldest = np.arange(first, last + 1) + len(self.shift[0]) - 1
        return np.asarray(self.later[:, [last + 1]] - self.later[:, np.minimum(oldest, last + 1)])

    def noises(self, first: int, last: int) -> FloatArray:
        """Return (state,) the most that noise explains which set in from ``first`` to ``last``.

        Twice its log likelihood ratio, n (v - 1 - log v) of a variance that has grown to v. One
        sample alone is no noise.
        """
        onsets = np.arange(first, last)
        if not len(onsets):
            return np.zeros(self.fresh.shape[1])
        count = (last + 1 - onsets)[:, None]
        variance = np.maximum(1.0, (self.fresh[last + 1] - self.fresh[onsets]) / count)
        return np.asarray((count * (variance - 1 - np.log(variance))).max(axis=0))


def _summed(values: FloatArray) -> FloatArray:
    """Return sums over time, the last axis but one, of the first so many values."""
    start = np.zeros_like(values[..., :1, :])
    return np.concatenate([start, np.cumsum(values, axis=-2)], axis=-2)


def alarm_starts(is_rare: NDArray[np.bool_], gap_steps: int) -> NDArray[np.int64]:
    """Return (time,) where the current alarm began, or now where there is none.

    An alarm is a stretch of times that are rare, or no further than ``gap_steps`` behind one.
    """
    times = np.arange(len(is_rare))
    last = np.maximum.accumulate(np.where(is_rare, times, -gap_steps - 1))
    in_alarm = times - last <= gap_steps
    begins = in_alarm & ~np.concatenate([[False], in_alarm[:-1]])
    started = np.maximum.accumulate(np.where(begins, times, 0))
    return np.asarray(np.where(in_alarm, started, times))


def _explained(
    young: tuple[FloatArray, FloatArray],
    later: tuple[FloatArray, FloatArray],
    first: int,
    last: int,
) -> FloatArray:
    """Return (state,) the square along a signature over its own, at the best onset.

    Both parts are pairs of these products: ``young`` (age, time, state), ``later`` (onset, state).
    """
    onsets = np.arange(first, last + 1)
    sums = []
    for values, old in zip(young, later, strict=True):
        total = old.copy()
        for age in range(len(values) - 1):
            at = onsets[onsets + age <= last]
            total[: len(at)] += values[age, at + age]
        sums.append(total)
    return np.asarray((sums[0] ** 2 / np.maximum(sums[1], _SMALLEST)).max(axis=0))

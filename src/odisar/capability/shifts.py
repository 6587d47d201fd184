"""A shift of one state: a sensor that reads too high or too low since some moment, and still does.

The next forecast is made from shifted samples, so innovations show a shift plainly when it sets in
and little of it afterwards: statistics of the last few forget what is still there. A generalised
likelihood ratio (Willsky and Jones, IEEE Trans. Automatic Control 1976) asks all innovations since
any possible onset how much better a shift along its signature explains them than nothing does. That
alone would not let go, as the end of a shift looks like the onset of one the other way. So a shift
that is still there is held against one that has ended: both of its steps are in that one's
signature, and it explains more as soon as the second one has come. So does a single wrong sample
(an additive outlier beside the level shift: Chen and Liu, J. American Statistical Association
1993); what is wrong for a few samples, less than the closed form looks back, is not told from a
shift, and held for as long as that is remembered or consistency bears it out.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from odisar.capability.innovations import FloatArray, LogScale
from odisar.capability.responses import StepResponse

#: A direction that is not seen at all explains nothing; keeps 0 / 0 out in any unit.
_SMALLEST = np.finfo(np.float64).tiny
#: Samples whose responses are in memory at a time, beside those that the memory reaches back to.
_CHUNK = 1024
#: So many standard deviations out innovations and samples are drawn in: sums over time, of which
#: differences are taken, must still tell small ones apart.
_FURTHEST = 1.0e4
#: No ratio below it is rare, however quiet held-out recordings were: chance alone exceeds it once
#: in a hundred samples (chi-square with one degree of freedom).
_CHANCE = 6.63
#: How much further out than consistency a shift may count, on the common log scale: what reads
#: wrong now disagrees with the other states of its sample now.
_BEYOND = 2.0


@dataclass(frozen=True)
class ShiftSteps:
    """How shifts are sought (``score.shift`` of a case in params.yaml).

    ``memory`` is among how many samples, the last ones, its onset or its end is sought, and how
    long one that has ended may have lasted; ``margin`` is how much further out than elsewhere it
    must be, on the common log scale; below zero, how much less far. The end of one that has lasted
    longer, and left no trace since, is taken for the onset of another.
    """

    memory: int
    margin: float


@dataclass(frozen=True)
class ShiftFilter:
    """What a shift of each state feature leaves in innovations, from its onset on and at its end.

    ``response`` is the closed form's, linearised where the machine is. Of a relative pose the
    features are rates: a shift of one is a position that creeps.
    """

    response: StepResponse

    def ratios(
        self,
        samples: NDArray[np.floating],
        innovations: FloatArray,
        precision: FloatArray,
        memory: int,
    ) -> FloatArray:
        """Return (time,) how much a shift that is still there explains beyond what else might.

        Twice the log of a likelihood ratio: of the state, and of its onset within ``memory``
        samples, that explains most, less that of a shift which has ended, of any state, or of none.
        Zero where that explains as much. Along one gapless run: ``samples`` (time, feature) and
        ``innovations`` (time, state feature), scaled, and ``precision``, their inverse covariance.
        NaN where there is no innovation.
        """
        found = np.full(len(innovations), np.nan)
        reach = 2 * memory + len(self.response.linear)
        for start in range(0, len(innovations), _CHUNK):
            first, stop = max(0, start - reach), min(start + _CHUNK, len(innovations))
            seen = _drawn_in(np.nan_to_num(innovations[first:stop]), precision)
            shown = self.response.at(np.clip(samples[first:stop], -_FURTHEST, _FURTHEST))
            ratios = _ratios(shown, seen, precision, memory)
            found[start:stop] = ratios[start - first :]
        return np.where(np.isfinite(innovations).all(axis=1), found, np.nan)


@dataclass(frozen=True)
class StateShift:
    """How plainly one state has shifted: on the common log scale, less a margin.

    ``twin`` and ``closed_form`` are the scales of what innovations of either say.
    """

    steps: ShiftSteps
    twin: LogScale
    closed_form: LogScale

    @classmethod
    def fit(
        cls, twin: Sequence[FloatArray], closed_form: Sequence[FloatArray], steps: ShiftSteps
    ) -> Self:
        """Fit on gapless runs (time,) of ratios of held-out recordings."""
        return cls(steps, *(_scale(np.concatenate(list(runs))) for runs in (twin, closed_form)))

    def score(
        self, twin: FloatArray | None, closed_form: FloatArray, consistency: FloatArray | None
    ) -> FloatArray:
        """Return (time,) scores of ratios along one gapless run, of both or the latter alone.

        The mean on the log scale, no further out than ``consistency`` (time,), what its lasting
        part says on its own, and a little; as it is where there is none.
        """
        mean = self.closed_form.of(1.0 + closed_form)
        if twin is not None:
            mean = (mean + self.twin.of(1.0 + twin)) / 2
        if consistency is not None:
            mean = np.minimum(mean, consistency + _BEYOND)
        return np.asarray(mean - self.steps.margin)


def _scale(ratios: FloatArray) -> LogScale:
    fitted = LogScale.fit(1.0 + ratios)
    return LogScale(fitted.usual, max(fitted.rare, float(np.log1p(_CHANCE))))


def _drawn_in(innovations: FloatArray, precision: FloatArray) -> FloatArray:
    furthest = np.abs(innovations * np.sqrt(np.diag(precision))).max(axis=1, initial=0.0)
    return np.asarray(innovations * (_FURTHEST / np.maximum(furthest, _FURTHEST))[:, None])


def _ratios(
    response: FloatArray, innovations: FloatArray, precision: FloatArray, memory: int
) -> FloatArray:
    """Return (time,) ratios of one piece; ``response`` (age, time, state feature, state)."""
    weighed = precision @ response
    one_older = np.concatenate([weighed[1:], weighed[-1:]])
    along = _Since.of(np.einsum("atfs,tf->ats", weighed, innovations))
    size = _Since.of(np.einsum("atfs,atfs->ats", weighed, response))
    single = _Since.of(np.einsum("atfs,atfs->ats", one_older, response))
    both = _Since.of(np.einsum("tfs,atfs->ats", weighed[-1], response))
    lasting = np.zeros_like(along.newest)
    for age in range(min(memory, len(innovations))):
        value = along.until(age) ** 2 / np.maximum(size.until(age), _SMALLEST)
        np.maximum(lasting[age:], value, out=lasting[age:])
    ended = _ended(along, size, (single, both), memory)
    return np.asarray(np.maximum(0.0, lasting.max(axis=1) - ended.max(axis=1)))


def _ended(
    along: "_Since", size: "_Since", shared: tuple["_Since", "_Since"], memory: int
) -> FloatArray:
    """Return (time, state) how much a shift explains that has ended within ``memory`` samples.

    It had lasted one sample, an outlier, or until its signature no longer changed; ``shared`` is
    what the signatures of its onset and its end have in common, in either case. Allowed to last any
    time between, it would explain much of what is usual. What its end leaves changes as long
    again: beyond that age, an end explains what it did then.
    """
    single, both = shared
    oldest = along.oldest
    ends = [(along.until(age), size.until(age)) for age in range(oldest + 1)]
    best = [np.zeros_like(end_along) for end_along, _ in ends]
    # The onset's age is outside, as its sums are the costly ones.
    for onset in range(1, min(memory + oldest, len(along.newest))):
        along_onset, size_onset = along.until(onset), size.until(onset)
        for age, (end_along, end_size) in enumerate(ends):
            lasted = onset - age
            if lasted == 1 or oldest <= lasted < memory:
                common = (single if lasted == 1 else both).until(age)[lasted:]
                own = size_onset + end_size[lasted:] - 2.0 * common
                value = (along_onset - end_along[lasted:]) ** 2 / np.maximum(own, _SMALLEST)
                np.maximum(best[age][lasted:], value, out=best[age][lasted:])
    later = max(1, memory - oldest)
    best[-1] = pd.DataFrame(best[-1]).rolling(later, min_periods=1).max().to_numpy()
    ended = np.zeros_like(along.newest)
    for age, most in enumerate(best):
        np.maximum(ended[age:], most, out=ended[age:])
    return ended


@dataclass(frozen=True)
class _Since:
    """Products of what a shift leaves, summed over time from any onset on.

    ``young`` (age, time, state) are the sums up to an age by the onset's time, as long as what is
    left changes with age; ``old`` (time + 1, state) those over time of what stays.
    """

    newest: FloatArray
    young: FloatArray
    old: FloatArray

    @classmethod
    def of(cls, products: FloatArray) -> Self:
        """Return the sums of (age, time, state) products of one piece."""
        aligned = np.zeros_like(products[:-1])
        for age, values in enumerate(products[:-1]):
            aligned[age, : max(0, len(values) - age)] = values[age:]
        start = np.zeros_like(products[-1, :1])
        old = np.concatenate([start, np.cumsum(products[-1], axis=0)])
        return cls(products[0], np.cumsum(aligned, axis=0), old)

    @property
    def oldest(self) -> int:
        """The age from which on what a shift leaves stays."""
        return len(self.young)

    def until(self, age: int) -> FloatArray:
        """Return (time - age, state) the sums from each onset until it has this age."""
        times = self.young.shape[1]
        count = max(0, times - age)
        if age < self.oldest:
            return self.young[age, :count]
        later = self.old[age + 1 : age + 1 + count] - self.old[self.oldest : self.oldest + count]
        return np.asarray(self.young[-1, :count] + later)

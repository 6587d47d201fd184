"""A scored recording: what every detector said about one recording, and what is known about it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from odisar.errors import OdisarError
from odisar.recordings.schema import Interval, RecordingInfo

#: The detector that knows whether a disturbance is active now; it is computed, never passed in.
ORACLE = "oracle"

#: The oracle's score is 0 or 1, so anything in between separates them.
ORACLE_THRESHOLD = 0.5

#: Times are compared after rounding to this many decimals of a second: a sum of 0.1 s steps must
#: still meet the interval border it stands on.
_TIME_DECIMALS = 6


@dataclass(frozen=True)
class ScoredRecording:
    """Scores of one recording at the times they became available.

    Attributes
    ----------
    name
        The recording's name; unique within a set-up.
    info, intervals
        Metadata and disturbed stretches, as in the recording itself.
    time_s
        (time,) seconds, increasing, starting at the first time with a full context. Times are
        ``stride_steps`` steps apart within a contiguous run; a wider distance is a gap.
    scores
        By detector, (time,); NaN where the detector has no score yet. Higher is more abnormal.
    thresholds
        By detector, the fixed threshold (mean + k sigma on calibration), above zero.
    operating_thresholds
        By detector, the threshold that holds the promised alarm rate with persistence.
    first_consequence_s
        First moment after the onset at which a state had been outside its calibration maximum for
        long enough; None if there was none.
    horizon_steps, context_steps
        Length of forecast and of context, in steps of ``step_s``.
    step_s
        One step of the twin in seconds: 1 / rate. Where not every sample is scored, ``time_s`` is
        spaced by a whole multiple of it.
    """

    name: str
    info: RecordingInfo
    intervals: tuple[Interval, ...]
    time_s: NDArray[np.float64]
    scores: Mapping[str, NDArray[np.float64]]
    thresholds: Mapping[str, float]
    operating_thresholds: Mapping[str, float]
    first_consequence_s: float | None
    horizon_steps: int
    context_steps: int
    step_s: float

    def __post_init__(self) -> None:
        if len(self.time_s) and np.any(np.diff(self.time_s) <= 0):
            raise OdisarError(f"scored recording {self.name!r}: time_s must increase throughout")
        if ORACLE in self.scores:
            raise OdisarError(
                f"scored recording {self.name!r}: {ORACLE!r} is computed from the labels; rename "
                "the detector"
            )
        for detector, score in self.scores.items():
            self._check_detector(detector, score)
        if self.horizon_steps % self.stride_steps:
            raise OdisarError(
                f"scored recording {self.name!r}: horizon_steps={self.horizon_steps} is not a "
                f"multiple of the {self.stride_steps} steps between scores; change the stride"
            )

    def _check_detector(self, detector: str, score: NDArray[np.float64]) -> None:
        where = f"scored recording {self.name!r}, detector {detector!r}"
        if score.shape != self.time_s.shape:
            raise OdisarError(
                f"{where}: {score.shape} scores for {self.time_s.shape} times; they must match"
            )
        for title, given in (
            ("threshold", self.thresholds),
            ("operating threshold", self.operating_thresholds),
        ):
            if detector not in given or not math.isfinite(given[detector]):
                raise OdisarError(f"{where}: needs a finite {title}; calibrate the detector")
        if self.thresholds[detector] <= 0:
            raise OdisarError(
                f"{where}: threshold {self.thresholds[detector]} must be above zero, because "
                "recordings are pooled by score / threshold"
            )

    @property
    def stride_steps(self) -> int:
        """Steps between two scored times."""
        if len(self.time_s) < 2:
            return 1
        return max(1, round(float(np.diff(self.time_s).min()) / self.step_s))

    @property
    def spacing_s(self) -> float:
        """Seconds between two scored times."""
        return self.stride_steps * self.step_s

    @property
    def horizon_s(self) -> float:
        """Seconds from the issue of a forecast to its last step."""
        return self.horizon_steps * self.step_s

    @property
    def detectors(self) -> tuple[str, ...]:
        """Names of the deployable detectors: all but the oracle."""
        return tuple(self.scores)

    @property
    def cluster(self) -> str:
        """The recordings resampled together with this one; itself if nothing is known."""
        return self.info.base_seed or self.name

    def runs(self) -> list[tuple[int, int]]:
        """Return half-open index ranges of ``time_s`` without a gap."""
        gaps = np.flatnonzero(np.diff(self.time_s) > 1.5 * self.spacing_s) + 1
        borders = [0, *gaps.tolist(), len(self.time_s)]
        return [(a, b) for a, b in pairwise(borders) if b > a]

    def support(self) -> NDArray[np.bool_]:
        """Return (time,) True where every deployable detector has a score."""
        keep = np.ones(len(self.time_s), dtype=bool)
        for score in self.scores.values():
            keep &= np.isfinite(score)
        return keep


def rounded_times(time_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return times of any shape without the rounding noise of repeated addition."""
    rounded: NDArray[np.float64] = np.round(time_s, _TIME_DECIMALS)
    return rounded

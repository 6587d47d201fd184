"""What a recording is: samples at a declared rate, and what is known about them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

#: Splits a recording can belong to. ``cross-fit`` recordings change their part from fold to fold.
SPLITS = ("train", "validation", "calibration", "development", "test", "cross-fit")

#: Columns of ``recordings.csv`` with a meaning of their own; any other column is kept as it is.
INDEX_COLUMNS = (
    "recording",
    "maneuver",
    "variant",
    "disturbance",
    "components",
    "strength",
    "base_seed",
    "split",
    "fold",
)

#: Columns of ``labels.csv``: the labelled intervals, any number of rows for a recording.
LABEL_COLUMNS = ("recording", "start_s", "end_s", "label")

#: The value of ``disturbance`` and ``components`` for a recording without any.
UNDISTURBED = "none"


@dataclass(frozen=True)
class Interval:
    """A labelled stretch of a recording: disturbed where ``start_s <= time < end_s``."""

    start_s: float
    end_s: float
    label: str


@dataclass(frozen=True)
class RecordingInfo:
    """What is known about a recording besides its samples.

    ``base_seed`` names the cluster for intervals over recordings: recordings that share it are
    variations of one another (another strength of the same manoeuvre, another fault on the same
    block) and are resampled together.
    """

    case: str
    maneuver: str = ""
    variant: str = ""
    disturbance: str = UNDISTURBED
    components: str = UNDISTURBED
    strength: float | None = None
    base_seed: str = ""
    split: str = "test"
    fold: int | None = None
    extra: Mapping[str, str] = field(default_factory=dict)

    @property
    def is_disturbed(self) -> bool:
        """Whether the recording holds a disturbance anywhere."""
        return self.disturbance != UNDISTURBED

    def column(self, name: str) -> str:
        """Return a metadata column as text, of the index or an extra one; empty if unknown."""
        value = self.extra[name] if name in self.extra else getattr(self, name, None)
        return "" if value is None else str(value)


@dataclass(frozen=True)
class Recording:
    """A recording: ``values`` (sample, channel) in physical units at ``time_s`` (sample,) seconds.

    ``segments`` are half-open sample ranges without a gap; no window crosses their borders.
    """

    name: str
    info: RecordingInfo
    time_s: NDArray[np.float64]
    values: NDArray[np.float64]
    intervals: tuple[Interval, ...] = ()
    segments: tuple[tuple[int, int], ...] = ()

    def __post_init__(self) -> None:
        if not self.segments:
            object.__setattr__(self, "segments", ((0, len(self.time_s)),))


def label_times(time_s: NDArray[np.float64], intervals: Sequence[Interval]) -> NDArray[np.bool_]:
    """Return (sample,) True where a time lies in one of the labelled intervals."""
    labels = np.zeros(len(time_s), dtype=bool)
    for interval in intervals:
        labels |= (time_s >= interval.start_s) & (time_s < interval.end_s)
    return labels

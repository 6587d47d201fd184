"""Choose windows, splits, guards, faults and training for as much as was recorded."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from odisar.errors import OdisarError

_FRACTIONS_FROM = 10
_CLEAN_NEEDED = 8
_DISJOINT_WINDOWS = 100
_ODD_SHARE = 0.2
_SCORED_SAMPLES = 400_000
_BATCH = 16

#: Context and horizon as multiples of a patch, the longest first.
_WINDOWS = ((12, 12), (12, 6), (8, 4), (4, 2), (2, 1))

# Folds, blocks needed, block and fault in windows: from comfortable to the least that works.
_CUTS = (
    (6, 12, 7.0, 2.0),
    (6, 12, 5.0, 1.5),
    (4, 8, 5.0, 1.5),
    (4, 8, 4.0, 1.0),
    (4, 4, 4.0, 1.0),
)


@dataclass(frozen=True)
class Extent:
    """What was recorded: samples of every segment of every recording, and how many are clean."""

    segments: tuple[tuple[int, ...], ...]
    rate_hz: float
    clean: int
    has_labels: bool
    has_splits: bool

    @property
    def is_labelled(self) -> bool:
        """Whether something is known to be abnormal, so that no faults need be injected."""
        return self.has_labels or self.clean < len(self.segments)

    @property
    def samples(self) -> int:
        """All samples."""
        return sum(map(sum, self.segments))

    @property
    def shortest(self) -> int:
        """The shortest recording's longest segment, in samples.

        A recording far shorter than the others doesn't count: it is to be left out.
        """
        longest = sorted(max(lengths, default=0) for lengths in self.segments)
        usual = longest[len(longest) // 2] if longest else 0
        return min((length for length in longest if length >= _ODD_SHARE * usual), default=0)

    @property
    def hours(self) -> float:
        """All recorded time."""
        return self.samples / self.rate_hz / 3600.0

    def blocks(self, length: int, gap: int) -> int:
        """Return how many blocks of so many samples can be cut, so far apart."""
        lengths = (steps for recording in self.segments for steps in recording)
        return sum((steps + gap) // (length + gap) for steps in lengths)


@dataclass(frozen=True)
class Plan:
    """Lengths in steps; ``folds`` is None where whole recordings are drawn into splits."""

    kind: str
    context: int
    horizon: int
    folds: int | None
    block: int
    fault_start: int
    fault_duration: int
    doubt: str

    @property
    def window(self) -> int:
        """Context and horizon together."""
        return self.context + self.horizon


@dataclass(frozen=True)
class Wishes:
    """What the user chose up front: the rate [Hz] and the window [s]; None is left to the plan."""

    rate_hz: float | None = None
    context_s: float | None = None
    horizon_s: float | None = None

    def check(self) -> None:
        """Raise OdisarError where a wish is not above 0."""
        for name, value in vars(self).items():
            if value is not None and not 0 < value < math.inf:
                option = name.replace("_", "-")
                raise OdisarError(f"--{option} {value:g}: give a number above 0")

    def windows(self, patch_steps: int, rate_hz: float) -> list[tuple[int, int]]:
        """Return contexts and horizons to try, in steps, the longest first."""
        unit = patch_steps * math.ceil(5 / patch_steps)
        context, horizon = (
            None if wish is None else max(round(wish * rate_hz / patch_steps), 1) * patch_steps
            for wish in (self.context_s, self.horizon_s)
        )
        tried = [(context or unit * usual, horizon or unit * ahead) for usual, ahead in _WINDOWS]
        return list(dict.fromkeys(tried))


_NO_WISHES = Wishes()


def shortest_plan(patch_steps: int, *, has_splits: bool) -> Plan:
    """Return a plan that asks nothing of recordings, to read them before one is made."""
    kind = "metadata" if has_splits else "fractions"
    return Plan(kind, patch_steps, patch_steps, None, 0, patch_steps, patch_steps, "")


def make_plan(extent: Extent, patch_steps: int, wishes: Wishes = _NO_WISHES) -> Plan:
    """Return the longest windows that leave enough of them to learn and to judge by."""
    windows = wishes.windows(patch_steps, extent.rate_hz)
    if extent.has_splits or (
        len(extent.segments) >= _FRACTIONS_FROM and extent.clean >= _CLEAN_NEEDED
    ):
        return _by_recordings(extent, windows)
    for folds, needed, blocks_of, fault_of in _CUTS:
        for context, horizon in windows:
            plan = _cut(context, horizon, folds, blocks_of, fault_of)
            if extent.blocks(plan.block, plan.context) >= needed:
                return plan
    context, horizon = windows[-1]
    plan = _cut(context, horizon, 4, 4.0, 1.0)
    blocks = extent.blocks(plan.block, plan.context)
    seconds = 4 * (plan.block + plan.context) / extent.rate_hz
    doubt = (
        f"too little was recorded: {blocks} of 4 blocks; about {seconds:.3g} s without a gap are "
        "needed at this rate"
    )
    return Plan(**{**plan.__dict__, "doubt": doubt})


def _by_recordings(extent: Extent, windows: Sequence[tuple[int, int]]) -> Plan:
    kind = "metadata" if extent.has_splits else "fractions"
    shortest, doubt = extent.shortest, ""
    fitting = [
        (context, horizon)
        for context, horizon in windows
        if 4 * (context + horizon) <= shortest
        and extent.samples >= _DISJOINT_WINDOWS * (context + horizon)
    ]
    if not fitting:
        needed_s = 4 * sum(windows[-1]) / extent.rate_hz
        doubt = f"little for a twin; recordings of {needed_s:.3g} s and longer would help"
    context, horizon = fitting[0] if fitting else windows[-1]
    window = context + horizon
    return Plan(
        kind,
        context,
        horizon,
        None,
        0,
        fault_start=max(min(round(3.3 * window), round(0.45 * shortest)), context),
        fault_duration=max(min(2 * window, round(0.35 * shortest)), horizon),
        doubt=doubt,
    )


def _cut(context: int, horizon: int, folds: int, blocks_of: float, fault_of: float) -> Plan:
    window = context + horizon
    block = round(blocks_of * window)
    return Plan(
        "cross-fit",
        context,
        horizon,
        folds,
        block,
        fault_start=round(0.45 * block),
        fault_duration=round(fault_of * window),
        doubt="",
    )


def fault_sizes(extent: Extent, plan: Plan, channels: int) -> tuple[tuple[float, ...], int]:
    """Return sizes in standard deviations and how many channels get faults.

    Every kind, size and channel is a copy of every test recording, and every copy is scored.
    """
    tested = extent.samples if plan.folds else 0.25 * extent.samples
    for sizes, most in (((0.5, 1.0, 2.0), 4), ((1.0, 2.0), 3), ((1.0,), 3), ((1.0,), 2)):
        used = min(channels, most)
        copies = used * (3 * len(sizes) + 1 + len(sizes[:2]))
        if copies * tested <= _SCORED_SAMPLES:
            return sizes, used
    return (1.0,), min(channels, 1)


@dataclass(frozen=True)
class Training:
    """Sizes of training and tuning."""

    epochs: int
    steps_per_epoch: int
    patience_epochs: int
    validation_stride: int
    steps_per_trial: int


def plan_training(extent: Extent, plan: Plan) -> Training:
    """Return training steps for as many windows as there are to train on."""
    share = 0.4 if plan.folds is None else 1 - 3 / plan.folds
    windows = share * extent.samples
    steps = min(max(50 * math.ceil(windows / _BATCH / 50), 50), 500)
    is_small = steps < 200
    return Training(
        epochs=15 if is_small else 25,
        steps_per_epoch=steps,
        patience_epochs=4 if is_small else 6,
        validation_stride=int(min(max(windows // 1000, 1), 30)),
        steps_per_trial=200 if is_small else 400,
    )


def seconds(steps: float, rate_hz: float) -> float:
    """Return steps as seconds, rounded down to a number that is easy to read, not below a step."""
    value = steps / rate_hz
    for digits in (1.0, 0.1, 0.01):
        rounded = math.floor(value / digits + 1e-9) * digits
        if value >= 10 * digits:
            return float(f"{rounded:.6g}")
    return float(f"{value:.4g}")

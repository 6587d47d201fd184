"""The scores to choose from: statistics of innovations and parity residuals, put together."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from odisar.capability.combined import SATURATED
from odisar.capability.innovations import FloatArray, held_to_newer, newer_half
from odisar.capability.release import Release
from odisar.capability.scoring import RECONSTRUCTION
from odisar.config.score import ScoreConfig

#: Steps of the windows that are tried, and leads of forecasts that are compared with now.
WINDOWS, LEADS = (1, 2, 3, 5, 10, 20), (5, 10)
WEIGHTS, SIZES, LIMITED = (0.1, 0.3), (3, 5, 10), (10, 20)
#: Of the few last innovations whose mean has its share.
RECENT = (2, 3, 5)
#: Windows of the size that goes with a limited mean, and of parity residuals' mean and size.
_FULL_SIZES, _TIED = (5, 10), 10
#: Of the few last parity residuals: how many, and their share. One is from no sample but its own.
TIED_RECENT = ((1, 0.4), (1, 0.6), (2, 0.4))
#: The scatter that adds up: over how many innovations, and its share of the mean.
SCATTER = ((60, 0.3), (60, 0.45))
#: How much further out than the rest one sensor's noise must be, and its shift, on the common log
#: scale.
MARGINS = ((0.3, 0.5), (0.75, 1.0), (1.0, 1.0))
#: Letting go, beside not doing so.
RELEASES = (Release(10, 0.5), Release(10, 1.0), Release(60, 1.0))

#: Before the name of a statistic of the closed form's innovations, of parity residuals.
CLOSED, PARITY = "closed form's ", "parity residuals' "
#: The noise of one sensor, and its shift, as the monitor's score has them.
NOISE, SHIFT = "noise of one sensor", "shift of one state"

#: (time,) statistics of one recording by name, on their log scale.
Statistics = Mapping[str, FloatArray]


@dataclass(frozen=True)
class Candidate:
    """A score to choose from: ``of`` makes it of statistics.

    ``parts`` counts those, newer halves of windows aside. One that doesn't use the twin is there to
    be compared with, not to be chosen. With ``margins`` it is that, or one sensor's noise or shift
    less its margin, whichever is rarest, and with a ``release`` it lets go of what is over.
    """

    name: str
    parts: int
    of: Callable[[Statistics], FloatArray]
    uses_twin: bool = True
    margins: tuple[float, float] | None = None
    release: Release | None = None

    @property
    def can_be_chosen(self) -> bool:
        """Whether the rule may choose it (see ``development``)."""
        return self.uses_twin and self.margins is not None


def candidates(share_holding: float = 1.0) -> list[Candidate]:
    """Return every candidate, in the order of the table.

    Consistency counts by the share of states whose relation holds, as in the monitor's mean.
    """
    singles = [f"T2 of mean over {k}" for k in WINDOWS]
    singles += [f"T2 of limited mean over {k}" for k in limited_steps()]
    singles += [f"T2 of exponential mean, weight {a:g}" for a in WEIGHTS]
    singles += [f"log NIS over {k}" for k in SIZES] + ["log NIS over 5, by regime"]
    singles += [f"size of one state over {k}" for k in size_steps()]
    singles += [f"T2 of errors {lead} ahead, mean over 10" for lead in LEADS]
    singles += [RECONSTRUCTION]
    singles += [f"{source}{name}" for source in (CLOSED, PARITY) for name in of_limited()]
    made = [
        Candidate(name, 1, lambda s, n=name: s[n], not name.startswith((CLOSED, PARITY)))  # type: ignore[misc]
        for name in singles
    ]
    for label, size in (("", "log NIS over 5"), (" of one state", "size of one state over 10")):
        made += _combined(label, "T2 of mean over 10", size)
    return made + [
        one
        for steps in LIMITED
        for size in _FULL_SIZES
        for recent in RECENT
        for one in _limited(steps, size, recent, share_holding)
    ]


def shipped(score: ScoreConfig) -> str | None:
    """Return the name of the candidate that a case's score is; None if none can be.

    All of them hear a shift, and look back on as many parity residuals.
    """
    made, tied, scatter = score.innovation, score.consistency, score.scatter
    if score.shift is None or {tied.mean_steps, tied.size_steps} != {_TIED}:
        return None
    name = f"mean over {made.mean_steps}, size over {made.size_steps}, reconstruction; "
    name += f"recent {made.recent_steps} ({made.recent_share:g}); closed form; "
    name += f"consistency, recent {tied.recent_steps} ({tied.recent_share:g})"
    if scatter.share:
        name += f"; scatter over {scatter.steps} ({scatter.share:g})"
    name += f"; noise {score.noise.margin:g}, shift {score.shift.margin:g}"
    if score.release.share:
        name += f"; release over {score.release.steps} ({score.release.share:g})"
    return name


def of_limited() -> list[str]:
    """Return the statistics that candidates with a limited mean are made of, of each source."""
    means = [f"T2 of limited mean over {k}" for k in limited_steps()]
    sizes = [f"size of one state over {k}" for k in size_steps()]
    return [*means, *sizes, *(f"T2 of mean over {k}" for k in recent_steps())]


def limited_steps() -> list[int]:
    """Return over how many innovations limited means are taken, newer halves included."""
    return _with_halves({*LIMITED, _TIED})


def size_steps() -> list[int]:
    """Return over how many innovations sizes are taken, newer halves included."""
    return sorted({*_with_halves({*SIZES, *_FULL_SIZES, _TIED}), *many_steps()})


def recent_steps() -> list[int]:
    """Return of how many innovations recent means are."""
    return sorted({*RECENT, *(steps for steps, _ in TIED_RECENT)})


def _with_halves(steps: set[int]) -> list[int]:
    return sorted(steps | {newer_half(k) for k in steps})


def many_steps() -> list[int]:
    """Return over how many innovations scatter is tried."""
    return sorted({steps for steps, _ in SCATTER})


def _limited(steps: int, size: int, last: int, holding: float) -> list[Candidate]:
    """Return the largest of three, of a mean that single innovations can't rule.

    Alone, averaged with what the innovations of the closed form say, and with what parity residuals
    say as well; the last also with the scatter that adds up, with one sensor's noise and shift
    beside, and letting go. In between the same without the twin. All of them hold mean and size to
    the newer halves of their windows, as the monitor does.
    """
    name = f"mean over {steps}, size over {size}, reconstruction; recent {last} (0.3)"
    alone, closed = _view("", steps, size, last), _view(CLOSED, steps, size, last)
    made = [
        Candidate(name, 4, alone),
        Candidate(f"{name}; closed form", 7, lambda s: (alone(s) + closed(s)) / 2),
    ]
    for few, share in TIED_RECENT:
        tied = _tied(few, share)
        label = f"consistency, recent {few} ({share:g})"
        whole = Candidate(
            f"{name}; closed form; {label}", 10, _mean((alone, 1.0), (closed, 1.0), (tied, holding))
        )
        without = f"no twin: mean over {steps}, size over {size}; recent {last} (0.3); {label}"
        free = Candidate(without, 6, _mean((closed, 1.0), (tied, holding)), uses_twin=False)
        full, rest = [whole], [free]
        for many, part in SCATTER:
            added, sizes = f"; scatter over {many} ({part:g})", [f"size of one state over {many}"]
            sizes.append(f"{CLOSED}{sizes[0]}")
            for one, used, group in ((whole, sizes, full), (free, sizes[1:], rest)):
                mean = _with_scatter(one.of, used, part)
                parts = one.parts + len(used)
                group.append(replace(one, name=f"{one.name}{added}", parts=parts, of=mean))
        made += [*full, *rest, *(heard for one in full for heard in _beside(one))]
    return made


def _beside(one: Candidate) -> list[Candidate]:
    """Return a candidate with one sensor's noise and shift beside, and letting go."""
    made = []
    for noise, shift in MARGINS:
        name = f"{one.name}; noise {noise:g}, shift {shift:g}"
        heard = replace(one, name=name, parts=one.parts + 4, margins=(noise, shift))
        made.append(heard)
        for release in RELEASES:
            name = f"{heard.name}; release over {release.steps} ({release.share:g})"
            made.append(replace(heard, name=name, release=release))
    return made


def _view(source: str, steps: int, size: int, last: int) -> Callable[[Statistics], FloatArray]:
    """Return what the innovations of one source say: of the twin, or of its closed form."""
    recent = f"{source}T2 of mean over {last}"

    def of(s: Statistics) -> FloatArray:
        lasting = _lasting(s, source, steps, size)
        if not source:
            lasting = np.maximum(lasting, s[RECONSTRUCTION])
        return 0.7 * lasting + 0.3 * s[recent]

    return of


def _lasting(s: Statistics, source: str, steps: int, size: int) -> FloatArray:
    """Return the larger of limited mean and size, either held to the newer half of its window."""
    windows = (("T2 of limited mean", steps), ("size of one state", size))
    held = [
        held_to_newer(
            s[f"{source}{name} over {many}"], s[f"{source}{name} over {newer_half(many)}"]
        )
        for name, many in windows
    ]
    return np.asarray(np.max(held, axis=0))


def _with_scatter(
    mean: Callable[[Statistics], FloatArray], sizes: list[str], share: float
) -> Callable[[Statistics], FloatArray]:
    def of(s: Statistics) -> FloatArray:
        scatter = np.mean([np.minimum(s[size], SATURATED) for size in sizes], axis=0)
        return np.asarray((1 - share) * mean(s) + share * scatter)

    return of


def _mean(
    *weighed: tuple[Callable[[Statistics], FloatArray], float],
) -> Callable[[Statistics], FloatArray]:
    counted = [(view, weight) for view, weight in weighed if weight > 0]
    whole = sum(weight for _, weight in counted)

    def of(s: Statistics) -> FloatArray:
        return np.asarray(sum(weight * view(s) for view, weight in counted) / whole)

    return of


def _tied(few: int, share: float) -> Callable[[Statistics], FloatArray]:
    """Return what parity residuals say."""
    recent = f"{PARITY}T2 of mean over {few}"
    return lambda s: (1 - share) * _lasting(s, PARITY, _TIED, _TIED) + share * s[recent]


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


def _largest(statistics: Statistics, names: tuple[str, ...]) -> FloatArray:
    return np.asarray(np.max([statistics[name] for name in names], axis=0))

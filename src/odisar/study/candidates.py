"""The scores to choose from: statistics of innovations and parity residuals, put together."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from odisar.capability.combined import SATURATED
from odisar.capability.innovations import FloatArray
from odisar.capability.release import Release
from odisar.capability.scoring import RECONSTRUCTION

#: Steps of the windows that are tried, and leads of forecasts that are compared with now.
WINDOWS, LEADS = (1, 3, 5, 10, 20), (5, 10)
WEIGHTS, SIZES, LIMITED = (0.1, 0.3), (3, 5, 10), (10, 20)
#: Of the few last innovations, and of the sizes of parity residuals, that are offered.
RECENT, _TIED_SIZES = (1, 3, 5), (3, 10)
#: The scatter that adds up: over how many innovations, and its share of the mean.
SCATTER = ((20, 0.2), (60, 0.3), (60, 0.45))
#: How much further out than the rest one sensor's noise must be, and its shift, on the common log
#: scale. Shifts are found with more to spare.
MARGINS = ((0.0, 0.25), (0.3, 0.5), (0.75, 1.0))
#: Letting go, beside not doing so.
RELEASES = (Release(10, 0.5), Release(60, 0.5), Release(60, 1.0))

#: Before the name of a statistic of the closed form's innovations, of parity residuals.
CLOSED, PARITY = "closed form's ", "parity residuals' "
#: The noise of one sensor, and its shift, as the monitor's score has them.
NOISE, SHIFT = "noise of one sensor", "its shift"

#: (time,) statistics of one recording by name, on their log scale.
Statistics = Mapping[str, FloatArray]


@dataclass(frozen=True)
class Candidate:
    """A score to choose from: ``of`` makes it of statistics, ``parts`` counts those.

    One that doesn't use the twin is there to be compared with, not to be chosen. With ``margins``
    it is that, or one sensor's noise or shift less its margin, whichever is rarest, and with a
    ``release`` it lets go of what is over.
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


def candidates() -> list[Candidate]:
    """Return every candidate, in the order of the table."""
    singles = [f"T2 of mean over {k}" for k in WINDOWS]
    singles += [f"T2 of limited mean over {k}" for k in LIMITED]
    singles += [f"T2 of exponential mean, weight {a:g}" for a in WEIGHTS]
    singles += [f"log NIS over {k}" for k in SIZES] + ["log NIS over 5, by regime"]
    singles += [f"size of one state over {k}" for k in (*SIZES, *many_steps())]
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
        for size in SIZES
        for recent in RECENT[1:]
        for one in _limited(steps, size, recent)
    ]


def of_limited() -> list[str]:
    """Return the statistics that candidates with a limited mean are made of, of each source."""
    means = [f"T2 of limited mean over {k}" for k in LIMITED]
    sizes = [f"size of one state over {k}" for k in (*SIZES, *many_steps())]
    return [*means, *sizes, *(f"T2 of mean over {k}" for k in RECENT)]


def many_steps() -> list[int]:
    """Return over how many innovations scatter is tried."""
    return sorted({steps for steps, _ in SCATTER})


def _limited(steps: int, size: int, last: int) -> list[Candidate]:
    """Return the largest of three, of a mean that single innovations can't rule.

    Alone, averaged with what the innovations of the closed form say, and with what parity residuals
    say as well; the last also with the scatter that adds up, with one sensor's noise and shift
    beside, and letting go. In between the same without the twin.
    """
    name = f"largest of limited mean over {steps}, size of one state over {size}, reconstruction"
    name += f"; recent mean over {last} (.7, .3)"
    alone, closed = _view("", steps, size, last), _view(CLOSED, steps, size, last)
    made = [
        Candidate(name, 4, alone),
        Candidate(f"{name}; mean with closed form", 7, lambda s: (alone(s) + closed(s)) / 2),
    ]
    for tied_size in _TIED_SIZES:
        tied = _tied(tied_size)
        label = f"consistency (size over {tied_size})"
        whole = f"{name}; mean with closed form and {label}"
        without = (
            f"no twin: closed form's limited mean over {steps}, size of one state over {size}; "
            f"recent mean over {last} (.7, .3); mean with {label}"
        )
        made += [
            Candidate(whole, 10, _mean(alone, closed, tied)),
            Candidate(without, 6, _mean(closed, tied), uses_twin=False),
        ]
    for many, share in SCATTER:
        added, sizes = f"; scatter over {many} ({share:g})", [f"size of one state over {many}"]
        sizes.append(f"{CLOSED}{sizes[0]}")
        mean = _with_scatter(_mean(alone, closed, tied), sizes, share)
        made.append(Candidate(f"{whole}{added}", 12, mean))
        mean = _with_scatter(_mean(closed, tied), sizes[1:], share)
        made.append(Candidate(f"{without}{added}", 7, mean, uses_twin=False))
    # Those with every part, consistency with the last of its sizes.
    full = [one for one in made if one.name.startswith(whole)]
    for one in full:
        for margins in MARGINS:
            noise, shift = margins
            name = f"{one.name}; or {NOISE}, {noise:g}, or {SHIFT}, {shift:g}"
            heard = replace(one, name=name, parts=one.parts + 4, margins=margins)
            made.append(heard)
            for release in RELEASES:
                name = f"{heard.name}; release over {release.steps} ({release.share:g})"
                made.append(replace(heard, name=name, release=release))
    return made


def _view(source: str, steps: int, size: int, last: int) -> Callable[[Statistics], FloatArray]:
    """Return what the innovations of one source say: of the twin, or of its closed form."""
    names = [f"T2 of limited mean over {steps}", f"size of one state over {size}"]
    lasting = (*(f"{source}{name}" for name in names), *([] if source else [RECONSTRUCTION]))
    recent = f"{source}T2 of mean over {last}"
    return lambda s: 0.7 * _largest(s, lasting) + 0.3 * s[recent]


def _with_scatter(
    mean: Callable[[Statistics], FloatArray], sizes: list[str], share: float
) -> Callable[[Statistics], FloatArray]:
    def of(s: Statistics) -> FloatArray:
        scatter = np.mean([np.minimum(s[size], SATURATED) for size in sizes], axis=0)
        return np.asarray((1 - share) * mean(s) + share * scatter)

    return of


def _mean(*views: Callable[[Statistics], FloatArray]) -> Callable[[Statistics], FloatArray]:
    def of(s: Statistics) -> FloatArray:
        return np.asarray(np.mean([view(s) for view in views], axis=0))

    return of


def _tied(size: int) -> Callable[[Statistics], FloatArray]:
    """Return what parity residuals say: no sample before the last is in one, so one is recent."""
    lasting = (f"{PARITY}T2 of limited mean over 10", f"{PARITY}size of one state over {size}")
    recent = f"{PARITY}T2 of mean over 1"
    return lambda s: 0.6 * _largest(s, lasting) + 0.4 * s[recent]


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

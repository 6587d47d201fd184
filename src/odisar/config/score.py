"""The windows of the monitor's score: how far back each of its statistics looks."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from odisar.config.base import PositiveInt, Section

#: What is usual and rare on held-out recordings isn't known from fewer scores.
FEWEST_KNOWN = 20

#: Computing time and storage grow with the memory for shifts.
LONGEST_MEMORY = 1000

#: How much further out than elsewhere something must be to be heard, on the common log scale;
#: below zero, how much less far.
Margin = Annotated[float, Field(ge=-1, le=100)]

_Weight = Annotated[float, Field(ge=0, lt=1)]
_Share = Annotated[float, Field(ge=0, le=1)]


class StatisticsConfig(Section):
    """How far back statistics of innovations, or of parity residuals, look.

    ``mean_steps``, ``size_steps`` and ``recent_steps`` are samples: of T2 of the mean, of the size
    of the state that scatters most, and of T2 of very few, which lets go as soon as a disturbance
    has ended and has ``recent_share`` of the weight; the rest is that of the larger of the others,
    which hardly count more than in the newer half of their windows.
    """

    mean_steps: PositiveInt
    size_steps: PositiveInt
    recent_steps: PositiveInt
    recent_share: _Weight


class ScatterConfig(Section):
    """Over how many samples innovations' scatter adds up, and its share of the score's mean.

    It remembers for as long. A share of 0 leaves it out.
    """

    steps: PositiveInt
    share: _Weight


class NoiseConfig(Section):
    """How far back the noise of one sensor looks, and how rare it must be.

    ``lasting_steps`` and ``recent_steps`` are samples, the latter with ``recent_share`` of the
    weight; what lasts counts hardly more than in the newer half of its window. ``margin`` is taken
    off: 0 lets noise count as soon as it is as rare as anything else must be, 1 only where it is
    about twice as far out; below 0 it counts sooner than anything else.
    """

    lasting_steps: PositiveInt
    recent_steps: PositiveInt
    recent_share: _Weight
    margin: Margin

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.recent_steps > self.lasting_steps:
            raise ValueError(
                f"recent_steps={self.recent_steps} must not be above "
                f"lasting_steps={self.lasting_steps}"
            )
        return self


class ShiftConfig(Section):
    """How far back a shift of one state is sought, and how rare it must be.

    Its onset is sought among the last ``memory_steps`` samples; ``margin`` is taken off, as that of
    noise is.
    """

    memory_steps: Annotated[int, Field(ge=1, le=LONGEST_MEMORY)]
    margin: Margin


class ReleaseConfig(Section):
    """How a score lets go of something strong that is over.

    Where its highest value within the last ``steps`` samples was strong and it has fallen far below
    that, ``share`` of so much of the fall is taken off as well (see ``capability.release``). A
    share of 0 leaves scores as they are.
    """

    steps: PositiveInt
    share: _Share


class ScoreConfig(Section):
    """How far back a case's score looks.

    On innovations, the twin's and its closed form's alike, on parity residuals (``consistency``),
    on the scatter that adds up, on the noise of one sensor and on a shift of one state (null: none
    is sought); and how it lets go (``release``).
    """

    innovation: StatisticsConfig
    consistency: StatisticsConfig
    scatter: ScatterConfig
    noise: NoiseConfig
    shift: ShiftConfig | None
    release: ReleaseConfig

    @property
    def longest_steps(self) -> int:
        """How many steps after its first forecast a run has its first score, at the latest."""
        parts = (self.innovation, self.consistency)
        steps = [n for p in parts for n in (p.mean_steps, p.size_steps, p.recent_steps)]
        scatter = self.scatter.steps if self.scatter.share else 0
        return max(*steps, scatter, self.noise.lasting_steps + 1)

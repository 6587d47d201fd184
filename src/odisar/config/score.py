"""The windows of the monitor's score: how far back each of its statistics looks."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from odisar.config.base import NonNegativeFloat, PositiveInt, Section

_Weight = Annotated[float, Field(ge=0, lt=1)]


class StatisticsConfig(Section):
    """How far back statistics of innovations, or of parity residuals, look.

    ``mean_steps``, ``size_steps`` and ``recent_steps`` are samples: of T2 of the mean, of the size
    of the state that scatters most, and of T2 of very few, which lets go as soon as a disturbance
    has ended and has ``recent_share`` of the weight; the rest is that of the larger of the others.
    """

    mean_steps: PositiveInt
    size_steps: PositiveInt
    recent_steps: PositiveInt
    recent_share: _Weight


class InnovationStatisticsConfig(StatisticsConfig):
    """The same of innovations, with the size over ``long_steps``, which has ``long_share``.

    A little more scatter than usual adds up in it, and it remembers for as long.
    """

    long_steps: PositiveInt
    long_share: _Weight

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.recent_share + self.long_share >= 1:
            raise ValueError(
                f"recent_share={self.recent_share:g} and long_share={self.long_share:g} leave no "
                "weight for the mean and the size: together they must be below 1"
            )
        return self


class NoiseConfig(Section):
    """How far back the noise of one sensor looks, and how rare it must be.

    ``lasting_steps`` and ``recent_steps`` are samples, the latter with ``recent_share`` of the
    weight. ``margin`` is taken off: 0 lets noise count as soon as it is as rare as anything else
    must be, 1 only where it is about twice as far out.
    """

    lasting_steps: PositiveInt
    recent_steps: PositiveInt
    recent_share: _Weight
    margin: NonNegativeFloat


class ScoreConfig(Section):
    """Of a case's innovations, the twin's and its closed form's alike, parity residuals, noise."""

    innovation: InnovationStatisticsConfig
    consistency: StatisticsConfig
    noise: NoiseConfig

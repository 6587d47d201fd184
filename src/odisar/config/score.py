"""The windows of the monitor's score: how far back each of its statistics looks."""

from typing import Annotated

from pydantic import Field

from odisar.config.base import PositiveInt, Section


class StatisticsConfig(Section):
    """How far back statistics of innovations, or of parity residuals, look.

    ``mean_steps``, ``size_steps`` and ``recent_steps`` are samples: of T2 of the mean, of the size
    of the state that scatters most, and of T2 of very few, which lets go as soon as a disturbance
    has ended and has ``recent_share`` of the weight; the rest is that of the larger of the others.
    """

    mean_steps: PositiveInt
    size_steps: PositiveInt
    recent_steps: PositiveInt
    recent_share: Annotated[float, Field(ge=0, lt=1)]


class ScoreConfig(Section):
    """Of a case's innovations, the twin's and its closed form's alike, and parity residuals."""

    innovation: StatisticsConfig
    consistency: StatisticsConfig

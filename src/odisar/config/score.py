"""The windows of the monitor's score: how far back each of its statistics looks."""

from typing import Annotated

from pydantic import Field

from odisar.config.base import PositiveInt, Section


class StatisticsConfig(Section):
    """How many of the last innovations, or parity residuals, statistics look at, and a weight."""

    mean_steps: PositiveInt
    size_steps: PositiveInt
    recent_steps: PositiveInt
    recent_share: Annotated[float, Field(ge=0, lt=1)]


class ScoreConfig(Section):
    """Of a case's innovations, the twin's and its closed form's alike, and parity residuals."""

    innovation: StatisticsConfig
    consistency: StatisticsConfig

"""Fitted statistics of innovations, and a score made of them, as plain numbers."""

from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, model_validator

from odisar.capability.innovations import (
    InnovationLimit,
    InnovationScore,
    InnovationSize,
    LogScale,
    MeanInnovation,
)
from odisar.config.base import PositiveInt, Section

NUMBER_LIMIT = 1e30
Number = Annotated[float, Field(ge=-NUMBER_LIMIT, le=NUMBER_LIMIT)]


class ScaleValues(Section):
    """The log scale of a statistic."""

    usual: Number
    rare: Number

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.rare <= self.usual:
            raise ValueError(f"rare={self.rare} must be above usual={self.usual}")
        return self


class Covariant(Section):
    """Anything with an inverse covariance."""

    precision: list[list[Number]]

    @model_validator(mode="after")
    def _check(self) -> Self:
        if any(len(row) != len(self.precision) for row in self.precision):
            raise ValueError(f"precision: expected {len(self.precision)} numbers in each row")
        return self


class LimitValues(Covariant):
    """How far out single innovations may count."""

    distance: Annotated[float, Field(gt=0, le=NUMBER_LIMIT)]


class StatisticValues(Covariant):
    """One statistic of innovations: its window, the inverse covariance, its log scale."""

    steps: PositiveInt
    scale: ScaleValues


class MeanValues(StatisticValues):
    """T2 of a mean, of innovations that are cut back to a limit or not."""

    limit: LimitValues | None


class InnovationValues(Section):
    """One innovation score."""

    mean: MeanValues
    size: StatisticValues
    newer_mean: MeanValues
    newer_size: StatisticValues
    recent: MeanValues
    recent_share: Annotated[float, Field(ge=0, lt=1)]
    reconstruction: ScaleValues | None

    @classmethod
    def of(cls, score: InnovationScore) -> Self:
        """Return the numbers of a fitted score."""
        rebuilt = score.reconstruction
        return cls(
            mean=_mean_values(score.mean),
            size=StatisticValues(**statistic_values(score.size)),
            newer_mean=_mean_values(score.newer_mean),
            newer_size=StatisticValues(**statistic_values(score.newer_size)),
            recent=_mean_values(score.recent),
            recent_share=score.recent_share,
            reconstruction=None if rebuilt is None else ScaleValues(**vars(rebuilt)),
        )

    def build(self) -> InnovationScore:
        """Return the score."""
        rebuilt = self.reconstruction
        return InnovationScore(
            _mean(self.mean),
            InnovationSize(**statistic_arguments(self.size)),
            _mean(self.newer_mean),
            InnovationSize(**statistic_arguments(self.newer_size)),
            _mean(self.recent),
            self.recent_share,
            None if rebuilt is None else LogScale(**rebuilt.model_dump()),
        )


def _mean_values(part: MeanInnovation) -> MeanValues:
    limit = part.limit
    given = (
        None
        if limit is None
        else {
            "precision": limit.precision.tolist(),
            "distance": limit.distance,
        }
    )
    return MeanValues.model_validate({**statistic_values(part), "limit": given})


def statistic_values(part: MeanInnovation | InnovationSize) -> dict[str, Any]:
    """Return the numbers of a statistic."""
    return {
        "steps": part.steps,
        "precision": part.precision.tolist(),
        "scale": ScaleValues(**vars(part.scale)),
    }


def _mean(values: MeanValues) -> MeanInnovation:
    limit = values.limit
    built = None if limit is None else InnovationLimit(np.array(limit.precision), limit.distance)
    return MeanInnovation(**statistic_arguments(values), limit=built)


def statistic_arguments(values: StatisticValues) -> dict[str, Any]:
    """Return what a statistic is made of."""
    return {
        "steps": values.steps,
        "precision": np.array(values.precision),
        "scale": LogScale(**values.scale.model_dump()),
    }

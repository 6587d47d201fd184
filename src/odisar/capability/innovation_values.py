"""Fitted innovation scores as plain numbers: what thresholds and bundles hold of them."""

from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, model_validator

from odisar.capability.innovations import InnovationScore, InnovationSize, LogScale, MeanInnovation
from odisar.capability.scoring import InnovationScores
from odisar.config.base import PositiveInt, Section

_NUMBER_LIMIT = 1e30
_Number = Annotated[float, Field(ge=-_NUMBER_LIMIT, le=_NUMBER_LIMIT)]


class ScaleValues(Section):
    """The log scale of a statistic."""

    usual: _Number
    rare: _Number

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.rare <= self.usual:
            raise ValueError(f"rare={self.rare} must be above usual={self.usual}")
        return self


class StatisticValues(Section):
    """One statistic of innovations: its window, the inverse covariance, its log scale."""

    steps: PositiveInt
    precision: list[list[_Number]]
    scale: ScaleValues

    @model_validator(mode="after")
    def _check(self) -> Self:
        if any(len(row) != len(self.precision) for row in self.precision):
            raise ValueError(f"precision: expected {len(self.precision)} numbers in each row")
        return self


class InnovationValues(Section):
    """One innovation score."""

    mean: StatisticValues
    size: StatisticValues
    recent: StatisticValues
    recent_share: Annotated[float, Field(ge=0, lt=1)]
    reconstruction: ScaleValues | None

    @classmethod
    def of(cls, score: InnovationScore) -> Self:
        """Return the numbers of a fitted score."""
        rebuilt = score.reconstruction
        return cls(
            mean=_values(score.mean),
            size=_values(score.size),
            recent=_values(score.recent),
            recent_share=score.recent_share,
            reconstruction=None if rebuilt is None else ScaleValues(**vars(rebuilt)),
        )

    def build(self) -> InnovationScore:
        """Return the score."""
        rebuilt = self.reconstruction
        return InnovationScore(
            MeanInnovation(**_arguments(self.mean)),
            InnovationSize(**_arguments(self.size)),
            MeanInnovation(**_arguments(self.recent)),
            self.recent_share,
            None if rebuilt is None else LogScale(**rebuilt.model_dump()),
        )


class InnovationScoreValues(Section):
    """The twin's score and that of its closed form alone."""

    twin: InnovationValues
    closed_form: InnovationValues

    @classmethod
    def of(cls, scores: InnovationScores) -> Self:
        """Return the numbers of fitted scores."""
        return cls(
            twin=InnovationValues.of(scores.twin),
            closed_form=InnovationValues.of(scores.closed_form),
        )

    def build(self) -> InnovationScores:
        """Return the scores."""
        return InnovationScores(self.twin.build(), self.closed_form.build())

    @property
    def states(self) -> set[int]:
        """How many state features the covariances are of; more than one number fits no twin."""
        parts = [
            part
            for score in (self.twin, self.closed_form)
            for part in (score.mean, score.size, score.recent)
        ]
        return {len(part.precision) for part in parts}


def _values(part: MeanInnovation | InnovationSize) -> StatisticValues:
    return StatisticValues(
        steps=part.steps,
        precision=part.precision.tolist(),
        scale=ScaleValues(**vars(part.scale)),
    )


def _arguments(values: StatisticValues) -> dict[str, Any]:
    return {
        "steps": values.steps,
        "precision": np.array(values.precision),
        "scale": LogScale(**values.scale.model_dump()),
    }

"""Fitted innovation scores as plain numbers: what thresholds and bundles hold of them."""

from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from odisar.capability.combined import RELEASED, InnovationScores, MeanParts, Scatter
from odisar.capability.consistency import Consistency
from odisar.capability.innovations import InnovationSize, LogScale
from odisar.capability.outliers import NoiseSteps, SensorNoise
from odisar.capability.release import Release
from odisar.capability.shifts import ShiftSteps, StateShift
from odisar.capability.statistic_values import (
    Covariant,
    InnovationValues,
    Number,
    ScaleValues,
    StatisticValues,
    statistic_arguments,
    statistic_values,
)
from odisar.config.base import PositiveInt, Section
from odisar.config.score import LONGEST_MEMORY, Margin


class RelationValues(Section):
    """Relations between the features of a sample: the states' positions, a row of weights each."""

    states: list[Annotated[int, Field(ge=0)]]
    weights: list[list[Number]]

    @model_validator(mode="after")
    def _check(self) -> Self:
        if len(self.weights) != len(self.states):
            raise ValueError(f"weights: expected {len(self.states)} rows, one for each state")
        if len({len(row) for row in self.weights}) > 1:
            raise ValueError("weights: expected as many numbers in each row")
        return self


class ScatterValues(Section):
    """The scatter over many samples, and its share of the mean."""

    twin: StatisticValues
    closed_form: StatisticValues
    share: Annotated[float, Field(gt=0, lt=1)]

    @classmethod
    def of(cls, scatter: Scatter) -> Self:
        """Return the numbers of a fitted score."""
        sizes = (scatter.twin, scatter.closed_form)
        twin, closed = (StatisticValues(**statistic_values(size)) for size in sizes)
        return cls(twin=twin, closed_form=closed, share=scatter.share)

    def build(self) -> Scatter:
        """Return the score."""
        twin, closed = (
            InnovationSize(**statistic_arguments(v)) for v in (self.twin, self.closed_form)
        )
        return Scatter(twin, closed, self.share)


class NoiseStepsValues(Section):
    """How far back the noise of one sensor looks, and its margin."""

    lasting: PositiveInt
    recent: PositiveInt
    recent_share: Annotated[float, Field(ge=0, lt=1)]
    margin: Margin


class NoiseValues(Section):
    """The score of the noise of one sensor."""

    steps: NoiseStepsValues
    lasting: ScaleValues
    newer: ScaleValues
    recent: ScaleValues

    @classmethod
    def of(cls, noise: SensorNoise) -> Self:
        """Return the numbers of a fitted score."""
        return cls(
            steps=NoiseStepsValues(**vars(noise.steps)),
            lasting=ScaleValues(**vars(noise.lasting)),
            newer=ScaleValues(**vars(noise.newer)),
            recent=ScaleValues(**vars(noise.recent)),
        )

    def build(self) -> SensorNoise:
        """Return the score."""
        return SensorNoise(
            NoiseSteps(**self.steps.model_dump()),
            LogScale(**self.lasting.model_dump()),
            LogScale(**self.newer.model_dump()),
            LogScale(**self.recent.model_dump()),
        )


class ShiftStepsValues(Section):
    """How far back a shift of one state is sought, and its margin."""

    memory: Annotated[int, Field(ge=1, le=LONGEST_MEMORY)]
    margin: Margin


class ShiftValues(Section):
    """The score of a shift of one state."""

    steps: ShiftStepsValues
    twin: ScaleValues
    closed_form: ScaleValues

    @classmethod
    def of(cls, shift: StateShift) -> Self:
        """Return the numbers of a fitted score."""
        return cls(
            steps=ShiftStepsValues(**vars(shift.steps)),
            twin=ScaleValues(**vars(shift.twin)),
            closed_form=ScaleValues(**vars(shift.closed_form)),
        )

    def build(self) -> StateShift:
        """Return the score."""
        return StateShift(
            ShiftSteps(**self.steps.model_dump()),
            LogScale(**self.twin.model_dump()),
            LogScale(**self.closed_form.model_dump()),
        )


class ReleaseValues(Section):
    """How the score lets go of something strong that is over."""

    steps: PositiveInt
    share: Annotated[float, Field(ge=0, le=1)]


class InnovationScoreValues(Section):
    """All that the monitor's score is made of: parts, relations, noise, shift and scales."""

    twin: InnovationValues
    closed_form: InnovationValues
    consistency: InnovationValues
    relations: RelationValues
    share_holding: Annotated[float, Field(ge=0, le=1)]
    scatter: ScatterValues | None
    noise: NoiseValues
    shift: ShiftValues | None
    scales: dict[str, ScaleValues]
    release: ReleaseValues

    @model_validator(mode="after")
    def _check(self) -> Self:
        if set(self.scales) != set(RELEASED):
            raise ValueError(f"scales: expected {', '.join(RELEASED)}")
        return self

    @classmethod
    def of(cls, scores: InnovationScores) -> Self:
        """Return the numbers of fitted scores."""
        parts, tied = scores.parts, scores.parts.relations
        return cls(
            twin=InnovationValues.of(parts.twin),
            closed_form=InnovationValues.of(parts.closed_form),
            consistency=InnovationValues.of(parts.consistency),
            relations=RelationValues(states=list(tied.states), weights=tied.weights.tolist()),
            share_holding=parts.share_holding,
            scatter=None if parts.scatter is None else ScatterValues.of(parts.scatter),
            noise=NoiseValues.of(scores.noise),
            shift=None if scores.shift is None else ShiftValues.of(scores.shift),
            scales={name: ScaleValues(**vars(s)) for name, s in scores.scales.items()},
            release=ReleaseValues(**vars(scores.release)),
        )

    def build(self) -> InnovationScores:
        """Return the scores."""
        tied = self.relations
        parts = MeanParts(
            self.twin.build(),
            self.closed_form.build(),
            self.consistency.build(),
            Consistency(tuple(tied.states), np.array(tied.weights)),
            self.share_holding,
            None if self.scatter is None else self.scatter.build(),
        )
        return InnovationScores(
            parts,
            self.noise.build(),
            None if self.shift is None else self.shift.build(),
            {name: LogScale(**scale.model_dump()) for name, scale in self.scales.items()},
            Release(**self.release.model_dump()),
        )

    @property
    def states(self) -> set[int]:
        """How many state features the covariances are of; more than one number fits no twin."""
        parts: list[Covariant] = []
        for score in (self.twin, self.closed_form, self.consistency):
            means = (score.mean, score.newer_mean, score.recent)
            parts += [*means, score.size, score.newer_size]
            parts += [mean.limit for mean in means if mean.limit is not None]
        if self.scatter is not None:
            parts += [self.scatter.twin, self.scatter.closed_form]
        return {len(part.precision) for part in parts}

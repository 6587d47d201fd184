"""Sections for the twin, its training and its tuning."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from odisar.config.base import PositiveFloat, PositiveInt, Section

# Far above any sensible twin: what a file that was meddled with may ask for has an end.
ModelDim = Annotated[int, Field(gt=0, le=4096)]
HiddenDim = Annotated[int, Field(gt=0, le=16_384)]
Count = Annotated[int, Field(gt=0, le=64)]
Steps = Annotated[int, Field(gt=0, le=100_000)]
DropoutRate = Annotated[float, Field(ge=0, lt=1)]


class TwinConfig(Section):
    """Shape of the Transformer (paper, Table "Model and Training Parameters"), and its closed form.

    The next sample is always forecast as what a frozen closed form of the last
    ``closed_form_lags`` samples says, plus what the Transformer adds; with ``residual_forecast``
    the horizon as well.
    """

    patch_steps: Steps
    model_dim: ModelDim
    heads: Count
    layers: Count
    feedforward_dim: HiddenDim
    reconstruction_dim: HiddenDim
    dropout: DropoutRate
    detach_reconstruction: bool
    closed_form_lags: Steps
    residual_forecast: bool

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.model_dim % self.heads:
            raise ValueError(
                f"twin.model_dim={self.model_dim} must be a multiple of twin.heads={self.heads}"
            )
        return self


class MonteCarloConfig(Section):
    """The dropout masks that are drawn once and stored with a twin."""

    draws: Annotated[int, Field(ge=2)]
    dropout_scope: Literal["all", "decoder"]


class TrainingConfig(Section):
    """How a twin is trained. An epoch is ``steps_per_epoch`` batches drawn by the epoch's seed."""

    batch_size: PositiveInt
    learning_rate: PositiveFloat
    epochs: PositiveInt
    steps_per_epoch: PositiveInt
    patience_epochs: PositiveInt
    gradient_clip: PositiveFloat
    weigh_loss: bool
    validation_stride_steps: PositiveInt


class LearningRateRange(Section):
    """Bounds of a log-uniform search."""

    low: PositiveFloat
    high: PositiveFloat


class TuningConfig(Section):
    """The Optuna study: what is searched, for how long. Dropout is not searched (it would vanish).

    ``storage`` is ``journal`` (a file, on one machine) or the URL of a database for several.
    """

    trials: PositiveInt
    steps_per_trial: PositiveInt
    reports_per_trial: PositiveInt
    pruner_warmup_trials: PositiveInt
    learning_rate: LearningRateRange
    model_dim: Annotated[list[ModelDim], Field(min_length=1)]
    layers: Annotated[list[Count], Field(min_length=1)]
    feedforward_dim: Annotated[list[HiddenDim], Field(min_length=1)]
    storage: Annotated[str, Field(pattern=r"^journal$|^[a-z0-9+]+://")]

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.reports_per_trial > self.steps_per_trial:
            raise ValueError(
                f"tuning.reports_per_trial={self.reports_per_trial} is above "
                f"tuning.steps_per_trial={self.steps_per_trial}"
            )
        if self.learning_rate.low >= self.learning_rate.high:
            raise ValueError("tuning.learning_rate: low must be below high")
        return self

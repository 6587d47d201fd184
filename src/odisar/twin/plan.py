"""What decides the weights of a twin, besides the windows."""

from dataclasses import dataclass

from odisar.config.learning import TrainingConfig, TwinConfig


@dataclass(frozen=True)
class TrainingPlan:
    """Everything that decides the weights, besides the windows."""

    twin: TwinConfig
    training: TrainingConfig
    seed: int
    accelerator: str

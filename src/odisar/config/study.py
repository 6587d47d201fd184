"""Section for the full study: what the default run leaves out for its time."""

from typing import Annotated

from pydantic import Field

from odisar.config.base import PositiveFloat, PositiveInt, Section
from odisar.config.learning import DropoutRate


class FitConfig(Section):
    """How long networks are fitted: steps of so many windows; see ``fitting.FitBudget``."""

    steps: PositiveInt
    batch_size: PositiveInt
    learning_rate: PositiveFloat
    gradient_clip: PositiveFloat
    validations: PositiveInt


class StudyConfig(Section):
    """What the study trains and judges.

    ``seeds`` counts trainings of the main twins, the default run's among them; ``setups`` are the
    set-ups of the alternatives; ``dropout`` rates and ``draws`` are what confidence is tried with;
    ``vus_buffer_steps`` is the widest buffer around an event of the range-aware measure, and
    ``vus_stride`` takes every so many scores of a recording, a matter of time.
    """

    setups: list[str]
    seeds: PositiveInt
    detectors: FitConfig
    forecasters: FitConfig
    pilot: FitConfig
    dropout: Annotated[list[DropoutRate], Field(min_length=1)]
    draws: Annotated[list[PositiveInt], Field(min_length=1)]
    vus_buffer_steps: PositiveInt
    vus_stride: PositiveInt

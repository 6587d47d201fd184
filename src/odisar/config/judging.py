"""Sections for the capability and for the evaluation."""

from typing import Annotated, Literal, Self

from pydantic import Field

from odisar.config.base import PositiveFloat, PositiveInt, Section
from odisar.config.cases import Case

_GUARDS = ("guard_start_s", "guard_end_s")


class CapabilityConfig(Section):
    """Thresholds and attribution (paper, section "Creating DTC")."""

    threshold_rule: Literal["sigma", "log-sigma", "operating", "conformal"]
    threshold_sigmas: PositiveFloat
    attribution_top: PositiveInt
    scoring_batch: PositiveInt


class OperatingPoint(Section):
    """The alarm rate promised to the operator, and how its threshold is set."""

    promised_per_hour: PositiveFloat
    set_to_share_of_promise: Annotated[float, Field(gt=0, le=1)]
    pool_below_hours: PositiveFloat


class EvaluationConfig(Section):
    """Protocols and intervals."""

    consequence_s: PositiveFloat
    bootstrap_draws: PositiveInt
    bootstrap_bins: PositiveInt
    confidence: Annotated[float, Field(gt=0, lt=1)]
    operating_point: OperatingPoint


class Judging(EvaluationConfig):
    """The evaluation of one case: the section, and the case's own times."""

    short_lead_s: PositiveFloat
    guard_start_s: PositiveFloat
    guard_end_s: PositiveFloat

    @classmethod
    def of(cls, evaluation: EvaluationConfig, case: Case) -> Self:
        """Return how a case is judged."""
        times = {name: getattr(case, name) for name in ("short_lead_s", *_GUARDS)}
        return cls.model_validate({**evaluation.model_dump(), **times})

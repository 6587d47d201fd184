"""Numbers that several simulators take: shares, counts from zero, and ranges to draw from."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from odisar.config.base import Section

NonNegativeInt = Annotated[int, Field(ge=0)]
Share = Annotated[float, Field(ge=0, le=1)]


class Range(Section):
    """The lower and the upper end of what is drawn, both included."""

    low: float
    high: float

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.low > self.high:
            raise ValueError(f"low={self.low} is above high={self.high}; swap them")
        return self

"""What every section of ``params.yaml`` is: frozen, complete, strict, without unknown keys."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

PositiveInt = Annotated[int, Field(gt=0)]
PositiveFloat = Annotated[float, Field(gt=0)]
NonNegativeFloat = Annotated[float, Field(ge=0)]
Fraction = Annotated[float, Field(gt=0, lt=1)]


class Section(BaseModel):
    """A section of the configuration. It has no defaults: ``params.yaml`` is the only source.

    Strict: ``epochs: true`` or ``epochs: "5"`` is refused instead of being taken for a number.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)

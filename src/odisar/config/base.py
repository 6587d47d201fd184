"""What every section of ``params.yaml`` is: frozen, complete, and without unknown keys."""

from pydantic import BaseModel, ConfigDict


class Section(BaseModel):
    """A section of the configuration. It has no defaults: ``params.yaml`` is the only source."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

"""Section for the registry of deployed capabilities."""

from typing import Annotated, Literal

from pydantic import Field

from odisar.config.base import PositiveInt, Section


class ChampionRule(Section):
    """When the alias ``champion`` moves to a new version.

    The new version's ``metric`` on the development recordings must exceed the champion's, on the
    same recordings, by more than ``margin``.
    """

    metric: Literal["auroc"]
    margin: Annotated[float, Field(ge=0, lt=1)]


class RegistryConfig(Section):
    """What is registered, and what a registered model takes.

    ``max_rows`` is how many samples may be assessed at once; ``development_stride_steps`` how far
    apart the windows are on which versions are compared.
    """

    max_rows: PositiveInt
    development_stride_steps: PositiveInt
    champion: ChampionRule

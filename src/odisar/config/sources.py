"""Sections for public recordings: where a file is published, and how it becomes recordings."""

from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from odisar.config.base import Section
from odisar.config.cases import PositiveFloat, PositiveInt


class PinnedFile(Section):
    """A published file that never changes: an address with its commit, and the file's SHA-256.

    Where ``environment_variable`` is set, the local copy it names is read instead. ``folder`` is
    relative to the project's root and ignored by git.
    """

    url: Annotated[str, Field(pattern=r"^https://\S+$")]
    sha256: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
    file_name: Annotated[str, Field(pattern=r"^[\w][\w.-]*$")]
    folder: str
    environment_variable: Annotated[str, Field(pattern=r"^[A-Z][A-Z0-9_]*$")]
    size_limit_mb: PositiveFloat
    timeout_s: PositiveFloat
    licence: str
    credit: str


class Regime(Section):
    """A range of ordered propeller speed [RPM], both ends included, and what it is used for.

    ``reference`` recordings train and judge the twin by cross-fitting; ``novel`` ones only test it.
    """

    name: Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9-]*$")]
    min_rpm: PositiveFloat
    max_rpm: PositiveFloat
    use: Literal["reference", "novel"]

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.min_rpm >= self.max_rpm:
            raise ValueError(
                f"regime {self.name!r}: min_rpm={self.min_rpm} must be below max_rpm={self.max_rpm}"
            )
        return self


class GunnerusConfig(Section):
    """R/V Gunnerus' sea trial: the published file and its conversion."""

    file: PinnedFile
    raw_rate_hz: PositiveFloat
    average_samples: PositiveInt
    roll_sign: Literal[-1, 1]
    regime_window_s: PositiveFloat
    regimes: Annotated[list[Regime], Field(min_length=1)]
    minimum_s: PositiveFloat
    piece_s: PositiveFloat

    @model_validator(mode="after")
    def _check(self) -> Self:
        by_speed = sorted(self.regimes, key=lambda regime: regime.min_rpm)
        for lower, upper in pairwise(by_speed):
            if lower.max_rpm >= upper.min_rpm:
                raise ValueError(
                    f"regimes {lower.name!r} and {upper.name!r} overlap between "
                    f"{upper.min_rpm} and {lower.max_rpm} RPM; move one of the bounds"
                )
        names = [regime.name for regime in self.regimes]
        if len(set(names)) < len(names):
            raise ValueError(f"regimes: names must differ, found {', '.join(names)}")
        if self.piece_s < self.minimum_s:
            raise ValueError(
                f"piece_s={self.piece_s} must not be below minimum_s={self.minimum_s}: pieces "
                "would be shorter than the shortest stretch that is kept"
            )
        return self

    @property
    def rate_hz(self) -> float:
        """Samples a second after averaging."""
        return self.raw_rate_hz / self.average_samples


class SourcesConfig(Section):
    """Public recordings that the project downloads and converts."""

    gunnerus: GunnerusConfig

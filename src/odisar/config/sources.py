"""Sections for public recordings: where a file is published, and how it becomes recordings."""

from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from odisar.config.base import PositiveFloat, PositiveInt, Section


class Pinned(Section):
    """Something published that never changes: its address, with the commit, and its terms.

    Where ``environment_variable`` is set, the local copy it names is read instead. ``folder`` is
    relative to the project's root and ignored by git. ``size_limit_mb`` is that of one file.
    """

    url: Annotated[str, Field(pattern=r"^https://\S+$")]
    folder: str
    environment_variable: Annotated[str, Field(pattern=r"^[A-Z][A-Z0-9_]*$")]
    size_limit_mb: PositiveFloat
    timeout_s: PositiveFloat
    licence: str
    credit: str


class PinnedFile(Pinned):
    """One published file and its SHA-256."""

    sha256: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
    file_name: Annotated[str, Field(pattern=r"^[\w][\w.-]*$")]


class PinnedFolder(Pinned):
    """Published files below one address.

    ``registry`` is a file beside the code of ``odisar.sources``: a line for each published file
    with its path below the address and its SHA-256 (the format of pooch's registries).
    """

    url: Annotated[str, Field(pattern=r"^https://\S+/$")]
    registry: Annotated[str, Field(pattern=r"^[\w][\w.-]*$")]


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


class ExcludedSession(Section):
    """A session that is left out whole, and why."""

    session: Annotated[str, Field(pattern=r"^\d+$")]
    reason: Annotated[str, Field(min_length=1)]


class Omni3Config(Section):
    """Tracked runs of a three-wheel robot: the published files and their conversion.

    ``uses`` says of each manoeuvre (a folder of the published files) whether its runs are normal
    (``reference``) or only tested as ``novel``. ``split_cycle`` is dealt over the reference runs
    in the order of manoeuvre, session and run, over and over.
    """

    files: PinnedFolder
    raw_rate_hz: PositiveFloat
    rate_hz: PositiveFloat
    uses: dict[str, Literal["reference", "novel"]]
    excluded: list[ExcludedSession]
    split_cycle: list[Literal["train", "validation", "calibration", "test"]]
    minimum_s: PositiveFloat

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.rate_hz > self.raw_rate_hz:
            raise ValueError(
                f"rate_hz={self.rate_hz} must not be above raw_rate_hz={self.raw_rate_hz}: "
                "samples would be repeated"
            )
        missing = {"train", "validation", "calibration", "test"} - set(self.split_cycle)
        if missing:
            raise ValueError(f"split_cycle: {', '.join(sorted(missing))} has no place in it")
        sessions = [item.session for item in self.excluded]
        if len(set(sessions)) < len(sessions):
            raise ValueError(f"excluded: a session is named twice in {', '.join(sessions)}")
        return self


class SourcesConfig(Section):
    """Public recordings that the project downloads and converts."""

    gunnerus: GunnerusConfig
    omni3: Omni3Config

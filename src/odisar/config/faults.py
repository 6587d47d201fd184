"""Sensor faults that a case asks for, to judge a detector where nothing abnormal was recorded."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from odisar.config.base import PositiveFloat, Section

FaultKind = Literal["noise", "bias", "drift", "stuck", "delay"]


class Span(Section):
    """A length in seconds drawn evenly between two, both included."""

    low: PositiveFloat
    high: PositiveFloat

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.low > self.high:
            raise ValueError(f"low={self.low} is above high={self.high}; swap them")
        return self


class Creep(Section):
    """Faults that grow steadily: channels, and rates in their unit per second."""

    channels: Annotated[list[str], Field(min_length=1)]
    rates: Annotated[list[PositiveFloat], Field(min_length=1)]


class Faults(Section):
    """Sensor faults to inject into copies of held-out recordings (see ``recordings.faults``).

    ``sizes`` lists, by kind, the sizes of noise (its standard deviation), bias and drift (at the
    end of the interval), in standard deviations of the channel over the training recordings
    (``sizes_in: sd``) or in the channel's unit; ``delays_s`` are for delay.
    ``creep`` is a value that grows steadily, as a position that is added up from slipping wheels.
    A stuck or delayed sensor differs from a sound one only while its channel moves: a copy that
    never differs by ``shows_from_sd`` standard deviations is marked ``hidden`` in the metadata
    column ``fault_shows``, any other ``shows``.
    """

    kinds: list[FaultKind]
    channels: list[str]
    sizes: dict[FaultKind, list[PositiveFloat]]
    sizes_in: Literal["sd", "unit"]
    delays_s: list[PositiveFloat]
    creep: Creep | None
    start_s: PositiveFloat
    duration_s: Span
    shows_from_sd: PositiveFloat

    @property
    def all_channels(self) -> list[str]:
        """Names of all channels that some fault is put on."""
        return self.channels + (self.creep.channels if self.creep else [])

    @model_validator(mode="after")
    def _check(self) -> Self:
        for kind in self.kinds:
            sizes = self.delays_s if kind == "delay" else self.sizes.get(kind)
            if kind != "stuck" and not sizes:
                raise ValueError(f"faults: {kind} is among kinds but has no size; add one")
        return self

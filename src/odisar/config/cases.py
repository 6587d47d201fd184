"""A case: one machine, its channels, and what is asked of the twin. A new case needs no code."""

import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from odisar.config.base import Fraction, PositiveFloat, PositiveInt, Section
from odisar.config.faults import Faults
from odisar.config.formats import BagFormat, CsvFormat
from odisar.config.score import ScoreConfig

#: What can make a case's recordings where they are missing.
Maker = Literal["ferry-simulator", "gunnerus-trial", "robot-simulator", "omni3-runs", "none"]


class Channel(Section):
    """One column of a recording, in physical units.

    ``known_ahead`` is only for commands whose future is planned when the forecast is issued: the
    twin's decoder then sees them up to the horizon. ``min`` and ``max`` are what is physically
    possible, not what is usual: a sample outside them is an error in the file.
    """

    name: str
    unit: str
    role: Literal["state", "command"]
    output: bool
    known_ahead: bool
    min: float
    max: float

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.min >= self.max:
            raise ValueError(f"channel {self.name!r}: min={self.min} must be below max={self.max}")
        if self.known_ahead and self.role != "command":
            raise ValueError(
                f"channel {self.name!r}: known_ahead needs role: command; the future of a state "
                "is what the twin forecasts"
            )
        if self.output and self.role != "state":
            raise ValueError(f"channel {self.name!r}: only a state can be an output")
        return self


class Source(Section):
    """Where a case's recordings lie and how their files are read.

    ``maker`` says what makes them where they are missing: a simulator, a download, or nothing
    (they are yours). ``csv`` and ``bag`` (see ``config.formats``) say how such files are read;
    ``bag`` may be null where there are none. ``resample: hold`` puts every recording on a grid of
    ``rate_hz``, holding the last sample (so that nothing looks ahead); ``thin`` keeps the samples
    that this grid would hold with their own stamps, which a relative pose needs; ``none`` takes
    all samples as they are recorded.
    """

    folder: str
    maker: Maker
    time_column: str
    max_recordings: PositiveInt
    csv: CsvFormat
    bag: BagFormat | None
    resample: Literal["none", "hold", "thin"]


class Pose(Section):
    """Which channels are a planar pose, and in which coordinates the twin sees it.

    ``heading`` names one channel (an angle in rad or deg) or two (z and w of a quaternion about
    the vertical axis). ``absolute`` takes the channels as they are. ``relative`` gives the twin
    the pose's increments, divided by the difference of their stamps, and lets it forecast the
    displacement in the frame of the last pose (see ``windows.coordinates``).
    """

    x: str
    y: str
    heading: Annotated[list[str], Field(min_length=1, max_length=2)]
    coordinates: Literal["absolute", "relative"]

    @property
    def channels(self) -> list[str]:
        """Names of all channels of the pose."""
        return [self.x, self.y, *self.heading]


class WindowConfig(Section):
    """Context (what the twin sees) and horizon (what it forecasts), in steps of ``1 / rate_hz``."""

    context_steps: PositiveInt
    horizon_steps: PositiveInt


class Splits(Section):
    """How recordings are divided before anything is windowed.

    ``metadata`` takes the ``split`` column of ``recordings.csv``; ``fractions`` draws whole
    recordings with the case's seed; ``cross-fit`` cuts every recording of split ``cross-fit``
    into blocks, deals them over ``folds`` and lets each fold test, calibrate and validate once.
    """

    kind: Literal["metadata", "fractions", "cross-fit"]
    fractions: dict[Literal["train", "validation", "calibration", "test"], Fraction] | None
    folds: Annotated[int, Field(ge=4)] | None
    block_s: PositiveFloat | None
    block_gap_s: Annotated[float, Field(ge=0)] | None

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.kind == "fractions" and (
            self.fractions is None
            or set(self.fractions) != {"train", "validation", "calibration", "test"}
            or not math.isclose(sum(self.fractions.values()), 1.0)
        ):
            raise ValueError(
                "splits.kind=fractions needs fractions for train, validation, calibration and "
                "test that add up to 1"
            )
        if self.kind == "cross-fit" and None in (self.folds, self.block_s, self.block_gap_s):
            raise ValueError("splits.kind=cross-fit needs folds, block_s and block_gap_s")
        return self


class RangeRule(Section):
    """A one-line check a user would try first: flag where a channel's mean leaves a range."""

    name: str
    channel: str
    min: float
    max: float


class Groups(Section):
    """Which recordings are judged together.

    ``overall`` selects, by metadata column, the disturbed recordings that the ``overall`` rows and
    the ``group_by`` rows pool; ``apart`` names columns whose other values get rows of their own.
    ``with_clean`` names groups whose recordings are disturbed from end to end: the undisturbed
    test recordings join them, or there would be nothing to tell them from.
    """

    overall: dict[str, list[str]]
    group_by: list[str]
    apart: list[str]
    with_clean: list[str]


class Case(Section):
    """One machine: recordings, channels, window, splits and how its results are grouped."""

    title: str
    source: Source
    rate_hz: PositiveFloat
    max_gap_s: PositiveFloat
    channels: Annotated[list[Channel], Field(min_length=1)]
    pose: Pose | None
    window: WindowConfig
    splits: Splits
    score: ScoreConfig
    persistence_s: PositiveFloat
    short_lead_s: PositiveFloat
    guard_start_s: PositiveFloat
    guard_end_s: PositiveFloat
    groups: Groups
    faults: Faults | None
    range_rules: list[RangeRule]

    @model_validator(mode="after")
    def _check(self) -> Self:
        names = [channel.name for channel in self.channels]
        repeated = sorted({name for name in names if names.count(name) > 1})
        if repeated:
            raise ValueError(f"channels: {', '.join(repeated)} declared more than once")
        if self.max_gap_s * self.rate_hz < 1:
            raise ValueError(
                f"max_gap_s={self.max_gap_s} is shorter than a sampling period of "
                f"{1 / self.rate_hz:g} s: every step would be a gap"
            )
        short_lead_steps = round(self.short_lead_s * self.rate_hz)
        if not 1 <= short_lead_steps <= self.window.horizon_steps:
            raise ValueError(
                f"short_lead_s={self.short_lead_s} is {short_lead_steps} steps; it must be "
                f"between 1 and horizon_steps={self.window.horizon_steps}"
            )
        if not self.output_names:
            raise ValueError("channels: at least one state needs output: true")
        self._check_times()
        mentioned = [rule.channel for rule in self.range_rules]
        mentioned += self.faults.all_channels if self.faults else []
        mentioned += self.pose.channels if self.pose else []
        mentioned += list(self.source.bag.fields) if self.source.bag else []
        for name in mentioned:
            if name not in names:
                raise ValueError(f"{name!r} is not one of the channels: {', '.join(names)}")
        self._check_pose()
        self._check_bag()
        return self

    def _check_bag(self) -> None:
        taken = self.source.bag.fields if self.source.bag else None
        missing = [name for name in self.channel_names if taken is not None and name not in taken]
        if missing:
            raise ValueError(
                f"source.bag.fields: no field for {', '.join(missing)}; every channel needs one"
            )

    def _check_pose(self) -> None:
        if self.pose is None:
            return
        if len(set(self.pose.channels)) < len(self.pose.channels):
            raise ValueError("pose: a channel is named twice")
        if self.pose.coordinates == "relative" and self.source.resample == "hold":
            raise ValueError(
                "source.resample: hold loses the stamps by which the increments of a relative pose "
                "are divided; set it to thin (or pose.coordinates to absolute)"
            )
        by_name = {channel.name: channel for channel in self.channels}
        if len({by_name[name].output for name in self.pose.heading}) > 1:
            raise ValueError("pose.heading: z and w of a quaternion are both outputs, or neither")
        commands = [name for name in self.pose.channels if by_name[name].role == "command"]
        if commands:
            raise ValueError(f"pose: {', '.join(commands)} must be states, not commands")
        if len(self.pose.heading) == 1:
            unit = by_name[self.pose.heading[0]].unit
            if "/" in unit or not unit.casefold().startswith(("rad", "deg", "°")):
                raise ValueError(
                    f"pose.heading: {self.pose.heading[0]!r} is in {unit!r}; an angle is in rad or "
                    "deg (or name z and w of a quaternion)"
                )

    def _check_times(self) -> None:
        """Raise where a block or a fault has no room for what it must hold."""
        window_s = (self.window.context_steps + self.window.horizon_steps) / self.rate_hz
        block_s = self.splits.block_s
        if self.splits.kind == "cross-fit" and block_s is not None:
            if block_s < window_s:
                raise ValueError(
                    f"splits.block_s={block_s:g} is shorter than a window of {window_s:g} s; "
                    "lengthen it or shorten the window"
                )
            if self.faults and block_s < self.faults.start_s + self.faults.duration_s.high:
                raise ValueError(
                    f"splits.block_s={block_s:g} is shorter than faults.start_s + "
                    "faults.duration_s.high; a fault would not fit into a block"
                )

    @property
    def short_lead_steps(self) -> int:
        """Lead of the second forecast-error baseline in steps."""
        return round(self.short_lead_s * self.rate_hz)

    @property
    def channel_names(self) -> list[str]:
        """Names of all channels, in the order of the value array's last axis."""
        return [channel.name for channel in self.channels]

    @property
    def output_names(self) -> list[str]:
        """Names of the forecast states, in the order of the forecast's last axis."""
        return [channel.name for channel in self.channels if channel.output]

    @property
    def output_indices(self) -> list[int]:
        """Positions of the forecast states among the channels."""
        return [i for i, channel in enumerate(self.channels) if channel.output]

    @property
    def blamed_names(self) -> list[str]:
        """Names of the states that attribution can blame, z and w of a heading being one."""
        states = [channel.name for channel in self.channels if channel.role == "state"]
        if self.pose is None or self.pose.coordinates == "absolute":
            return states
        heading = " / ".join(self.pose.heading)
        others = [name for name in states if name not in self.pose.channels]
        return [self.pose.x, self.pose.y, heading, *others]

    @property
    def command_indices(self) -> list[int]:
        """Positions of the commands among the channels."""
        return [i for i, channel in enumerate(self.channels) if channel.role == "command"]

    @property
    def known_ahead_indices(self) -> list[int]:
        """Positions of the commands known over the horizon among the channels."""
        return [i for i, channel in enumerate(self.channels) if channel.known_ahead]


class Setup(Section):
    """What one twin is trained and judged on: a case, and which of its recordings train it.

    ``select`` keeps, by metadata column, the recordings for train, validation and calibration;
    development and test are never narrowed, so that set-ups are judged on the same recordings.
    """

    case: str
    select: dict[str, list[str]]
    published_as: str | None

"""Sensor faults injected into copies of clean held-out recordings.

The kinds follow the usual taxonomy of sensor faults: noise, bias, drift, stuck and delayed values,
and creep, a drift at a stated rate.
Sizes are multiples of the channel's standard deviation, or in its unit.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from odisar.config.cases import Case
from odisar.config.faults import FaultKind, Faults
from odisar.errors import OdisarError
from odisar.recordings.schema import Interval, Recording, label_times
from odisar.seeding import generator

# Written times have six decimals: two that are equal may differ by this.
_ROUNDING_S = 1e-6


@dataclass(frozen=True)
class _Fault:
    """One fault.

    ``amount`` is a size (``Faults.sizes_in``), seconds (delay), a rate (creep) or None (stuck).
    """

    kind: str
    channel: str
    amount: float | None

    @property
    def slug(self) -> str:
        channel = re.sub(r"[^a-z0-9]+", "_", self.channel.lower()).strip("_")
        parts = [self.kind, channel] + ([] if self.amount is None else [str(self.amount)])
        return "-".join(parts)


#: Metadata columns that a faulty copy has besides those of its original.
FAULT_COLUMNS = ("fault", "fault_on", "fault_channel", "fault_size", "fault_shows")


def inject_faults(
    recordings: Sequence[Recording],
    case: Case,
    channel_std: NDArray[np.float64],
    base_seed: int,
) -> list[Recording]:
    """Return one faulty copy for each clean recording and each fault of the case.

    Parameters
    ----------
    recordings
        Held-out recordings or blocks; those with a disturbance are passed over.
    channel_std
        (channel,) standard deviation over the training recordings, in physical units.
    base_seed
        Seed from which onset and noise of every copy derive, by the copy's name.

    Returns
    -------
    list[Recording]
        Copies with the fault's interval as their label and the original's cluster
        (``base_seed``). Outside the interval the values are those of the original, bit for bit.

    Raises
    ------
    OdisarError
        If a fault does not fit into a recording, or two copies would share a name.
    """
    if case.faults is None:
        return []
    clean = [recording for recording in recordings if not recording.info.is_disturbed]
    faults = list(_faults(case.faults))
    _check_fit(clean, case.faults, case.rate_hz)
    _check_slugs(faults)
    return [
        _faulty_copy(recording, fault, case.faults, case, channel_std, base_seed)
        for recording in clean
        for fault in faults
    ]


def _faults(faults: Faults) -> Iterator[_Fault]:
    for kind in faults.kinds:
        for channel in faults.channels:
            for amount in _amounts(faults, kind):
                yield _Fault(kind, channel, amount)
    if faults.creep is not None:
        for channel in faults.creep.channels:
            for rate in faults.creep.rates:
                yield _Fault("creep", channel, rate)


def _amounts(faults: Faults, kind: FaultKind) -> Sequence[float | None]:
    if kind == "stuck":
        return [None]
    return faults.delays_s if kind == "delay" else faults.sizes[kind]


def _check_slugs(faults: Sequence[_Fault]) -> None:
    slugs = [fault.slug for fault in faults]
    repeated = sorted({slug for slug in slugs if slugs.count(slug) > 1})
    if repeated:
        raise OdisarError(
            f"faults: {', '.join(repeated)} would be made twice; remove the repeated kind, size "
            "or delay, or give the channels names that differ by more than punctuation"
        )


def _check_fit(recordings: Sequence[Recording], faults: Faults, rate_hz: float) -> None:
    if faults.duration_s.low * rate_hz < 1:
        raise OdisarError(
            f"faults.duration_s.low={faults.duration_s.low:g} is shorter than one sample at "
            f"rate_hz={rate_hz:g}: raise it"
        )
    longest_s = max(faults.delays_s, default=0.0) if "delay" in faults.kinds else 0.0
    if longest_s > faults.start_s:
        raise OdisarError(
            f"faults.delays_s={longest_s:g} reaches back before the recording, because "
            f"faults.start_s={faults.start_s:g}: raise start_s or lower the delay"
        )
    short = [
        f"{item.name} ({item.time_s[-1] - item.time_s[0] + 1.0 / rate_hz:g} s)"
        for item in recordings
        if not len(_onsets(item, faults, rate_hz))
    ]
    if short:
        needed_s = faults.start_s + faults.duration_s.high
        raise OdisarError(
            f"faults need {needed_s:g} s (start_s + duration_s.high), the last "
            f"{faults.duration_s.high:g} free of gaps, which these recordings lack: "
            f"{', '.join(short)}. Lower start_s or duration_s, or lengthen the recordings "
            "(splits.block_s for blocks)"
        )


def _onsets(recording: Recording, faults: Faults, rate_hz: float) -> NDArray[np.int64]:
    """Return the samples at which a fault can begin and end before the segment does."""
    time_s = recording.time_s
    earliest_s = time_s[0] + faults.start_s - _ROUNDING_S
    onsets = [np.empty(0, dtype=np.int64)]
    for start, stop in recording.segments:
        latest_s = time_s[stop - 1] + 1.0 / rate_hz - faults.duration_s.high + _ROUNDING_S
        inside = time_s[start:stop]
        onsets.append(start + np.flatnonzero((inside >= earliest_s) & (inside <= latest_s)))
    return np.concatenate(onsets)


def _faulty_copy(
    recording: Recording,
    fault: _Fault,
    where: Faults,
    case: Case,
    channel_std: NDArray[np.float64],
    base_seed: int,
) -> Recording:
    name = f"{recording.name}-{fault.slug}"
    random = generator(base_seed, "faults", name)
    start_s = float(recording.time_s[random.choice(_onsets(recording, where, case.rate_hz))])
    interval = Interval(start_s, start_s + _duration_s(where, random), fault.kind)
    column = case.channel_names.index(fault.channel)
    inside = label_times(recording.time_s, [interval])
    values = recording.values.copy()
    std = float(channel_std[column])
    unit = std if where.sizes_in == "sd" else 1.0
    values[inside, column] = _faulty_values(fault, recording, inside, column, unit, random)
    deviation = np.abs(values[inside, column] - recording.values[inside, column]).max() / std
    return replace(
        recording,
        name=name,
        info=replace(
            recording.info,
            disturbance=fault.kind,
            components="all",
            strength=None,
            base_seed=recording.info.base_seed or recording.name,
            extra=_extra(
                recording.info.extra,
                fault,
                _size_unit(fault, where, case),
                shows=deviation >= where.shows_from_sd,
            ),
        ),
        values=values,
        intervals=(interval,),
    )


def _duration_s(faults: Faults, random: np.random.Generator) -> float:
    length = faults.duration_s
    return (
        length.low if length.low == length.high else float(random.uniform(length.low, length.high))
    )


def _size_unit(fault: _Fault, faults: Faults, case: Case) -> str:
    if fault.kind == "delay":
        return "s"
    unit = case.channels[case.channel_names.index(fault.channel)].unit
    if fault.kind == "creep":
        return f"{unit}/s"
    return "sd" if faults.sizes_in == "sd" else unit


def _extra(extra: Mapping[str, str], fault: _Fault, unit: str, *, shows: bool) -> dict[str, str]:
    size = "" if fault.amount is None else f"{fault.amount:g} {unit}"
    described = f"{fault.kind} {size}".strip()
    return {
        **extra,
        "fault": described,
        "fault_on": f"{described}, {fault.channel}",
        "fault_channel": fault.channel,
        "fault_size": size,
        "fault_shows": "shows" if shows else "hidden",
    }


def _faulty_values(
    fault: _Fault,
    recording: Recording,
    inside: NDArray[np.bool_],
    column: int,
    unit: float,
    random: np.random.Generator,
) -> NDArray[np.float64]:
    """Return what the sensor shows instead, at the samples ``inside`` (sample,) the interval.

    ``unit`` is what an amount of 1 means in the channel's unit.
    """
    truth = recording.values[:, column]
    time_s = recording.time_s
    size = 0.0 if fault.amount is None else fault.amount * unit
    if fault.kind == "creep":
        grown = (fault.amount or 0.0) * (time_s[inside] - time_s[inside][0])
        return np.asarray(truth[inside] + grown)
    samples = int(inside.sum())
    if fault.kind == "noise":
        return truth[inside] + random.normal(0.0, size, samples)
    if fault.kind == "bias":
        return truth[inside] + size
    if fault.kind == "drift":
        return truth[inside] + np.linspace(0.0, size, samples)
    if fault.kind == "stuck":
        return np.full(samples, truth[np.flatnonzero(inside)[0] - 1])
    # Across a gap a delayed sensor shows the last value before the gap.
    sources = (
        np.searchsorted(time_s, time_s[inside] - (fault.amount or 0.0) + _ROUNDING_S, "right") - 1
    )
    return truth[sources]

"""R/V Gunnerus' sea trial of 2022-10-27 as recordings (``gunnerus_trial`` reads the file)."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from odisar.config.sources import GunnerusConfig, Regime
from odisar.errors import OdisarError
from odisar.recordings.schema import UNDISTURBED, Interval, Recording, RecordingInfo
from odisar.recordings.writer import write_recordings
from odisar.sources.fetch import Say, fetch_pinned
from odisar.sources.gunnerus_trial import CHANNEL_NAMES, average, read_trial

CASE_NAME = "gunnerus"

_RPM = "Propeller Speed"


@dataclass(frozen=True)
class _Stretch:
    """A contiguous sample range ``start <= sample < stop`` in one regime, or outside all."""

    regime: Regime | None
    start: int
    stop: int

    @property
    def samples(self) -> int:
        return self.stop - self.start


def fetch_gunnerus(config: GunnerusConfig, root: Path, say: Say = print) -> Path:
    """Return the path of the published CSV (see ``fetch_pinned``)."""
    return fetch_pinned(config.file, root, say)


def make_gunnerus(config: GunnerusConfig, root: Path, folder: Path, say: Say = print) -> list[Path]:
    """Fetch the trial, convert it and write the recordings into ``folder``.

    The summary goes beside the folder (see ``summary_path``). Returns the files written.

    Raises
    ------
    OdisarError
        As ``fetch_gunnerus`` and ``convert_gunnerus``.
    """
    csv = fetch_gunnerus(config, root, say)
    recordings, summary = convert_gunnerus(csv, config, CASE_NAME)
    written = write_recordings(folder, recordings, CHANNEL_NAMES)
    path = summary_path(folder)
    summary.to_csv(path, index=False, float_format="%.2f", lineterminator="\n")
    say(describe_summary(summary))
    return [*written, path]


def summary_path(folder: Path) -> Path:
    """Return where the conversion summary of the recordings in ``folder`` is written."""
    # Not inside: a reader takes every CSV file there for a recording.
    return folder.with_name(f"{folder.name}-conversion-summary.csv")


def convert_gunnerus(
    csv: Path, config: GunnerusConfig, case_name: str
) -> tuple[list[Recording], pd.DataFrame]:
    """Convert the published CSV to recordings, and account for every second of it.

    Groups of ``average_samples`` samples are averaged: the file was interpolated to 2 Hz, and a
    third to three quarters of its samples lie on straight lines between their neighbours. Roll
    rate [deg/s] is the backward difference of the averaged roll, so that no sample knows a later
    one. Regimes are found on propeller speed alone, by its centred mean over ``regime_window_s``.

    Parameters
    ----------
    csv
        The file as published.
    config
        Its conversion.
    case_name
        The case that the recordings say they belong to.

    Returns
    -------
    recordings
        Values (sample, channel) in the order of ``CHANNEL_NAMES``; each begins at 0 s and says
        in ``trial_start_s`` where in the trial it began. Stretches of a reference regime whole
        (split ``cross-fit``); those of a novel regime cut into equal pieces of about ``piece_s``
        (split ``test``), each labelled novel throughout.
    summary
        One row for every stretch of the trial in order, written or not: ``start_s``, ``end_s``,
        ``seconds``, ``regime``, ``mean_rpm``, ``azimuth_sd_deg``, ``recordings`` (how many) and
        ``outcome``. The seconds add up to the trial's.

    Raises
    ------
    OdisarError
        A column is missing, a value is not a number, steps are not ``1 / raw_rate_hz``, or no
        stretch of the reference regime is long enough.
    """
    raw = read_trial(csv, config)
    table = average(raw, config)
    stretches = list(_stretches(table[_RPM].to_numpy(), config))
    recordings: list[Recording] = []
    rows = [_unused_row(0.0, 1 / config.rate_hz, "left out: no earlier sample for the roll rate")]
    counts: dict[str, int] = {}
    for stretch in stretches:
        made: list[Recording] = []
        if stretch.regime and stretch.samples >= config.minimum_s * config.rate_hz:
            name = stretch.regime.name
            counts[name] = counts.get(name, 0) + 1
            made = list(_recordings(table, stretch, counts[name], config, case_name))
        recordings += made
        rows.append(_summary_row(table, stretch, len(made), config))
    if spare := len(raw) % config.average_samples:
        first_s = (len(raw) - spare) / config.raw_rate_hz
        end_s = len(raw) / config.raw_rate_hz
        rows.append(_unused_row(first_s, end_s, "left out: too few samples to average"))
    if not any(recording.info.split == "cross-fit" for recording in recordings):
        raise OdisarError(
            f"{csv}: no stretch of a reference regime lasts minimum_s={config.minimum_s}; lower "
            "sources.gunnerus.minimum_s or widen the regime's min_rpm and max_rpm"
        )
    return recordings, pd.DataFrame(rows)


def describe_summary(summary: pd.DataFrame) -> str:
    """Return the conversion summary as text: seconds a regime, then every stretch left out."""
    lines = [f"conversion: {summary['seconds'].sum():.1f} s in {len(summary)} stretches"]
    used = summary[summary["recordings"] > 0]
    for regime, group in used.groupby("regime", sort=True):
        lengths = ", ".join(f"{seconds:.0f}" for seconds in group["seconds"])
        lines.append(
            f"  {regime}: {group['seconds'].sum():.0f} s as {group['recordings'].sum()} "
            f"recording(s) from stretches of {lengths} s"
        )
    for outcome, group in summary[summary["recordings"] == 0].groupby("outcome", sort=True):
        lines.append(f"  {outcome}: {len(group)} stretch(es), {group['seconds'].sum():.1f} s")
    return "\n".join(lines)


def _stretches(rpm: NDArray[np.float64], config: GunnerusConfig) -> Iterator[_Stretch]:
    """Yield the contiguous stretches of ``rpm`` (sample,) in order; together they are all of it."""
    # An odd number of samples, so that the mean is centred on one.
    window = 2 * int(config.regime_window_s * config.rate_hz / 2) + 1
    smooth = pd.Series(rpm).rolling(window, center=True, min_periods=1).mean().to_numpy()
    member = np.full(len(rpm), -1)
    for position, regime in enumerate(config.regimes):
        member[(smooth >= regime.min_rpm) & (smooth <= regime.max_rpm)] = position
    borders = [0, *(np.flatnonzero(np.diff(member)) + 1).tolist(), len(rpm)]
    for start, stop in pairwise(borders):
        if start < stop:
            position = int(member[start])
            yield _Stretch(config.regimes[position] if position >= 0 else None, start, stop)


def _recordings(
    table: pd.DataFrame, stretch: _Stretch, number: int, config: GunnerusConfig, case_name: str
) -> Iterator[Recording]:
    """Yield the recordings of the ``number``-th stretch of its regime that is kept."""
    regime = stretch.regime
    if regime is None:
        return
    novel = regime.use == "novel"
    pieces = max(1, round(stretch.samples / (config.piece_s * config.rate_hz))) if novel else 1
    borders = np.linspace(stretch.start, stretch.stop, pieces + 1).round().astype(int).tolist()
    for piece, (start, stop) in enumerate(pairwise(borders), start=1):
        name = f"{regime.name}-stretch-{number}" + (f"-piece-{piece}" if novel else "")
        yield Recording(
            name=name,
            info=RecordingInfo(
                case=case_name,
                maneuver="sea-trial",
                variant=regime.name,
                disturbance="novel" if novel else UNDISTURBED,
                components="all" if novel else UNDISTURBED,
                base_seed=name,
                split="test" if novel else "cross-fit",
                extra={"trial_start_s": f"{_trial_s(start, config):g}"},
            ),
            time_s=np.arange(stop - start) / config.rate_hz,
            values=table.to_numpy()[start:stop],
            intervals=(Interval(0.0, (stop - start) / config.rate_hz, "novel"),) if novel else (),
        )


def _trial_s(sample: int, config: GunnerusConfig) -> float:
    """Return where in the trial a row of the averaged table begins, in seconds."""
    # Row 0 is the second averaged sample: the first has no roll rate.
    return (sample + 1) / config.rate_hz


def _summary_row(
    table: pd.DataFrame, stretch: _Stretch, recordings: int, config: GunnerusConfig
) -> dict[str, object]:
    part = table.iloc[stretch.start : stretch.stop]
    if recordings:
        outcome = "written"
    elif stretch.regime is None:
        outcome = "left out: outside every regime"
    else:
        outcome = f"left out: shorter than minimum_s={config.minimum_s:g}"
    return {
        "start_s": _trial_s(stretch.start, config),
        "end_s": _trial_s(stretch.stop, config),
        "seconds": stretch.samples / config.rate_hz,
        "regime": stretch.regime.name if stretch.regime else "none",
        "mean_rpm": float(part[_RPM].mean()),
        "azimuth_sd_deg": float(part["Azimuth Angle"].std(ddof=0)),
        "recordings": recordings,
        "outcome": outcome,
    }


def _unused_row(start_s: float, end_s: float, outcome: str) -> dict[str, object]:
    return {
        "start_s": start_s,
        "end_s": end_s,
        "seconds": end_s - start_s,
        "regime": "none",
        "mean_rpm": float("nan"),
        "azimuth_sd_deg": float("nan"),
        "recordings": 0,
        "outcome": outcome,
    }

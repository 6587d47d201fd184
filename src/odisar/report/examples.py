"""Examples for the figures: two recordings of each case, and forecasts of each twin on one."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import torch
from numpy.typing import NDArray

from odisar.artifacts import write_json
from odisar.capability.scoring import Scorer
from odisar.config.cases import Case
from odisar.evaluation.cells import OVERALL, describe, disturbed_cells, metadata_columns
from odisar.evaluation.labels import merge_events
from odisar.recordings.schema import Recording
from odisar.twin.bundle import TrainedTwin
from odisar.twin.mc_dropout import draw_forecasts
from odisar.windows.targets import recorded_states
from odisar.windows.window_set import model_inputs, scaled_features

#: Quantiles of the Monte Carlo draws between which the band of a forecast lies.
BAND = (0.05, 0.95)

FORECAST_COLUMNS = (
    "setup",
    "recording",
    "issued_s",
    "time_s",
    "state",
    "forecast",
    "reconstruction",
    "low",
    "high",
    "truth",
)

_BATCH = 64
_DETAILS = (
    "case",
    "maneuver",
    "variant",
    "disturbance",
    "components",
    "base_seed",
    "fault_channel",
    "fault_size",
)


@dataclass(frozen=True)
class Tested:
    """A test recording, and the set-up and member that judged it."""

    setup: str
    member: str
    recording: Recording


def recordings_table(tested: Sequence[Tested], cases: Mapping[str, Case]) -> pd.DataFrame:
    """Return one row for each test recording of each set-up, ``events`` as JSON text."""
    rows = []
    for one in tested:
        info = one.recording.info
        groups = cases[one.setup].groups
        rows.append(
            {
                "setup": one.setup,
                "member": one.member,
                "recording": one.recording.name,
                "strength": info.strength,
                **{name: info.column(name) for name in _DETAILS},
                **{n: info.column(n) for n in metadata_columns(groups) if n != "strength"},
                "is_disturbed": info.is_disturbed,
                "is_overall": _is_overall(one.recording, cases[one.setup]),
                "events": json.dumps(_events(one.recording)),
            }
        )
    return pd.DataFrame(rows).fillna({"strength": np.nan})


def choose_examples(
    tested: Sequence[Tested], case: Case, wanted: str
) -> tuple[Recording, Recording | None]:
    """Return a disturbed recording and an undisturbed one that is like it, if there is one.

    The disturbed one is ``wanted`` if it was tested, else the strongest of those that count
    overall; the first by name among equals.
    """
    recordings = sorted({one.recording.name: one.recording for one in tested}.items())
    disturbed = [item for _, item in recordings if item.info.is_disturbed]
    clean = [item for _, item in recordings if not item.info.is_disturbed]
    counted = [item for item in disturbed if _is_overall(item, case)] or disturbed
    if not counted:
        counted = clean
    by_name = {item.name: item for item in disturbed}
    chosen = by_name.get(wanted) or max(counted, key=_force)
    clean = [item for item in clean if item is not chosen]
    return chosen, max(clean, key=lambda item: _likeness(item, chosen), default=None)


def traces_table(case: str, recordings: Sequence[Recording], names: Sequence[str]) -> pd.DataFrame:
    """Return every channel of some recordings as a long table, in physical units."""
    parts = [
        pd.DataFrame(item.values, columns=list(names))
        .assign(time_s=item.time_s, recording=item.name, case=case)
        .melt(["case", "recording", "time_s"], var_name="channel", value_name="value")
        for item in recordings
    ]
    return pd.concat(parts, ignore_index=True)


def forecasts_table(setup: str, twin: TrainedTwin, recording: Recording) -> pd.DataFrame:
    """Return forecasts before, early in and in the middle of the first event, physical units.

    Columns are ``FORECAST_COLUMNS``: ``low`` and ``high`` are quantiles (``BAND``) of the Monte
    Carlo draws, ``reconstruction`` what the twin's head makes of its own forecast.
    """
    positions = _issue_positions(twin, recording)
    output = Scorer(twin, _BATCH, "cpu").forecast(recording, positions)
    samples = scaled_features([recording], twin.scaler, twin.spec)
    inputs = model_inputs(samples, positions, twin.spec, len(twin.channel_names))
    drawn = draw_forecasts(twin.network, twin.masks, *inputs).forecast
    low, high = np.quantile(_physical(drawn, twin, recording, positions), BAND, axis=0)
    steps = np.arange(1, twin.spec.horizon_steps + 1)
    at = positions[:, None] + steps
    outputs = list(twin.spec.outputs)
    columns = {
        "forecast": _physical(output.forecast, twin, recording, positions),
        "reconstruction": _physical(output.reconstruction, twin, recording, positions),
        "low": low,
        "high": high,
        "truth": recording.values[at][..., outputs],
    }
    shape = columns["truth"].shape
    issued = np.broadcast_to(recording.time_s[positions][:, None, None], shape)
    times = np.broadcast_to(recording.time_s[at][..., None], shape)
    states = np.broadcast_to(np.array(twin.output_names), shape)
    table = pd.DataFrame(
        {
            "setup": setup,
            "recording": recording.name,
            "issued_s": issued.ravel(),
            "time_s": times.ravel(),
            "state": states.ravel(),
            **{name: values.ravel() for name, values in columns.items()},
        }
    )
    return table[list(FORECAST_COLUMNS)]


def describe_example(recording: Recording, case: Case) -> dict[str, Any]:
    """Return what the figures say about an example."""
    info = recording.info
    return {
        "recording": recording.name,
        "events": _events(recording),
        "units": {channel.name: channel.unit for channel in case.channels},
        "disturbance": info.disturbance,
        "strength": info.strength,
        "fault_channel": info.column("fault_channel"),
    }


def write_examples(
    folder: Path,
    chosen: Mapping[str, Any],
    recordings: pd.DataFrame,
    traces: pd.DataFrame,
    forecasts: pd.DataFrame,
) -> None:
    """Write the examples into a folder."""
    write_json(folder / "chosen.json", chosen)
    recordings.to_csv(folder / "recordings.csv", index=False, lineterminator="\n")
    traces.to_parquet(folder / "traces.parquet", index=False)
    forecasts.to_parquet(folder / "forecasts.parquet", index=False)


def _events(recording: Recording) -> list[list[float]]:
    return [[event.onset_s, event.end_s] for event in merge_events(recording.intervals)]


def _is_overall(recording: Recording, case: Case) -> bool:
    """Whether a recording counts in the overall rows of the result tables."""
    cells = disturbed_cells([describe(recording.info, case.groups)], case.groups)
    return any(cell.evaluated_on == OVERALL for cell in cells)


def _force(recording: Recording) -> tuple[float, float]:
    """Order disturbed recordings by strength, and by the size of a fault where it has one."""
    size, _, unit = recording.info.column("fault_size").partition(" ")
    return recording.info.strength or 0.0, float(size) if unit and unit != "s" else 0.0


def _likeness(clean: Recording, disturbed: Recording) -> int:
    names = ("base_seed", "maneuver", "variant")
    return sum(getattr(clean.info, name) == getattr(disturbed.info, name) for name in names)


def _issue_positions(twin: TrainedTwin, recording: Recording) -> NDArray[np.int64]:
    """Return up to three positions with a full context behind and a full horizon ahead."""
    horizon = twin.spec.horizon_steps
    possible = np.concatenate(
        [twin.spec.issue_positions(segment, 1) for segment in recording.segments]
    )
    events = _events(recording)
    onset_s, end_s = events[0] if events else (recording.time_s[-1] / 2,) * 2
    times = recording.time_s
    step_s = float(np.median(np.diff(times)))
    wanted = (
        onset_s - (horizon + 1) * step_s,
        onset_s + horizon * step_s / 2,
        (onset_s + end_s) / 2,
    )
    nearest = [possible[np.argmin(np.abs(times[possible] - time))] for time in wanted]
    return np.unique(np.array(nearest, dtype=np.int64))


def _physical(
    scaled: torch.Tensor, twin: TrainedTwin, recording: Recording, positions: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Return (..., window, step, state) in physical units and the recording's coordinates."""
    targets = twin.scaler.unscale_targets(scaled.numpy())
    return recorded_states(targets, recording, positions, twin.spec)

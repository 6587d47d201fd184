"""Tables of forecast accuracy: every forecaster on the same undisturbed windows, with intervals.

Errors are squared and summed for each recording; everything else, the intervals too, comes from
these sums (see ``evaluation.intervals``).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
import torch
from numpy.typing import ArrayLike, NDArray

from odisar.config.judging import EvaluationConfig
from odisar.errors import OdisarError
from odisar.evaluation.intervals import Resampler
from odisar.recordings.schema import Recording
from odisar.seeding import generator
from odisar.windows.scaling import Scaler
from odisar.windows.window_set import WindowSet
from odisar.windows.windowing import WindowSpec

#: (window, context step, feature) and (window, horizon step, command) to (window, step, state).
Forecast = Callable[[torch.Tensor, torch.Tensor], ArrayLike]

#: The forecaster that skill is counted from; the row over all states, and that over all steps.
PERSISTENCE, ALL_STATES, ALL_STEPS = "persistence", "all", 0

#: Columns of the table and their types, which a table without a row has as well.
FORECAST_COLUMNS = {
    **dict.fromkeys(("setup", "forecaster", "commands", "state"), "str"),
    "step": "int64",
    **dict.fromkeys(("rmse", "ci_low", "ci_high", "rmse_physical", "skill"), "float64"),
    **dict.fromkeys(("recordings", "windows"), "int64"),
}
#: Windows that are judged start every quarter of a horizon; a table has so many of its steps.
_STARTS_PER_HORIZON, _STEPS_SHOWN = 4, 12
#: Windows forecast at a time; a matter of memory, not of results.
_BATCH = 256

Row = dict[str, object]
FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class ForecastErrors:
    """What every forecaster erred by, summed over the windows of each recording.

    Attributes
    ----------
    squares
        By forecaster, (recording, step, state) sums of squared errors, scaled.
    windows
        (recording,) how many windows were summed; none of them zero.
    clusters
        (recording,) recordings that vary together share one.
    target_std
        (recording, state) what one scaled unit is in physical ones: folds have scales of their own.
    commands
        ``known-ahead`` where the commands of the horizon were given, else ``unknown``.
    """

    squares: Mapping[str, FloatArray]
    windows: FloatArray
    clusters: tuple[str, ...]
    target_std: FloatArray
    commands: str

    @classmethod
    def joined(cls, parts: Sequence["ForecastErrors"]) -> "ForecastErrors":
        """Return the errors of the same forecasters on all recordings of some folds."""
        return cls(
            squares={
                name: np.concatenate([part.squares[name] for part in parts])
                for name in parts[0].squares
            },
            windows=np.concatenate([part.windows for part in parts]),
            clusters=tuple(cluster for part in parts for cluster in part.clusters),
            target_std=np.concatenate([part.target_std for part in parts]),
            commands=parts[0].commands,
        )


def forecast_errors(
    recordings: Sequence[Recording],
    scaler: Scaler,
    spec: WindowSpec,
    forecasters: Mapping[str, Forecast],
) -> ForecastErrors:
    """Forecast windows of undisturbed recordings, a quarter of a horizon apart; sum the errors.

    Raises OdisarError where a recording is disturbed (no forecaster was promised to know that),
    where none holds a window, or where a forecaster answers with an array of another shape.
    """
    for recording in recordings:
        if recording.info.is_disturbed:
            raise OdisarError(
                f"recording {recording.name!r} is disturbed ({recording.info.disturbance}); "
                "forecast accuracy is that of undisturbed recordings: leave it out"
            )
    ordered = sorted(recordings, key=lambda item: item.name)
    stride_steps = max(1, spec.horizon_steps // _STARTS_PER_HORIZON)
    windows = [WindowSet([item], scaler, spec, stride_steps=stride_steps) for item in ordered]
    used = [i for i, item in enumerate(windows) if len(item)]
    if not used:
        raise OdisarError(
            f"none of {len(ordered)} recordings holds a window of {spec.context_steps} + "
            f"{spec.horizon_steps} steps; forecasts need longer recordings to be judged on"
        )
    sums = [_recording_squares(windows[i], forecasters) for i in used]
    return ForecastErrors(
        squares={name: np.stack([item[name] for item in sums]) for name in forecasters},
        windows=np.array([len(windows[i]) for i in used], dtype=np.float64),
        clusters=tuple(ordered[i].info.base_seed or ordered[i].name for i in used),
        target_std=np.tile(scaler.target_std, (len(used), 1)),
        commands="known-ahead" if spec.known_ahead else "unknown",
    )


def forecast_table(
    setup: str,
    errors: ForecastErrors,
    states: Sequence[str],
    cfg: EvaluationConfig,
    base_seed: int,
) -> pd.DataFrame:
    """Return the tidy table of accuracy, ``FORECAST_COLUMNS``, by forecaster, state and step.

    Steps are the first, the last and some between, evenly spaced.
    ``rmse`` and its interval are scaled, ``rmse_physical`` in the state's unit. State ``all``
    pools the scaled states (it has no unit), step 0 all steps. ``skill`` is 1 - MSE / MSE of
    persistence; empty where persistence isn't among the forecasters.
    """
    resampler = _resampler(setup, errors, cfg, base_seed)
    reference = errors.squares.get(PERSISTENCE)
    rows: list[Row] = []
    for name, squares in errors.squares.items():
        for cell in _cells(states, squares.shape):
            pooled = cell.pooled(squares)
            windows = errors.windows.sum()
            drawn = resampler.totals(pooled) / _drawn_windows(resampler, errors)
            low, high = resampler.interval(np.sqrt(drawn))
            held = np.nan if reference is None else cell.pooled(reference).sum()
            rows.append(
                {
                    "setup": setup,
                    "forecaster": name,
                    "commands": errors.commands,
                    "state": cell.state,
                    "step": cell.step,
                    "rmse": np.sqrt(pooled.sum() / windows),
                    "ci_low": low,
                    "ci_high": high,
                    "rmse_physical": np.sqrt(cell.physical(squares, errors.target_std) / windows),
                    "skill": 1.0 - pooled.sum() / held if held > 0 else np.nan,
                    "recordings": len(errors.windows),
                    "windows": int(windows),
                }
            )
    return _typed(rows)


def no_forecasts() -> pd.DataFrame:
    """Return the table of a set-up of which nothing could be judged."""
    return _typed([])


def _typed(rows: list[Row]) -> pd.DataFrame:
    return pd.DataFrame(rows, columns=list(FORECAST_COLUMNS)).astype(FORECAST_COLUMNS)


@dataclass(frozen=True)
class _Cell:
    """The states and steps that one row pools."""

    state: str
    step: int
    states: slice
    steps: slice

    def pooled(self, squares: FloatArray) -> FloatArray:
        """Return (recording,) sums over windows of the mean over the cell's steps and states."""
        return np.asarray(squares[:, self.steps, self.states].mean(axis=(1, 2)))

    def physical(self, squares: FloatArray, target_std: FloatArray) -> float:
        """Return the sum over windows in the state's unit; NaN where states are pooled."""
        if self.state == ALL_STATES:
            return float("nan")
        return float(self.pooled(squares * target_std[:, None] ** 2).sum())


def _cells(states: Sequence[str], shape: tuple[int, ...]) -> list[_Cell]:
    _, horizon_steps, count = shape
    if len(states) != count:
        raise OdisarError(f"forecasts have {count} states; asked for were {list(states)}")
    steps = sorted({1, *np.linspace(1, horizon_steps, _STEPS_SHOWN).round().astype(int).tolist()})
    chosen_states = [(ALL_STATES, slice(None))]
    chosen_states += [(name, slice(i, i + 1)) for i, name in enumerate(states)]
    chosen_steps = [(ALL_STEPS, slice(None)), *((step, slice(step - 1, step)) for step in steps)]
    return [
        _Cell(state, step, at_states, at_steps)
        for state, at_states in chosen_states
        for step, at_steps in chosen_steps
    ]


def _recording_squares(
    windows: WindowSet, forecasters: Mapping[str, Forecast]
) -> dict[str, FloatArray]:
    """Return, by forecaster, (step, state) sums of squared errors over all windows."""
    shape = (windows.spec.horizon_steps, len(windows.spec.outputs))
    sums = {name: np.zeros(shape) for name in forecasters}
    for start in range(0, len(windows), _BATCH):
        batch = windows.gather(torch.arange(start, min(start + _BATCH, len(windows))))
        truth = batch.truth.double().numpy()
        for name, forecast in forecasters.items():
            with torch.no_grad():
                found = np.asarray(forecast(batch.context, batch.known_future), dtype=np.float64)
            if found.shape != truth.shape:
                raise OdisarError(
                    f"forecaster {name!r} answers {found.shape} where windows, steps and states "
                    f"are {truth.shape}"
                )
            sums[name] += np.sum((found - truth) ** 2, axis=0)
    return sums


def _resampler(
    setup: str, errors: ForecastErrors, cfg: EvaluationConfig, base_seed: int
) -> Resampler:
    # Named without forecaster and commands: all are compared on the same draws.
    rng = generator(base_seed, "forecasts", setup)
    return Resampler.draw(errors.clusters, cfg.bootstrap_draws, cfg.confidence, rng)


def _drawn_windows(resampler: Resampler, errors: ForecastErrors) -> FloatArray:
    return resampler.totals(errors.windows)

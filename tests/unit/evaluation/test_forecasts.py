from dataclasses import replace

import numpy as np
import pytest
import torch

from odisar.errors import OdisarError
from odisar.evaluation.forecasts import (
    ALL_STATES,
    FORECAST_COLUMNS,
    ForecastErrors,
    forecast_errors,
    forecast_table,
)
from odisar.windows.scaling import Scaler
from odisar.windows.window_set import WindowSet
from small_system import SPEC, make_recording

from .evaluation_cases import CONFIG

STATES = ("Speed", "Turn Rate")
RECORDINGS = [make_recording(f"test-{i}", 60 + 20 * i) for i in range(5)]
SCALER = Scaler.fit(RECORDINGS, SPEC)


def last_value(context, _known):
    return context[:, -1:, 1:].expand(-1, SPEC.horizon_steps, -1)


def zero(context, _known):
    return np.zeros((len(context), SPEC.horizon_steps, 2))


FORECASTERS = {"persistence": last_value, "zero": zero}


def errors_of(recordings=RECORDINGS, forecasters=None, spec=SPEC, scaler=SCALER):
    return forecast_errors(recordings, scaler, spec, forecasters or FORECASTERS)


def table_of(errors):
    return forecast_table("system", errors, STATES, CONFIG, 1)


def cell(table, forecaster, state, step):
    found = table[(table.forecaster == forecaster) & (table.state == state) & (table.step == step)]
    assert len(found) == 1
    return found.iloc[0]


def test_errors_are_those_of_all_windows_pooled():
    table = table_of(errors_of())
    windows = WindowSet(RECORDINGS, SCALER, SPEC, stride_steps=2)
    batch = windows.gather(torch.arange(len(windows)))
    missed = (last_value(batch.context, None) - batch.truth).double().numpy()
    assert list(table.columns) == list(FORECAST_COLUMNS)
    assert len(table) == 2 * 3 * (1 + SPEC.horizon_steps)
    row = cell(table, "persistence", "Turn Rate", 10)
    expected = np.sqrt(np.mean(missed[:, 9, 1] ** 2))
    assert row.rmse == pytest.approx(expected, rel=1e-6)
    assert row.rmse_physical == pytest.approx(expected * SCALER.target_std[1], rel=1e-6)
    assert row.ci_low < row.rmse < row.ci_high
    assert (row.recordings, row.windows) == (5, len(windows))
    everything = cell(table, "persistence", ALL_STATES, 0)
    assert everything.rmse == pytest.approx(np.sqrt(np.mean(missed**2)), rel=1e-6)
    assert np.isnan(everything.rmse_physical)


def test_skill_is_counted_from_persistence():
    table = table_of(errors_of())
    held = cell(table, "persistence", ALL_STATES, 0)
    other = cell(table, "zero", ALL_STATES, 0)
    assert held.skill == 0
    assert other.skill == pytest.approx(1 - other.rmse**2 / held.rmse**2)
    alone = table_of(errors_of(forecasters={"zero": zero}))
    assert alone.skill.isna().all()


def test_of_a_long_horizon_first_last_and_some_steps_between_are_shown():
    spec = replace(SPEC, horizon_steps=25)
    table = table_of(
        errors_of(forecasters={"zero": lambda c, _: np.zeros((len(c), 25, 2))}, spec=spec)
    )
    steps = table.step.unique()
    assert len(steps) == 13
    assert {0, 1, 25} <= set(steps)
    windows = [len(WindowSet([item], SCALER, spec, stride_steps=6)) for item in RECORDINGS]
    assert set(table.windows) == {sum(windows)}


def test_folds_are_pooled_each_in_its_own_scale():
    wide = replace(SCALER, target_std=2 * SCALER.target_std)
    parts = [errors_of(RECORDINGS[:2]), errors_of(RECORDINGS[2:], scaler=wide)]
    table, whole = table_of(ForecastErrors.joined(parts)), table_of(errors_of())
    row, same = (cell(one, "persistence", "Speed", 10) for one in (table, whole))
    # "zero" forecasts the mean, which the wider scale doesn't move: physically nothing changes.
    physical = [cell(one, "zero", "Speed", 10).rmse_physical for one in (table, whole)]
    assert physical[0] == pytest.approx(physical[1], rel=1e-6)
    assert (row.recordings, row.windows) == (same.recordings, same.windows)
    assert row.rmse != pytest.approx(same.rmse, rel=1e-3)


def test_order_of_recordings_and_batches_has_no_influence():
    forth, back = table_of(errors_of()), table_of(errors_of(RECORDINGS[::-1]))
    for column in FORECAST_COLUMNS:
        assert forth[column].equals(back[column])


def test_recordings_that_vary_together_are_resampled_together():
    info = replace(RECORDINGS[0].info, base_seed="same")
    together = [replace(item, info=info) for item in RECORDINGS]
    table = table_of(errors_of(together))
    assert table.ci_low.isna().all()
    assert table.rmse.notna().all()


def test_known_commands_are_given_where_the_spec_declares_them():
    def command(_context, known):
        assert known.shape[1:] == (SPEC.horizon_steps, 1)
        return known.expand(-1, -1, 2)

    spec = replace(SPEC, known_ahead=(0,))
    table = table_of(errors_of(forecasters={"command": command}, spec=spec))
    assert set(table.commands) == {"known-ahead"}
    assert set(table_of(errors_of()).commands) == {"unknown"}


def test_recordings_too_short_for_a_window_are_not_counted():
    short = make_recording("short", 20)
    assert len(errors_of([*RECORDINGS, short]).windows) == 5
    with pytest.raises(OdisarError, match=r"none of 1 recordings holds a window of 20 \+ 10"):
        errors_of([short])


def test_a_disturbed_recording_is_refused():
    with pytest.raises(OdisarError, match=r"'pushed' is disturbed \(push\)"):
        errors_of([*RECORDINGS, make_recording("pushed", 100, push=0.2)])


def test_an_answer_of_another_shape_is_refused():
    with pytest.raises(OdisarError, match="'broken' answers"):
        errors_of(forecasters={"broken": lambda context, _: context[:, :1, 1:]})


def test_states_that_are_not_forecast_are_refused():
    with pytest.raises(OdisarError, match="2 states"):
        forecast_table("system", errors_of(), ("Speed",), CONFIG, 1)

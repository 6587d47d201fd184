from dataclasses import replace

import numpy as np
import pytest
import torch

from odisar.errors import OdisarError
from odisar.evaluation.forecasts import (
    ALL_STATES,
    FORECAST_COLUMNS,
    FORECAST_PAIR_COLUMNS,
    forecast_errors,
    forecast_pairs,
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


def errors_of(recordings=RECORDINGS, forecasters=None, stride=1, spec=SPEC):
    return forecast_errors(recordings, SCALER, spec, forecasters or FORECASTERS, stride)


def table_of(errors, steps=(1, 10)):
    return forecast_table("system", errors, STATES, steps, CONFIG, 1)


def cell(table, forecaster, state, step):
    found = table[(table.forecaster == forecaster) & (table.state == state) & (table.step == step)]
    assert len(found) == 1
    return found.iloc[0]


def test_errors_are_those_of_all_windows_pooled():
    table = table_of(errors_of())
    windows = WindowSet(RECORDINGS, SCALER, SPEC)
    batch = windows.gather(torch.arange(len(windows)))
    missed = (last_value(batch.context, None) - batch.truth).double().numpy()
    assert list(table.columns) == list(FORECAST_COLUMNS)
    assert len(table) == 2 * 3 * 3
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


def test_a_stride_takes_fewer_windows_of_every_recording():
    every, third = errors_of(), errors_of(stride=3)
    np.testing.assert_array_equal(third.windows, np.ceil(every.windows / 3))


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


def test_steps_and_states_that_are_not_forecast_are_refused():
    with pytest.raises(OdisarError, match="steps 1 to 10"):
        table_of(errors_of(), steps=(11,))
    with pytest.raises(OdisarError, match="2 states"):
        forecast_table("system", errors_of(), ("Speed",), (1,), CONFIG, 1)


def test_a_pair_is_compared_on_the_same_draws():
    def worse(context, known):
        truth = last_value(context, known)
        return truth + 1e-3

    errors = errors_of(forecasters={"persistence": last_value, "double": zero, "worse": worse})
    pairs = forecast_pairs("system", errors, CONFIG, 1)
    assert list(pairs.columns) == list(FORECAST_PAIR_COLUMNS)
    assert len(pairs) == 3
    row = pairs[pairs.against == "worse"].iloc[0]
    table = table_of(errors)
    ratio = (
        cell(table, "persistence", ALL_STATES, 0).rmse / cell(table, "worse", ALL_STATES, 0).rmse
    ) ** 2
    assert row.mse_ratio == pytest.approx(ratio)
    # Each alone varies by far more than their ratio does.
    alone = cell(table, "worse", ALL_STATES, 0)
    assert row.ci_high - row.ci_low < 0.05 * (alone.ci_high - alone.ci_low) / alone.rmse

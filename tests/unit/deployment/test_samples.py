"""Tables of samples: what is wrong with one is said by column, row and value."""

import decimal

import numpy as np
import pandas as pd
import pytest

from odisar.deployment import samples
from odisar.deployment.samples import recordings_from_table
from odisar.errors import OdisarError
from small_bundle import MAX_ROWS, small_case, table_of
from small_system import make_recording


@pytest.fixture
def table():
    return table_of(make_recording("a", 80))


def read(table, **changes):
    return recordings_from_table(table, "system", small_case(**changes), MAX_ROWS)


def refusal(table, **changes):
    with pytest.raises(OdisarError) as caught:
        read(table, **changes)
    return str(caught.value)


def with_cell(table, column, row, value):
    changed = table.astype({column: object})
    changed.loc[row, column] = value
    return changed


@pytest.mark.parametrize("given", [None, [[1.0]], {"time_s": [1.0]}, np.zeros((3, 4)), "time_s"])
def test_what_is_no_table_is_refused(given):
    assert "must be a table" in refusal(given)


def test_a_missing_column_is_named(table):
    said = refusal(table.drop(columns="Speed"))
    assert said.startswith("the table lacks the column 'Speed'; send 'time_s', 'Command'")


def test_an_unknown_column_is_refused_and_not_ignored(table):
    assert "unknown column 'Wind'" in refusal(table.assign(Wind=1.0))


def test_a_misspelt_channel_is_shown_with_its_right_name(table):
    said = refusal(table.rename(columns={"Turn Rate": "turn rate"}))
    assert "rename 'turn rate' to 'Turn Rate'" in said


def test_a_repeated_column_is_refused(table):
    twice = pd.concat([table, table[["Speed"]]], axis=1)
    assert "the column 'Speed' more than once" in refusal(twice)


def test_columns_without_names_are_refused(table):
    assert "unknown column '0'" in refusal(table.set_axis(range(4), axis="columns"))


def test_a_table_of_thousands_of_columns_is_refused_without_comparing_them(monkeypatch):
    monkeypatch.setattr(samples, "closest", lambda *_: pytest.fail("compared"))
    wide = pd.DataFrame(np.ones((1, 20_000)), columns=[f"c{i}" for i in range(20_000)])
    assert "20000 columns, far more than the 4 of the case" in refusal(wide)


def test_a_column_name_too_long_to_be_a_misspelling_is_not_compared(table, monkeypatch):
    compared = []
    monkeypatch.setattr(samples, "closest", lambda _, names: compared.extend(names))
    said = refusal(table.rename(columns={"Speed": "x" * 1_000_000, "Command": "command"}))
    assert set(compared) == {"command"}
    assert len(said) < 1000


def test_a_long_name_of_a_recording_is_shortened(table):
    table.loc[3, "Speed"] = 50.0
    said = refusal(table.assign(recording="r" * 1_000_000))
    assert "recording 'rrr" in said
    assert len(said) < 1000


def test_an_empty_table_is_refused(table):
    assert "no rows" in refusal(table.iloc[:0])
    assert "lacks the column" in refusal(pd.DataFrame())


def test_too_many_rows_are_refused():
    many = table_of(make_recording("long", MAX_ROWS + 1))
    assert f"{MAX_ROWS + 1} rows, more than the {MAX_ROWS}" in refusal(many)


@pytest.mark.parametrize(
    ("value", "problem"),
    [
        (np.nan, "the value is missing (nan)"),
        (None, "the value is missing (nan)"),
        (np.inf, "the value is infinite (inf)"),
        (-np.inf, "the value is infinite (-inf)"),
        ("fast", "the value is no number (fast)"),
        ("1.5", "the value is no number (1.5)"),
        (True, "the value is no number (True)"),
        ([1.0], "the value is no number ([1.0])"),
        (decimal.Decimal("1.5"), "the value is no number (1.5)"),
        (1 + 2j, "the value is no number ((1+2j))"),
        (10**400, "the value is infinite (inf)"),
        (99.0, "the value is outside -20 to 20 m/s (99)"),
    ],
)
def test_a_wrong_cell_is_named_by_column_row_and_value(table, value, problem):
    changed = table.astype({"Speed": object})
    changed.at[17, "Speed"] = value  # noqa: PD008 (a list is a value here)
    assert f"column 'Speed', row 17: {problem}; " in refusal(changed)


@pytest.mark.parametrize("kind", ["bool", "complex", "datetime64[ns]", "str"])
def test_a_column_of_another_kind_is_refused(table, kind):
    changed = table.assign(Speed=table["Speed"].round().astype(int).astype(kind))
    assert "column 'Speed', row 0: the value is no number" in refusal(changed)


@pytest.mark.parametrize("kind", ["float32", "Float64", "double[pyarrow]", "object", "category"])
def test_any_kind_of_number_is_taken(table, kind):
    (recording,) = read(table.astype(kind))
    np.testing.assert_allclose(recording.values, table.to_numpy()[:, 1:], rtol=1e-6)


def test_many_wrong_cells_are_counted_not_listed(table):
    said = refusal(table.assign(Speed=np.nan, Command=np.nan))
    assert len(said.splitlines()) < 20
    assert "and 75 more" in said


def test_time_that_goes_back_or_repeats_is_refused(table):
    swapped = table.iloc[[*range(10), 11, 10, *range(12, 80)]]
    assert "column 'time_s', row 11: the time goes back (10); sort the rows" in refusal(swapped)
    assert "repeated" in refusal(table.iloc[[*range(10), 9, *range(10, 80)]])


def test_another_rate_is_refused(table):
    assert "the rate is not rate_hz=1 (10 Hz)" in refusal(table.assign(time_s=table.time_s / 10))


def test_a_constant_state_is_refused(table):
    assert "column 'Speed': the state never changes" in refusal(table.assign(Speed=0.5))


def test_too_short_a_table_is_refused(table):
    said = refusal(table.iloc[:29])
    assert "shorter than one window (29 samples); a window takes 30 samples" in said


def test_the_recording_with_the_fault_is_named(table):
    good, bad = table.assign(recording="good"), table.assign(recording="bad")
    bad.loc[3, "Speed"] = 50.0
    said = refusal(pd.concat([good, bad], ignore_index=True))
    assert "recording 'bad', column 'Speed', row 83: the value is outside" in said
    assert "'good'" not in said


@pytest.mark.parametrize("name", [None, "", "  ", 7, np.nan])
def test_a_recordings_name_is_text(table, name):
    said = refusal(with_cell(table.assign(recording="a"), "recording", 5, name))
    assert "column 'recording', row 5: the name of the recording is no text" in said


def test_gaps_become_segments_as_in_the_reader(table):
    table.loc[40:, "time_s"] += 60.0
    assert read(table)[0].segments == ((0, 40), (40, 80))


def test_a_case_that_resamples_gets_its_samples_held_on_the_grid():
    table = table_of(make_recording("fast", 200))
    source = {**small_case().source.model_dump(), "resample": "hold"}
    (recording,) = read(table.assign(time_s=table["time_s"] * 0.4), source=source)
    np.testing.assert_allclose(np.diff(recording.time_s), 1.0)
    assert len(recording.values) == len(recording.time_s) == 80

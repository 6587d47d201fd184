"""The time column is found by what it does and what it is called; its pace is measured."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from odisar.errors import OdisarError
from odisar.proposals.samples import Sample
from odisar.proposals.times import find_time, measure_pace

STEPS = np.arange(200)


def sample(**columns):
    table = pd.DataFrame(columns)
    return Sample(Path("a.csv"), table)


def found(**columns):
    table = sample(v=np.sin(STEPS), **columns)
    return find_time([table], table.columns)


def test_a_column_called_time_goes_before_one_that_counts_rows():
    assert found(index=STEPS * 1.0, t=STEPS / 5).name == "t"


def test_without_such_a_name_the_one_that_rises_is_taken_with_a_doubt():
    time = found(moment=STEPS / 5 + 0.001)
    assert time.name == "moment"
    assert time.doubt


@pytest.mark.parametrize(
    ("name", "values", "scale_s"),
    [
        ("time_s", STEPS / 5, 1.0),
        ("time [s]", STEPS / 5, 1.0),
        ("time_ms", STEPS * 200.0, 1e-3),
        ("t (us)", STEPS * 2e5, 1e-6),
        ("stamp", 1.7e18 + STEPS * 2e8, 1e-9),
        ("stamp", 1.7e12 + STEPS * 200, 1e-3),
        ("stamp", 1.7e9 + STEPS / 5, 1.0),
    ],
)
def test_the_unit_of_time_is_told_by_the_name_or_the_size(name, values, scale_s):
    time = found(**{name: values})
    assert time.scale_s == scale_s
    assert time.is_epoch == (values[0] > 8e8)
    assert time.is_readable == (scale_s == 1.0)


def test_dates_as_text_are_time_that_must_be_converted():
    text = pd.Series(pd.Timestamp("2024-05-01T10:00:00") + pd.to_timedelta(STEPS / 5, unit="s"))
    table = sample(v=np.sin(STEPS), when=np.cos(STEPS), date=text.astype(str))
    time = find_time([table], table.columns)
    assert (time.name, time.is_text, time.is_readable) == ("date", True, False)
    assert time.seconds(table)[5] == pytest.approx(1.0)


def test_a_few_steps_back_do_not_hide_the_time():
    seconds = STEPS / 5
    seconds[100:] -= 3.0
    assert found(time=seconds).name == "time"


@pytest.mark.parametrize("columns", [{}, {"index": STEPS * 1.0}, {"w": np.cos(STEPS)}])
def test_without_time_the_columns_are_named_and_the_way_out(columns):
    with pytest.raises(OdisarError, match=r"a\.csv: no column looks like time.*'v'.*time_s"):
        found(**columns)


def test_an_even_pace_is_rounded_to_a_usual_rate():
    random = np.random.default_rng(0)
    pace = measure_pace([STEPS / 20.002 + random.normal(0, 0.003, len(STEPS))])
    assert (pace.rate_hz, pace.is_even) == (20.0, True)


def test_a_gap_does_not_change_the_pace():
    seconds = STEPS / 4.0
    seconds[120:] += 60
    assert measure_pace([seconds]).rate_hz == 4.0


def test_stamps_that_bunch_are_uneven():
    pace = measure_pace([STEPS / 10 + np.where(STEPS % 5 == 0, 0.07, 0)])
    assert (pace.rate_hz, pace.is_even) == (10.0, False)


def test_files_of_different_pace_are_uneven_and_say_so():
    pace = measure_pace([STEPS / 10, STEPS / 5, STEPS / 5])
    assert not pace.is_even
    assert pace.slowest_hz == pytest.approx(5.0)
    assert "files differ: 5 to 10 Hz" in pace.doubt


def test_a_sample_a_minute_is_a_rate_too():
    assert measure_pace([STEPS * 60.0]).rate_hz == pytest.approx(1 / 60, rel=1e-4)

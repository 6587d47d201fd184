"""Dates in text are read in one format that is found over all files, never guessed row by row."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from odisar.errors import OdisarError
from odisar.proposals.conversion import require_readable
from odisar.proposals.csv_sniffing import sniff_csv
from odisar.proposals.dates import find_dates
from odisar.proposals.samples import Sample
from odisar.proposals.times import find_time


def sample(*texts, name="a.csv"):
    return Sample(Path(name), pd.DataFrame({"date": texts}))


def dates(*texts):
    return find_dates("date", [sample(*texts)])


@pytest.mark.parametrize(
    ("texts", "form"),
    [
        (("11.03.2024 23:59:59", "12.03.2024 00:00:00"), "%d.%m.%Y %H:%M:%S"),
        (("11.03.24 23:59", "12.03.24 00:00"), "%d.%m.%y %H:%M"),
        (("11.03.2024 23:59:59,8", "12.03.2024 00:00:00"), "%d.%m.%Y %H:%M:%S,%f"),
        (("12/03/2024 23:59:59.5", "13/03/2024 00:00:00.0"), "%d/%m/%Y %H:%M:%S.%f"),
        (("03/12/2024 11:59:59 PM", "03/13/2024 12:00:00 AM"), "%m/%d/%Y %I:%M:%S %p"),
        (("2024-03-11T23:59:59Z", "2024-03-12T00:00:00.5Z"), "ISO8601"),
        (("20240311T235959", "20240312T000000"), "ISO8601"),
        (("2024/03/11 23:59:59", "2024/03/12 00:00:00"), "%Y/%m/%d %H:%M:%S"),
        (("11 Mar 2024 23:59:59", "12 Mar 2024 00:00:00"), "mixed"),
        (("23:59:59", "00:00:00"), "%H:%M:%S"),
    ],
)
def test_one_format_is_found_and_midnight_is_a_second_away(texts, form):
    found = dates(*texts)
    assert found.formats == (form,)
    steps = np.diff(found.seconds(pd.Series(texts)))
    assert 0 < steps[0] <= 60


def test_a_day_above_twelve_in_any_file_tells_the_order_of_all():
    files = [sample("03/04/2024 10:00"), sample("04/17/2024 10:00", name="b.csv")]
    assert find_dates("date", files).formats == ("%m/%d/%Y %H:%M",)


@pytest.mark.parametrize("texts", [("auto", "manual"), ("1.2.3", "1.2.4"), ("", "")])
def test_other_text_is_no_date(texts):
    assert dates(*texts) is None


def test_files_that_write_dates_in_different_ways_are_named():
    files = [sample("11.03.2024 10:00"), sample("2024-03-12 10:00", name="b.csv")]
    with pytest.raises(OdisarError, match=r"b\.csv: column 'date' holds '2024-03-12 10:00'"):
        find_dates("date", files)
    with pytest.raises(OdisarError, match="'13/03/2024' with the day first and '03/14/2024'"):
        dates("13/03/2024", "03/14/2024")


def convert(tmp_path, form, start):
    """Return what is said of files over midnight, and the program that is printed."""
    folder = tmp_path / "runs"
    folder.mkdir()
    moments = pd.Timestamp(start) + pd.to_timedelta(np.arange(240) * 0.5, unit="s")
    table = pd.DataFrame({"date": moments.strftime(form), "v": np.sin(np.arange(240))})
    table.to_csv(folder / "a.csv", index=False)
    one = sniff_csv(folder / "a.csv")
    time = find_time([one], one.columns)
    with pytest.raises(OdisarError) as raised:
        require_readable([one], time, folder)
    told = str(raised.value)
    return told, re.search(r"<<'END'\n(.*)END\n", told, re.DOTALL)[1]


def written(tmp_path):
    return pd.read_csv(tmp_path / "runs-converted" / "a.csv")["time_s"]


@pytest.mark.parametrize("day", [11, 12])
def test_a_recording_over_midnight_stays_in_one_piece(tmp_path, day):
    told, program = convert(tmp_path, "%d.%m.%Y %H:%M:%S.%f", f"2024-03-{day} 23:59:00")
    assert "read as %d.%m.%Y %H:%M:%S.%f, the day first: " in told
    assert f"{day} March 2024" in told
    assert 'date_format = "%d.%m.%Y %H:%M:%S.%f"' in program
    subprocess.run([sys.executable, "-c", program], check=True)
    assert np.diff(written(tmp_path)) == pytest.approx(0.5)


def test_slashes_that_tell_nothing_are_asked_about(tmp_path):
    told, program = convert(tmp_path, "%m/%d/%Y %H:%M:%S.%f", "2024-03-11 23:59:00")
    assert "ambiguous: 3 November 2024 or 11 March 2024" in told
    assert "Does the day or the month stand first?" in told
    unedited = subprocess.run([sys.executable, "-c", program], capture_output=True, check=False)
    assert unedited.returncode != 0
    assert b"date_format" in unedited.stderr
    assert not (tmp_path / "runs-converted" / "a.csv").exists()
    chosen = program.replace('# date_format = "%m/%d', 'date_format = "%m/%d')
    subprocess.run([sys.executable, "-c", chosen], check=True)
    assert np.diff(written(tmp_path)) == pytest.approx(0.5)

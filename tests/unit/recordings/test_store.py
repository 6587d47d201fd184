from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from odisar.errors import OdisarError
from odisar.recordings.schema import Interval
from odisar.recordings.store import METADATA_FILE, SAMPLES_FILE, read_store, write_store


@pytest.fixture
def recordings(make_recording):
    first = make_recording("a", 30, ((0, 10), (10, 30)), strength=0.1, extra={"sea": "calm"})
    return [replace(first, intervals=(Interval(1.0, 2.0, "wind"),)), make_recording("b", 5)]


def test_the_same_recordings_give_the_same_bytes(tmp_path, recordings):
    for name in ("one", "two"):
        write_store(tmp_path / name, recordings)
    for file in (SAMPLES_FILE, METADATA_FILE):
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "two" / file).read_bytes()


def test_the_table_can_be_read_without_this_package(tmp_path, recordings):
    write_store(tmp_path, recordings, ["Rudder", "Speed", "Heading"])
    table = pd.read_parquet(tmp_path / SAMPLES_FILE)
    assert list(table.columns) == ["recording", "time_s", "Rudder", "Speed", "Heading"]
    assert table["recording"].tolist() == ["a"] * 30 + ["b"] * 5
    np.testing.assert_array_equal(table["Speed"][:30], recordings[0].values[:, 1])


def test_no_recordings_at_all(tmp_path):
    write_store(tmp_path, [])
    assert read_store(tmp_path) == []


def test_what_does_not_fit_in_one_store(tmp_path, recordings):
    narrow = replace(recordings[1], values=np.zeros((5, 2)))
    with pytest.raises(OdisarError, match="2 and 3 channels"):
        write_store(tmp_path, [recordings[0], narrow])
    with pytest.raises(OdisarError, match="more than one recording is called a"):
        write_store(tmp_path, [recordings[0], recordings[0]])


def test_a_store_that_is_not_whole(tmp_path, recordings):
    with pytest.raises(OdisarError, match=r"samples\.parquet is missing"):
        read_store(tmp_path)
    write_store(tmp_path / "one", recordings)
    write_store(tmp_path / "two", recordings[:1])
    (tmp_path / "two" / METADATA_FILE).replace(tmp_path / "one" / METADATA_FILE)
    with pytest.raises(OdisarError, match=r"35 samples but recordings\.json tells of 30"):
        read_store(tmp_path / "one")

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet

from odisar.recordings import file_checks

SAMPLES = 30
MOMENTS = np.datetime64("2026-03-01T12:00:00.25", "us") + np.arange(SAMPLES) * 10**6


@pytest.fixture
def columns():
    i = np.arange(SAMPLES)
    return {
        "time_s": i.astype(float),
        "Rudder": 10 * np.sin(i),
        "Speed": 5 + np.cos(i),
        "Heading": 0.1 * np.sin(i / 3),
    }


def write(boat, columns, name="a.parquet", **options):
    path = boat.folder / name
    parquet.write_table(pa.table(columns), path, **options)
    return path


@pytest.mark.parametrize(
    "kind", ["int8", "uint8", "int32", "int64", "uint64", "float16", "float32", "bool_"]
)
def test_columns_of_any_numeric_type(boat, columns, kind):
    whole = np.arange(SAMPLES) % 2
    columns["Rudder"] = pa.array(whole.astype(getattr(np, kind)))
    write(boat, columns)
    result = boat.read()
    assert result.findings == []
    np.testing.assert_array_equal(result.recordings[0].values[:, 0], whole)


def test_a_column_with_a_dictionary(boat, columns):
    columns["Rudder"] = pa.array(columns["Rudder"]).dictionary_encode()
    write(boat, columns)
    result = boat.read()
    assert result.findings == []
    np.testing.assert_array_equal(
        result.recordings[0].values[:, 0], columns["Rudder"].to_numpy(zero_copy_only=False)
    )


def test_rows_in_several_groups(boat, columns):
    write(boat, columns, row_group_size=7)
    columns["Speed"][20] = np.nan
    write(boat, columns, "b.parquet", row_group_size=7)
    assert [recording.name for recording in boat.read().recordings] == ["a"]
    assert boat.one("the value is missing").row == 21


@pytest.mark.parametrize("unit", ["ms", "us", "ns"])
@pytest.mark.parametrize("zone", [None, "UTC", "Europe/Oslo"])
def test_timestamps_become_seconds_since_the_first(boat, columns, unit, zone):
    stamps = pa.array(MOMENTS).cast(pa.timestamp(unit))
    columns["time_s"] = stamps.cast(pa.timestamp(unit, zone)) if zone else stamps
    write(boat, columns)
    result = boat.read()
    assert result.findings == []
    (recording,) = result.recordings
    np.testing.assert_array_equal(recording.time_s, np.arange(SAMPLES))
    digits = {"ms": 3, "us": 6, "ns": 9}[unit]
    shown = f"2026-03-01T12:00:00.{'25'.ljust(digits, '0')}{'+00:00' if zone else ''}"
    assert recording.info.extra == {"started_at": shown}


def test_nanoseconds_are_not_rounded_before_they_are_subtracted(boat, columns):
    ticks = 1_700_000_000_000_000_000 + np.arange(SAMPLES) * 1_000_000_001
    columns["time_s"] = pa.array(ticks, type=pa.timestamp("ns"))
    write(boat, columns)
    (recording,) = boat.read().recordings
    np.testing.assert_array_equal(recording.time_s, np.arange(SAMPLES) * 1_000_000_001 / 1e9)


def test_seconds_as_numbers_have_no_start(boat, columns):
    write(boat, columns)
    assert boat.read().recordings[0].info.extra == {}


@pytest.mark.parametrize(
    ("column", "values", "problem", "value"),
    [
        ("Speed", pa.array(["1"] * SAMPLES), "does not hold numbers", "string"),
        ("Speed", pa.array(MOMENTS), "does not hold numbers", "timestamp[us]"),
        ("Speed", pa.nulls(SAMPLES), "does not hold numbers", "null"),
        ("Speed", pa.array([b"1"] * SAMPLES), "does not hold numbers", "binary"),
        (
            "time_s",
            pa.array([20_000] * SAMPLES, pa.date32()),
            "does not hold numbers",
            "date32[day]",
        ),
        ("Speed", pa.array([[1.0]] * SAMPLES), "is nested", "list<element: double>"),
        ("Speed", pa.array([{"x": 1.0}] * SAMPLES), "is nested", "struct<x: double>"),
    ],
)
def test_a_column_of_another_type(boat, columns, column, values, problem, value):
    columns[column] = values
    write(boat, columns)
    finding = boat.one(problem)
    assert (finding.severity, finding.column, finding.row) == ("error", column, None)
    assert finding.value == value
    assert boat.read().findings == [finding]


def test_nulls(boat, columns):
    speed = list(columns["Speed"])
    speed[4] = None
    columns["Speed"] = speed
    write(boat, columns)
    finding = boat.one("the value is missing")
    assert (finding.column, finding.row, finding.value) == ("Speed", 5, "null")


def test_a_time_that_is_missing(boat, columns):
    columns["time_s"] = pa.array(MOMENTS, mask=np.arange(SAMPLES) == 4)
    write(boat, columns)
    finding = boat.one("the value is missing")
    assert (finding.column, finding.row) == ("time_s", 5)
    assert boat.read().findings == [finding]


def test_whole_numbers_that_a_float_does_not_hold(boat, columns):
    columns["Rudder"] = pa.array([2**53 + 1, -(2**53) - 1, *range(SAMPLES - 2)])
    write(boat, columns)
    found = boat.found("more digits than a 64-bit float holds")
    assert [(finding.row, finding.value) for finding in found] == [
        (1, "9007199254740993"),
        (2, "-9007199254740993"),
    ]


def test_columns_that_are_missing_repeated_or_not_declared(boat, columns):
    table = pa.table(columns)
    names = ["time_s", "Rudder", "speed", "Heading", "Mood", "Heading"]
    arrays = [table.column(i) for i in (0, 1, 2, 3, 1, 3)]
    parquet.write_table(pa.Table.from_arrays(arrays, names=names), boat.folder / "a.parquet")
    missing = boat.one("the column is missing")
    assert (missing.column, missing.row) == ("Speed", None)
    assert "rename 'speed' to 'Speed'" in missing.remedy
    repeated = boat.one("more than once")
    assert (repeated.column, repeated.value) == ("Heading", "2 times")
    found = boat.found("not declared")
    assert {(finding.severity, finding.column) for finding in found} == {
        ("warning", "Mood"),
        ("warning", "speed"),
    }


def test_columns_that_are_not_declared_are_not_even_read(boat, columns):
    columns["Secret"] = pa.array([{"x": "y"}] * SAMPLES)
    path = write(boat, columns, compression="none")
    raw = path.read_bytes()
    metadata = parquet.ParquetFile(path).metadata.row_group(0)
    secret = metadata.column(metadata.num_columns - 1)
    start = secret.dictionary_page_offset or secret.data_page_offset
    path.write_bytes(raw[:start] + b"\xff" * 40 + raw[start + 40 :])
    assert [finding.column for finding in boat.read().findings] == ["Secret"]
    assert len(boat.read().recordings) == 1


def test_a_table_without_rows(boat, columns):
    write(boat, {name: values[:0] for name, values in columns.items()})
    finding = boat.one("no samples")
    assert (finding.severity, finding.row) == ("error", None)


@pytest.mark.parametrize("share", [0.01, 0.3, 0.6, 0.99])
def test_a_file_that_is_cut_off(boat, columns, share):
    path = write(boat, columns)
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    assert boat.one("the file is cut off").severity == "error"


def test_a_file_that_is_no_parquet(boat):
    boat.write("a.parquet", "time_s,Rudder,Speed,Heading\n" * 10)
    assert boat.one("the file is not Parquet").severity == "error"


def test_an_encrypted_file(boat):
    boat.write("a.parquet", b"PARE" + bytes(100) + b"PARE")
    assert boat.one("the file is encrypted").severity == "error"


def test_damage_at_any_place_is_never_a_traceback(boat, columns):
    path = write(boat, columns, write_page_checksum=True)
    raw = path.read_bytes()
    for start in range(4, len(raw) - 4, 97):
        damaged = raw[:start] + b"\xff" * 16 + raw[start + 16 :]
        path.write_bytes(damaged[: len(raw) - 4] + b"PAR1")
        for finding in boat.read().findings:
            assert str(boat.root) not in finding.value
    path.write_bytes(raw[:4] + b"\xff" * 200 + raw[204:])
    assert boat.one("the file is damaged").value


def test_a_folder_with_the_name_of_a_file(boat):
    (boat.folder / "a.parquet").mkdir()
    assert boat.one("a folder has the name").file == "boat/a.parquet"


def test_the_size_limit_is_for_the_file_and_for_what_it_unfolds_to(boat, columns, monkeypatch):
    path = write(boat, columns)
    monkeypatch.setattr(file_checks, "MAX_FILE_BYTES", path.stat().st_size - 1)
    assert boat.one("the file is larger than the limit")
    many = {name: np.zeros(100_000) for name in columns}
    path = write(boat, many)
    monkeypatch.setattr(file_checks, "MAX_FILE_BYTES", 1024**2)
    assert path.stat().st_size < 1024**2
    assert boat.one("the table is larger than the limit of 1 MiB").value == "3 MiB"


def test_an_end_that_states_another_number_of_rows(boat, columns, monkeypatch):
    write(boat, columns)
    whole = parquet.ParquetFile.read
    monkeypatch.setattr(
        parquet.ParquetFile, "read", lambda self, **options: whole(self, **options).slice(1)
    )
    finding = boat.one("the file is damaged")
    assert (finding.severity, finding.value) == ("error", "29 rows where its end states 30")

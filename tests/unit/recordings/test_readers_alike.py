"""What holds for recordings in every format."""

import numpy as np
import pytest

from odisar.recordings.quality import quality_table

LENGTH = 30


@pytest.fixture
def time_s():
    return np.arange(LENGTH, dtype=float)


def rows_of(findings, first_row):
    """Return the samples (from 0) that findings are about, whatever their format counts from."""
    return [finding.row - first_row for finding in findings if finding.row is not None]


@pytest.fixture
def first_row(request):
    return 2 if "csv" in request.node.callspec.params["write_format"] else 1


def test_numbers_come_back_exactly(write_format, bag_boat, columns, time_s):
    write_format(time_s, columns)
    result = bag_boat.read()
    assert result.findings == []
    (recording,) = result.recordings
    assert recording.name == "a"
    np.testing.assert_array_equal(recording.time_s, time_s)
    np.testing.assert_array_equal(recording.values, np.column_stack(list(columns.values())))


@pytest.mark.parametrize(
    ("value", "problem"),
    [(np.nan, "the value is missing"), (np.inf, "infinite"), (-np.inf, "infinite")],
)
def test_a_value_that_is_no_number(
    write_format, bag_boat, columns, time_s, first_row, value, problem
):
    columns["Speed"][7] = value
    write_format(time_s, columns)
    finding = bag_boat.one(problem)
    assert (finding.severity, finding.column, finding.row) == ("error", "Speed", 7 + first_row)
    assert bag_boat.read().findings == [finding]


def test_many_missing_values_are_counted(write_format, bag_boat, columns, time_s, first_row):
    columns["Heading"][5:20] = np.nan
    write_format(time_s, columns)
    found = bag_boat.found("the value is missing")
    assert rows_of(found, first_row) == [5, 6, 7, 8, 9]
    assert found[-1].value == "and 10 more"


def test_a_value_outside_the_limits(write_format, bag_boat, columns, time_s, first_row):
    columns["Speed"][7] = 99.0
    write_format(time_s, columns)
    finding = bag_boat.one("outside -15 to 15 m/s")
    assert (finding.column, finding.row, finding.value) == ("Speed", 7 + first_row, "99")


def test_a_state_that_never_changes(write_format, bag_boat, columns, time_s):
    columns["Speed"][:] = 5.0
    write_format(time_s, columns)
    assert bag_boat.one("the state never changes").column == "Speed"


def test_time_that_goes_back_or_stands_still(write_format, bag_boat, columns, time_s, first_row):
    time_s[10], time_s[20] = 9.0, 15.0
    write_format(time_s, columns)
    assert bag_boat.one("repeated").row == 10 + first_row
    assert bag_boat.one("goes back").row == 20 + first_row


def test_another_rate(write_format, bag_boat, columns, time_s):
    write_format(time_s / 2, columns)
    finding = bag_boat.one("the rate is not rate_hz=1")
    assert finding.value == "2 Hz"
    assert "source.resample to hold or thin" in finding.remedy


def test_a_gap_is_a_warning_and_a_border(write_format, bag_boat, columns, time_s, first_row):
    time_s[12:] += 5.0
    write_format(time_s, columns)
    finding = bag_boat.one("a gap")
    assert (finding.severity, finding.row, finding.value) == ("warning", 12 + first_row, "6")
    assert bag_boat.read().recordings[0].segments == ((0, 12), (12, 30))


def test_a_recording_that_is_too_short(write_format, bag_boat, columns, time_s):
    write_format(time_s[:9], {name: values[:9] for name, values in columns.items()})
    assert bag_boat.one("shorter than one window").value == "9 samples"


def test_the_quality_table_names_the_file(write_format, bag_boat, columns, time_s):
    path = write_format(time_s, columns)
    result = bag_boat.read()
    table = quality_table(result.findings, result.recordings, result.files)
    assert table["file"].tolist() == [path.name]
    assert table["samples"].tolist() == [LENGTH]


def test_metadata_and_labels_belong_to_a_recording_by_its_name(
    write_format, bag_boat, columns, time_s
):
    write_format(time_s, columns)
    bag_boat.write("recordings.csv", "recording,disturbance,sea\na,wind,calm\nb,wind,calm\n")
    bag_boat.write("labels.csv", "recording,start_s,end_s,label\na,5,30,wind\nc,5,30,wind\n")
    result = bag_boat.read()
    (recording,) = result.recordings
    assert recording.info.disturbance == "wind"
    assert recording.info.extra["sea"] == "calm"
    assert recording.intervals[0].end_s == 30.0
    assert "add a recording called b" in bag_boat.one("the row has no file").remedy
    assert "add a recording called c" in bag_boat.one("unknown recording").remedy


def test_an_empty_file(bag_boat):
    for name in ("a.csv", "b.parquet", "c.mcap", "d.db3"):
        bag_boat.write(name, b"")
    found = bag_boat.found("the file is empty")
    assert [finding.file for finding in found] == [
        "boat/a.csv",
        "boat/b.parquet",
        "boat/c.mcap",
        "boat/d.db3",
    ]


def test_a_file_that_leads_nowhere(bag_boat):
    for name in ("a.csv", "b.parquet", "c.mcap", "d.db3"):
        (bag_boat.folder / name).symlink_to(bag_boat.folder / "nowhere")
    found = bag_boat.found("cannot be read")
    assert [finding.value for finding in found] == ["No such file or directory"] * 4


def test_bytes_of_no_known_kind(bag_boat):
    noise = np.random.default_rng(1).integers(0, 256, 5000, dtype=np.uint8).tobytes()
    for name in ("a.csv", "b.parquet", "c.mcap", "d.db3"):
        bag_boat.write(name, noise)
    result = bag_boat.read()
    assert result.recordings == []
    assert len(result.findings) == 4
    assert all(str(bag_boat.root) not in finding.value for finding in result.findings)


def test_all_formats_lie_side_by_side(bag_boat, ros, columns, time_s, write_format):
    write_format(time_s, columns)
    bag_boat.good("b.csv")
    ros.write(bag_boat.folder / "c.1", ros.boat(time_s, columns), "sqlite")
    result = bag_boat.read()
    assert result.findings == []
    assert [recording.name for recording in result.recordings] == ["a", "b", "c.1"]


def test_one_name_in_two_formats(bag_boat, ros, columns, time_s):
    bag_boat.good("a.csv")
    ros.write(bag_boat.folder / "a", ros.boat(time_s, columns))
    assert bag_boat.one("two files are named 'a'").value == "a.csv"

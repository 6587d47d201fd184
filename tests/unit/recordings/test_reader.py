from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from odisar.errors import OdisarError
from odisar.recordings import file_checks
from odisar.recordings.quality import raise_on_errors
from odisar.recordings.writer import write_recordings

HEADER = "time_s,Rudder,Speed,Heading\n"


def errors(result):
    return [finding for finding in result.findings if finding.severity == "error"]


def test_good_files_are_read_in_the_order_of_their_names_without_findings(boat):
    boat.good("b.csv")
    boat.good("a.csv")
    result = boat.read()
    assert [recording.name for recording in result.recordings] == ["a", "b"]
    assert result.findings == []
    first = result.recordings[0]
    assert first.values.shape == (30, 3)
    assert first.time_s.tolist() == list(range(30))
    assert first.values[2, 1] == 4.5839
    assert first.segments == ((0, 30),)


def test_channels_are_taken_by_name_whatever_their_order_in_the_file(boat):
    lines = [",".join(reversed(line.strip().split(","))) for line in boat.good("a.csv").open()]
    boat.write("b.csv", "\n".join(lines) + "\n")
    straight, reversed_ = boat.read().recordings
    np.testing.assert_array_equal(straight.values, reversed_.values)


@pytest.mark.parametrize("change", ["bom", "crlf", "no last newline", "blank end", "quotes"])
def test_harmless_ways_of_writing_a_file_are_accepted(boat, change):
    raw = boat.good("a.csv").read_bytes()
    changed = {
        "bom": b"\xef\xbb\xbf" + raw,
        "crlf": raw.replace(b"\n", b"\r\n"),
        "no last newline": raw.rstrip(),
        "blank end": raw + b"\n\n",
        "quotes": raw.replace(b"\n0,", b'\n"0",'),
    }[change]
    boat.write("b.csv", changed)
    result = boat.read()
    assert result.findings == []
    np.testing.assert_array_equal(result.recordings[0].values, result.recordings[1].values)


def test_the_line_reader_gives_the_same_numbers_as_the_fast_one(boat):
    raw = boat.good("a.csv").read_text()
    boat.write("b.csv", raw + "\n")
    fast, slow = boat.read().recordings
    np.testing.assert_array_equal(fast.values, slow.values)
    np.testing.assert_array_equal(fast.time_s, slow.time_s)


def test_an_empty_file(boat):
    boat.write("a.csv", b"")
    assert boat.one("the file is empty").file == "boat/a.csv"


def test_a_file_with_a_header_only(boat):
    boat.write("a.csv", HEADER)
    assert boat.one("no samples").severity == "error"


def test_a_blank_first_line(boat):
    boat.write("a.csv", "\n" + HEADER)
    assert boat.one("the first line is blank").row == 1


def test_a_missing_header(boat):
    boat.write("a.csv", "0,1,2,3\n1,2,3,4\n")
    assert boat.one("the header line is missing").value == "0,1,2,3"


@pytest.mark.parametrize(
    ("raw", "problem"),
    [
        (b"\x89PNG\r\n\x1a\n\x00\x00\x00", "binary"),
        (bytes(range(1, 32)) * 40 + b"\xff\xfe", "binary"),
        (HEADER.encode("utf-16"), "UTF-16"),
        (HEADER.replace("Speed", "Speed °").encode("latin-1"), "not in UTF-8"),
    ],
)
def test_a_file_that_is_not_text_in_utf8(boat, raw, problem):
    boat.write("a.csv", raw)
    assert boat.one(problem).row is not None


def test_a_file_that_leads_nowhere(boat):
    (boat.folder / "a.csv").symlink_to(boat.folder / "nowhere")
    assert boat.one("cannot be read").value == "No such file or directory"


def test_a_file_without_permission(boat, monkeypatch):
    # Taking the permission away would not stop a superuser, as in many containers.
    def refuse(path):
        raise PermissionError(13, "Permission denied", str(path))

    boat.good("a.csv")
    monkeypatch.setattr(Path, "read_bytes", refuse)
    assert boat.one("cannot be read").value == "Permission denied"


def test_a_file_above_the_size_limit(boat, monkeypatch):
    monkeypatch.setattr(file_checks, "MAX_FILE_BYTES", 1024**2)
    with (boat.folder / "a.csv").open("wb") as file:
        file.truncate(2 * 1024**2)
    finding = boat.one("larger than the limit of 1 MiB")
    assert finding.value == "2 MiB"


@pytest.mark.parametrize(
    ("line", "problem"),
    [("3,1,2\n", "too few fields"), ("3,1,2,3,4\n", "too many fields")],
)
def test_ragged_lines(boat, line, problem):
    boat.spoiled({5: line})
    finding = boat.one(problem)
    assert (finding.row, finding.value) == (5, f"{line.count(',') + 1} fields")
    assert errors(boat.read()) == [finding]


def test_a_blank_line_inside_the_data_is_named(boat):
    boat.spoiled({5: "\n3,1,2,0.5\n"})
    finding = boat.one("the line is blank")
    assert (finding.row, finding.severity) == (5, "warning")
    assert len(boat.read().recordings[0].time_s) == 30


def test_an_open_quotation_mark(boat):
    boat.spoiled({5: '3,"1,2,3\n'})
    assert boat.one("nor can any after it").row == 5


def test_a_missing_column_with_a_name_close_to_it(boat):
    boat.write("a.csv", boat.good("a.csv").read_text().replace("Speed", "speed"))
    finding = boat.one("the column is missing")
    assert (finding.column, finding.row) == ("Speed", 1)
    assert "rename 'speed' to 'Speed'" in finding.remedy


def test_a_repeated_column(boat):
    lines = boat.good("a.csv").read_text().splitlines()
    boat.write("a.csv", "\n".join([lines[0] + ",Speed", *(f"{line},1" for line in lines[1:])]))
    finding = boat.one("more than once")
    assert (finding.column, finding.value) == ("Speed", "2 times")


def test_an_extra_column_is_named_and_not_read(boat):
    lines = boat.good("a.csv").read_text().splitlines()
    boat.write("a.csv", "\n".join([lines[0] + ",Mood", *(f"{line},good" for line in lines[1:])]))
    result = boat.read()
    assert [(found.severity, found.column) for found in result.findings] == [("warning", "Mood")]
    assert result.recordings[0].values.shape == (30, 3)


@pytest.mark.parametrize(
    ("cell", "problem"),
    [
        ("fast", "not a number"),
        ("1_000", "not a number"),
        ("0x10", "not a number"),
        ("", "missing"),
        ("NaN", "missing"),
        ("inf", "infinite"),
        ("-Infinity", "infinite"),
        ("1e999", "infinite"),
        ('"0,5"', "decimal comma"),
    ],
)
def test_a_cell_without_a_number(boat, cell, problem):
    boat.spoiled({7: f"5,1,{cell},0.1\n"})
    found = errors(boat.read())
    assert len(found) == 1
    assert problem in found[0].problem
    place = (found[0].file, found[0].column, found[0].row, found[0].value)
    assert place == ("boat/a.csv", "Speed", 7, cell.strip('"'))


def test_semicolons_and_decimal_commas_are_both_named(boat):
    text = boat.good("a.csv").read_text().replace(",", ";").replace(".", ",")
    boat.write("a.csv", text)
    assert boat.one("separated by semicolons").row == 1
    found = boat.found("decimal comma")
    assert [finding.row for finding in found[:3]] == [2, 3, 4]


def test_many_rows_with_one_problem_are_counted(boat):
    boat.spoiled({number: f"{number - 2},1,x,0.1\n" for number in range(5, 17)})
    found = boat.found("not a number")
    assert [finding.row for finding in found] == [5, 6, 7, 8, 9, None]
    assert found[-1].value == "and 7 more"


def test_a_folder_of_every_fault_gives_one_table_of_them_all(boat):
    faults = {
        "empty.csv": b"",
        "binary.csv": b"\x00\x01",
        "text.csv": HEADER + "0,1,fast,0\n1,2,3\n2,1,inf,0.2\n2,1,,99\n1,1,1,1\n",
        "columns.csv": "time_s,Rudder,Rudder\n0,1,2\n1,2,3\n",
        "recordings.csv": "recording,split,strength\ntext,exam,big\ntext,test,1\nghost,test,1\n",
        "labels.csv": "recording,start_s,end_s,label\nghost,1,2,wind\nempty,5,4,wind\ngood,x,4,\n",
    }
    for name, content in faults.items():
        boat.write(name, content)
    boat.good("good.csv")
    with pytest.raises(OdisarError) as raised:
        raise_on_errors(boat.read().findings)
    message = str(raised.value)
    for problem in (
        "the file is empty",
        "binary, not text",
        "the value is not a number",
        "too few fields",
        "the value is infinite",
        "the value is missing",
        "outside -3.2 to 3.2 rad",
        "the time stamp is repeated",
        "the time goes back",
        "the column is missing",
        "the column appears more than once",
        "unknown split",
        "not a number",
        "the recording has two rows",
        "the row has no file",
        "the file has no row",
        "labels for an unknown recording",
        "ends before it starts",
        "the label is missing",
    ):
        assert problem in message
    assert "in 6 places" in message
    assert str(boat.root) not in message


def test_what_the_writer_writes_is_read_without_a_finding(make_boat, make_recording):
    boat = make_boat(splits={"kind": "metadata"})
    recording = make_recording("turn", base_seed="s1", strength=0.25, extra={"sea": "calm"})
    values = recording.values.copy()
    values[:, 2] /= 100
    recording = replace(recording, values=values)
    write_recordings(boat.folder, [recording], boat.case.channel_names)
    result = boat.read()
    assert result.findings == []
    assert result.recordings[0].info == recording.info
    np.testing.assert_allclose(result.recordings[0].values, values, atol=5e-7)

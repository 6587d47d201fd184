"""CSV files with other separators and decimal signs than commas and points."""

import numpy as np
import pytest

from odisar.config.formats import CsvFormat
from odisar.recordings import csv_reader
from odisar.recordings.quality import Notes

SIGNS = {"comma": ",", "semicolon": ";", "tab": "\t", "bar": "|", "space": " "}
LAYOUTS = [
    (separator, decimal)
    for separator in SIGNS
    for decimal in ("point", "comma")
    if (separator, decimal) != ("comma", "comma")
]


def rewrite(text, separator, decimal):
    sign = "," if decimal == "comma" else "."
    return text.replace(",", "\0").replace(".", sign).replace("\0", SIGNS[separator])


@pytest.fixture
def boat_of(make_boat):
    def make(separator, decimal="point"):
        return make_boat(source={"csv": {"separator": separator, "decimal": decimal}})

    return make


@pytest.fixture
def plain():
    """Return the text and the numbers of a plain file."""
    numbers = np.column_stack([np.arange(30.0), *np.random.default_rng(1).uniform(0, 3, (3, 30))])
    lines = [",".join(map(repr, row)) for row in numbers.tolist()]
    return "\n".join(["time_s,Rudder,Speed,Heading", *lines, ""]), numbers


@pytest.mark.parametrize(("separator", "decimal"), LAYOUTS)
@pytest.mark.parametrize("path", ["fast", "slow"])
def test_every_declared_layout_gives_the_same_numbers(
    boat_of, plain, separator, decimal, path, monkeypatch
):
    text, numbers = plain
    boat = boat_of(separator, decimal)
    boat.write("a.csv", rewrite(text, separator, decimal))
    if path == "slow":
        monkeypatch.setattr(csv_reader, "_read_clean", lambda *_: None)
    result = boat.read()
    assert result.findings == []
    np.testing.assert_array_equal(result.recordings[0].time_s, numbers[:, 0])
    np.testing.assert_array_equal(result.recordings[0].values, numbers[:, 1:])


@pytest.mark.parametrize(("separator", "decimal"), LAYOUTS)
def test_clean_files_of_every_layout_take_the_fast_path(
    boat_of, plain, separator, decimal, monkeypatch
):
    boat = boat_of(separator, decimal)
    boat.write("a.csv", rewrite(plain[0], separator, decimal))
    monkeypatch.setattr(csv_reader, "LineReader", None)
    assert len(boat.read().recordings) == 1


@pytest.mark.parametrize("separator", ["semicolon", "tab", "bar", "space"])
def test_a_separator_that_is_not_declared(make_boat, plain, separator):
    boat = make_boat()
    boat.write("a.csv", rewrite(plain[0], separator, "point"))
    finding = boat.one("fields are separated by")
    assert (finding.severity, finding.row) == ("error", 1)
    assert finding.remedy == (
        f"declare source.csv.separator: {separator} for the case, or save the file with commas "
        "between fields and points in numbers (0.5)"
    )
    assert boat.read().findings == [finding]


def test_commas_where_semicolons_are_declared(boat_of, plain):
    boat = boat_of("semicolon", "comma")
    boat.write("a.csv", plain[0])
    finding = boat.one("fields are separated by commas")
    assert "semicolons between fields and commas in numbers (0,5)" in finding.remedy


def test_decimal_commas_that_are_not_declared(boat_of, plain):
    boat = boat_of("semicolon", "point")
    boat.write("a.csv", rewrite(plain[0], "semicolon", "comma"))
    finding = boat.found("the number has a decimal comma")[0]
    assert (finding.row, finding.column) == (2, "time_s")
    assert "declare source.csv.decimal: comma" in finding.remedy


def test_decimal_points_where_commas_are_declared(boat_of, plain):
    boat = boat_of("semicolon", "comma")
    boat.write("a.csv", rewrite(plain[0], "semicolon", "point"))
    finding = boat.found("the number has a decimal point")[0]
    assert finding.remedy == (
        "write it with a comma (0,5), or declare source.csv.decimal: point for the case"
    )


@pytest.mark.parametrize("separator", ["semicolon", "tab", "space"])
def test_faults_of_a_line_are_found_whatever_separates_it(boat_of, plain, separator):
    boat = boat_of(separator)
    lines = plain[0].splitlines()
    lines[4], lines[6], lines[8] = "3,1,fast,1", "5,1", "7,1,nan,1"
    boat.write("a.csv", rewrite("\n".join(lines), separator, "point"))
    places = {
        (found.problem, found.column, found.row, found.value) for found in boat.read().findings
    }
    assert places == {
        ("the value is not a number", "Speed", 5, "fast"),
        ("the line has too few fields", "", 7, "2 fields"),
        ("the value is missing", "Speed", 9, "nan"),
    }


def test_runs_of_blanks_separate_and_those_at_the_ends_do_not(boat_of, plain):
    boat = boat_of("space")
    lines = [f"  {line} \t" for line in plain[0].strip().replace(",", " \t  ").splitlines()]
    boat.write("a.csv", "\r\n".join(lines) + "\r\n\r\n")
    result = boat.read()
    assert result.findings == []
    np.testing.assert_array_equal(result.recordings[0].values, plain[1][:, 1:])


def test_a_blank_line_between_lines_of_blanks_is_named(boat_of, plain):
    boat = boat_of("space")
    lines = plain[0].replace(",", " ").splitlines()
    lines.insert(4, "   ")
    boat.write("a.csv", "\n".join(lines))
    assert boat.one("the line is blank").row == 5


@pytest.mark.parametrize("separator", ["semicolon", "tab", "space"])
def test_quoted_fields_may_hold_the_separator(separator, plain):
    names = ["time_s", "Rudder of; the\tboat", "Speed", "Heading"]
    if separator == "space":
        names[1] = "Rudder of the boat"
    text = rewrite(plain[0], separator, "point")
    text = text.replace("Rudder", f'"{names[1]}"').replace("\n0.0", '\n"0.0"')
    notes = Notes("a.csv")
    layout = CsvFormat(separator=separator, decimal="point")
    table = csv_reader.read_columns(text, names, layout, notes)
    assert notes.findings == []
    np.testing.assert_array_equal(table.values, plain[1])


def test_of_many_columns_that_are_not_declared_the_first_are_named(boat):
    header, *lines = boat.good("a.csv").read_text().splitlines()
    header += "".join(f",c{i:05}" for i in range(20_000))
    boat.write("a.csv", "\n".join([header, *(line + ",0" * 20_000 for line in lines), ""]))
    found = boat.found("not declared and is not read")
    assert [finding.column for finding in found] == [*(f"c{i:05}" for i in range(5)), ""]
    assert found[-1].value == "and 19,995 more"


def test_rows_are_those_of_the_file_where_an_undeclared_field_has_line_breaks(boat):
    header, *lines = boat.good("a.csv").read_text().splitlines()
    lines[9] = "9,1,99,0.1"
    remarks = [line + ',"one\ntwo"' for line in lines]
    boat.write("a.csv", "\n".join([f"{header},Remark", *remarks, ""]))
    assert boat.one("outside -15 to 15 m/s").row == 2 + 2 * 9


def test_utf_32_is_not_taken_for_utf_16(boat):
    text = boat.good("a.csv").read_text()
    boat.write("a.csv", text.encode("utf-32"))
    assert boat.one("the file is in UTF-").problem == "the file is in UTF-32"

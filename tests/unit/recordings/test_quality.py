import pandas as pd
import pytest

from odisar.errors import OdisarError
from odisar.recordings.quality import (
    QUALITY_COLUMNS,
    Finding,
    Notes,
    quality_table,
    raise_on_errors,
    read_findings,
    read_quality_table,
    write_findings,
    write_quality_table,
)

ERROR = Finding("error", "boat/b.csv", "Speed", 3, "x", "the value is not a number", "mend it")
WARNING = Finding("warning", "boat/a.csv", "time_s", 9, "2", "a gap", "nothing")


def test_warnings_alone_raise_nothing():
    raise_on_errors([WARNING])


def test_errors_are_raised_in_an_aligned_table_with_a_way_out():
    longer = Finding("error", "boat/long-name.csv", "", None, "y" * 80, "odd", "see to it")
    with pytest.raises(OdisarError) as raised:
        raise_on_errors([ERROR, WARNING, longer])
    lines = str(raised.value).splitlines()
    assert lines[0] == "the recordings cannot be used: 2 findings in 2 places"
    header, _, first, second = lines[2:6]
    for title, cell in (("row", "3"), ("column", "Speed"), ("value", "x"), ("problem", "the v")):
        assert first[header.index(title) :].startswith(cell)
    assert second[header.index("value") :].startswith("y" * 29 + "...")
    assert "a gap" not in str(raised.value)
    assert lines[-1].startswith("Mend the files")


@pytest.mark.parametrize(("total", "rest"), [(5, None), (6, "and 1 more")])
def test_findings_of_a_kind_beyond_the_first_are_counted(total, rest):
    by_rows, one_by_one = Notes("a.csv"), Notes("a.csv")
    by_rows.rows("bad", "mend", [(row, "x") for row in range(4)], column="Speed", total=total)
    for row in range(total):
        one_by_one.error("bad", "mend", column="Speed", row=row, value="x")
    assert [found.row for found in one_by_one.findings[:5]] == list(range(5))
    assert [found.value for found in one_by_one.findings[5:]] == ([rest] if rest else [])
    assert by_rows.findings[4].value == f"and {total - 4} more"


def test_the_quality_table_has_every_recording_and_every_file_with_a_finding(make_recording):
    recordings = [make_recording("a", 30, ((0, 10), (10, 30))), make_recording("c", 20)]
    table = quality_table([ERROR, WARNING], recordings)
    assert list(table.columns) == list(QUALITY_COLUMNS)
    assert table["file"].tolist() == ["a.csv", "b.csv", "c.csv"]
    assert table["samples"].tolist() == [30, 0, 20]
    assert table["seconds"].tolist() == [28.0, 0.0, 19.0]
    assert table["segments"].tolist() == [2, 0, 1]
    assert table["gaps"].tolist() == [1, 0, 0]
    assert table["errors"].tolist() == [0, 1, 0]
    assert table["warnings"].tolist() == [1, 0, 0]
    assert table["findings"].tolist() == [
        "a gap (row 9, time_s, 2)",
        "the value is not a number (row 3, Speed, x)",
        "",
    ]


def test_recordings_of_two_cases_are_not_mixed_up(make_recording):
    with pytest.raises(ValueError, match="one case at a time"):
        quality_table([], [make_recording("a"), make_recording("a")])


def test_findings_and_table_are_read_as_they_were_written(tmp_path, make_recording):
    write_findings(tmp_path / "quality" / "findings.json", [ERROR, WARNING])
    assert read_findings(tmp_path / "quality" / "findings.json") == [ERROR, WARNING]
    table = quality_table([ERROR], [make_recording("a")])
    write_quality_table(tmp_path / "quality.csv", table)
    pd.testing.assert_frame_equal(read_quality_table(tmp_path / "quality.csv"), table)


def test_a_file_cannot_steer_the_terminal_by_its_names():
    hostile = "\x1b[2Jname"
    notes = Notes(f"boat/{hostile}.csv")
    notes.error(f"no field {hostile}", f"rename {hostile}", column=hostile, value=hostile)
    with pytest.raises(OdisarError) as caught:
        raise_on_errors(notes.findings)
    assert "\x1b" not in str(caught.value)
    assert str(caught.value).count("?[2Jname") == 5
    table = quality_table(notes.findings, [])
    assert "\x1b" not in table.findings[0]

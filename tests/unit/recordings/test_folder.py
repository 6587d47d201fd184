import time

from odisar.config.cases import Case

HEADER = "time_s,Rudder,Speed,Heading\n"


def test_a_folder_named_like_a_recording(boat):
    (boat.folder / "a.csv").mkdir()
    assert boat.one("a folder has the name")


def test_a_folder_that_is_missing_or_holds_nothing(boat):
    assert boat.one("holds no recording").file == "boat"
    boat.folder.rmdir()
    assert boat.one("does not exist").severity == "error"
    boat.folder.write_text("")
    assert boat.one("not a folder").severity == "error"


def test_other_formats_are_named_and_not_read(boat):
    boat.good("a.csv")
    boat.write("b.xlsx", b"PK")
    boat.write(".hidden.csv", HEADER)
    boat.write("README.md", "about this folder")
    (boat.folder / "older").mkdir()
    boat.write("older/c.parquet", b"PAR1")
    found = boat.found("not a CSV or Parquet file nor a ROS 2 bag")
    assert [finding.value for finding in found] == [".hidden.csv", "b.xlsx", "older"]
    assert boat.read().findings == found


def test_too_many_recordings(make_boat):
    boat = make_boat(source={"max_recordings": 1})
    boat.good("a.csv")
    boat.good("b.csv")
    assert boat.one("source.max_recordings=1").value == "2 files"


def test_two_files_with_one_name(boat):
    boat.good("a.csv")
    boat.good("a.CSV")
    assert boat.one("two files are named 'a'")


def test_four_hundred_files_are_read_within_seconds(boat, make_case):
    case: Case = make_case(source={"max_recordings": 500})
    boat.case = case
    text = boat.good("a.csv", samples=1200).read_bytes()
    for i in range(430):
        boat.write(f"r{i:03d}.csv", text)
    started = time.perf_counter()
    assert len(boat.read().recordings) == 431
    assert time.perf_counter() - started < 10

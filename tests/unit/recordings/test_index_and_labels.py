import pytest

from odisar.recordings.schema import Interval

METADATA = {"kind": "metadata"}


def test_metadata_columns_are_typed_and_others_kept(make_boat):
    boat = make_boat(splits=METADATA)
    boat.good("a.csv")
    boat.write(
        "recordings.csv",
        "recording,maneuver,disturbance,strength,base_seed,split,fold,sea\n"
        "a,turning,wind,0.25,s1,development,2,calm\n",
    )
    boat.write("labels.csv", "recording,start_s,end_s,label\na,5,12.5,wind\na,20,30,wind\n")
    result = boat.read()
    assert result.findings == []
    info = result.recordings[0].info
    assert (info.case, info.maneuver, info.disturbance) == ("boat", "turning", "wind")
    assert (info.strength, info.base_seed, info.split, info.fold) == (0.25, "s1", "development", 2)
    assert info.extra == {"sea": "calm"}
    assert info.components == "none"
    assert result.recordings[0].intervals == (
        Interval(5.0, 12.5, "wind"),
        Interval(20.0, 30.0, "wind"),
    )


def test_without_metadata_a_label_names_the_disturbance(boat):
    boat.good("a.csv")
    boat.good("b.csv")
    boat.write("labels.csv", "recording,start_s,end_s,label\nb,5,12,gusts\n")
    result = boat.read()
    assert result.findings == []
    assert [item.info.disturbance for item in result.recordings] == ["none", "gusts"]


def test_splits_by_metadata_need_the_metadata(make_boat):
    boat = make_boat(splits=METADATA)
    boat.good("a.csv")
    assert boat.one("needs this file").file == "boat/recordings.csv"


@pytest.mark.parametrize(
    ("line", "problem", "column", "value"),
    [
        ("a,exam,,", "unknown split", "split", "exam"),
        ("a,,,", "unknown split", "split", ""),
        ("a,cross-fit,,", "unknown split", "split", "cross-fit"),
        ("a,train,big,", "not a number", "strength", "big"),
        ("a,train,nan,", "not a number", "strength", "nan"),
        ("a,train,,-1", "not a fold", "fold", "-1"),
        ("a,train,,", "has two rows", "recording", "a"),
        ("b,train,,", "has no file", "recording", "b"),
        ("b,train", "too few fields", "", "2 fields"),
        ("b,train,,,", "too many fields", "", "5 fields"),
    ],
)
def test_faults_of_a_metadata_row(make_boat, line, problem, column, value):
    boat = make_boat(splits=METADATA)
    boat.good("a.csv")
    first = "a,train,,\n" if "two rows" in problem else ""
    boat.write("recordings.csv", f"recording,split,strength,fold\n{first}{line}\n")
    finding = boat.one(problem)
    place = (finding.severity, finding.column, finding.row, finding.value)
    assert place == ("error", column, 3 if first else 2, value)


def test_a_file_without_a_metadata_row(make_boat):
    boat = make_boat(splits=METADATA)
    boat.good("a.csv")
    boat.write("recordings.csv", "recording,split\n")
    assert boat.one("the file has no row").value == "a"


def test_metadata_without_a_needed_column_or_with_a_repeated_one(make_boat):
    boat = make_boat(splits=METADATA)
    boat.good("a.csv")
    boat.write("recordings.csv", "recording;split\na;train\n")
    found = boat.found("the column is missing")
    assert [finding.column for finding in found] == ["recording", "split"]
    assert "commas" in found[0].remedy
    boat.write("recordings.csv", "recording,split,split\na,train,test\n")
    assert boat.one("more than once").column == "split"


def test_splits_that_are_not_used_are_named(boat):
    boat.good("a.csv")
    boat.write("recordings.csv", "recording,split\na,train\n")
    assert boat.one("splits.kind=fractions draws").severity == "warning"


def test_metadata_and_labels_must_not_contradict_each_other(make_boat):
    boat = make_boat(splits=METADATA)
    for name in ("a", "b", "c"):
        boat.good(f"{name}.csv")
    boat.write(
        "recordings.csv", "recording,disturbance,split\na,none,test\nb,wind,test\nc,wind,train\n"
    )
    boat.write("labels.csv", "recording,start_s,end_s,label\na,1,2,wind\nc,1,2,wind\n")
    labelled = boat.one("labels a recording with disturbance=none")
    assert (labelled.severity, labelled.row, labelled.value) == ("error", 2, "a")
    unlabelled = boat.one("disturbed but has no label")
    assert (unlabelled.severity, unlabelled.row, unlabelled.value) == ("warning", 3, "b")
    assert boat.one("becomes part of what is normal").row == 4


@pytest.mark.parametrize(
    ("line", "problem", "column", "value"),
    [
        ("ghost,1,2,wind", "unknown recording", "recording", "ghost"),
        ("a,2,1,wind", "ends before it starts", "end_s", "1"),
        ("a,2,2,wind", "the interval is empty", "end_s", "2"),
        ("a,-1,2,wind", "leaves its recording", "start_s", "-1"),
        ("a,1,30.5,wind", "leaves its recording", "end_s", "30.5"),
        ("a,soon,2,wind", "not a number", "start_s", "soon"),
        ("a,1,inf,wind", "not a number", "end_s", "inf"),
        ("a,1,2,", "the label is missing", "label", ""),
        ("a,1,2", "too few fields", "", "3 fields"),
    ],
)
def test_faults_of_a_label(boat, line, problem, column, value):
    boat.good("a.csv")
    boat.write("labels.csv", f"recording,start_s,end_s,label\n{line}\n")
    finding = boat.one(problem)
    place = (finding.severity, finding.file, finding.column, finding.row, finding.value)
    assert place == ("error", "boat/labels.csv", column, 2, value)


def test_labels_may_reach_the_end_of_the_last_sample(boat):
    boat.good("a.csv")
    boat.write("labels.csv", "recording,start_s,end_s,label\na,0,30,wind\n")
    assert boat.read().findings == []


def test_a_label_for_a_file_with_errors_is_not_called_unknown(boat):
    boat.good("a.csv")
    boat.write("b.csv", b"")
    boat.write("labels.csv", "recording,start_s,end_s,label\nb,0,30,wind\n")
    assert boat.found("unknown recording") == []


def test_an_empty_table_and_an_open_quotation_mark(boat):
    boat.good("a.csv")
    boat.write("recordings.csv", b"")
    boat.write("labels.csv", 'recording,start_s,end_s,label\na,0,3,"wind\n')
    assert boat.one("the file is empty").file == "boat/recordings.csv"
    assert boat.one("nor can any after it").row == 2

from dataclasses import replace

import numpy as np
import pytest

from odisar.errors import OdisarError
from odisar.recordings.blocks import cut_blocks
from odisar.recordings.schema import Interval
from odisar.recordings.splits import PARTS, assign_splits, deal_blocks

CROSS_FIT = {"kind": "cross-fit", "folds": 4, "block_s": 20.0, "block_gap_s": 5.0}


def names(parts):
    return {part: [recording.name for recording in parts[part]] for part in parts}


@pytest.fixture
def by_metadata(make_recording):
    return [
        make_recording(f"{split}-{maneuver}", split=split, maneuver=maneuver)
        for split in PARTS
        for maneuver in ("zigzag", "random")
    ]


def test_metadata_splits_are_taken_as_they_are(make_case, by_metadata):
    parts = assign_splits(by_metadata, make_case(splits={"kind": "metadata"}), {}, None, 1)
    assert names(parts) == {part: [f"{part}-zigzag", f"{part}-random"] for part in PARTS}


def test_select_narrows_what_is_fitted_and_never_what_judges(make_case, by_metadata):
    case = make_case(splits={"kind": "metadata"})
    parts = names(assign_splits(by_metadata, case, {"maneuver": ["random"]}, None, 1))
    for part in ("train", "validation", "calibration"):
        assert parts[part] == [f"{part}-random"]
    for part in ("development", "test"):
        assert parts[part] == [f"{part}-zigzag", f"{part}-random"]


@pytest.mark.parametrize(
    ("select", "message"),
    [
        ({"manoeuvre": ["random"]}, "'manoeuvre' is not a column"),
        ({"is_disturbed": ["False"]}, "'is_disturbed' is not a column"),
        ({"maneuver": ["turning"]}, "leaves split train empty"),
    ],
)
def test_a_selection_that_cannot_be_met(make_case, by_metadata, select, message):
    case = make_case(splits={"kind": "metadata"})
    with pytest.raises(OdisarError, match=message):
        assign_splits(by_metadata, case, select, None, 1)


def test_select_by_a_column_of_the_users_own(make_case, by_metadata):
    own = [replace(item, info=replace(item.info, extra={"sea": "calm"})) for item in by_metadata]
    own[0] = replace(own[0], info=replace(own[0].info, extra={}))
    case = make_case(splits={"kind": "metadata"})
    parts = assign_splits(own, case, {"sea": ["calm"]}, None, 1)
    assert names(parts)["train"] == ["train-random"]


def test_development_alone_may_be_empty(make_case, by_metadata):
    case = make_case(splits={"kind": "metadata"})
    without = [item for item in by_metadata if item.info.split != "development"]
    assert assign_splits(without, case, {}, None, 1)["development"] == []
    without = [item for item in by_metadata if item.info.split != "calibration"]
    with pytest.raises(OdisarError, match="no recording is in split calibration"):
        assign_splits(without, case, {}, None, 1)


def test_a_fold_is_for_cross_fit_alone(make_case, by_metadata):
    with pytest.raises(OdisarError, match="has no folds"):
        assign_splits(by_metadata, make_case(splits={"kind": "metadata"}), {}, 0, 1)


def test_fractions_are_met_and_depend_on_the_seed_alone(make_case, make_recording):
    recordings = [make_recording(f"r{i:02d}") for i in range(20)]
    first = names(assign_splits(recordings, make_case(), {}, None, 1))
    assert [len(first[part]) for part in PARTS] == [8, 4, 4, 0, 4]
    again = names(assign_splits(recordings[::-1], make_case(), {}, None, 1))
    assert {part: sorted(first[part]) for part in PARTS} == {
        part: sorted(again[part]) for part in PARTS
    }
    assert names(assign_splits(recordings, make_case(), {}, None, 2)) != first


def test_fractions_keep_variations_of_one_seed_together(make_case, make_recording):
    recordings = [make_recording(f"r{i:02d}", base_seed=f"s{i % 5}") for i in range(20)]
    parts = assign_splits(recordings, make_case(), {}, None, 1)
    homes = {(item.info.base_seed, part) for part in PARTS for item in parts[part]}
    assert len(homes) == 5


def test_fractions_leave_disturbed_recordings_to_the_test(make_case, make_recording):
    clean = [make_recording(f"r{i}") for i in range(4)]
    twin = make_recording("twin", base_seed="s")
    gusts = make_recording("gusts", base_seed="s", disturbance="wind")
    parts = assign_splits([*clean, twin, gusts], make_case(), {}, None, 1)
    assert {"twin", "gusts"} < set(names(parts)["test"])


def test_too_few_recordings_for_fractions(make_case, make_recording):
    with pytest.raises(OdisarError, match=r"at least 4 recordings .* there are 3"):
        assign_splits([make_recording(f"r{i}") for i in range(3)], make_case(), {}, None, 1)


def test_blocks_are_apart_and_never_cross_a_gap(make_case, make_recording):
    recording = make_recording("long", 100, ((0, 30), (30, 100)))
    recording = replace(recording, intervals=(Interval(15.0, 45.0, "wind"),))
    blocks = cut_blocks(recording, make_case(splits=CROSS_FIT))
    assert [block.name for block in blocks] == [f"long-block-0{i}" for i in range(4)]
    assert [block.time_s[0] for block in blocks] == [0.0, 40.0, 65.0, 90.0]
    assert [len(block.time_s) for block in blocks] == [20] * 4
    assert [block.segments for block in blocks] == [((0, 20),)] * 4
    assert [block.info.base_seed for block in blocks] == [block.name for block in blocks]
    assert blocks[0].intervals == (Interval(15.0, 20.0, "wind"),)
    assert blocks[1].intervals == (Interval(40.0, 45.0, "wind"),)
    assert blocks[2].intervals == blocks[3].intervals == ()
    np.testing.assert_array_equal(blocks[1].values, recording.values[30:50])


def test_the_gap_between_blocks_also_holds_across_a_gap_in_the_recording(make_case, make_recording):
    recording = make_recording("long", 60, ((0, 20), (20, 60)))
    case = make_case(splits=CROSS_FIT | {"block_gap_s": 15.0})
    assert [block.time_s[0] for block in cut_blocks(recording, case)] == [0.0, 35.0]


def test_each_fold_tests_calibrates_and_validates_other_blocks(make_case, make_recording):
    recordings = [make_recording(f"r{i}", 70, split="cross-fit") for i in range(2)]
    case = make_case(splits=CROSS_FIT)
    assert [block.info.fold for block in deal_blocks(recordings, case)] == [0, 1, 2, 3, 0, 1]
    parts = assign_splits(recordings, case, {}, 3, 1)
    assert names(parts) == {
        "train": ["r0-block-02"],
        "validation": ["r0-block-01", "r1-block-02"],
        "calibration": ["r0-block-00", "r1-block-01"],
        "development": [],
        "test": ["r1-block-00"],
    }


def test_other_recordings_take_turns_over_the_folds(make_case, make_recording):
    recordings = [make_recording("r", 200, split="cross-fit")]
    recordings += [make_recording(f"novel{i}", disturbance="novel") for i in range(6)]
    recordings += [make_recording("fixed", disturbance="novel", fold=2)]
    case = make_case(splits=CROSS_FIT)
    tested = [
        [item.name for item in assign_splits(recordings, case, {}, fold, 1)["test"]]
        for fold in range(4)
    ]
    novel = [[name for name in fold if "block" not in name] for fold in tested]
    assert novel == [["novel0", "novel4"], ["novel1", "novel5"], ["novel2", "fixed"], ["novel3"]]


@pytest.mark.parametrize(
    ("samples", "fold", "message"),
    [(60, 0, r"4 folds, but .* give 2"), (200, 4, "fold 4 is not one"), (200, None, "fold None")],
)
def test_cross_fit_that_cannot_be_met(make_case, make_recording, samples, fold, message):
    recordings = [make_recording("r", samples, split="cross-fit")]
    with pytest.raises(OdisarError, match=message):
        assign_splits(recordings, make_case(splits=CROSS_FIT), {}, fold, 1)

"""What holds for every recording: stores and files keep it, splits and faults respect it."""

import itertools
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

from odisar.config.cases import Case
from odisar.recordings.faults import inject_faults
from odisar.recordings.reader import read_case
from odisar.recordings.schema import Interval, Recording, RecordingInfo, label_times
from odisar.recordings.splits import PARTS, assign_splits, deal_blocks
from odisar.recordings.store import read_store, write_store
from odisar.recordings.writer import write_recordings
from small_system import SCORE

TEXT = st.text(st.characters(min_codepoint=32, exclude_categories=("C", "Z")), max_size=8)
NUMBER = st.floats(-1e6, 1e6)


def make_case(splits=None, faults=None):
    channels = [
        {"name": name, "unit": "m", "role": "state", "output": True, "known_ahead": False,
         "min": -1e6, "max": 1e6}
        for name in ("x", "y")
    ]  # fmt: skip
    return Case(
        title="",
        source={"folder": "folder", "maker": "none", "time_column": "time_s", "max_recordings": 50,
                "csv": {"separator": "comma", "decimal": "point"}, "bag": None, "resample": "none"},
        rate_hz=2.0,
        max_gap_s=0.75,
        channels=channels,
        pose=None,
        window={"context_steps": 2, "horizon_steps": 1},
        splits={"kind": "metadata", "fractions": None, "folds": None, "block_s": None,
                "block_gap_s": None} | (splits or {}),
        score=SCORE,
        persistence_s=1.0,
        short_lead_s=0.5,
        guard_start_s=10.0,
        guard_end_s=10.0,
        groups={"overall": {}, "group_by": [], "apart": [], "with_clean": []},
        faults=faults,
        range_rules=[],
    )  # fmt: skip


@st.composite
def infos(draw):
    return RecordingInfo(
        case="case",
        maneuver=draw(TEXT),
        variant=draw(TEXT),
        disturbance="wind",
        components=draw(st.sampled_from(["none", "all"])),
        strength=draw(st.none() | NUMBER),
        base_seed=draw(TEXT),
        split=draw(st.sampled_from(PARTS)),
        fold=draw(st.none() | st.integers(0, 9)),
        extra={"sea": draw(TEXT)},
    )


@st.composite
def segmented(draw, name, info, values=None, shortest=3):
    """A recording of up to three segments at 2 Hz, with one labelled interval."""
    lengths = draw(st.lists(st.integers(shortest, shortest + 30), min_size=1, max_size=3))
    borders = np.cumsum([0, *lengths])
    time_s = np.arange(borders[-1]) / 2 + np.repeat(np.arange(len(lengths)) * 7.5, lengths)
    if values is None:
        values = np.column_stack([np.sin(time_s), np.cos(time_s)])
    else:
        values = draw(npst.arrays(np.float64, (int(borders[-1]), 2), elements=values))
    start, stop = sorted(draw(st.tuples(*[st.integers(0, int(time_s[-1]))] * 2)))
    intervals = (Interval(float(start), float(stop), "wind"),) if start < stop else ()
    segments = tuple(zip(borders[:-1].tolist(), borders[1:].tolist(), strict=True))
    return Recording(name, info, time_s, values, intervals, segments)


def same(left, right):
    assert (left.name, left.info) == (right.name, right.info)
    assert (left.intervals, left.segments) == (right.intervals, right.segments)


@given(st.data())
@settings(max_examples=40, deadline=None)
def test_a_store_returns_every_bit(data):
    anything = st.floats(width=64)
    recordings = [
        data.draw(segmented(f"r{i}", data.draw(infos()), anything))
        for i in range(data.draw(st.integers(0, 3)))
    ]
    with tempfile.TemporaryDirectory() as folder:
        write_store(Path(folder), recordings)
        read = read_store(Path(folder))
    assert len(read) == len(recordings)
    for left, right in zip(recordings, read, strict=True):
        same(left, right)
        assert left.time_s.tobytes() == right.time_s.tobytes()
        assert left.values.tobytes() == right.values.tobytes()


@given(st.data())
@settings(max_examples=40, deadline=None)
def test_files_return_what_was_written_to_six_decimals(data):
    count = data.draw(st.integers(1, 3))
    recordings = [
        data.draw(segmented(f"r{i}", data.draw(infos()), NUMBER, shortest=4)) for i in range(count)
    ]
    for recording in recordings:
        recording.values[:2] = [[0.0, 1.0], [1.0, 0.0]]
    with tempfile.TemporaryDirectory() as root:
        write_recordings(Path(root) / "folder", recordings, ["x", "y"])
        result = read_case("case", make_case(), Path(root))
    assert [found for found in result.findings if found.severity == "error"] == []
    for left, right in zip(recordings, result.recordings, strict=True):
        same(left, right)
        np.testing.assert_allclose(left.time_s, right.time_s, atol=5.1e-7, rtol=0)
        np.testing.assert_allclose(left.values, right.values, atol=5.1e-7, rtol=0)


@given(
    st.lists(st.sampled_from(["", "s1", "s2", "s3"]), max_size=12),
    st.integers(0, 2**32),
)
@settings(max_examples=60, deadline=None)
def test_fractions_put_every_recording_in_one_split_and_clusters_together(seeds, seed):
    seeds = ["", "", "", "", *seeds]
    recordings = [
        Recording(
            f"r{i}", RecordingInfo("case", base_seed=cluster), np.arange(2.0), np.ones((2, 2))
        )
        for i, cluster in enumerate(seeds)
    ]
    fractions = {"train": 0.5, "validation": 0.1, "calibration": 0.2, "test": 0.2}
    case = make_case({"kind": "fractions", "fractions": fractions})
    parts = assign_splits(recordings, case, {}, None, seed)
    placed = [(item.name, part) for part in PARTS for item in parts[part]]
    assert sorted(name for name, _ in placed) == sorted(item.name for item in recordings)
    assert all(parts[part] for part in fractions)
    homes = {(seeds[int(name[1:])], part) for name, part in placed if seeds[int(name[1:])]}
    assert len(homes) == len({cluster for cluster in seeds if cluster})


@given(st.data(), st.integers(4, 6), st.integers(3, 8), st.integers(0, 6))
@settings(max_examples=60, deadline=None)
def test_every_block_tests_in_one_fold_and_has_one_part_in_each(data, folds, steps, gap_steps):
    info = RecordingInfo("case", split="cross-fit")
    recordings = [data.draw(segmented(f"r{i}", info, shortest=60)) for i in range(3)]
    recordings += [
        data.draw(segmented(f"novel{i}", RecordingInfo("case", disturbance="novel", fold=fold)))
        for i, fold in enumerate(data.draw(st.lists(st.none() | st.integers(0, folds - 1))))
    ]
    case = make_case({
        "kind": "cross-fit", "folds": folds, "block_s": steps / 2, "block_gap_s": gap_steps / 2,
    })  # fmt: skip
    blocks = deal_blocks(recordings, case)
    tested = Counter()
    for fold in range(folds):
        parts = assign_splits(recordings, case, {}, fold, 1)
        placed = [item.name for part in PARTS for item in parts[part]]
        assert len(placed) == len(set(placed))
        assert {block.name for block in blocks} <= set(placed)
        tested.update(item.name for item in parts["test"])
    whole = {block.name for block in blocks} | {f"novel{i}" for i in range(len(recordings) - 3)}
    assert tested == Counter(whole)
    for recording in recordings[:3]:
        own = [block for block in blocks if block.name.startswith(f"{recording.name}-")]
        for block in own:
            np.testing.assert_allclose(np.diff(block.time_s), 0.5)
            assert len(block.time_s) == steps
        for before, after in itertools.pairwise(own):
            assert after.time_s[0] - before.time_s[-1] >= 0.5 + gap_steps / 2 - 1e-6


@given(st.data(), st.integers(0, 2**32))
@settings(max_examples=60, deadline=None)
def test_a_fault_leaves_everything_outside_its_interval_untouched(data, seed):
    recording = data.draw(segmented("r", RecordingInfo("case"), NUMBER, shortest=20))
    faults = {
        "kinds": ["noise", "bias", "drift", "stuck", "delay"], "channels": ["y"],
        "sizes": {"noise": [0.5, 2.0], "bias": [0.5, 2.0], "drift": [0.5, 2.0]}, "sizes_in": "sd",
        "delays_s": [1.3], "creep": None, "start_s": 1.5, "duration_s": {"low": 2.0, "high": 4.0},
        "shows_from_sd": 0.25,
    }  # fmt: skip
    original = recording.values.tobytes()
    for copy in inject_faults([recording], make_case(faults=faults), np.ones(2), seed):
        inside = label_times(copy.time_s, copy.intervals)
        assert 4 <= inside.sum() <= 8
        assert copy.values[~inside].tobytes() == recording.values[~inside].tobytes()
        assert copy.values[:, 0].tobytes() == recording.values[:, 0].tobytes()
        assert np.isfinite(copy.values).all()
    assert recording.values.tobytes() == original

"""What holds of the runs as they are published; left out where there is no copy of them."""

import os
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import yaml

from odisar.config.cases import Case
from odisar.config.sources import Omni3Config
from odisar.recordings.reader import read_case
from odisar.recordings.writer import write_recordings
from odisar.sources import fetch
from odisar.sources.omni3 import CHANNEL_NAMES, convert_omni3
from odisar.sources.omni3_runs import list_runs
from odisar.windows.coordinates import pose_rates

LOCAL = os.environ.get("ODISAR_OMNI3_FOLDER", "")
PARAMS = Path(__file__).parents[3] / "params.yaml"


@pytest.fixture(scope="module")
def real():
    if not LOCAL:
        pytest.skip("needs ODISAR_OMNI3_FOLDER, a copy of the published runs")
    config = Omni3Config.model_validate(yaml.safe_load(PARAMS.read_text())["sources"]["omni3"])
    runs = list_runs(fetch.read_registry(config.files))
    return convert_omni3(Path(LOCAL), runs, config, "omni3")


def test_the_published_runs_give_the_known_splits(real):
    recordings, summary = real
    assert summary["published_s"].sum() == pytest.approx(4537.08, abs=0.01)
    assert Counter(summary["split"]) == {
        "train": 26,
        "validation": 5,
        "calibration": 15,
        "test": 33,
        "none": 1,
    }
    assert len(recordings) == 79
    hours = summary[summary["use"] == "reference"].groupby("split")["seconds"].sum() / 3600
    assert hours["train"] > 0.37
    assert hours["calibration"] > 0.21
    assert hours["test"] > 0.30


def test_every_session_of_four_runs_or_more_trains_and_tests(real):
    _, summary = real
    known = summary[summary["use"] == "reference"]
    for _, session in known.groupby("session"):
        assert len(session) >= 4
        assert {"train", "test"} <= set(session["split"])


def test_the_published_wheels_agree_with_the_tracked_pose(real):
    recordings, _ = real
    wheels, pose = [], []
    for recording in recordings:
        rates = pose_rates(recording.time_s, recording.values[:, :3])
        wheels.append(recording.values[1:, 3:])
        pose.append(rates[1:])
    wheels, pose = np.concatenate(wheels), np.concatenate(pose)
    for channel, spread in enumerate((0.016, 0.016, 0.08)):
        assert np.corrcoef(wheels[:, channel], pose[:, channel])[0, 1] > 0.95
        assert np.std(wheels[:, channel] - pose[:, channel]) < spread


def test_the_published_runs_are_read_back_without_a_word_and_hold_a_fault(real, tmp_path):
    recordings, _ = real
    case = Case.model_validate(yaml.safe_load(PARAMS.read_text())["cases"]["omni3"])
    assert tuple(case.channel_names) == CHANNEL_NAMES
    write_recordings(tmp_path / case.source.folder, recordings, CHANNEL_NAMES)
    read = read_case("omni3", case, tmp_path)
    assert read.findings == []
    assert len(read.recordings) == len(recordings)
    shortest_s = min(len(r.time_s) for r in read.recordings) / case.rate_hz
    assert shortest_s > case.faults.start_s + case.faults.duration_s.high

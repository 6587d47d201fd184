"""A user's own model is probed on recordings of a set-up, by its dotted name."""

import sys
from pathlib import Path

import pytest

from odisar.config.loader import load_config
from odisar.errors import OdisarError
from odisar.stages.members import MemberData
from odisar.study import leakage
from odisar.study.leakage import probe_own_model
from odisar.windows.scaling import Scaler
from small_bundle import small_case
from small_system import SPEC, make_recording

MODULE = """
import numpy as np

def now(recordings):
    return [np.exp(recording.values[:, 1]) for recording in recordings]

def next_sample(recordings):
    return [np.exp(np.roll(recording.values[:, 1], -1)) for recording in recordings]

def late(recordings):
    return [
        np.append([np.nan, np.nan], np.exp(recording.values[:-2, 1])) for recording in recordings
    ]
"""


@pytest.fixture(scope="module")
def config(request):
    """Return the shipped parameters, read once."""
    return load_config(request.config.rootpath)


@pytest.fixture(autouse=True)
def _member(monkeypatch, tmp_path, config):
    train = [make_recording(f"train-{i}", 100) for i in range(2)]
    splits = {"train": train, "calibration": [make_recording("calibration", 100)]}
    data = MemberData(small_case(), splits, Scaler.fit(train, SPEC), SPEC)
    monkeypatch.setattr(leakage, "load_config", lambda _: config)
    monkeypatch.setattr(leakage, "load_member", lambda *_: data)
    monkeypatch.setattr(sys, "path", list(sys.path))
    (tmp_path / "my_small_detector.py").write_text(MODULE)
    monkeypatch.chdir(tmp_path)
    yield
    sys.modules.pop("my_small_detector", None)


def test_a_score_that_looks_at_now_passes():
    report = probe_own_model(Path(), "my_small_detector:now", "vessel-all", 0)
    assert report.passed
    assert report.detector == "my_small_detector:now"


def test_a_score_that_looks_at_the_next_sample_is_caught():
    report = probe_own_model(Path(), "my_small_detector:next_sample", "vessel-all", 0)
    assert {"future", "truncation"} <= set(report.failed_probes)


@pytest.mark.parametrize(("delay_steps", "failed"), [(0, ("control",)), (2, ())])
def test_a_late_score_passes_with_the_delay_that_is_stated(delay_steps, failed):
    report = probe_own_model(Path(), "my_small_detector:late", "vessel-all", delay_steps)
    assert report.failed_probes == failed


def test_an_unknown_set_up_is_refused_with_those_there_are():
    with pytest.raises(OdisarError, match=r"'boat' is not declared; declared: .*vessel-all"):
        probe_own_model(Path(), "my_small_detector:now", "boat", 0)

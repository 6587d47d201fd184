"""The bundle stage: which samples become the example, and what is compared with what."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from odisar.errors import OdisarError
from odisar.stages.bundle import _example, _inputs_key, _settings, measure_again
from small_bundle import small_case, small_settings
from small_system import make_recording


def test_the_example_is_the_first_stretch_that_would_be_accepted():
    recording = make_recording("calibration", 120)
    values = recording.values.copy()
    values[:45, 1] = 0.5  # a state that does not change for a whole example
    example = _example([replace(recording, values=values)], "system", small_case(), 11)
    assert len(example.data) == 41
    assert example.data[0][0] == 10.0
    np.testing.assert_array_equal(np.array(example.data)[:, 1:], values[10:51])


def test_no_example_reaches_over_a_gap():
    recording = make_recording("calibration", 70)
    time_s = recording.time_s + np.where(recording.time_s >= 25, 100.0, 0.0)
    cut = replace(recording, time_s=time_s, segments=((0, 25), (25, 70)))
    assert _example([cut], "system", small_case(), 11).data[0][0] == 125.0


def test_recordings_without_a_sound_stretch_are_refused():
    still = replace(make_recording("still", 60), values=np.ones((60, 3)))
    with pytest.raises(OdisarError, match="add calibration recordings"):
        _example([still], "system", small_case(), 11)


def test_the_key_names_what_went_in(tmp_path):
    (tmp_path / "twin").mkdir()
    (tmp_path / "twin/weights").write_bytes(b"1")
    (tmp_path / "limits.json").write_bytes(b"2")
    paths = [tmp_path / "twin", tmp_path / "limits.json"]
    key = _inputs_key(paths)
    assert _inputs_key(paths) == key
    (tmp_path / "twin/weights").write_bytes(b"3")
    assert _inputs_key(paths) != key


def test_a_champion_of_other_channels_is_not_measured():
    case = small_case()
    channels = [c.model_dump() for c in case.channels][:2]
    then = SimpleNamespace(case=small_case(channels=channels))
    config = SimpleNamespace(case_of=lambda _: case)
    with pytest.raises(OdisarError, match="its channels are Command, Speed, today's"):
        measure_again(config, None, "small", then)


def test_a_threshold_that_flags_everything_is_not_deployed(trained_twin):
    config = SimpleNamespace(
        capability=SimpleNamespace(threshold_sigmas=3.0, attribution_top=3, scoring_batch=8),
        registry=SimpleNamespace(max_rows=10),
    )
    limits = {
        "innovation": small_settings(trained_twin).innovation.model_dump(),
        "thresholds": {"score": 1.0, "reconstruction": 1.0, "variance": 1.0},
        "sigma": {"odisar": 1.0},
        "operating": {"odisar": 0.0},
        "operating_pooled": 0,
        "calibration_hours": 1.0,
    }
    with pytest.raises(OdisarError, match=r"operating\.odisar"):
        _settings(config, limits, 10)

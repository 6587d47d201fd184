import hashlib
import os

import numpy as np
import pandas as pd
import pytest

from odisar.config.sources import GunnerusConfig
from odisar.errors import OdisarError
from odisar.sources.gunnerus import (
    CHANNEL_NAMES,
    convert_gunnerus,
    describe_summary,
    make_gunnerus,
    summary_path,
)

LOCAL = os.environ.get("ODISAR_GUNNERUS_CSV", "")


def trial(seconds_at_rpm, spare=1):
    """A table as published: 2 Hz, ordered RPM in steps, every column a different ramp."""
    rpm = np.repeat([rpm for _, rpm in seconds_at_rpm], [2 * s for s, _ in seconds_at_rpm])
    rpm = np.append(rpm, np.full(spare, rpm[-1])).astype(float)
    samples = np.arange(len(rpm))
    return pd.DataFrame(
        {
            "tvec": samples / 2,
            "N": 0.0,
            "E": 0.0,
            "phi": 0.001 * samples**2,
            "psi": 0.0,
            "u": 1.0 * samples,
            "v": 2.0 * samples,
            "r": 3.0 * samples,
            "Azi": 4.0 * samples,
            "RPM": rpm,
        }
    )


def samples_of(recording):
    return pd.DataFrame(recording.values, columns=list(CHANNEL_NAMES), index=recording.time_s)


@pytest.fixture
def write(tmp_path):
    def _write(table):
        path = tmp_path / "trial.csv"
        table.to_csv(path)
        return path

    return _write


def test_pairs_are_averaged_and_the_first_second_has_no_roll_rate(write, config):
    recordings, _ = convert_gunnerus(write(trial([(40, 170)])), config, "gunnerus")
    (recording,) = recordings
    # The second pair is samples 2 and 3 of the file; phi of a pair is 0.001 times mean(k^2).
    first_pair, second_pair = -0.001 * (0 + 1) / 2, -0.001 * (4 + 9) / 2
    expected = {
        "Azimuth Angle": 4 * 2.5,
        "Propeller Speed": 170.0,
        "Surge Speed": 2.5,
        "Sway Speed": 2 * 2.5,
        "Yaw Rate": 3 * 2.5,
        "Roll Angle": second_pair,
        "Roll Rate": second_pair - first_pair,
    }
    assert tuple(expected) == CHANNEL_NAMES
    samples = samples_of(recording)
    np.testing.assert_allclose(samples.iloc[0], list(expected.values()), rtol=1e-12)
    np.testing.assert_array_equal(samples.index, np.arange(39.0))
    assert recording.info.column("trial_start_s") == "1"


def test_no_channel_knows_a_later_sample(write, config):
    table = trial([(40, 170)])
    (before,), _ = convert_gunnerus(write(table), config, "gunnerus")
    changed = table.copy()
    changed.loc[40:, ["phi", "u", "v", "r", "Azi"]] = 7.0
    (after,), _ = convert_gunnerus(write(changed), config, "gunnerus")
    # Samples 40 and 41 of the file are second 20, which is row 19.
    differs = (samples_of(before) != samples_of(after)).any(axis=1)
    assert not differs.iloc[:19].any()
    assert differs.iloc[19]


def test_regimes_become_cross_fit_recordings_and_novel_pieces(write, config):
    table = trial([(40, 170), (70, 110), (10, 170), (50, 110), (60, 170)])
    recordings, _ = convert_gunnerus(write(table), config, "gunnerus")
    kinds = [(r.name, r.info.split, r.info.disturbance, r.info.components) for r in recordings]
    assert kinds == [
        ("rpm-170-stretch-1", "cross-fit", "none", "none"),
        ("rpm-110-stretch-1-piece-1", "test", "novel", "all"),
        ("rpm-110-stretch-1-piece-2", "test", "novel", "all"),
        ("rpm-110-stretch-2-piece-1", "test", "novel", "all"),
        ("rpm-110-stretch-2-piece-2", "test", "novel", "all"),
        ("rpm-170-stretch-2", "cross-fit", "none", "none"),
    ]
    for recording in recordings:
        assert recording.info.base_seed == recording.name
        assert recording.info.maneuver == "sea-trial"
        assert recording.info.variant == recording.name[:7]
        spans = [(i.start_s, i.end_s, i.label) for i in recording.intervals]
        novel = recording.info.is_disturbed
        assert spans == ([(0.0, float(len(recording.time_s)), "novel")] if novel else [])


def test_pieces_of_a_stretch_hold_each_of_its_samples_once(write, config):
    recordings, summary = convert_gunnerus(
        write(trial([(40, 170), (100, 110)])), config, "gunnerus"
    )
    pieces = [r for r in recordings if r.info.split == "test"]
    starts = [float(r.info.column("trial_start_s")) for r in pieces]
    lengths = [len(r.time_s) for r in pieces]
    np.testing.assert_array_equal(np.cumsum([starts[0], *lengths])[:-1], starts)
    row = summary[summary["regime"] == "rpm-110"].iloc[0]
    assert sum(lengths) == row["seconds"]
    assert row["recordings"] == len(pieces) == 3


def test_every_second_is_accounted_for(write, config):
    table = trial([(40, 170), (8, 140), (12, 110), (8, 140), (60, 170), (5, 110)])
    recordings, summary = convert_gunnerus(write(table), config, "gunnerus")
    assert summary["seconds"].sum() == len(table) / 2
    np.testing.assert_array_equal(summary["start_s"].to_numpy()[1:], summary["end_s"][:-1])
    written = summary[summary["outcome"] == "written"]
    assert written["seconds"].sum() == sum(len(r.time_s) for r in recordings)
    assert "left out: shorter than minimum_s=20" in set(summary["outcome"])
    assert "left out: outside every regime" in set(summary["outcome"])
    assert summary.iloc[-1]["outcome"] == "left out: too few samples to average"
    text = describe_summary(summary)
    assert text.startswith(f"conversion: {len(table) / 2:.1f} s")
    assert all(outcome in text for outcome in set(summary["outcome"]) - {"written"})


def test_a_short_dip_in_speed_does_not_end_a_stretch(write, config):
    table = trial([(40, 170), (1, 158), (40, 170)])
    recordings, _ = convert_gunnerus(write(table), config, "gunnerus")
    assert [len(r.time_s) for r in recordings] == [80]


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda t: t.drop(columns="phi"), "no column phi"),
        (lambda t: t.astype({"u": object}).replace({"u": {5.0: "x"}}), "row 7, column u: 'x'"),
        (lambda t: t.drop(index=10), "row 12, column tvec: a step of 1 s"),
        (lambda t: t.assign(RPM=110.0), "no stretch of a reference regime"),
    ],
)
def test_a_file_that_is_not_the_trial_is_refused(write, config, damage, message):
    with pytest.raises(OdisarError, match=message):
        convert_gunnerus(write(damage(trial([(40, 170)]))), config, "gunnerus")


def test_regimes_that_overlap_are_no_configuration(settings):
    settings["regimes"][1]["max_rpm"] = 165.0
    with pytest.raises(ValueError, match="overlap between 164"):
        GunnerusConfig.model_validate(settings)


def test_folder_summary_and_licence_come_from_one_call(write, settings, tmp_path, monkeypatch):
    csv = write(trial([(40, 170), (40, 110)]))
    settings["file"]["sha256"] = hashlib.sha256(csv.read_bytes()).hexdigest()
    monkeypatch.setenv("ODISAR_TEST_TRIAL_CSV", str(csv))
    said = []
    folder = tmp_path / "data" / "gunnerus"
    written = make_gunnerus(GunnerusConfig.model_validate(settings), tmp_path, folder, said.append)
    assert {path.name for path in folder.iterdir()} == {
        "recordings.csv",
        "labels.csv",
        "rpm-170-stretch-1.csv",
        "rpm-110-stretch-1-piece-1.csv",
    }
    assert set(written) == {*folder.iterdir(), summary_path(folder)}
    samples = pd.read_csv(folder / "rpm-170-stretch-1.csv")
    assert tuple(samples.columns) == ("time_s", *CHANNEL_NAMES)
    assert pd.read_csv(summary_path(folder))["seconds"].sum() == 80.5
    assert "GPL-3" in said[0]
    assert said[1].startswith("conversion: 80.5 s")


@pytest.mark.skipif(not LOCAL, reason="needs ODISAR_GUNNERUS_CSV, a copy of the published trial")
def test_the_published_trial_gives_the_known_stretches(settings):
    settings |= {"regime_window_s": 31.0, "minimum_s": 90.0, "piece_s": 300.0}
    settings["regimes"].append(
        {"name": "rpm-205", "min_rpm": 195.0, "max_rpm": 210.0, "use": "novel"}
    )
    recordings, summary = convert_gunnerus(
        LOCAL, GunnerusConfig.model_validate(settings), "gunnerus"
    )
    lengths = [len(r.time_s) for r in recordings if r.info.split == "cross-fit"]
    assert lengths == [483, 514, 1818, 140, 283, 149]
    assert summary["seconds"].sum() == 8850.5
    novel = [r for r in recordings if r.info.split == "test"]
    seconds = {"rpm-110": 0, "rpm-205": 0}
    for recording in novel:
        seconds[recording.info.variant] += len(recording.time_s)
    assert seconds == {"rpm-110": 3787, "rpm-205": 1103}
    samples = pd.concat([samples_of(r) for r in recordings])
    # Thrusters aft: positive azimuth turns to port, and the vessel heels outward, starboard down.
    assert samples["Azimuth Angle"].corr(samples["Yaw Rate"]) < -0.8
    assert samples["Yaw Rate"].corr(samples["Roll Angle"]) > 0.7

import hashlib
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from odisar.config.sources import Omni3Config
from odisar.errors import OdisarError
from odisar.sources import fetch, omni3
from odisar.sources.omni3 import CHANNEL_NAMES, convert_omni3, describe_summary, make_omni3
from odisar.sources.omni3_runs import (
    Run,
    body_velocities,
    convert_run,
    list_runs,
    read_robot,
    read_run,
    wrap_heading,
)

PARAMS = Path(__file__).parents[3] / "params.yaml"
METADATA = "type,omni3,\nngear,10,\nencRes,100,\nLi,0.2,\nDi,0.1,0.1,0.2\nThi,,\n"
M_PER_TICK = np.pi * np.array([0.1, 0.1, 0.2]) / 1000


@pytest.fixture
def settings():
    """The section of params.yaml, with sessions of the made-up runs below."""
    section = yaml.safe_load(PARAMS.read_text())["sources"]["omni3"]
    return section | {
        "excluded": [{"session": "9", "reason": "its clocks disagree"}],
        "split_cycle": ["train", "test", "calibration", "validation"],
        "minimum_s": 4.0,
    }


@pytest.fixture
def config(settings):
    return Omni3Config.model_validate(settings)


def table(samples, seed=1):
    """A run as published: 25 Hz, whole ticks, a heading that passes pi."""
    random = np.random.default_rng(seed)
    time_s = np.arange(samples) / 25
    pose = np.cumsum(random.normal(0, 0.01, (samples, 2)), axis=0)
    ticks = random.integers(-40, 40, (samples, 3))
    return np.column_stack([time_s, pose, 4.0 + time_s / 10, ticks])


def write_run(folder, run, rows):
    path = folder / run.path
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savetxt(path, rows, delimiter=",", fmt="%.15g")
    (folder / run.metadata).write_text(METADATA)
    return path


@pytest.fixture
def published(tmp_path):
    """Nine runs: five on a square, one too short, two by joystick, one of an excluded session."""
    folder = tmp_path / "published"
    lengths = {
        Run("square", "1", "01"): 200,
        Run("square", "1", "02"): 201,
        Run("square", "1", "03"): 90,
        Run("square", "1", "04"): 202,
        Run("square", "2", "01"): 203,
        Run("square", "2", "02"): 204,
        Run("joystick", "3", "01"): 200,
        Run("joystick", "3", "02"): 200,
        Run("circular", "9", "01"): 200,
    }
    for seed, (run, samples) in enumerate(lengths.items()):
        write_run(folder, run, table(samples, seed))
    return folder


def runs_in(folder):
    return list_runs(p.relative_to(folder).as_posix() for p in folder.rglob("*.csv"))


def test_a_sample_is_the_last_one_before_each_tenth_of_a_second_under_its_own_stamp(
    published, config
):
    run = table(200)
    time_s, values = convert_run(run, read_robot(published / "square/1/1_metadata.csv"), config)
    # Every tenth of a second: samples 0, 2, 5, 7, 10 ... The first has no velocity.
    taken = np.sort(np.concatenate([np.arange(0, 200, 5), np.arange(2, 200, 5)]))[1:]
    taken = taken[: len(time_s)]
    np.testing.assert_array_equal(time_s, run[taken, 0])
    np.testing.assert_array_equal(values[:, :2], run[taken, 1:3])
    assert set(np.round(np.diff(time_s), 9)) == {0.08, 0.12}
    # 0.08 to 7.88 s: whole pairs of steps, so that the mean and the median step are the period.
    assert len(time_s) == 79
    assert np.mean(np.diff(time_s)) == pytest.approx(0.1)
    assert np.median(np.diff(time_s)) == pytest.approx(0.1)


def test_no_tick_is_lost_and_none_comes_from_a_later_sample(published, config):
    robot = read_robot(published / "square/1/1_metadata.csv")
    np.testing.assert_allclose(robot.m_per_tick, M_PER_TICK)
    run = table(200)
    time_s, values = convert_run(run, robot, config)
    last = round(time_s[-1] * 25)
    travelled = np.sum(values[:, 3:] * np.diff(time_s, prepend=0.0)[:, None], axis=0)
    rims = run[1 : last + 1, 4:].sum(axis=0) * M_PER_TICK
    np.testing.assert_allclose(travelled, body_velocities(rims, 0.2), atol=1e-12)
    for changed_from in (20, 21, 22, 23, 24):
        changed = run.copy()
        changed[changed_from:, 1:] += 5.0
        _, after = convert_run(changed, robot, config)
        differs = (after != values).any(axis=1)
        np.testing.assert_array_equal(differs, time_s >= run[changed_from, 0])


def test_wheels_that_turn_a_known_way_move_the_robot_a_known_way():
    def rims(ahead, left, turn):
        """The rims' speeds of wheels at -60, 60 and 180 degrees from ahead."""
        sine, cosine = np.sqrt(3) / 2, 0.5
        return np.array(
            [
                -sine * ahead - cosine * left - 0.2 * turn,
                sine * ahead - cosine * left - 0.2 * turn,
                left - 0.2 * turn,
            ]
        )

    motions = np.array([[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0], [0.3, -0.2, 0.7]])
    speeds = np.array([rims(*motion) for motion in motions])
    np.testing.assert_allclose(body_velocities(speeds, 0.2), motions, atol=1e-12)


def test_headings_are_wrapped_and_plus_pi_stays():
    headings = np.array([0.0, np.pi, -np.pi, 3.5, -12.0, 12.0])
    wrapped = wrap_heading(headings)
    np.testing.assert_allclose(wrapped[:3], [0.0, np.pi, np.pi])
    assert ((wrapped > -np.pi) & (wrapped <= np.pi)).all()
    np.testing.assert_allclose(np.exp(1j * wrapped), np.exp(1j * headings), atol=1e-12)


def test_runs_are_dealt_over_the_splits_and_novel_ones_only_test(published, config):
    recordings, summary = convert_omni3(published, runs_in(published), config, "omni3")
    dealt = [(r.name, r.info.split, r.info.disturbance, r.info.components) for r in recordings]
    assert dealt == [
        ("joystick-3-run-01", "test", "novel", "all"),
        ("joystick-3-run-02", "test", "novel", "all"),
        ("square-1-run-01", "train", "none", "none"),
        ("square-1-run-02", "test", "none", "none"),
        ("square-1-run-04", "calibration", "none", "none"),
        ("square-2-run-01", "validation", "none", "none"),
        ("square-2-run-02", "train", "none", "none"),
    ]
    for recording in recordings:
        assert recording.info.base_seed == recording.name
        assert recording.name == "{}-{}-run-{}".format(
            recording.info.maneuver, recording.info.variant, recording.info.column("run")
        )
        assert recording.info.column("session") == recording.info.variant
        spans = [(i.start_s, i.end_s, i.label) for i in recording.intervals]
        novel = recording.info.is_disturbed
        end_s = pytest.approx(recording.time_s[-1] + 0.1)
        assert spans == ([(recording.time_s[0], end_s, "novel")] if novel else [])
    assert len(summary) == 9


def test_every_run_is_accounted_for(published, config):
    recordings, summary = convert_omni3(published, runs_in(published), config, "omni3")
    by_name = summary.set_index("recording")
    assert by_name.loc["circular-9-run-01", "outcome"] == "left out: its clocks disagree"
    assert by_name.loc["square-1-run-03", "outcome"] == "left out: shorter than minimum_s=4"
    written = by_name[by_name["outcome"] == "written"]
    assert dict(written["samples"]) == {r.name: len(r.time_s) for r in recordings}
    assert dict(written["split"]) == {r.name: r.info.split for r in recordings}
    assert (by_name.drop(written.index)["samples"] == 0).all()
    text = describe_summary(summary)
    assert text.startswith(f"conversion: {summary['published_s'].sum():.1f} s in 9 runs")
    assert "  test, novel: 2 run(s) of 1 session(s), 0.00 h" in text
    assert "  train: 2 run(s) of 2 session(s), 0.00 h" in text
    assert "  left out: its clocks disagree: 1 run(s), 8.0 s" in text


def test_folder_summary_and_licence_come_from_one_call(published, config, tmp_path, monkeypatch):
    registry = {
        p.relative_to(published).as_posix(): hashlib.sha256(p.read_bytes()).hexdigest()
        for p in published.rglob("*.csv")
    }
    for module in (fetch, omni3):
        monkeypatch.setattr(module, "read_registry", lambda _: registry)
    monkeypatch.setenv("ODISAR_OMNI3_FOLDER", str(published))
    said = []
    folder = tmp_path / "data" / "omni3"
    written = make_omni3(config, tmp_path, folder, said.append)
    summary = folder.with_name("omni3-conversion-summary.csv")
    assert set(written) == {*folder.iterdir(), summary}
    samples = pd.read_csv(folder / "square-1-run-01.csv")
    assert tuple(samples.columns) == ("time_s", *CHANNEL_NAMES)
    assert len(pd.read_csv(summary)) == 9
    assert len(said) == 2
    assert "MIT" in said[0]
    assert said[1].startswith("conversion: ")


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda _: [], r"row 1: there are no samples"),
        (
            lambda lines: [*lines[:4], "0.16,1,2,3,4,5", *lines[5:]],
            r"row 5: found 6 columns, expected 7",
        ),
        (
            lambda lines: [*lines[:4], "0.16,1,2,3,4,x,6", *lines[5:]],
            r"row 5, column 6 \(ticks 2\): 'x' is not a number",
        ),
        (
            lambda lines: [*lines[:4], "0.16,1,nan,3,4,5,6", *lines[5:]],
            r"row 5, column 3 \(y\): 'nan' is not a number",
        ),
        (
            lambda lines: [*lines[:4], lines[3], *lines[5:]],
            r"row 5, column 1 \(time\): the time goes back or stands still \(a step of 0 s\)",
        ),
        (
            lambda lines: [*lines[:4], *lines[5:]],
            r"row 5, column 1 \(time\): a step of 0\.08 s where .*raw_rate_hz=25 says 0\.04 s",
        ),
    ],
)
def test_a_run_that_is_not_as_published_is_refused_by_row_and_column(
    published, config, damage, message
):
    path = published / "square/1/1_run-01.csv"
    path.write_text("".join(f"{line}\n" for line in damage(path.read_text().splitlines())))
    with pytest.raises(OdisarError, match=message) as caught:
        read_run(path, config)
    assert str(caught.value).startswith(f"{path}: ")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("type,omni3", "type,diff", "row 1, column 2: the type is 'diff', expected 'omni3'"),
        ("encRes,100,\n", "", "no row 'encRes'"),
        ("Di,0.1,0.1,0.2", "Di,0.1,,0.2", r"row 5, column 3 \(Di\): '' is not a number"),
        ("Di,0.1,0.1,0.2", "Di,0.1", r"row 5, column 3: Di needs 3 value\(s\)"),
        ("ngear,10,", "ngear,-10,", "row 2: ngear is -10, expected more than 0"),
    ],
)
def test_metadata_that_do_not_describe_the_robot_are_refused(published, old, new, message):
    path = published / "square/1/1_metadata.csv"
    path.write_text(METADATA.replace(old, new))
    with pytest.raises(OdisarError, match=message) as caught:
        read_robot(path)
    assert str(caught.value).startswith(f"{path}: ")


def test_a_file_that_is_missing_is_named(published, config):
    (published / "square/1/1_run-01.csv").unlink()
    runs = [*runs_in(published), Run("square", "1", "01")]
    with pytest.raises(OdisarError, match=r"1_run-01\.csv: cannot be read"):
        convert_omni3(published, runs, config, "omni3")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"uses": {"square": "reference"}}, "does not say what circular, joystick is used for"),
        ({"excluded": [{"session": "8", "reason": "?"}]}, "8 is not among the published sessions"),
    ],
)
def test_a_configuration_that_does_not_fit_the_runs_is_refused(
    published, settings, change, message
):
    config = Omni3Config.model_validate(settings | change)
    with pytest.raises(OdisarError, match=message):
        convert_omni3(published, runs_in(published), config, "omni3")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"rate_hz": 50.0}, "must not be above raw_rate_hz"),
        ({"split_cycle": ["train", "test"]}, "calibration, validation has no place"),
        ({"excluded": [{"session": "8", "reason": "?"}] * 2}, "named twice"),
    ],
)
def test_a_section_that_contradicts_itself_is_no_configuration(settings, change, message):
    with pytest.raises(ValueError, match=message):
        Omni3Config.model_validate(settings | change)

import sys
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from sklearn.metrics import average_precision_score

from odisar.errors import OdisarError
from odisar.evaluation import range_aware
from odisar.evaluation.intervals import Resampler
from odisar.evaluation.labels import label_active
from odisar.evaluation.range_aware import (
    VUS_COLUMNS,
    mean_over_recordings,
    recording_vus_pr,
    vus_pr,
    vus_pr_table,
)
from odisar.recordings.schema import Interval

from .evaluation_cases import CONFIG, GROUPS, scored, vessel_test_set

TIMES = np.arange(0.0, 200.0)
EVENT = (80.0, 130.0)


@pytest.fixture
def tsadmetrics():
    """Skip where the packages of the study aren't installed."""
    return pytest.importorskip("tsadmetrics")


def recording(scores, event=EVENT, times=TIMES, **keywords):
    return scored(times, {"odisar": scores}, event, **keywords)


def disturbed():
    return label_active(TIMES, (Interval(*EVENT, "storm"),))


def noise(samples=200, seed=0):
    return np.random.default_rng(seed).normal(size=samples)


def volume_by_definition(labels, scores, widest):
    """Return VUS-PR for one event, with every score as a threshold."""
    inside = np.flatnonzero(labels)
    away = np.maximum(inside[0] - np.arange(len(labels)), np.arange(len(labels)) - inside[-1])
    areas = []
    for buffer in range(widest + 1):
        near = (away > 0) & (away <= buffer // 2)
        worth = np.where(labels, 1.0, 0.0)
        worth[near] = np.sqrt(1 - away[near] / buffer)
        area, recall_before = 0.0, 0.0
        for threshold in np.sort(scores)[::-1]:
            flags = scores >= threshold
            hits = worth[flags].sum()
            positives = (2 * labels.sum() + worth[flags & near].sum()) / 2
            recall = min(hits / positives, 1.0) if flags[worth > 0].any() else 0.0
            area += (recall - recall_before) * hits / flags.sum()
            recall_before = recall
        areas.append(area)
    return np.mean(areas)


@pytest.mark.usefixtures("tsadmetrics")
def test_without_a_buffer_it_is_the_average_precision():
    labels = disturbed()
    for seed in range(3):
        scores = noise(seed=seed) + labels
        value = recording_vus_pr(recording(scores), "odisar", 0)
        assert value == pytest.approx(average_precision_score(labels, scores))


@pytest.mark.usefixtures("tsadmetrics")
@pytest.mark.parametrize("buffer", [1, 5, 20])
def test_with_a_buffer_it_is_the_volume_written_down_from_its_definition(buffer):
    labels = disturbed()
    scores = noise() + np.roll(labels, 8)
    value = recording_vus_pr(recording(scores), "odisar", buffer)
    assert value == pytest.approx(volume_by_definition(labels, scores, buffer))


@pytest.mark.usefixtures("tsadmetrics")
def test_random_scores_reach_the_share_of_disturbed_samples():
    times = np.arange(0.0, 2000.0)
    item = recording(noise(2000), (600.0, 1000.0), times)
    assert recording_vus_pr(item, "odisar", 20) == pytest.approx(0.2, abs=0.03)


@pytest.mark.usefixtures("tsadmetrics")
def test_a_late_score_gains_by_the_buffer_and_a_perfect_one_keeps_all():
    labels = disturbed()
    late = recording(0.1 * noise() + np.roll(labels, 6))
    assert recording_vus_pr(late, "odisar", 20) > recording_vus_pr(late, "odisar", 0) + 0.02
    perfect = recording(labels.astype(float))
    assert recording_vus_pr(perfect, "odisar", 20) == 1.0


def measure(labels, scores, buffer):
    """Stand in for the package: the mean disturbed score, and a little for the buffer."""
    return float(scores[labels].mean()) + buffer / 1000


@pytest.fixture
def simple_measure(monkeypatch):
    monkeypatch.setattr(range_aware, "_volume", measure)


@pytest.mark.usefixtures("simple_measure")
def test_samples_are_the_times_that_all_detectors_share():
    scores = np.where(TIMES < 100, 5.0, 1.0)
    item = scored(TIMES, {"odisar": scores, "rmse": np.where(TIMES < 110, np.nan, 1.0)}, EVENT)
    assert recording_vus_pr(item, "odisar", 0) == 1.0


@pytest.mark.usefixtures("simple_measure")
def test_a_buffer_is_as_long_in_time_where_fewer_steps_are_scored():
    item = recording(np.ones(50), times=TIMES[::4])
    assert recording_vus_pr(item, "odisar", 40) == pytest.approx(1 + 10 / 1000)


@pytest.mark.usefixtures("simple_measure")
@pytest.mark.parametrize("event", [None, (0.0, 1000.0), (500.0, 600.0)])
def test_a_recording_with_one_kind_of_samples_has_no_value(event):
    assert np.isnan(recording_vus_pr(recording(np.ones(200), event), "odisar", 5))


@pytest.mark.usefixtures("simple_measure")
def test_the_value_is_the_mean_over_recordings_that_have_one():
    items = [recording(np.full(200, level), name=f"r{level}") for level in (0.2, 0.4, 0.9)]
    items.append(recording(np.ones(200), None, name="clean"))
    resampler = Resampler.draw([r.name for r in items], 500, 0.9, np.random.default_rng(0))
    value, (low, high) = vus_pr(items, "odisar", 0, resampler)
    assert value == pytest.approx(0.5)
    assert low == pytest.approx(0.2)
    assert high == pytest.approx(0.9)


def test_recordings_of_one_cluster_give_a_mean_without_an_interval():
    resampler = Resampler.draw(["a", "a"], 50, 0.9, np.random.default_rng(0))
    value, interval = mean_over_recordings(np.array([0.2, 0.4]), resampler)
    assert value == pytest.approx(0.3)
    assert np.isnan(interval).all()
    value, interval = mean_over_recordings(np.full(2, np.nan), resampler)
    assert np.isnan([value, *interval]).all()


@pytest.mark.usefixtures("simple_measure")
def test_the_table_has_a_row_for_each_detector_and_cell():
    items = vessel_test_set()
    table = vus_pr_table({"ferry": items}, GROUPS, CONFIG, 30.0, 1)
    assert tuple(table.columns) == VUS_COLUMNS
    assert len(table) == (2 * 5 + 1) * 2
    overall = table[(table["evaluated_on"] == "overall") & (table["strength"] == 1.0)]
    assert set(overall["recordings"]) == {8}
    chosen = [r for r in items if r.info.components == "all" and r.info.strength == 1.0]
    values = [recording_vus_pr(r, "rmse", 30) for r in chosen]
    found = overall.set_index("detector").loc["rmse"]
    assert found["vus_pr"] == pytest.approx(np.mean(values))
    assert found["ci_low"] <= found["vus_pr"] <= found["ci_high"]
    assert found["disturbed_share"] == pytest.approx(420 / 1080, abs=0.06)
    again = vus_pr_table({"ferry": items[::-1]}, GROUPS, CONFIG, 30.0, 1)
    pd.testing.assert_frame_equal(table, again)


def test_a_missing_package_is_named_with_the_way_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "tsadmetrics.metrics.Registry", None)
    with pytest.raises(OdisarError, match="make study-setup"):
        recording_vus_pr(recording(noise()), "odisar", 5)


def test_what_cannot_be_judged_is_refused():
    with pytest.raises(OdisarError, match="must not be negative"):
        recording_vus_pr(recording(noise()), "odisar", -1)
    items = [recording(noise(), name="a"), recording(noise(), name="b")]
    mixed = [items[0], replace(items[1], scores={})]
    with pytest.raises(OdisarError, match="same detectors"):
        vus_pr_table({"ferry": mixed}, GROUPS, CONFIG, 5.0, 1)

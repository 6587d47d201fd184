from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from sklearn.metrics import f1_score, roc_auc_score

from odisar.errors import OdisarError
from odisar.evaluation.tables import DETECTION_COLUMNS, detection_table, operating_table
from odisar.recordings.schema import label_times

from .evaluation_cases import CONFIG, GROUPS, scored, vessel_test_set

PUBLISHED_AS = {"ferry": "vessel-all"}
KEYS = ["evaluated_on", "strength", "protocol", "detector", "metric"]


@pytest.fixture(scope="module")
def recordings():
    return vessel_test_set()


@pytest.fixture(scope="module")
def table(recordings):
    return detection_table({"ferry": recordings}, GROUPS, CONFIG, 6.0, 1, PUBLISHED_AS)


def row(table, *key):
    chosen = table
    for column, value in zip(KEYS, key, strict=True):
        same = chosen[column].isna() if value is None else chosen[column] == value
        chosen = chosen[same]
    assert len(chosen) == 1
    return chosen.iloc[0]


def test_every_row_is_there_once(table):
    assert tuple(table.columns) == DETECTION_COLUMNS
    assert not table.duplicated(["setup", *KEYS]).any()
    # Overall, two cases, two manoeuvres at two strengths, and wind apart; 3 detectors, 4 metrics.
    assert len(table[table["metric"] == "auroc"]) == (2 * 5 + 1) * 4 * 3
    assert len(table[table["metric"] == "delay_p50_s"]) == (2 * 5 + 1) * 2
    assert len(table[table["metric"] == "false_alarms_per_hour"]) == 3 * 2


def test_the_monitors_rows_are_scikit_learns_over_the_pooled_times(table, recordings):
    chosen = [
        r for r in recordings if r.info.disturbance == "case-1" and r.info.components == "all"
    ]
    chosen = [r for r in chosen if r.info.strength == 0.5]
    scores = np.concatenate([r.scores["odisar"][60:] for r in chosen])
    labels = np.concatenate([label_times(r.time_s[60:], r.intervals) for r in chosen])
    key = ("case-1", 0.5, "P2", "odisar")
    assert row(table, *key, "auroc")["value"] == pytest.approx(roc_auc_score(labels, scores))
    assert row(table, *key, "f1_ood")["value"] == pytest.approx(f1_score(labels, scores > 2.0))
    assert row(table, *key, "f1_ind")["value"] == pytest.approx(f1_score(~labels, scores <= 2.0))


def test_the_oracle_is_perfect_on_the_present_only(table):
    oracle = table[(table["detector"] == "oracle") & (table["metric"] == "auroc")]
    assert (oracle.loc[oracle["protocol"].isin(["P2", "P2-guarded"]), "value"] == 1.0).all()
    assert (oracle.loc[oracle["protocol"].isin(["P1", "proactive"]), "value"] < 1.0).all()


def test_intervals_hold_their_values(table):
    known = table.dropna(subset=["value", "ci_low", "ci_high"])
    assert len(known) > 0.9 * len(table)
    inside = (known["ci_low"] <= known["value"]) & (known["value"] <= known["ci_high"])
    # Few clusters: a percentile interval may miss its own value now and then.
    assert inside.mean() > 0.97


def test_published_figures_stand_beside_full_strength_of_two_protocols(table):
    assert row(table, "case-2", 1.0, "P1", "rmse", "f1_ind")["published"] == 0.50
    assert row(table, "case-2", 1.0, "P2", "odisar", "auroc")["published"] == 0.9862
    given = table.dropna(subset=["published"])
    assert set(given["protocol"]) == {"P1", "P2"}
    assert set(given["strength"]) == {1.0}
    assert set(given["detector"]) == {"odisar", "rmse"}


def test_the_order_of_recordings_has_no_influence(table, recordings):
    again = detection_table({"ferry": recordings[::-1]}, GROUPS, CONFIG, 6.0, 1, PUBLISHED_AS)
    pd.testing.assert_frame_equal(table, again)


def test_another_seed_moves_intervals_and_no_value(table, recordings):
    again = detection_table({"ferry": recordings}, GROUPS, CONFIG, 6.0, 2, PUBLISHED_AS)
    pd.testing.assert_series_equal(table["value"], again["value"])
    assert not again["ci_low"].equals(table["ci_low"])


def test_recordings_of_different_twins_are_pooled_by_their_thresholds(recordings):
    def scaled(item, factor):
        return replace(
            item,
            scores={k: v * factor for k, v in item.scores.items()},
            thresholds={k: v * factor for k, v in item.thresholds.items()},
            operating_thresholds={k: v * factor for k, v in item.operating_thresholds.items()},
        )

    mixed = [scaled(item, 4.0 if i % 2 else 0.5) for i, item in enumerate(recordings)]
    args = (GROUPS, CONFIG, 6.0, 1, PUBLISHED_AS)
    plain, other = (detection_table({"ferry": r}, *args) for r in (recordings, mixed))
    pd.testing.assert_frame_equal(plain, other)


def event_of(delay, number, lead=20.0):
    """Return a recording whose event at 100 s is announced after ``delay``, or never."""
    times = np.arange(0.0, 400.0)
    on = np.inf if delay is None else 100 + delay - 5
    return scored(
        times,
        {"odisar": np.where((times >= on) & (times < 300), 2.0, 0.0)},
        (100.0, 300.0),
        name=f"r{number}",
        consequence_s=100.0 + (delay or 0) + lead,
    )


def test_delays_count_an_undetected_event_as_longer_than_any():
    items = [event_of(delay, i) for i, delay in enumerate([10, 20, 30, 40, None])]
    table = detection_table({"ferry": items}, GROUPS, CONFIG, 6.0, 1, {"ferry": None})
    key = ("overall", 1.0, "P2", "odisar")
    assert row(table, *key, "events_detected")["value"] == 0.8
    assert row(table, *key, "delay_p50_s")["value"] == 30.0
    assert np.isnan(row(table, *key, "delay_p90_s")["value"])
    assert row(table, *key, "delay_p90_s")["ci_low"] >= 30.0
    assert row(table, *key, "lead_time_p50_s")["value"] == 20.0
    assert table["published"].isna().all()


def test_recordings_that_share_a_seed_give_no_interval():
    items = [event_of(10, i) for i in range(3)]
    items = [replace(r, info=replace(r.info, base_seed="same")) for r in items]
    table = detection_table({"ferry": items}, GROUPS, CONFIG, 6.0, 1, {"ferry": None})
    assert table["ci_low"].isna().all()


def test_the_operating_table_says_what_the_rates_rest_on(recordings):
    table = operating_table({"ferry": recordings}, GROUPS, CONFIG, 6.0)
    odisar = table.set_index("detector").loc["odisar"]
    assert odisar["recordings"] == 4
    assert odisar["windows"] == 4 * 1081
    assert odisar["hours"] == pytest.approx(4 * 1081 / 3600)
    assert odisar["events"] == 16
    assert odisar["ci_low"] <= odisar["false_alarms_per_hour"] <= odisar["ci_high"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda items: items[:0], "no scored recordings"),
        (lambda items: [items[0], items[0]], "scored twice"),
        (
            lambda items: [items[0], replace(items[1], scores={"rmse": items[1].scores["rmse"]})],
            "same detectors",
        ),
    ],
)
def test_what_cannot_be_compared_is_refused(recordings, change, message):
    with pytest.raises(OdisarError, match=message):
        detection_table({"ferry": change(recordings)}, GROUPS, CONFIG, 6.0, 1, PUBLISHED_AS)

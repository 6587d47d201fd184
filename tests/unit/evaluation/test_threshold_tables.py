from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from odisar.errors import OdisarError
from odisar.evaluation.alarms import poisson_interval
from odisar.evaluation.tables import detection_table
from odisar.evaluation.threshold_tables import THRESHOLD_COLUMNS, Ruled, threshold_table

from .evaluation_cases import CONFIG, GROUPS, scored, vessel_test_set

THRESHOLDS = {
    "sigma": {"odisar": 2.0, "rmse": 2.0},
    "operating": {"odisar": 1.2, "rmse": 1.5},
    "conformal": {"odisar": 1.4},
}
PROMISED = {"operating": {"odisar": 1.0, "rmse": 1.0}, "conformal": {"odisar": 1.3}}


@pytest.fixture(scope="module")
def recordings():
    return vessel_test_set()


@pytest.fixture(scope="module")
def table(recordings):
    return threshold_table({"ferry": [Ruled(recordings, THRESHOLDS, PROMISED)]}, GROUPS, CONFIG, 6)


def one(table, **values):
    for column, value in values.items():
        table = table[table[column] == value]
    assert len(table) == 1
    return table.iloc[0]


def test_every_rule_of_a_detector_has_a_row_for_each_strength(table):
    assert tuple(table.columns) == THRESHOLD_COLUMNS
    pairs = table[["detector", "rule"]].drop_duplicates().to_numpy().tolist()
    assert pairs == [
        ["odisar", "sigma"],
        ["odisar", "operating"],
        ["odisar", "conformal"],
        ["rmse", "sigma"],
        ["rmse", "operating"],
    ]
    assert len(table) == 2 * len(pairs)
    assert set(table["strength"]) == {0.5, 1.0}


def test_each_rule_is_judged_as_the_detection_table_would_with_its_threshold(table, recordings):
    limits = {"odisar": 1.2, "rmse": 1.5}
    ruled = [replace(r, thresholds=limits, operating_thresholds=limits) for r in recordings]
    judged = detection_table({"ferry": ruled}, GROUPS, CONFIG, 6.0, 1, {"ferry": None})
    judged = judged[(judged["protocol"] == "P2") & (judged["evaluated_on"] == "overall")]
    for detector in limits:
        for strength in (0.5, 1.0):
            found = one(table, rule="operating", detector=detector, strength=strength)
            cell = judged[(judged["detector"] == detector) & (judged["strength"] == strength)]
            values = cell.set_index("metric")["value"]
            for metric in ("f1_ood", "f1_ind", "events_detected", "delay_p50_s"):
                assert found[metric] == pytest.approx(values[metric], nan_ok=True)
        quiet = judged[(judged["detector"] == detector) & judged["strength"].isna()].iloc[0]
        for column, name in [("measured_per_hour", "value"), ("ci_low",) * 2, ("ci_high",) * 2]:
            assert found[column] == pytest.approx(quiet[name])


def test_a_promise_stands_where_a_rule_makes_one(table):
    promised = table.drop_duplicates(["detector", "rule"]).set_index(["rule", "detector"])
    promised = promised["promised_per_hour"]
    assert promised[("operating", "rmse")] == 1.0
    assert promised[("conformal", "odisar")] == 1.3
    assert promised["sigma"].isna().all()


def test_false_alarms_are_those_of_undisturbed_recordings_that_lasted():
    times = np.arange(0.0, 3600.0)
    quiet = np.zeros(3600)
    quiet[100:110] = quiet[500:520] = quiet[900:903] = 3.0
    table = threshold_table(
        {"ferry": [Ruled([scored(times, {"odisar": quiet})], {"sigma": {"odisar": 2.0}})]},
        GROUPS,
        CONFIG,
        6.0,
    )
    row = one(table, rule="sigma")
    assert (row["measured_per_hour"], row["hours"]) == (2.0, 1.0)
    assert (row["ci_low"], row["ci_high"]) == pytest.approx(poisson_interval(2, 0.95))
    assert np.isnan(row["strength"])
    assert np.isnan(row["f1_ood"])


def test_a_higher_threshold_detects_later_and_alarms_less():
    times = np.arange(0.0, 600.0)
    rising = np.clip((times - 100) / 10, 0.0, 9.0) * (times < 400)
    items = [
        scored(times, {"odisar": rising}, (100.0, 400.0), name="event"),
        scored(times, {"odisar": np.where(times % 60 < 10, 3.5, 1.0)}, name="quiet"),
    ]
    rules = {"low": {"odisar": 3.0}, "high": {"odisar": 6.0}, "beyond": {"odisar": 9.0}}
    table = threshold_table({"ferry": [Ruled(items, rules)]}, GROUPS, CONFIG, 6.0)
    table = table.set_index("rule")
    assert table["delay_p50_s"].to_list()[:2] == [31.0 + 5, 61.0 + 5]
    assert table["measured_per_hour"].to_list() == [60.0, 0.0, 0.0]
    assert table["recordings_alarmed"].to_list() == [1.0, 0.0, 0.0]
    assert table.loc["beyond", "events_detected"] == 0.0
    assert np.isnan(table.loc["beyond", "delay_p50_s"])


def test_parts_of_folds_are_pooled_by_their_own_thresholds(table, recordings):
    halves = (
        recordings[::2],
        [
            replace(r, scores={name: 3 * values for name, values in r.scores.items()})
            for r in recordings[1::2]
        ],
    )
    tripled = {
        rule: {detector: 3 * value for detector, value in own.items()}
        for rule, own in THRESHOLDS.items()
    }
    weaker = {**PROMISED, "conformal": {"odisar": 2.6}}
    parts = [Ruled(halves[0], THRESHOLDS, PROMISED), Ruled(halves[1], tripled, weaker)]
    pooled = threshold_table({"ferry": parts}, GROUPS, CONFIG, 6.0)
    assert pooled["threshold"].isna().all()
    conformal = pooled[pooled["rule"] == "conformal"]
    assert set(conformal["promised_per_hour"]) == {2.6}
    same = [c for c in THRESHOLD_COLUMNS if c not in ("threshold", "promised_per_hour")]
    pd.testing.assert_frame_equal(pooled[same], table[same])


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        (lambda r: [Ruled(r[:0], THRESHOLDS)], "no scored recordings"),
        (lambda r: [Ruled(r, {"sigma": {"odisar": np.inf}})], "no finite threshold for 'odisar'"),
        (
            lambda r: [Ruled(r[:2], THRESHOLDS), Ruled(r[2:], {"sigma": THRESHOLDS["sigma"]})],
            "rule 'operating' has no finite threshold for 'odisar' in every part",
        ),
        (lambda r: [Ruled(r, THRESHOLDS), Ruled(r[:1], THRESHOLDS)], "scored twice"),
    ],
)
def test_what_cannot_be_judged_by_all_rules_is_refused(recordings, parts, message):
    with pytest.raises(OdisarError, match=message):
        threshold_table({"ferry": parts(recordings)}, GROUPS, CONFIG, 6.0)

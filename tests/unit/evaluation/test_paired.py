from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from odisar.errors import OdisarError
from odisar.evaluation.paired import PAIRED_COLUMNS, Comparison, paired_table, seed_spread_table
from odisar.evaluation.protocols import PROTOCOLS
from odisar.evaluation.tables import detection_table

from .evaluation_cases import CONFIG, GROUPS, scored, vessel_test_set

PUBLISHED_AS = {"ferry": None}


def with_detectors(recordings, make):
    """Return the recordings with what ``make(recording)`` adds to their scores."""
    changed = []
    for item in recordings:
        scores = {**item.scores, **make(item)}
        changed.append(
            replace(
                item,
                scores=scores,
                thresholds=dict.fromkeys(scores, 2.0),
                operating_thresholds=dict.fromkeys(scores, 2.0),
            )
        )
    return changed


@pytest.fixture(scope="module")
def recordings():
    return with_detectors(
        vessel_test_set(repeats=4),
        lambda item: {"twin": item.scores["odisar"], "blind": np.ones(len(item.time_s))},
    )


@pytest.fixture(scope="module")
def paired(recordings):
    return paired_table({"ferry": recordings}, GROUPS, CONFIG, 6.0, 1, Comparison("odisar"))


def chosen(table, **values):
    for column, value in values.items():
        table = table[table[column] == value]
    return table


def test_every_other_detector_stands_in_every_cell_once(paired):
    assert tuple(paired.columns) == PAIRED_COLUMNS
    cells = (2 * 5 + 1) * 3
    assert len(paired) == cells * (3 * len(PROTOCOLS) + 1)
    assert set(paired["other"]) == {"rmse", "twin", "blind"}
    assert set(paired["detector"]) == {"odisar"}
    assert set(paired.loc[paired["metric"] == "delay_p50_s", "protocol"]) == {"P2"}
    keys = ["setup", "evaluated_on", "strength", "protocol", "metric", "other"]
    assert not paired.duplicated(keys).any()


def test_differences_are_those_of_the_detection_table(paired, recordings):
    table = detection_table({"ferry": recordings}, GROUPS, CONFIG, 6.0, 1, PUBLISHED_AS)
    keys = ["evaluated_on", "strength", "protocol", "metric"]
    values = table.pivot_table("value", keys, "detector", dropna=False)
    expected = values["odisar"] - values["rmse"]
    found = chosen(paired, other="rmse").set_index(keys)["difference"]
    pd.testing.assert_series_equal(found, expected.loc[found.index], check_names=False)


def test_a_detector_differs_from_its_double_by_nothing_at_all(paired):
    double = chosen(paired, other="twin").dropna(subset=["difference"])
    assert len(double) > 100
    assert (double["difference"] == 0).all()
    known = double[double["metric"] != "delay_p50_s"]
    assert (known[["ci_low", "ci_high"]].abs().to_numpy() < 1e-12).all()


def test_an_interval_in_pairs_is_narrower_than_two_intervals_apart(recordings):
    # One detector is the other one and a little noise: hard recordings are hard for both.
    random = np.random.default_rng(3)
    near = with_detectors(
        recordings,
        lambda item: {"near": item.scores["odisar"] + 0.1 * random.normal(size=len(item.time_s))},
    )
    pairs = paired_table({"ferry": near}, GROUPS, CONFIG, 6.0, 1, Comparison("odisar"))
    table = detection_table({"ferry": near}, GROUPS, CONFIG, 6.0, 1, PUBLISHED_AS)
    cell = {"evaluated_on": "overall", "strength": 0.5, "protocol": "P2", "metric": "auroc"}
    difference = chosen(pairs, other="near", **cell).iloc[0]
    alone = chosen(table, detector="odisar", **cell).iloc[0]
    assert difference["ci_low"] < difference["difference"] < difference["ci_high"]
    width = difference["ci_high"] - difference["ci_low"]
    assert width < 0.5 * (alone["ci_high"] - alone["ci_low"])


def test_against_a_constant_the_interval_is_the_detectors_own_shifted(paired, recordings):
    # The same draws are taken as for the detection table, and the same correction for binning.
    table = detection_table({"ferry": recordings}, GROUPS, CONFIG, 6.0, 1, PUBLISHED_AS)
    cell = {"evaluated_on": "overall", "strength": 1.0, "protocol": "P2", "metric": "auroc"}
    difference = chosen(paired, other="blind", **cell).iloc[0]
    alone = chosen(table, detector="odisar", **cell).iloc[0]
    for column in ("ci_low", "ci_high"):
        assert difference[column] == pytest.approx(alone[column] - 0.5)


def test_the_next_best_is_the_best_of_the_others(recordings):
    table = paired_table({"ferry": recordings}, GROUPS, CONFIG, 6.0, 1, Comparison("blind"))
    best = table[table["is_next_best"]]
    keys = ["evaluated_on", "strength", "protocol", "metric"]
    assert not best.duplicated(keys).any()
    shares = best[best["metric"] != "delay_p50_s"]
    smallest = table.groupby(keys)["difference"].min()
    pd.testing.assert_series_equal(
        shares.set_index(keys)["difference"].sort_index(),
        smallest.drop("delay_p50_s", level="metric"),
    )


def event_of(number, **delays):
    """Return a recording whose event at 100 s every detector finds after its delay, or never."""
    times = np.arange(0.0, 400.0)
    onsets = {name: np.inf if d is None else 100 + d - 5 for name, d in delays.items()}
    scores = {
        name: np.where((times >= on) & (times < 300), 2.0, 0.0) for name, on in onsets.items()
    }
    return scored(times, scores, (100.0, 300.0), name=f"r{number}")


def test_less_delay_is_better_and_an_undetected_median_has_no_difference():
    items = [event_of(i, odisar=10 + i, quick=6 + i, slow=40 + 2 * i, never=None) for i in range(5)]
    table = paired_table({"ferry": items}, GROUPS, CONFIG, 6.0, 1, Comparison("odisar"))
    delays = chosen(table, metric="delay_p50_s", evaluated_on="overall").set_index("other")
    assert delays.loc["quick", "difference"] == 4.0
    assert delays.loc["slow", "difference"] == 12.0 - 44.0
    assert -35.0 <= delays.loc["slow", "ci_low"] <= -32.0 <= delays.loc["slow", "ci_high"] <= -30.0
    assert np.isnan(delays.loc["never", ["difference", "ci_low", "ci_high"]].astype(float)).all()
    assert delays["is_next_best"].to_dict() == {"quick": True, "slow": False, "never": False}


def test_recordings_that_share_a_seed_give_a_difference_without_an_interval():
    items = [event_of(i, odisar=10, rmse=20) for i in range(3)]
    items = [replace(r, info=replace(r.info, base_seed="same")) for r in items]
    table = paired_table({"ferry": items}, GROUPS, CONFIG, 6.0, 1, Comparison("odisar"))
    assert table["difference"].notna().any()
    assert table[["ci_low", "ci_high"]].isna().all(axis=None)


def test_the_order_of_recordings_has_no_influence(paired, recordings):
    again = paired_table({"ferry": recordings[::-1]}, GROUPS, CONFIG, 6.0, 1, Comparison("odisar"))
    pd.testing.assert_frame_equal(paired, again)


def test_a_reference_without_scores_is_refused(recordings):
    with pytest.raises(OdisarError, match="no scores of 'reconstruction' to compare with"):
        paired_table({"ferry": recordings}, GROUPS, CONFIG, 6.0, 1, Comparison("reconstruction"))


def seed_table(values, strength=(np.nan, 1.0)):
    rows = [
        ("ferry", "overall", s, "P2", "odisar", "auroc", value)
        for s, value in zip(strength, values, strict=True)
    ]
    columns = ["setup", "evaluated_on", "strength", "protocol", "detector", "metric", "value"]
    return pd.DataFrame(rows, columns=columns)


def test_the_spread_over_seeds_is_mean_and_extremes_of_each_cell():
    spread = seed_spread_table(
        [seed_table([0.5, 0.9]), seed_table([0.7, np.nan]), seed_table([0.3, 0.8])]
    )
    first, second = spread.to_dict("records")
    assert np.isnan(first["strength"])
    assert (first["smallest"], first["largest"], first["seeds"]) == (0.3, 0.7, 3)
    assert first["mean"] == pytest.approx(0.5)
    assert (second["seeds"], second["undefined"]) == (2, 1)
    assert second["mean"] == pytest.approx(0.85)


def test_the_spread_is_of_cells_not_of_positions(recordings):
    table = detection_table({"ferry": recordings[:9]}, GROUPS, CONFIG, 6.0, 1, PUBLISHED_AS)
    spread = seed_spread_table([table, table[::-1]])
    assert len(spread) == len(table)
    pd.testing.assert_series_equal(spread["mean"], table["value"], check_names=False)
    assert spread["smallest"].equals(spread["largest"])


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ([seed_table([0.5, 0.9])], "1 table cannot show a spread"),
        ([seed_table([0.5, 0.9]), seed_table([0.5, 0.9], (np.nan, 0.5))], "table 2 .* other rows"),
        ([seed_table([0.5, 0.9]), seed_table([0.5, 0.9])[:1]], "table 2 .* other rows"),
    ],
)
def test_a_spread_of_what_cannot_be_compared_is_refused(tables, message):
    with pytest.raises(OdisarError, match=message):
        seed_spread_table(tables)

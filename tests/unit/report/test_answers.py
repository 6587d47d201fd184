import numpy as np
import pandas as pd

from odisar.artifacts import write_table
from odisar.report import answers, tables
from odisar.report.load import Results

from .altered import change_pair
from .invented_tables import STATES


def cells(table, *head):
    return next(row for row in table.rows if tuple(row[: len(head)]) == head)


def test_the_published_monitor_stands_beside_ours_and_beside_the_papers_score(results):
    table = answers.effectiveness(results, "vessel-all")
    assert table.title == "RQ1, vessel-all: by scenario under P2, strength 1"
    for name in ("ODiSAR", "reconstruction (paper's score, causal)"):
        assert cells(table, "overall", name)[-1] == "90.0 / 90.0 / 90.0 / 90.0"
    assert {row[1] for row in table.rows} == {"ODiSAR", "reconstruction (paper's score, causal)"}


def test_forecast_errors_stand_beside_the_scores_with_their_published_values(results):
    table = answers.against_forecast_errors(results, "vessel-all")
    assert cells(table, "overall", "forecast RMSE")[-1] == "90.0 / 90.0 / 90.0 / 90.0"
    assert cells(table, "overall", "ODiSAR without Transformer")[-1] == ""


def test_without_published_values_there_is_no_column_for_them(results):
    results.detection["published"] = np.nan
    for table in (
        answers.effectiveness(results, "vessel-all"),
        tables.paper_protocol(results, "vessel-all"),
    ):
        assert "published" not in table.columns
    assert answers.effectiveness(results, "vessel-all").note == ""


def test_every_rule_is_told_with_its_promise_and_what_it_gave(results):
    own, others = answers.rules(results, "vessel-all")
    assert not own.folded
    assert others.folded
    row = cells(own, "ODiSAR", "conformal, by blocks")
    assert row[3:7] == ["1", "0.5 [0.2, 0.9]", "8", "25.0"]
    assert cells(own, "ODiSAR", "mean + k sigma (the paper's)")[3] == "-"
    assert "per block of time, not per hour" in own.note
    assert {row[0] for row in others.rows} >= {"ODiSAR without Transformer", "forecast RMSE"}


def test_reliability_is_told_before_and_after_recalibration(results):
    whole, by_state = answers.reliability(results, "vessel-all")
    assert [row[0] for row in whole.rows] == [
        "Monte Carlo draws alone",
        "draws and noise floor",
        "recalibrated",
    ]
    assert whole.rows[0][3] == "30.0 [25.0, 35.0]"
    assert by_state.rows[0][:3] == ["Surge Speed", "m/s", "Monte Carlo draws alone"]


def test_pairs_carry_their_sign_and_the_best_other_detector_a_star(results):
    change_pair(results, "rmse", "delay_p50_s", np.nan, np.nan, np.nan)
    table = answers.pairs(results, "vessel-all")
    assert cells(table, "ODiSAR without Transformer", "0.25")[2] == "+4.00 * [+3.00, +5.00]"
    assert cells(table, "forecast RMSE", "1")[-1] == "-"


def test_the_guilty_channel_is_told_beside_chance(results):
    row = cells(answers.blame(results, "vessel-all"), "stuck", "any", "by ODiSAR")
    assert row[3:] == ["40 of 8", "25.0 [15.0, 35.0]", "20.0", "90.0 [80.0, 100.0]", "60.0"]


def test_leakage_probes_are_told_with_what_must_and_what_may_not_move(results):
    table = answers.leakage(results, "vessel-all")
    assert cells(table, "ODiSAR", "future")[2:] == ["0 of 6", "0.5", "may not move", "yes"]
    assert cells(table, "ODiSAR", "control")[2:] == ["6 of 6", "0.5", "must move", "yes"]


def test_the_headline_lists_the_best_alternative_and_on_demand_every_detector(results):
    short = {row[2] for row in tables.headline(results).rows}
    assert "Mahalanobis, window statistics" in short
    extra = results.detection[results.detection.detector == "mahalanobis"]
    worse = extra.assign(detector="stuck", value=extra.value - 0.2)
    results.detection = pd.concat([results.detection, worse], ignore_index=True)
    assert "stuck sensor" not in {row[2] for row in tables.headline(results).rows}
    assert "stuck sensor" in {row[2] for row in tables.headline(results, every_detector=True).rows}


def test_errors_of_forecasts_are_told_with_and_without_the_commands(results, workspace):
    known = results.forecast[results.forecast.forecaster == "closed-form"]
    every = pd.concat([results.forecast, known.assign(commands="known-ahead")])
    write_table(workspace.results / "forecast.csv", every)
    table = answers.forecasts(Results(workspace, results.config), "vessel-all")
    assert len(table.rows) == 4 * (1 + len(STATES))
    assert {row[1] for row in table.rows} == {"known", "unknown"}
    assert [row[2] for row in table.rows[:4]] == ["all (scaled)"] * 4

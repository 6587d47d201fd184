import pytest

from odisar.report.body import render_body
from odisar.report.figures.baselines import has_study_networks
from odisar.report.figures.forecasting import has_studied_forecasts, studied_error_by_step
from odisar.report.figures.leakage import probed
from odisar.report.load import study_folder
from odisar.report.study import STUDY_TABLES, missing_study, seed_sentences, study_tables

from .invented_comparisons import write_study


@pytest.fixture
def studied(results, workspace):
    write_study(workspace)
    return results


def test_without_the_study_the_report_says_what_is_missing_and_shows_nothing_of_it(results):
    assert study_tables(results) == []
    (sentence,) = missing_study(results)
    assert all(given.title in sentence for given in STUDY_TABLES)
    assert not has_studied_forecasts(results, "vessel-all")
    assert not has_study_networks(results, "vessel-all")
    assert "one training seed" in seed_sentences(results)[0]
    assert "Not in this report, because the full study" in render_body(results, [], [], [])


def test_a_table_that_is_missing_alone_is_named_alone(studied, workspace):
    (study_folder(workspace.root) / "pilot.csv").unlink()
    assert len(study_tables(studied)) == len(STUDY_TABLES) - 1
    (sentence,) = missing_study(studied)
    assert "pilot study" in sentence
    assert "time to train" not in sentence


def test_with_the_study_everything_is_printed_and_nothing_missed(studied):
    assert missing_study(studied) == []
    body = render_body(studied, [], [], [])
    for given in STUDY_TABLES:
        assert f"Study: {given.title}".replace("'", "&#39;") in body


def test_the_spread_over_seeds_is_told_where_it_is_known(studied):
    (sentence,) = seed_sentences(studied)
    assert "vessel-all at strength 1 93.0 and 97.0 % (3 seeds)" in sentence


def test_seeds_of_other_set_ups_tell_nothing_of_these(studied, workspace):
    path = study_folder(workspace.root) / "seeds.csv"
    path.write_text(path.read_text().replace("vessel-", "waypoint-"))
    assert seed_sentences(studied) == [
        "The study's training seeds are of other set-ups than these."
    ]


def test_the_published_recipe_stands_in_the_leakage_panel_as_it_failed(studied):
    table = probed(studied, "vessel-all").set_index(["detector", "probe"])
    assert not table.passed["published-recipe", "future"]
    assert table.passed["published-recipe", "control"]
    assert table.passed["odisar", "future"]


def test_forecast_errors_are_drawn_by_step_in_seconds_without_the_pooled_steps(studied):
    axes = studied_error_by_step(studied, "vessel-all").axes[0]
    assert len(axes.lines) == 3
    assert list(axes.lines[0].get_xdata()) == [1.0, 10.0, 30.0, 60.0]
    assert axes.get_title() == "all states [scaled]"

import pytest

from odisar.evaluation.published import (
    is_full_strength,
    published_shares,
    published_values,
)


def test_the_published_table_is_whole():
    values = published_values()
    scenarios = ["case-1", "case-2", "case-3", "zigzag", "random", "turning", "overall"]
    metrics = ["auroc", "tnr_at_tpr95", "f1_ind", "f1_ood"]
    for setup, names in {
        "vessel-all": scenarios,
        "vessel-random": scenarios,
        "robot-waypoint": ["waypoint"],
    }.items():
        for name in names:
            for detector in ("odisar", "rmse"):
                assert all(0 <= values[setup, name, detector, metric] < 1 for metric in metrics)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        (("vessel-all", "case-1", "rmse", "tnr_at_tpr95"), 0.6419),
        (("vessel-random", "random", "rmse", "f1_ind"), 0.0),
        (("vessel-all", "overall", "odisar", "auroc"), 0.9753),
        (("robot-waypoint", "waypoint", "odisar", "f1_ood"), 0.89),
        (("robot-waypoint", "overall", "odisar", "f1_ood"), 0.89),
    ],
)
def test_published_figures_are_the_papers(key, value):
    assert published_values()[key] == value


def test_the_papers_monitor_stands_beside_ours_and_beside_its_own_score():
    values = published_values()
    monitors = {key: value for key, value in values.items() if key[2] == "odisar"}
    assert monitors
    for (setup, name, _, metric), value in monitors.items():
        assert values[setup, name, "reconstruction", metric] == value
    assert {key[2] for key in values} == {"odisar", "reconstruction", "rmse"}


def test_published_quadrants_are_ranges_with_the_papers_words():
    shares = published_shares()
    assert (shares["vessel-all", "red"].low, shares["vessel-all", "red"].high) == (0.0, 0.05)
    assert sum(shares["robot-waypoint", q].low for q in ("green", "yellow", "orange", "red")) == 1
    assert shares["vessel-all", "orange"].statement == "33-39 %"


def test_full_strength_is_one_or_none():
    assert is_full_strength(1.0)
    assert is_full_strength(float("nan"))
    assert not is_full_strength(0.5)
